//! Objects: address, value, and the trait by which a device offers its own to SDO and PDO.

use super::nmt::NmtState;
use super::sdo::Abort;

/// Where an object lies in the dictionary.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Address {
    /// Index.
    pub index: u16,
    /// Sub-index.
    pub sub: u8,
}

/// The object at `index`, sub-index `sub`.
pub const fn at(index: u16, sub: u8) -> Address {
    Address { index, sub }
}

/// An integer of one to four bytes, little-endian on the wire, sign as its reader takes it.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Number {
    raw: u32,
    len: u8,
}

impl Number {
    /// From little-endian bytes; `None` unless there are one to four.
    pub fn from_bytes(bytes: &[u8]) -> Option<Self> {
        let (raw, len) = match *bytes {
            [a] => ([a, 0, 0, 0], 1),
            [a, b] => ([a, b, 0, 0], 2),
            [a, b, c] => ([a, b, c, 0], 3),
            [a, b, c, d] => ([a, b, c, d], 4),
            _ => return None,
        };
        Some(Self {
            raw: u32::from_le_bytes(raw),
            len,
        })
    }

    /// Bytes on the wire; of the four only the first [`Self::len`] count.
    pub const fn to_bytes(self) -> [u8; 4] {
        self.raw.to_le_bytes()
    }

    /// Length on the wire, bytes.
    #[allow(clippy::len_without_is_empty)] // a number is never empty
    pub const fn len(self) -> u8 {
        self.len
    }

    /// The bits, zero-extended.
    pub const fn bits(self) -> u32 {
        self.raw
    }
}

macro_rules! number {
    ($($kind:ty),*) => {$(
        impl From<$kind> for Number {
            fn from(value: $kind) -> Self {
                // Through the kind's own width, so that a negative number leaves no ones above its length.
                let mut raw = [0; 4];
                for (to, from) in raw.iter_mut().zip(value.to_le_bytes()) {
                    *to = from;
                }
                Self { raw: u32::from_le_bytes(raw), len: size_of::<$kind>() as u8 }
            }
        }
        impl From<$kind> for Value {
            fn from(value: $kind) -> Self {
                Self::Number(value.into())
            }
        }
        impl TryFrom<Number> for $kind {
            type Error = Abort;
            fn try_from(number: Number) -> Result<Self, Abort> {
                if number.len as usize == size_of::<$kind>() {
                    Ok(number.raw as $kind)
                } else {
                    Err(Abort::LENGTH)
                }
            }
        }
    )*};
}
number!(u8, i8, u16, i16, u32, i32);

/// What reading an object gives.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Value {
    /// An integer.
    Number(Number),
    /// A visible string, uploaded in segments.
    Text(&'static str),
}

/// What happened to the node that its device must know of.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Event {
    /// The NMT state changed.
    State(NmtState),
    /// The application restarts (NMT reset node).
    Reset,
    /// The master's heartbeat is lost.
    MasterLost,
    /// The RPDO of this number (from 1) did not come within its event time.
    RpdoLate(u8),
}

/// What a node is beyond its communication: its objects, and what it does at a SYNC.
pub trait Device {
    /// Reads one of the device's own objects; [`Abort::NO_OBJECT`] or [`Abort::NO_SUB`] where there is none.
    fn read(&self, at: Address) -> Result<Value, Abort>;

    /// Writes one of the device's own objects, from an SDO or a mapped RPDO.
    fn write(&mut self, at: Address, number: Number) -> Result<(), Abort>;

    /// A SYNC came while operational: synchronous RPDOs are written, TPDOs will be read next, so latch now.
    fn sync(&mut self, count: u8);

    /// Something happened to the node.
    fn event(&mut self, event: Event);
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    proptest! {
        #[test]
        fn numbers_survive_their_bytes(value: i16, wide: i32) {
            for number in [Number::from(value), Number::from(wide), Number::from(value as u8)] {
                let bytes = number.to_bytes();
                prop_assert_eq!(Number::from_bytes(&bytes[..number.len() as usize]), Some(number));
            }
            prop_assert_eq!(i16::try_from(Number::from(value)), Ok(value));
            prop_assert_eq!(i32::try_from(Number::from(wide)), Ok(wide));
        }
    }

    #[test]
    fn a_number_of_another_length_is_refused() {
        assert_eq!(u16::try_from(Number::from(7u8)), Err(Abort::LENGTH));
        assert_eq!(Number::from_bytes(&[0; 5]), None);
    }
}
