//! The classic CAN data frame, 11-bit identifiers only, as CANopen uses it.

use embedded_can::{ExtendedId, Id, StandardId};

/// One frame: identifier, and up to eight data bytes. A remote frame carries a length and no data.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Frame {
    id: u16,
    remote: bool,
    len: u8,
    data: [u8; 8],
}

impl Frame {
    /// A data frame; `None` if `id` is over 0x7FF or `data` over eight bytes.
    pub fn data(id: u16, data: &[u8]) -> Option<Self> {
        if id > 0x7FF {
            return None;
        }
        let mut frame = Self {
            id,
            remote: false,
            len: data.len() as u8,
            data: [0; 8],
        };
        frame.data.get_mut(..data.len())?.copy_from_slice(data);
        Some(frame)
    }

    /// A data frame of `L` ≤ 8 bytes, checked when compiled; of `id` the low 11 bits count.
    pub const fn of<const L: usize>(id: u16, bytes: [u8; L]) -> Self {
        const { assert!(L <= 8) };
        let mut data = [0; 8];
        let mut k = 0;
        while k < L {
            data[k] = bytes[k];
            k += 1;
        }
        Self {
            id: id & 0x7FF,
            remote: false,
            len: L as u8,
            data,
        }
    }

    /// Identifier, 0..=0x7FF.
    pub fn cob(&self) -> u16 {
        self.id
    }

    /// Whether this is a remote frame: it asks for data and holds none.
    pub fn is_remote(&self) -> bool {
        self.remote
    }

    /// The length field, 0..=8: bytes of data, or asked for.
    pub fn length(&self) -> u8 {
        self.len
    }

    /// The data bytes; empty for a remote frame.
    pub fn bytes(&self) -> &[u8] {
        let len = if self.remote { 0 } else { self.len as usize };
        self.data.get(..len).unwrap_or(&[])
    }

    /// The data bytes of a frame that has all eight.
    pub fn full(&self) -> Option<&[u8; 8]> {
        (self.len == 8 && !self.remote).then_some(&self.data)
    }

    /// Three words, as a CAN controller's message memory holds a frame: identifier (bits 0 to 10), length (16 to 19) and
    /// remote flag (24); then the data, unused bytes zero.
    pub fn to_words(&self) -> [u32; 3] {
        let [a, b, c, d, e, f, g, h] = self.data;
        let head = u32::from(self.id) | u32::from(self.len) << 16 | u32::from(self.remote) << 24;
        [head, u32::from_le_bytes([a, b, c, d]), u32::from_le_bytes([e, f, g, h])]
    }

    /// The frame of [`Self::to_words`]; `None` if identifier or length is none.
    pub fn from_words([head, low, high]: [u32; 3]) -> Option<Self> {
        let [a, b, c, d] = low.to_le_bytes();
        let [e, f, g, h] = high.to_le_bytes();
        let (id, len, remote) = (head as u16, (head >> 16) as u8, head >> 24);
        let legal = id <= 0x7FF && len <= 8 && remote <= 1;
        legal.then_some(Self {
            id,
            remote: remote == 1,
            len,
            data: [a, b, c, d, e, f, g, h],
        })
    }
}

impl embedded_can::Frame for Frame {
    fn new(id: impl Into<Id>, data: &[u8]) -> Option<Self> {
        match id.into() {
            Id::Standard(id) => Self::data(id.as_raw(), data),
            Id::Extended(ExtendedId { .. }) => None,
        }
    }

    fn new_remote(id: impl Into<Id>, dlc: usize) -> Option<Self> {
        match id.into() {
            Id::Standard(id) if dlc <= 8 => Some(Self {
                id: id.as_raw(),
                remote: true,
                len: dlc as u8,
                data: [0; 8],
            }),
            _ => None,
        }
    }

    fn is_extended(&self) -> bool {
        false
    }

    fn is_remote_frame(&self) -> bool {
        self.remote
    }

    fn id(&self) -> Id {
        Id::Standard(StandardId::new(self.id).unwrap_or(StandardId::ZERO))
    }

    fn dlc(&self) -> usize {
        self.len as usize
    }

    fn data(&self) -> &[u8] {
        self.bytes()
    }
}
