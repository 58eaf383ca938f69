//! The eight bytes of each SDO message.

use super::Abort;
use crate::canopen::object::{Address, Number, at};

/// Bytes of data in one segment.
const SEGMENT: usize = 7;

/// Client to server.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Request {
    /// Read an object.
    Upload(Address),
    /// Next segment of the upload under way; the toggle starts at false.
    Segment {
        /// Alternates from segment to segment.
        toggle: bool,
    },
    /// Write an object of up to four bytes.
    Download(Address, Number),
    /// The client gives up.
    Abort(Address, Abort),
}

/// Server to client.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Response {
    /// The object was written.
    Downloaded(Address),
    /// The object's value, up to four bytes.
    Uploaded(Address, Number),
    /// The object is `size` bytes long and comes in segments.
    UploadStarted(Address, u32),
    /// A segment: the first `len` of the seven bytes count.
    Segment {
        /// The request's toggle.
        toggle: bool,
        /// Data.
        data: [u8; SEGMENT],
        /// How many bytes of it count, 0..=7.
        len: u8,
        /// No more segments follow.
        last: bool,
    },
    /// Refused.
    Abort(Address, Abort),
}

fn message(command: u8, address: Address, data: [u8; 4]) -> [u8; 8] {
    let [low, high] = address.index.to_le_bytes();
    let [a, b, c, d] = data;
    [command, low, high, address.sub, a, b, c, d]
}

/// Expedited transfer, size given: bits 0 and 1; bits 2 and 3 count the bytes that do not hold data.
fn expedited(command: u8, address: Address, number: Number) -> [u8; 8] {
    message(
        command | 0b11 | (4u8.saturating_sub(number.len()) << 2),
        address,
        number.to_bytes(),
    )
}

/// Number of an expedited transfer; without a size all four bytes count.
fn number(command: u8, data: [u8; 4]) -> Option<Number> {
    let unused = if command & 1 != 0 { (command >> 2) & 3 } else { 0 };
    Number::from_bytes(data.get(..4 - unused as usize)?)
}

impl Request {
    /// The message.
    pub fn encode(self) -> [u8; 8] {
        match self {
            Self::Upload(address) => message(0x40, address, [0; 4]),
            Self::Segment { toggle } => [0x60 | (toggle as u8) << 4, 0, 0, 0, 0, 0, 0, 0],
            Self::Download(address, number) => expedited(0x20, address, number),
            Self::Abort(address, Abort(code)) => message(0x80, address, code.to_le_bytes()),
        }
    }

    /// From a message; `Err` is the answer that an unknown or unsupported command deserves.
    pub fn decode(bytes: &[u8; 8]) -> Result<Self, Response> {
        let &[command, low, high, sub, a, b, c, d] = bytes;
        let address = at(u16::from_le_bytes([low, high]), sub);
        let data = [a, b, c, d];
        let refused = Response::Abort(address, Abort::COMMAND);
        match command >> 5 {
            1 if command & 0b10 != 0 => number(command, data)
                .map(|number| Self::Download(address, number))
                .ok_or(refused),
            2 => Ok(Self::Upload(address)),
            3 => Ok(Self::Segment {
                toggle: command & 0x10 != 0,
            }),
            4 => Ok(Self::Abort(address, Abort(u32::from_le_bytes(data)))),
            _ => Err(refused),
        }
    }
}

impl Response {
    /// The message.
    pub fn encode(self) -> [u8; 8] {
        match self {
            Self::Downloaded(address) => message(0x60, address, [0; 4]),
            Self::Uploaded(address, number) => expedited(0x40, address, number),
            Self::UploadStarted(address, size) => message(0x41, address, size.to_le_bytes()),
            Self::Segment {
                toggle,
                data,
                len,
                last,
            } => {
                let unused = (SEGMENT as u8).saturating_sub(len);
                let [a, b, c, d, e, f, g] = data;
                let command = (toggle as u8) << 4 | unused << 1 | last as u8;
                [command, a, b, c, d, e, f, g]
            }
            Self::Abort(address, Abort(code)) => message(0x80, address, code.to_le_bytes()),
        }
    }

    /// From a message; `None` for an unknown command.
    pub fn decode(bytes: &[u8; 8]) -> Option<Self> {
        let &[command, low, high, sub, a, b, c, d] = bytes;
        let address = at(u16::from_le_bytes([low, high]), sub);
        let data = [a, b, c, d];
        match command >> 5 {
            0 => Some(Self::Segment {
                toggle: command & 0x10 != 0,
                data: [low, high, sub, a, b, c, d],
                len: SEGMENT as u8 - ((command >> 1) & 7),
                last: command & 1 != 0,
            }),
            2 if command & 0b10 != 0 => number(command, data).map(|number| Self::Uploaded(address, number)),
            2 => Some(Self::UploadStarted(address, u32::from_le_bytes(data))),
            3 => Some(Self::Downloaded(address)),
            4 => Some(Self::Abort(address, Abort(u32::from_le_bytes(data)))),
            _ => None,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    fn address() -> impl Strategy<Value = Address> {
        (any::<u16>(), any::<u8>()).prop_map(|(index, sub)| at(index, sub))
    }

    fn any_number() -> impl Strategy<Value = Number> {
        prop::collection::vec(any::<u8>(), 1..=4).prop_map(|bytes| Number::from_bytes(&bytes).unwrap())
    }

    proptest! {
        #[test]
        fn requests_survive_their_bytes(address in address(), number in any_number(), code: u32, toggle: bool) {
            for request in [
                Request::Upload(address),
                Request::Segment { toggle },
                Request::Download(address, number),
                Request::Abort(address, Abort(code)),
            ] {
                prop_assert_eq!(Request::decode(&request.encode()), Ok(request));
            }
        }

        #[test]
        fn responses_survive_their_bytes(
            address in address(), number in any_number(), code: u32, toggle: bool, last: bool, data: [u8; 7], len in 0..=7u8,
        ) {
            for response in [
                Response::Downloaded(address),
                Response::Uploaded(address, number),
                Response::UploadStarted(address, code),
                Response::Segment { toggle, data, len, last },
                Response::Abort(address, Abort(code)),
            ] {
                prop_assert_eq!(Response::decode(&response.encode()), Some(response));
            }
        }

        #[test]
        fn any_eight_bytes_are_read_without_panic(bytes: [u8; 8]) {
            let _ = Request::decode(&bytes);
            let _ = Response::decode(&bytes);
        }
    }

    #[test]
    fn known_messages_of_the_standard() {
        let write = Request::Download(at(0x1017, 0), Number::from(1000u16));
        assert_eq!(write.encode(), [0x2B, 0x17, 0x10, 0, 0xE8, 0x03, 0, 0]);
        assert_eq!(
            Request::Upload(at(0x1018, 1)).encode(),
            [0x40, 0x18, 0x10, 1, 0, 0, 0, 0]
        );
        let value = Response::Uploaded(at(0x1000, 0), Number::from(0x0002_0192u32));
        assert_eq!(value.encode(), [0x43, 0x00, 0x10, 0, 0x92, 0x01, 0x02, 0x00]);
        let refused = Response::Abort(at(0x2000, 0), Abort::NO_OBJECT);
        assert_eq!(refused.encode(), [0x80, 0, 0x20, 0, 0, 0, 0x02, 0x06]);
    }
}
