//! Drive profile CiA 402 (IEC 61800-7-201): the power state machine from both ends, and its process data.
//!
//! - [`PowerState`]: what a statusword says;
//! - [`machine::Machine`]: the state machine as a drive runs it;
//! - [`command::Commander`]: the choice of controlwords as a master makes it;
//! - [`pdo`]: the process data of one cycle; [`object`]: the indices.

pub mod command;
pub mod machine;
pub mod object;
pub mod pdo;

/// Device type 0x1000 of a servo drive: profile 402, type bit 17.
pub const SERVO_DRIVE: u32 = 0x0002_0192;

/// Modes of operation (0x6060) that the controller uses.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Mode {
    /// Cyclic synchronous velocity, mode 9: the drive closes its own speed loop.
    #[default]
    Velocity,
    /// Cyclic synchronous torque, mode 10.
    Torque,
}

crate::wire_enum!(Mode { Velocity, Torque });

impl Mode {
    /// Value of 0x6060 and 0x6061.
    pub const fn code(self) -> i8 {
        match self {
            Self::Velocity => 9,
            Self::Torque => 10,
        }
    }

    /// Bit of the mode in supported drive modes, 0x6502.
    pub const fn supported_bit(self) -> u32 {
        1 << (self.code() - 1)
    }

    /// Mode of a value of 0x6060; `None` for one that the controller does not use.
    pub const fn from_code(code: i8) -> Option<Self> {
        match code {
            9 => Some(Self::Velocity),
            10 => Some(Self::Torque),
            _ => None,
        }
    }
}

/// Bits of the statusword 0x6041 beside those of the state.
pub mod status {
    /// Bit 4: the power stage has its voltage.
    pub const VOLTAGE: u16 = 1 << 4;
    /// Bit 9: the drive obeys the bus.
    pub const REMOTE: u16 = 1 << 9;
    /// Bit 11: a limit of torque, speed or position is holding the drive back.
    pub const LIMIT: u16 = 1 << 11;
    /// Bit 12, in the cyclic synchronous modes: the drive follows the command value.
    pub const FOLLOWS: u16 = 1 << 12;
}

/// Controlwords 0x6040 that the state machine knows.
pub mod control {
    /// Disable voltage.
    pub const DISABLE_VOLTAGE: u16 = 0x0000;
    /// Quick stop (its bit is active low).
    pub const QUICK_STOP: u16 = 0x0002;
    /// Shutdown: to ready to switch on.
    pub const SHUTDOWN: u16 = 0x0006;
    /// Switch on.
    pub const SWITCH_ON: u16 = 0x0007;
    /// Enable operation.
    pub const ENABLE: u16 = 0x000F;
    /// Fault reset, on its rising edge.
    pub const FAULT_RESET: u16 = 0x0080;
    /// Bit 8: hold still, state unchanged.
    pub const HALT: u16 = 1 << 8;
}

/// States of the power state machine.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum PowerState {
    /// Self-test.
    #[default]
    NotReady,
    /// No torque, power may be off.
    SwitchOnDisabled,
    /// No torque, waiting to be switched on.
    ReadyToSwitchOn,
    /// Power stage on, no torque.
    SwitchedOn,
    /// Torque on, commands followed.
    OperationEnabled,
    /// Torque on, stopping or stopped on the quick-stop ramp.
    QuickStopActive,
    /// Torque on, stopping because of a fault.
    FaultReaction,
    /// No torque, a fault is latched.
    Fault,
}

impl PowerState {
    /// The state's bits in a statusword.
    pub const fn bits(self) -> u16 {
        match self {
            Self::NotReady => 0x00,
            Self::SwitchOnDisabled => 0x40,
            Self::ReadyToSwitchOn => 0x21,
            Self::SwitchedOn => 0x23,
            Self::OperationEnabled => 0x27,
            Self::QuickStopActive => 0x07,
            Self::FaultReaction => 0x0F,
            Self::Fault => 0x08,
        }
    }

    /// The state that a statusword says; `None` for bits that no state has.
    pub const fn of(statusword: u16) -> Option<Self> {
        // First the one that is looked for in every cycle.
        if statusword & 0x6F == 0x27 {
            return Some(Self::OperationEnabled);
        }
        match statusword & 0x4F {
            0x00 => return Some(Self::NotReady),
            0x40 => return Some(Self::SwitchOnDisabled),
            0x0F => return Some(Self::FaultReaction),
            0x08 => return Some(Self::Fault),
            _ => {}
        }
        match statusword & 0x6F {
            0x21 => Some(Self::ReadyToSwitchOn),
            0x23 => Some(Self::SwitchedOn),
            0x07 => Some(Self::QuickStopActive),
            _ => None,
        }
    }

    /// Whether the motor carries torque in this state.
    pub const fn has_torque(self) -> bool {
        matches!(
            self,
            Self::OperationEnabled | Self::QuickStopActive | Self::FaultReaction
        )
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_state_is_read_back_from_its_bits_whatever_the_other_bits() {
        use PowerState::*;
        let states = [
            NotReady,
            SwitchOnDisabled,
            ReadyToSwitchOn,
            SwitchedOn,
            OperationEnabled,
            QuickStopActive,
            FaultReaction,
            Fault,
        ];
        let elsewhere = status::VOLTAGE | status::REMOTE | status::LIMIT | status::FOLLOWS | 0x8000 | 0x0080;
        for state in states {
            for others in [0, elsewhere] {
                assert_eq!(PowerState::of(state.bits() | others), Some(state));
            }
        }
        assert_eq!(PowerState::of(0x01), None);
    }
}
