//! What can go wrong with a node, as a number for the core and a line for people.

use crate::canopen::object::Address;

/// Codes of failures that the master finds itself, in the range that CiA 301 leaves to the device (0xFFxx). A lost
/// heartbeat has the standard's own code, 0x8130, and emergencies keep the code that the node sent.
pub mod reason {
    /// No boot-up message after a reset of communication.
    pub const NO_BOOT_UP: u16 = 0xFF01;
    /// A node that was operational has booted again: it lost its power or its mind.
    pub const REBOOTED: u16 = 0xFF02;
    /// The node left operational without being told.
    pub const NOT_OPERATIONAL: u16 = 0xFF03;
    /// The node refused an SDO.
    pub const SDO_ABORT: u16 = 0xFF04;
    /// The node did not answer an SDO.
    pub const SDO_TIMEOUT: u16 = 0xFF05;
    /// Device type 0x1000 is not the one expected.
    pub const DEVICE_TYPE: u16 = 0xFF10;
    /// Vendor number 0x1018 sub 1 is not the one expected.
    pub const VENDOR: u16 = 0xFF11;
    /// Product code 0x1018 sub 2 is not the one expected.
    pub const PRODUCT: u16 = 0xFF12;
    /// The drive lacks the mode, 0x6502.
    pub const SUPPORTED_MODES: u16 = 0xFF13;
    /// Motor rated torque 0x6076 is not the one expected.
    pub const RATED_TORQUE: u16 = 0xFF14;
    /// Encoder resolution 0x608F is not the one expected.
    pub const ENCODER: u16 = 0xFF15;
    /// Gear ratio 0x6091 is not the one expected.
    pub const GEAR: u16 = 0xFF16;
    /// The mode that was set is not in force, 0x6061.
    pub const MODE: u16 = 0xFF17;
}

/// A failure of a node.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Failure {
    /// Node number.
    pub node: u8,
    /// One of [`reason`], or an emergency code.
    pub code: u16,
    /// The object that an SDO was about, if one was.
    pub object: Option<Address>,
    /// SDO abort code, or the value found where another was expected.
    pub value: u32,
}

impl Failure {
    /// An emergency, or a failure without an object.
    pub(super) const fn emergency(node: u8, code: u16) -> Self {
        Self {
            node,
            code,
            object: None,
            value: 0,
        }
    }
}

impl core::fmt::Display for Failure {
    fn fmt(&self, f: &mut core::fmt::Formatter<'_>) -> core::fmt::Result {
        use crate::canopen::emcy::code;
        let what = match self.code {
            reason::NO_BOOT_UP => "no boot-up after reset",
            reason::REBOOTED => "rebooted while in use",
            reason::NOT_OPERATIONAL => "left operational by itself",
            reason::SDO_ABORT => "SDO refused",
            reason::SDO_TIMEOUT => "SDO not answered",
            reason::DEVICE_TYPE => "unexpected device type",
            reason::VENDOR => "unexpected vendor",
            reason::PRODUCT => "unexpected product",
            reason::SUPPORTED_MODES => "mode not supported",
            reason::RATED_TORQUE => "unexpected rated torque",
            reason::ENCODER => "unexpected encoder resolution",
            reason::GEAR => "unexpected gear ratio",
            reason::MODE => "mode not taken",
            code::OVER_CURRENT => "over-current",
            code::OVER_VOLTAGE => "DC link over-voltage",
            code::UNDER_VOLTAGE => "DC link under-voltage",
            code::OVER_TEMPERATURE => "too hot",
            code::SENSOR => "position sensor",
            code::OVER_SPEED => "over-speed",
            code::OVERRUN => "overrun",
            code::ERROR_PASSIVE => "CAN error passive",
            code::HEARTBEAT => "heartbeat lost",
            code::BUS_OFF => "recovered from bus-off",
            code::PDO_LENGTH => "PDO too short",
            code::RPDO_TIMEOUT => "RPDO timed out",
            code::FOLLOWING => "following error",
            code::POSITION_LIMIT => "position limit",
            _ => "emergency",
        };
        write!(f, "node {}: {what} (0x{:04X})", self.node, self.code)?;
        if let Some(Address { index, sub }) = self.object {
            write!(f, ", object 0x{index:04X}:{sub}, 0x{:08X}", self.value)?;
        }
        Ok(())
    }
}
