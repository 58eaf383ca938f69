//! Emergency objects: what a node says once when something breaks, and once when it is well again.

/// Emergency codes in use (CiA 301 and CiA 402).
pub mod code {
    /// All errors are gone.
    pub const NONE: u16 = 0x0000;
    /// Over-current in the drive's output.
    pub const OVER_CURRENT: u16 = 0x2310;
    /// DC link over-voltage.
    pub const OVER_VOLTAGE: u16 = 0x3210;
    /// DC link under-voltage: motor power was cut.
    pub const UNDER_VOLTAGE: u16 = 0x3220;
    /// Drive too hot.
    pub const OVER_TEMPERATURE: u16 = 0x4310;
    /// Position sensor.
    pub const SENSOR: u16 = 0x7300;
    /// Motor over-speed (CiA 402, speed).
    pub const OVER_SPEED: u16 = 0x7310;
    /// CAN overrun: a frame, or a request, was lost.
    pub const OVERRUN: u16 = 0x8110;
    /// The CAN controller went error passive.
    pub const ERROR_PASSIVE: u16 = 0x8120;
    /// Heartbeat lost.
    pub const HEARTBEAT: u16 = 0x8130;
    /// Recovered from bus-off.
    pub const BUS_OFF: u16 = 0x8140;
    /// A PDO was shorter than its map.
    pub const PDO_LENGTH: u16 = 0x8210;
    /// An RPDO did not come in its time.
    pub const RPDO_TIMEOUT: u16 = 0x8250;
    /// Following error.
    pub const FOLLOWING: u16 = 0x8611;
    /// A software position limit was passed (CiA 402, reference limit).
    pub const POSITION_LIMIT: u16 = 0x8612;
}

/// An emergency object: code, error register (object 0x1001), vendor bytes.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Emergency {
    /// One of [`code`], or a vendor's own.
    pub code: u16,
    /// Object 0x1001: bit 0 generic, 1 current, 2 voltage, 3 temperature, 4 communication, 5 device profile.
    pub register: u8,
    /// Free for the vendor.
    pub vendor: [u8; 5],
}

impl Emergency {
    /// An emergency of `code`, with the register bits of the code's class.
    pub const fn new(code: u16) -> Self {
        let register = match code >> 12 {
            0x0 => 0,
            0x2 => 1 | 1 << 1,
            0x3 => 1 | 1 << 2,
            0x4 => 1 | 1 << 3,
            0x8 if code >> 8 <= 0x82 => 1 | 1 << 4,
            0x7 | 0x8 => 1 | 1 << 5,
            _ => 1,
        };
        Self {
            code,
            register,
            vendor: [0; 5],
        }
    }

    /// Frame data.
    pub const fn encode(self) -> [u8; 8] {
        let [low, high] = self.code.to_le_bytes();
        let [a, b, c, d, e] = self.vendor;
        [low, high, self.register, a, b, c, d, e]
    }

    /// From frame data; `None` unless it is eight bytes.
    pub const fn decode(bytes: &[u8]) -> Option<Self> {
        let &[low, high, register, a, b, c, d, e] = bytes else {
            return None;
        };
        Some(Self {
            code: u16::from_le_bytes([low, high]),
            register,
            vendor: [a, b, c, d, e],
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    proptest! {
        #[test]
        fn eight_bytes_survive_decode_and_encode(bytes: [u8; 8]) {
            prop_assert_eq!(Emergency::decode(&bytes).map(Emergency::encode), Some(bytes));
        }
    }

    #[test]
    fn the_error_register_names_the_class() {
        let register = |code| Emergency::new(code).register;
        assert_eq!(register(code::NONE), 0);
        assert_eq!(register(code::OVER_CURRENT), 0b11);
        assert_eq!(register(code::UNDER_VOLTAGE), 0b101);
        assert_eq!(register(code::HEARTBEAT), 0b1_0001);
        assert_eq!(register(code::FOLLOWING), 0b10_0001);
    }
}
