//! The CANopen master: between frames on the bus and the process image of one control cycle.
//!
//! It has no bus, no clock and no thread. Its owner calls, in every cycle of 5 ms: [`Master::sync`] at the cycle's
//! start, [`Master::receive`] for each frame that comes, and at the step phase [`Master::inputs`], the core's step, and
//! [`Master::outputs`]. Time is counted in these cycles.
//!
//! Nodes are N drives (1..=N), a camera and an I/O node. Each is brought up by itself (`station`): reset of
//! communication, boot-up, SDO script (`script`), NMT start; a node that reboots later is brought up again. Each PDO
//! has one mailbox and the newest frame wins. What fails is a [`Failure`]: node and code in the process image, the rest
//! for people through [`Master::last_failure`].

mod axis;
mod config;
mod failure;
mod script;
mod station;

pub use config::{ConfigError, DriveConfig, MasterConfig};
pub use failure::{Failure, reason};

use crate::camera::{self, Pairing, SLITS};
use crate::can::Frame;
use crate::canopen::cob::{self, Service};
use crate::canopen::emcy::{Emergency, code};
use crate::canopen::heartbeat::Producer;
use crate::canopen::nmt::NmtState;
use crate::canopen::sync;
use crate::cia402::pdo::{Condition, Motion};
use crate::io;
use crate::process::{AxisInput, Inputs, NEVER, Outputs, Sighting};
use crate::telemetry;
use crate::wire::Wire;
use axis::Axis;
use heapless::Deque;
use station::Station;

/// Asynchronous frames in a cycle while nodes are set up: they and their answers, 135 µs each at most, fit between the last RPDO's end and
/// the guard before SYNC. Once all nodes are up there are none.
const ASYNC_FRAMES: u32 = 4;
/// Commands to camera and I/O node are sent on change, and at least this often, so that a node that came late has them.
const REFRESH: u8 = 20;

/// Frames of telemetry that may wait: two points, as many as one exposure of two slits gives.
const TELEMETRY: usize = 4;

/// Identifier of the first drive's TPDO1; the others' follow.
const FIRST_TPDO1: usize = cob::tpdo(1, 1) as usize;

/// A command that goes out on change and every [`REFRESH`] cycles.
#[derive(Clone, Copy, Debug)]
struct Announced<const L: usize> {
    last: [u8; L],
    age: u8,
}

impl<const L: usize> Announced<L> {
    const fn new() -> Self {
        Self {
            last: [0; L],
            age: REFRESH,
        }
    }

    /// Takes this cycle's command; true if it is to be sent now.
    fn update(&mut self, now: [u8; L]) -> bool {
        self.age = self.age.saturating_add(1);
        let send = now != self.last || self.age >= REFRESH;
        if send {
            self.last = now;
            self.age = 0;
        }
        send
    }
}

/// The master of `N` drives, a camera node and an I/O node.
#[derive(Clone, Debug)]
pub struct Master<const N: usize> {
    config: MasterConfig<N>,
    axes: [Axis; N],
    camera: Station,
    io: Station,
    heartbeat: Producer,
    /// The process image, filled as frames come; what is handed out once waits in the fields that follow.
    image: Inputs<N>,
    /// By slit.
    pairings: [Pairing; SLITS],
    sightings: [Option<Sighting>; SLITS],
    camera_command: Announced<2>,
    io_command: Announced<3>,
    /// Telemetry that is still to go out.
    telemetry: Deque<Frame, TELEMETRY>,
    /// Where the round of asynchronous frames begins, so that no station starves.
    turn: usize,
    /// Node and code of the first failure that no image has told.
    pending: (u8, u16),
    last: Option<Failure>,
}

impl<const N: usize> Master<N> {
    /// A master of no nodes, to be set up.
    pub const EMPTY: Self = Self {
        config: MasterConfig::EMPTY,
        axes: [Axis::EMPTY; N],
        camera: Station::EMPTY,
        io: Station::EMPTY,
        heartbeat: Producer::new(0, 0),
        image: Inputs::EMPTY,
        pairings: [Pairing::new(0), Pairing::new(1)],
        sightings: [None; SLITS],
        camera_command: Announced::new(),
        io_command: Announced::new(),
        telemetry: Deque::new(),
        turn: 0,
        pending: (0, 0),
        last: None,
    };

    /// A master by this configuration; nothing is sent before the first [`Self::outputs`].
    pub fn new(config: &MasterConfig<N>) -> Result<Self, ConfigError> {
        let mut master = Self::EMPTY;
        master.set_up(config)?;
        Ok(master)
    }

    /// Sets up an [`Self::EMPTY`] master where it stands: it takes ten kilobytes, which a microcontroller's stack does not hold.
    pub fn set_up(&mut self, config: &MasterConfig<N>) -> Result<(), ConfigError> {
        config.check()?;
        let every = config.tpdo2_every.max(1);
        let watch = config.watch_cycles();
        self.config = *config;
        for (node, axis) in (1..).zip(&mut self.axes) {
            axis.station.assign(node, watch, Some(node % every));
        }
        self.image = Inputs::default();
        self.camera.assign(config.camera_node, watch, None);
        self.io.assign(config.io_node, watch, None);
        self.heartbeat = Producer::new(config.master_heartbeat_cycles as u32, 1);
        Ok(())
    }

    /// Opens a cycle: sends SYNC with the next count, and lets every age and time-out advance.
    pub fn sync(&mut self, tx: &mut impl FnMut(Frame)) {
        self.image.sync = sync::next(self.image.sync);
        tx(Frame::of(cob::SYNC, [self.image.sync]));
        self.heartbeat.elapse(1);
        age(&mut self.image.camera_age);
        age(&mut self.image.io_age);
        for axis in &mut self.image.axes {
            age(&mut axis.age);
        }
        for k in 0..N + 2 {
            let failure = self.station(k).and_then(Station::cycle);
            self.report(failure);
        }
    }

    /// Takes a frame from the bus.
    pub fn receive(&mut self, frame: &Frame) {
        // Most frames are the drives' TPDO1: those before all that a frame may else be.
        let drive = usize::from(frame.cob()).wrapping_sub(FIRST_TPDO1);
        if let (Some(axis), Some(bytes)) = (self.image.axes.get_mut(drive), frame.full()) {
            return take_motion(axis, Motion::of(bytes));
        }
        if frame.is_remote() {
            return;
        }
        let bytes = frame.bytes();
        match Service::of(frame.cob()) {
            Some(Service::Tpdo(pdo, node)) if node == self.camera.node() => self.take_sighting(pdo, bytes),
            Some(Service::Tpdo(1, node)) => self.take_tpdo1(node, bytes),
            Some(Service::Tpdo(2, node)) => self.take_tpdo2(node, bytes),
            Some(Service::Heartbeat(node)) => {
                if let Some(state) = bytes.first().copied().and_then(NmtState::from_code) {
                    if node == self.camera.node() {
                        self.image.camera_age = 0;
                    }
                    let failure = self.station_of(node).and_then(|station| station.heartbeat(state));
                    self.report(failure);
                    self.go_on(node);
                }
            }
            Some(Service::Emergency(node)) => {
                if let Some(emergency) = Emergency::decode(bytes)
                    && emergency.code != code::NONE
                    && self.station_of(node).is_some()
                {
                    self.report(Some(Failure::emergency(node, emergency.code)));
                }
            }
            Some(Service::SdoResponse(node)) => {
                if let Ok(message) = bytes.try_into() {
                    let failure = self.station_of(node).and_then(|station| station.sdo(message));
                    self.report(failure);
                    self.go_on(node);
                }
            }
            _ => {}
        }
    }

    /// Gives a node that is being set up the next step of its script, if it has done the one before.
    fn go_on(&mut self, node: u8) {
        if let Some(at) = self.station_of(node).and_then(|station| station.wants()) {
            let step = script::step(&self.config, node, at);
            if let Some(station) = self.station_of(node) {
                station.begin(step);
            }
        }
    }

    /// TPDO1 and 2 are of the first slit, 3 and 4 of the second.
    fn take_sighting(&mut self, pdo: u8, bytes: &[u8]) {
        self.image.camera_age = 0;
        let slit = usize::from(pdo > 2);
        let (Some(pairing), Some(sighting)) = (self.pairings.get_mut(slit), self.sightings.get_mut(slit)) else {
            return;
        };
        let whole = if pdo & 1 == 1 {
            pairing.place(bytes)
        } else {
            pairing.manner(bytes)
        };
        *sighting = whole.or(*sighting);
    }

    fn take_tpdo1(&mut self, node: u8, bytes: &[u8]) {
        if node == self.io.node() {
            if let Some(&digital) = bytes.first() {
                self.image.digital = digital;
                self.image.io_age = 0;
            }
        } else if let Some(axis) = self.axis_input(node) {
            match Motion::decode(bytes) {
                Some(motion) => take_motion(axis, motion),
                None => self.report(Some(Failure::emergency(node, code::PDO_LENGTH))),
            }
        }
    }

    fn take_tpdo2(&mut self, node: u8, bytes: &[u8]) {
        if let Some(axis) = self.axis_input(node) {
            match Condition::decode(bytes) {
                Some(condition) => {
                    axis.velocity = condition.velocity;
                    axis.error_code = condition.error_code;
                    axis.mode = condition.mode;
                }
                None => self.report(Some(Failure::emergency(node, code::PDO_LENGTH))),
            }
        }
    }

    /// Completes the process image of this cycle. A sighting of each slit, one a cycle, and the first failure are handed out once; `overruns` is what
    /// the timer counted.
    pub fn inputs(&mut self, overruns: u8) -> &Inputs<N> {
        (self.image.emergency_node, self.image.emergency_code) = core::mem::take(&mut self.pending);
        self.image.sighting = self.sightings.iter_mut().find_map(Option::take);
        self.image.bus_ready = self.is_ready();
        self.image.overruns = overruns;
        &self.image
    }

    /// The process image as [`Self::inputs`] left it, and newer where frames have come since.
    pub fn image(&self) -> &Inputs<N> {
        &self.image
    }

    /// Sends the core's commands: first the RPDOs of all drives that are operational, then what is due to camera and I/O
    /// node, then, until all are up, a few asynchronous frames in the slack that follows.
    ///
    /// A drive counts the SYNCs to its TPDO2 from its NMT start, so drives are started in different cycles: no cycle
    /// then carries the TPDO2 of all. (The SYNC start value, 0x1800 sub 6, would do it too, but few drives have it.)
    pub fn outputs(&mut self, outputs: &Outputs<N>, tx: &mut impl FnMut(Frame)) {
        for ((axis, node), (input, output)) in self
            .axes
            .iter_mut()
            .zip(1..)
            .zip(self.image.axes.iter().zip(&outputs.axes))
        {
            if let Some(frame) = axis.command(self.config.mode, node, input, output) {
                tx(frame);
            }
        }
        if self.camera.is_operational() {
            let command = camera::encode_command(outputs.exposure, outputs.look);
            if self.camera_command.update(command) {
                tx(Frame::of(cob::rpdo(1, self.camera.node()), command));
            }
        }
        if self.io.is_operational() {
            let command = io::encode_outputs(outputs.lamp, outputs.flow);
            if self.io_command.update(command) {
                tx(Frame::of(cob::rpdo(1, self.io.node()), command));
            }
        }
        // A frame a cycle, so that the camera's and the telemetry's do not come on top of each other.
        if let Some(frame) = self.telemetry.pop_front() {
            tx(frame);
        }
        if let Some(point) = &outputs.taught {
            for frame in telemetry::frames(self.config.master_node, point) {
                // A full queue loses the point; its number tells the listener.
                let _ = self.telemetry.push_back(frame);
            }
        }
        if self.heartbeat.take_due() {
            tx(Frame::of(
                cob::heartbeat(self.config.master_node),
                [NmtState::Operational.code()],
            ));
        }
        if !self.image.bus_ready {
            self.set_up_stations(tx);
        }
    }

    /// Sends what the bring-up of stations that are not yet operational has to say; those that are have nothing to.
    fn set_up_stations(&mut self, tx: &mut impl FnMut(Frame)) {
        let mut budget = ASYNC_FRAMES;
        let mut nmt = true;
        let slot = self.image.sync.checked_rem(self.config.tpdo2_every).unwrap_or(0);
        let turn = self.turn;
        for k in 0..N + 2 {
            if budget == 0 {
                break;
            }
            let station = self.station((turn + k) % (N + 2));
            if let Some(frame) = station.and_then(|station| station.transmit(&mut nmt, slot)) {
                tx(frame);
                budget -= 1;
            }
        }
        self.turn = (self.turn + 1) % (N + 2);
    }

    /// The newest failure, for people; it is kept until the next one.
    pub fn last_failure(&self) -> Option<Failure> {
        self.last
    }

    /// Whether every node is set up and operational.
    pub fn is_ready(&self) -> bool {
        self.camera.is_operational()
            && self.io.is_operational()
            && self.axes.iter().all(|axis| axis.station.is_operational())
    }

    /// Count of the last SYNC, zero before the first.
    pub fn count(&self) -> u8 {
        self.image.sync
    }

    fn report(&mut self, failure: Option<Failure>) {
        if let Some(Failure { node, code, .. }) = failure {
            if self.pending.0 == 0 {
                self.pending = (node, code);
            }
            self.last = failure;
        }
    }

    fn axis_input(&mut self, node: u8) -> Option<&mut AxisInput> {
        self.image.axes.get_mut((node as usize).checked_sub(1)?)
    }

    fn station(&mut self, k: usize) -> Option<&mut Station> {
        if k == N {
            Some(&mut self.camera)
        } else if k == N + 1 {
            Some(&mut self.io)
        } else {
            self.axes.get_mut(k).map(|axis| &mut axis.station)
        }
    }

    fn station_of(&mut self, node: u8) -> Option<&mut Station> {
        if node == self.camera.node() {
            Some(&mut self.camera)
        } else if node == self.io.node() {
            Some(&mut self.io)
        } else {
            let axis = self.axes.get_mut((node as usize).checked_sub(1)?)?;
            Some(&mut axis.station)
        }
    }
}

/// TPDO1 of this cycle.
fn take_motion(axis: &mut AxisInput, motion: Motion) {
    axis.position = motion.position;
    axis.torque = motion.torque;
    axis.statusword = motion.statusword;
    axis.age = 0;
}

/// One cycle more; [`NEVER`] stays, and stands only for never.
fn age(age: &mut u8) {
    if *age < NEVER - 1 {
        *age += 1;
    }
}

#[cfg(test)]
mod tests;
