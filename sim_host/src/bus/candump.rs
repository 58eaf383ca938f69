//! Frames as lines of `candump -L`, which can-utils, python-can and Wireshark read.

use super::Delivery;
use std::fmt::Write;

/// Appends the line of a delivery: `(seconds.microseconds) interface ID#DATA`.
pub fn write_line(text: &mut String, interface: &str, delivery: &Delivery) {
    let us = delivery.t_ns / 1000;
    let frame = &delivery.frame;
    // Writing to a String cannot fail.
    let _ = write!(
        text,
        "({:010}.{:06}) {interface} {:03X}#",
        us / 1_000_000,
        us % 1_000_000,
        frame.cob()
    );
    if frame.is_remote() {
        text.push('R');
    }
    for byte in frame.bytes() {
        let _ = write!(text, "{byte:02X}");
    }
    text.push('\n');
}

#[cfg(test)]
mod tests {
    use super::*;
    use hal::can::Frame;

    #[test]
    fn a_line_reads_as_can_utils_writes_it() {
        let mut text = String::new();
        let delivery = Delivery {
            t_ns: 12_005_064_000,
            sender: 0,
            frame: Frame::of(0x181, [0x37, 0x02, 0xFF]),
        };
        write_line(&mut text, "vcan0", &delivery);
        assert_eq!(text, "(0000000012.005064) vcan0 181#3702FF\n");
    }
}
