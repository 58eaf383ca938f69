//! Process data of one drive and cycle: maps, and the frames that those maps give.

use super::object as o;
use crate::canopen::pdo::{Mapped, mapped};

/// Map of RPDO1 in cyclic synchronous velocity: controlword, target velocity, torque offset.
pub const RPDO1_VELOCITY: [Mapped; 3] = [
    mapped(o::CONTROLWORD, 0, 16),
    mapped(o::TARGET_VELOCITY, 0, 32),
    mapped(o::TORQUE_OFFSET, 0, 16),
];
/// Map of RPDO1 in cyclic synchronous torque: controlword, target torque.
pub const RPDO1_TORQUE: [Mapped; 2] = [mapped(o::CONTROLWORD, 0, 16), mapped(o::TARGET_TORQUE, 0, 16)];
/// Map of TPDO1: statusword, position, torque.
pub const TPDO1: [Mapped; 3] = [
    mapped(o::STATUSWORD, 0, 16),
    mapped(o::POSITION, 0, 32),
    mapped(o::TORQUE, 0, 16),
];
/// Map of TPDO2: velocity, error code, mode.
pub const TPDO2: [Mapped; 3] = [
    mapped(o::VELOCITY, 0, 32),
    mapped(o::ERROR_CODE, 0, 16),
    mapped(o::MODE_DISPLAY, 0, 8),
];

/// RPDO1 in cyclic synchronous velocity.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct VelocityCommand {
    /// Controlword.
    pub controlword: u16,
    /// Target velocity, counts/s.
    pub velocity: i32,
    /// Torque offset, per mille of rated.
    pub torque_offset: i16,
}

impl VelocityCommand {
    /// Frame data, by [`RPDO1_VELOCITY`].
    pub const fn encode(self) -> [u8; 8] {
        // By words, as it goes into a message memory.
        let velocity = self.velocity as u32;
        let [a, b, c, d] = (self.controlword as u32 | velocity << 16).to_le_bytes();
        let [e, f, g, h] = (velocity >> 16 | (self.torque_offset as u32) << 16).to_le_bytes();
        [a, b, c, d, e, f, g, h]
    }
}

/// RPDO1 in cyclic synchronous torque.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct TorqueCommand {
    /// Controlword.
    pub controlword: u16,
    /// Target torque, per mille of rated.
    pub torque: i16,
}

impl TorqueCommand {
    /// Frame data, by [`RPDO1_TORQUE`].
    pub const fn encode(self) -> [u8; 4] {
        let [a, b] = self.controlword.to_le_bytes();
        let [c, d] = self.torque.to_le_bytes();
        [a, b, c, d]
    }
}

/// TPDO1.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Motion {
    /// Statusword.
    pub statusword: u16,
    /// Position at the SYNC, counts.
    pub position: i32,
    /// Torque, per mille of rated.
    pub torque: i16,
}

impl Motion {
    /// From frame data, by [`TPDO1`]; `None` unless it is eight bytes.
    pub const fn decode(bytes: &[u8]) -> Option<Self> {
        let &[a, b, c, d, e, f, g, h] = bytes else { return None };
        Some(Self::of(&[a, b, c, d, e, f, g, h]))
    }

    /// From the data of a frame of eight bytes, by [`TPDO1`].
    pub const fn of(&[a, b, c, d, e, f, g, h]: &[u8; 8]) -> Self {
        // By words: a frame that comes from a message memory is two of them.
        let (low, high) = (u32::from_le_bytes([a, b, c, d]), u32::from_le_bytes([e, f, g, h]));
        Self {
            statusword: low as u16,
            position: (low >> 16 | high << 16) as i32,
            torque: (high >> 16) as i16,
        }
    }
}

/// TPDO2.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Condition {
    /// Velocity, counts/s.
    pub velocity: i32,
    /// Error code, zero for none.
    pub error_code: u16,
    /// Mode of operation in force.
    pub mode: i8,
}

impl Condition {
    /// From frame data, by [`TPDO2`]; `None` unless it is seven bytes.
    pub const fn decode(bytes: &[u8]) -> Option<Self> {
        let &[a, b, c, d, e, f, g] = bytes else { return None };
        Some(Self {
            velocity: i32::from_le_bytes([a, b, c, d]),
            error_code: u16::from_le_bytes([e, f]),
            mode: i8::from_le_bytes([g]),
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    fn bytes_of(map: &[Mapped]) -> usize {
        map.iter().map(|entry| entry.bits as usize).sum::<usize>() / 8
    }

    #[test]
    fn frames_are_as_long_as_their_maps() {
        assert_eq!(bytes_of(&RPDO1_VELOCITY), VelocityCommand::default().encode().len());
        assert_eq!(bytes_of(&RPDO1_TORQUE), TorqueCommand::default().encode().len());
        assert!(Motion::decode(&[0; 8][..bytes_of(&TPDO1)]).is_some());
        assert!(Condition::decode(&[0; 8][..bytes_of(&TPDO2)]).is_some());
    }

    proptest! {
        #[test]
        fn commands_and_answers_lay_out_alike(word: u16, wide: i32, narrow: i16, mode: i8) {
            // RPDO1 in velocity mode and TPDO1 have the same layout, so one decodes the other.
            let command = VelocityCommand { controlword: word, velocity: wide, torque_offset: narrow };
            let motion = Motion { statusword: word, position: wide, torque: narrow };
            prop_assert_eq!(Motion::decode(&command.encode()), Some(motion));
            let torque = TorqueCommand { controlword: word, torque: narrow }.encode();
            prop_assert_eq!(u16::from_le_bytes([torque[0], torque[1]]), word);
            prop_assert_eq!(i16::from_le_bytes([torque[2], torque[3]]), narrow);
            let mut bytes = [0; 7];
            bytes[..4].copy_from_slice(&wide.to_le_bytes());
            bytes[4..6].copy_from_slice(&word.to_le_bytes());
            bytes[6] = mode as u8;
            prop_assert_eq!(Condition::decode(&bytes), Some(Condition { velocity: wide, error_code: word, mode }));
        }
    }
}
