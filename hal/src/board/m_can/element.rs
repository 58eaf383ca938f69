//! A classic frame as the words of a transmit buffer and of a receive FIFO's element, in the message memory.
//!
//! Two words of head, two of data. 11-bit identifiers stand where the upper bits of 29-bit ones would.

use crate::can::Frame;

/// Words of an element that holds up to eight data bytes.
pub const WORDS: usize = 4;

const IDENTIFIER: u32 = 18;
const REMOTE: u32 = 1 << 29;
const EXTENDED: u32 = 1 << 30;
const LENGTH: u32 = 16;
const FD_FORMAT: u32 = 1 << 21;

/// A frame to be sent; it asks for no entry in the list of sent frames.
pub fn to_send(frame: &Frame) -> [u32; WORDS] {
    let [_, low, high] = frame.to_words();
    let remote = if frame.is_remote() { REMOTE } else { 0 };
    [
        u32::from(frame.cob()) << IDENTIFIER | remote,
        u32::from(frame.length()) << LENGTH,
        low,
        high,
    ]
}

/// A received frame; `None` for one that CANopen does not have: 29-bit, remote or FD.
pub fn received([head, second, low, high]: [u32; WORDS]) -> Option<Frame> {
    if head & (REMOTE | EXTENDED) != 0 || second & FD_FORMAT != 0 {
        return None;
    }
    // A classic frame may say that it is longer than its eight bytes (ISO 11898-1).
    let said = second >> LENGTH & 0xF;
    let length = if said < 8 { said } else { 8 };
    Frame::from_words([head >> IDENTIFIER & 0x7FF | length << 16, low, high])
}

#[cfg(test)]
mod tests {
    use super::*;
    use embedded_can::{Frame as _, StandardId};
    use proptest::prelude::*;

    #[test]
    fn a_frame_stands_in_the_words_as_the_manual_has_it() {
        let frame = Frame::data(0x181, &[0x11, 0x22, 0x33, 0x44, 0x55]).unwrap();
        assert_eq!(to_send(&frame), [0x181 << 18, 5 << 16, 0x4433_2211, 0x55]);
        let remote = Frame::new_remote(StandardId::new(0x701).unwrap(), 1).unwrap();
        assert_eq!(to_send(&remote), [0x701 << 18 | 1 << 29, 1 << 16, 0, 0]);
    }

    #[test]
    fn what_canopen_does_not_send_is_no_frame() {
        for head in [1 << 29, 1 << 30] {
            assert_eq!(received([0x181 << 18 | head, 0, 0, 0]), None);
        }
        assert_eq!(received([0x181 << 18, 1 << 21, 0, 0]), None);
    }

    #[test]
    fn a_length_over_eight_means_eight_bytes() {
        let frame = received([0x181 << 18, 15 << 16, 0x0403_0201, 0x0807_0605]).unwrap();
        assert_eq!(frame.bytes(), [1, 2, 3, 4, 5, 6, 7, 8]);
    }

    proptest! {
        #[test]
        fn what_is_sent_is_received_whatever_time_stamp_and_filter_it_came_with(
            id in 0u16..=0x7FF, data in proptest::collection::vec(any::<u8>(), 0..=8), stamp: u16, filter in 0u32..0x80,
        ) {
            let frame = Frame::data(id, &data).unwrap();
            let [head, second, low, high] = to_send(&frame);
            let error_passive = 1 << 31; // the sender's, in the head
            let read = received([head | error_passive, second | u32::from(stamp) | filter << 24, low, high]);
            prop_assert_eq!(read, Some(frame));
        }
    }
}
