//! What each node is asked and told by SDO in pre-operational, a step at a time: a script is a kilobyte, and bring-up is slow enough to write it
//! anew for each of its steps.

use super::config::{DriveConfig, MasterConfig};
use super::failure::reason;
use crate::canopen::cob;
use crate::canopen::object::{Address, Number, at};
use crate::canopen::pdo::{ACYCLIC, INVALID, Mapped};
use crate::canopen::slave::Identity;
use crate::cia402::{self, control, object as o, pdo};
use crate::{camera, io};

/// A script as it is written: of its steps one is kept.
struct Script {
    /// Steps still to be passed over.
    before: usize,
    step: Option<Step>,
}

/// One SDO of a script.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Step {
    /// Read, and refuse the node unless the bits of `mask` are those of `expected`.
    Check {
        /// Object to read.
        object: Address,
        /// Bits that count.
        mask: u32,
        /// What they must be.
        expected: u32,
        /// Failure if they are not, one of [`reason`].
        reason: u16,
    },
    /// Write.
    Write(Address, Number),
}

const fn check(index: u16, sub: u8, expected: u32, reason: u16) -> Step {
    Step::Check {
        object: at(index, sub),
        mask: u32::MAX,
        expected,
        reason,
    }
}

fn write(index: u16, sub: u8, number: impl Into<Number>) -> Step {
    Step::Write(at(index, sub), number.into())
}

/// One PDO to set up: its parameter object, identifier, transmission type, map, and what else is particular to it.
struct PdoPlan<'a> {
    /// 0x1400 + k for an RPDO, 0x1800 + k for a TPDO; the map is 0x200 above.
    index: u16,
    cob: u16,
    transmission: u8,
    /// RPDO: longest time between two frames, ms; zero does not watch, and is not written.
    event_ms: u16,
    map: &'a [Mapped],
}

impl<'a> PdoPlan<'a> {
    /// What `node` takes with every SYNC as its RPDO 1.
    fn received(node: u8, event_ms: u16, map: &'a [Mapped]) -> Self {
        Self {
            index: 0x1400,
            cob: cob::rpdo(1, node),
            transmission: 1,
            event_ms,
            map,
        }
    }

    /// What `node` sends as its TPDO `k`, from 1 on.
    fn sent(k: u8, node: u8, transmission: u8, map: &'a [Mapped]) -> Self {
        Self {
            index: 0x1800 + u16::from(k) - 1,
            cob: cob::tpdo(k, node),
            transmission,
            event_ms: 0,
            map,
        }
    }
}

fn append_pdo(script: &mut Script, plan: PdoPlan) {
    let map_index = plan.index + 0x200;
    if script.passes(5 + plan.map.len() + usize::from(plan.event_ms != 0)) {
        return;
    }
    append(script, || {
        [
            write(plan.index, 1, INVALID | plan.cob as u32),
            write(plan.index, 2, plan.transmission),
            write(map_index, 0, 0u8),
        ]
    });
    if plan.event_ms != 0 {
        append(script, || [write(plan.index, 5, plan.event_ms)]);
    }
    for (k, entry) in plan.map.iter().enumerate() {
        append(script, || [write(map_index, k as u8 + 1, entry.encode())]);
    }
    append(script, || {
        [
            write(map_index, 0, plan.map.len() as u8),
            write(plan.index, 1, plan.cob as u32),
        ]
    });
}

impl Script {
    /// Passes over `count` steps if the one that is kept is not among them; true then.
    fn passes(&mut self, count: usize) -> bool {
        let elsewhere = self.step.is_some() || self.before >= count;
        if self.step.is_none() && elsewhere {
            self.before -= count;
        }
        elsewhere
    }
}

/// Steps that are written only if one of them is kept.
fn append<const L: usize>(script: &mut Script, steps: impl FnOnce() -> [Step; L]) {
    if !script.passes(L) {
        script.step = steps().get(script.before).copied();
    }
}

/// Step `at` of what `node` is to be asked and told; `None` behind the last.
#[inline(never)] // not in the cycle's own frame
pub fn step<const N: usize>(config: &MasterConfig<N>, node: u8, at: usize) -> Option<Step> {
    let mut script = Script { before: at, step: None };
    if node == config.camera_node {
        camera(&mut script, config);
    } else if node == config.io_node {
        io(&mut script, config);
    } else {
        let settings = config.drives.get(usize::from(node).checked_sub(1)?)?;
        drive(&mut script, config, settings, node);
    }
    script.step
}

/// SYNC and heartbeats: the same for every node.
fn append_common<const N: usize>(script: &mut Script, config: &MasterConfig<N>) {
    let watch_ms = config.cycles_ms(config.master_heartbeat_cycles as u32 * 5 / 2);
    append(script, || {
        [
            write(0x1005, 0, cob::SYNC as u32),
            write(0x1006, 0, config.cycle_us),
            write(0x1016, 1, (config.master_node as u32) << 16 | watch_ms as u32),
            write(0x1017, 0, config.node_heartbeat_ms),
        ]
    });
}

/// The script of drive `node`.
fn drive<const N: usize>(script: &mut Script, config: &MasterConfig<N>, drive: &DriveConfig, node: u8) {
    let [vendor, product] = drive.vendor_product;
    let [gear_motor, gear_shaft] = drive.gear;
    let mode = config.mode;
    append(script, || {
        [
            check(0x1000, 0, cia402::SERVO_DRIVE, reason::DEVICE_TYPE),
            check(0x1018, 1, vendor, reason::VENDOR),
            check(0x1018, 2, product, reason::PRODUCT),
            Step::Check {
                object: at(o::SUPPORTED_MODES, 0),
                mask: mode.supported_bit(),
                expected: mode.supported_bit(),
                reason: reason::SUPPORTED_MODES,
            },
            check(o::RATED_TORQUE, 0, drive.rated_torque_mnm, reason::RATED_TORQUE),
            check(o::ENCODER_RESOLUTION, 1, drive.encoder_counts, reason::ENCODER),
            check(o::ENCODER_RESOLUTION, 2, 1, reason::ENCODER),
            check(o::GEAR_RATIO, 1, gear_motor, reason::GEAR),
            check(o::GEAR_RATIO, 2, gear_shaft, reason::GEAR),
        ]
    });
    append_common(script, config);
    let wanted: &[Mapped] = match mode {
        cia402::Mode::Velocity => &pdo::RPDO1_VELOCITY,
        cia402::Mode::Torque => &pdo::RPDO1_TORQUE,
    };
    let time_out_ms = config.cycles_ms(config.rpdo_timeout_cycles as u32);
    append_pdo(script, PdoPlan::received(node, time_out_ms, wanted));
    append_pdo(script, PdoPlan::sent(1, node, 1, &pdo::TPDO1));
    append_pdo(script, PdoPlan::sent(2, node, config.tpdo2_every, &pdo::TPDO2));
    let [low, high] = drive.position_limits;
    append(script, || {
        [
            write(o::ABORT_CONNECTION, 0, 3i16),  // quick stop when the master is lost
            write(o::QUICK_STOP_OPTION, 0, 6i16), // on the quick-stop ramp, then hold: an arm has a weight
            write(o::SHUTDOWN_OPTION, 0, 0i16),   // no torque at once
            write(o::DISABLE_OPTION, 0, 0i16),    // no torque at once
            write(o::HALT_OPTION, 0, 2i16),       // on the quick-stop ramp, then hold
            write(o::FAULT_OPTION, 0, 2i16),      // on the quick-stop ramp, then no torque
            write(o::QUICK_STOP_DECELERATION, 0, drive.quick_stop),
            write(o::FOLLOWING_WINDOW, 0, drive.following_window),
            write(o::FOLLOWING_TIME, 0, drive.following_time_ms),
            write(o::MAX_TORQUE, 0, drive.max_torque),
            write(o::POSITION_LIMITS, 1, low),
            write(o::POSITION_LIMITS, 2, high),
            write(o::MAX_SPEED, 0, drive.max_speed_rpm),
            // A drive that holds after the loss of an earlier master takes no other mode before it lets go (brake closed).
            write(o::CONTROLWORD, 0, control::DISABLE_VOLTAGE),
            write(o::MODE, 0, mode.code()),
            check(o::MODE_DISPLAY, 0, mode.code() as u8 as u32, reason::MODE),
        ]
    });
}

/// A node of our own making: it is what it says, and its RPDO 1 comes with every SYNC.
fn begin_own<const N: usize>(script: &mut Script, config: &MasterConfig<N>, is: &Identity, node: u8, rpdo1: &[Mapped]) {
    let [_, product, ..] = is.numbers;
    append(script, || {
        [
            check(0x1000, 0, is.device_type, reason::DEVICE_TYPE),
            check(0x1018, 2, product, reason::PRODUCT),
        ]
    });
    append_common(script, config);
    append_pdo(script, PdoPlan::received(node, 0, rpdo1));
}

/// The script of the camera node: its sighting goes with the SYNC after it is ready.
fn camera<const N: usize>(script: &mut Script, config: &MasterConfig<N>) {
    let node = config.camera_node;
    begin_own(script, config, &camera::IDENTITY, node, &camera::RPDO1);
    for (slit, first) in [1, 3].into_iter().enumerate() {
        for (k, map) in (first..).zip([camera::place_map(slit), camera::manner_map(slit)]) {
            append_pdo(script, PdoPlan::sent(k, node, ACYCLIC, &map));
        }
    }
}

/// The script of the I/O node: inputs with every SYNC, because the E-stop chain is among them.
fn io<const N: usize>(script: &mut Script, config: &MasterConfig<N>) {
    let node = config.io_node;
    begin_own(script, config, &io::IDENTITY, node, &io::RPDO1);
    append_pdo(script, PdoPlan::sent(1, node, 1, &io::TPDO1));
}
