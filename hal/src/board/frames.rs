//! What travels between an emulated board and its surroundings at each timer event: frames with their times, and a few
//! bytes of trace.
//!
//! Both ways a message is a [`Head`], its frames, and, from the board only, trace bytes to its end. The board speaks
//! first and waits; the answer carries the frames that the bus delivered up to the next timer event, and what was read out of
//! an image sensor in the meantime.

use crate::can::Frame;
use crate::wire::{Sink, Wire};
use crate::{wire_enum, wire_struct};

/// Most frames in a message: 2.5 ms at 1 Mbit/s hold 53 of the shortest, 47 bits without stuffing.
pub const FRAMES_MAX: usize = 64;

/// Most trace bytes in a message.
pub const TRACE_MAX: usize = 6144;

/// Before every timer event the bus is quiet for this long as the board sees it: frames that end later are handed over
/// at its beginning. So a frame's interrupt never coincides with the tick, and a frame that was on time is never late.
pub const GUARD_US: u32 = 50;

/// What a message begins with.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Head {
    /// Bytes that follow.
    pub length: u16,
    /// Frames among them.
    pub frames: u8,
    /// From the surroundings: bits of [`ask`]. From the board: frames it had to drop since the last message.
    pub flags: u8,
    /// From the surroundings, of a board with an image sensor: what has been read out of it.
    pub read_out: ReadOut,
}

wire_struct!(Head {
    length: u16,
    frames: u8,
    flags: u8,
    read_out: ReadOut
});

/// What has been read out of the image sensor.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
#[repr(u8)]
pub enum ReadOut {
    /// Nothing: it has not finished, or was not asked for.
    #[default]
    None,
    /// An image. After the message, and not in its length: width and height, u16 each, and the pixels, rows from the top.
    Image,
    /// The image was lost on its way.
    Lost,
}

wire_enum!(ReadOut { None, Image, Lost });

/// What the surroundings may ask of the image, bits of [`Head::flags`].
pub mod ask {
    /// The next report is to be followed by the instruments ([`crate::board::report::Instruments`]).
    pub const INSTRUMENTS: u8 = 1 << 0;

    /// Up to the next timer event everything below it is to be as busy as it can ([`crate::board::load`]).
    pub const LOAD: u8 = 1 << 1;

    /// The bits from here on are a number n: just before the next timer event, something of the tick's own priority is to
    /// hold it up for n times [`STALL_US`].
    pub const STALL_SHIFT: u32 = 2;
    /// Unit of a stall, µs: the longest, 63 of them, is 6 cycles.
    pub const STALL_US: u32 = 500;
}

/// A frame and when it ended on the bus.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Stamped {
    /// Microseconds since the last timer event.
    pub at_us: u16,
    /// The frame.
    pub frame: Frame,
}

impl Wire for Stamped {
    const BYTES: usize = u16::BYTES + <[u32; 3]>::BYTES;

    const EMPTY: Self = Self {
        at_us: 0,
        frame: Frame::of(0, []),
    };

    fn write(&self, sink: &mut impl Sink) {
        self.at_us.write(sink);
        self.frame.to_words().write(sink);
    }

    fn fill(&mut self, source: &mut &[u8]) -> Option<()> {
        self.at_us.fill(source)?;
        self.frame = Frame::from_words(<[u32; 3]>::read(source)?)?;
        Some(())
    }
}

#[cfg(test)]
mod tests {
    extern crate std;
    use super::*;
    use embedded_can::Frame as _;
    use std::vec::Vec;

    impl Sink for Vec<u8> {
        fn put(&mut self, bytes: &[u8]) {
            self.extend_from_slice(bytes);
        }
    }

    #[test]
    fn a_frame_comes_back_with_its_time_whatever_its_length_and_kind() {
        for length in 0..=8 {
            let data = [1, 2, 3, 4, 5, 6, 7, 8];
            let frames = [
                Frame::data(0x181, &data[..length]).unwrap(),
                Frame::new_remote(embedded_can::StandardId::new(0x701).unwrap(), length).unwrap(),
            ];
            for frame in frames {
                let stamped = Stamped { at_us: 2449, frame };
                let mut bytes = Vec::new();
                stamped.write(&mut bytes);
                assert_eq!(bytes.len(), Stamped::BYTES);
                assert_eq!(Stamped::read(&mut bytes.as_slice()), Some(stamped));
            }
        }
    }

    #[test]
    fn an_identifier_over_0x7ff_or_nine_bytes_are_no_frame() {
        let mut bytes = Vec::new();
        Stamped::default().write(&mut bytes);
        let mut wide = bytes.clone();
        wide[3] = 0x08;
        assert_eq!(Stamped::read(&mut wide.as_slice()), None);
        bytes[4] = 9; // the length
        assert_eq!(Stamped::read(&mut bytes.as_slice()), None);
    }
}
