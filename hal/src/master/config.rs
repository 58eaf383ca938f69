//! What the master is told: which nodes there must be, and how they are to be set up.

use crate::canopen::cob::NODE_MAX;
use crate::cia402::Mode;
use crate::wire_struct;

/// One drive: what it must be, and what it is told.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct DriveConfig {
    /// Vendor number and product code, 0x1018 sub 1 and 2; refused if the drive has others.
    pub vendor_product: [u32; 2],
    /// Motor rated torque 0x6076, mN·m; refused if the drive has another: every torque on the bus is per mille of it.
    pub rated_torque_mnm: u32,
    /// Encoder counts per motor revolution, 0x608F; refused if the drive has others.
    pub encoder_counts: u32,
    /// Gear ratio that the drive counts with, 0x6091: motor revolutions per this many shaft revolutions; refused else.
    pub gear: [u32; 2],
    /// Maximum torque 0x6072, per mille of rated.
    pub max_torque: u16,
    /// Maximum motor speed 0x6080, 1/min.
    pub max_speed_rpm: u32,
    /// Software position limits 0x607D, counts, lower first.
    pub position_limits: [i32; 2],
    /// Quick stop deceleration 0x6085, counts/s².
    pub quick_stop: u32,
    /// Following error window 0x6065, counts; drives watch it only in modes with a position demand.
    pub following_window: u32,
    /// Following error time out 0x6066, ms.
    pub following_time_ms: u16,
}

wire_struct!(DriveConfig {
    vendor_product: [u32; 2],
    rated_torque_mnm: u32,
    encoder_counts: u32,
    gear: [u32; 2],
    max_torque: u16,
    max_speed_rpm: u32,
    position_limits: [i32; 2],
    quick_stop: u32,
    following_window: u32,
    following_time_ms: u16,
});

/// The whole bus.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct MasterConfig<const N: usize> {
    /// Mode of all drives.
    pub mode: Mode,
    /// The drives, nodes 1..=N.
    pub drives: [DriveConfig; N],
    /// Node number of the camera, over N.
    pub camera_node: u8,
    /// Node number of the I/O node, over N.
    pub io_node: u8,
    /// The master's own node number, over N, for its heartbeat.
    pub master_node: u8,
    /// Communication cycle period, µs: 0x1006, and the master's unit of time.
    pub cycle_us: u32,
    /// TPDO2 goes every that many SYNCs, 1..=240; drives are staggered over them: see [`super::Master::outputs`].
    pub tpdo2_every: u8,
    /// Period of the nodes' heartbeats 0x1017, ms; the master takes a node as lost after 2.5 periods.
    pub node_heartbeat_ms: u16,
    /// Period of the master's heartbeat, cycles; nodes take it as lost after 2.5 periods, 0x1016.
    pub master_heartbeat_cycles: u16,
    /// Longest time between two RPDO1 that a drive accepts, cycles, 0x1400 sub 5: it then quick-stops.
    pub rpdo_timeout_cycles: u16,
}

wire_struct!(MasterConfig<const N: usize> {
    mode: Mode, drives: [DriveConfig; N], camera_node: u8, io_node: u8, master_node: u8, cycle_us: u32, tpdo2_every: u8,
    node_heartbeat_ms: u16, master_heartbeat_cycles: u16, rpdo_timeout_cycles: u16,
});

impl<const N: usize> MasterConfig<N> {
    /// The usual bus: 5 ms cycle, TPDO2 every 4th SYNC, camera node 32, I/O node 33, master 127.
    ///
    /// Heartbeats are assumed: nodes 100 ms, because their PDOs tell more and sooner; the master 25 ms, so that a dead
    /// master is noticed after 60 ms, 18 mm at 0.3 m/s, and sooner, after four cycles, by the missing RPDOs.
    pub const fn new(mode: Mode, drives: [DriveConfig; N]) -> Self {
        Self {
            mode,
            drives,
            camera_node: 32,
            io_node: 33,
            master_node: NODE_MAX,
            cycle_us: 5000,
            tpdo2_every: 4,
            node_heartbeat_ms: 100,
            master_heartbeat_cycles: 5,
            rpdo_timeout_cycles: 4,
        }
    }

    /// Cycles of silence after which a node's heartbeat is lost: 2.5 periods.
    pub(super) fn watch_cycles(&self) -> u32 {
        // `check` refuses a cycle of zero; `max` spares the division a way to fail.
        self.node_heartbeat_ms as u32 * 2500 / self.cycle_us.max(1) + 1
    }

    /// Milliseconds, rounded up, of a number of cycles.
    pub(super) fn cycles_ms(&self, cycles: u32) -> u16 {
        cycles.saturating_mul(self.cycle_us).div_ceil(1000).min(u16::MAX as u32) as u16
    }

    pub(super) fn check(&self) -> Result<(), ConfigError> {
        let range = |field, value: u32, low, high| {
            if (low..=high).contains(&value) {
                Ok(())
            } else {
                Err(ConfigError {
                    field,
                    value,
                    low,
                    high,
                })
            }
        };
        range("number of drives", N as u32, 1, 30)?;
        let above = N as u32 + 1;
        range("camera_node", self.camera_node.into(), above, NODE_MAX.into())?;
        range("io_node", self.io_node.into(), above, NODE_MAX.into())?;
        range("master_node", self.master_node.into(), above, NODE_MAX.into())?;
        let distinct = self.camera_node != self.io_node
            && self.camera_node != self.master_node
            && self.io_node != self.master_node;
        range("distinct nodes of camera, I/O and master", distinct as u32, 1, 1)?;
        range("cycle_us", self.cycle_us, 1000, 100_000)?;
        range("tpdo2_every", self.tpdo2_every.into(), 1, 240)?;
        range("node_heartbeat_ms", self.node_heartbeat_ms.into(), 20, 10_000)?;
        range("master_heartbeat_cycles", self.master_heartbeat_cycles.into(), 1, 200)?;
        range("rpdo_timeout_cycles", self.rpdo_timeout_cycles.into(), 2, 200)?;
        for drive in &self.drives {
            range("rated_torque_mnm", drive.rated_torque_mnm, 1, 1_000_000)?;
            range("encoder_counts", drive.encoder_counts, 1, 1 << 24)?;
            range("max_torque", drive.max_torque.into(), 1, 5000)?;
            range("max_speed_rpm", drive.max_speed_rpm, 1, 20_000)?;
            range("quick_stop", drive.quick_stop, 1, u32::MAX)?;
            let [low, high] = drive.position_limits;
            range("position_limits in order", (low < high) as u32, 1, 1)?;
        }
        Ok(())
    }
}

/// A configuration value out of its range.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct ConfigError {
    /// Field of [`MasterConfig`] or [`DriveConfig`].
    pub field: &'static str,
    /// Its value.
    pub value: u32,
    /// Lowest value allowed.
    pub low: u32,
    /// Highest value allowed.
    pub high: u32,
}

impl core::fmt::Display for ConfigError {
    fn fmt(&self, f: &mut core::fmt::Formatter<'_>) -> core::fmt::Result {
        let Self {
            field,
            value,
            low,
            high,
        } = self;
        write!(f, "bus configuration: {field} is {value}, allowed {low}..={high}")
    }
}

impl core::error::Error for ConfigError {}
