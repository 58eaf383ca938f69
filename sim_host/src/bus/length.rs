//! Exact length of a classic CAN data frame on the wire: header, data, CRC-15, stuff bits, interframe space.

use hal::can::Frame;

/// Bits of the interframe space.
pub const INTERFRAME: u32 = 3;
/// CRC delimiter, acknowledge slot and delimiter, end of frame: 1 + 1 + 1 + 7 bits, never stuffed.
const TAIL: u32 = 10;
/// Generator of the CRC-15 of CAN (ISO 11898-1): x^15 + x^14 + x^10 + x^8 + x^7 + x^4 + x^3 + 1, without its top bit.
const CRC15: u16 = 0x4599;

const CRC_TABLE: [u16; 256] = {
    let mut table = [0; 256];
    let mut byte = 0;
    while byte < 256 {
        let mut crc = (byte as u16) << 7;
        let mut bit = 0;
        while bit < 8 {
            crc = (crc << 1) ^ if crc & 0x4000 != 0 { CRC15 } else { 0 };
            bit += 1;
        }
        table[byte] = crc & 0x7FFF;
        byte += 1;
    }
    table
};

/// Bits that `frame` occupies on the bus, stuff bits and interframe space included.
pub fn bits(frame: &Frame) -> u32 {
    let (stream, len) = stuffable(frame);
    len + stuff_bits(stream, len) + TAIL + INTERFRAME
}

/// The bits from start of frame to the end of the CRC, right-aligned, and how many they are.
fn stuffable(frame: &Frame) -> (u128, u32) {
    let data = frame.bytes();
    // Start of frame 0, identifier 11, RTR, IDE and reserved 0, length 4.
    let header = (frame.cob() as u128) << 7 | (frame.is_remote() as u128) << 6 | frame.length() as u128;
    let bits = data.iter().fold(header, |bits, &byte| bits << 8 | byte as u128);
    let len = 19 + 8 * data.len() as u32;
    (bits << 15 | crc(bits, len) as u128, len + 15)
}

/// CRC-15 of `len` bits. Leading zeros do not change a CRC that starts at zero, so whole bytes serve.
fn crc(bits: u128, len: u32) -> u16 {
    let bytes = len.div_ceil(8);
    (0..bytes).rev().fold(0, |crc, k| {
        let byte = (bits >> (8 * k)) as u8;
        (crc << 8 & 0x7FFF) ^ CRC_TABLE[((crc >> 7) as u8 ^ byte) as usize]
    })
}

/// Stuff bits: one of the other value after every five alike, itself the first of the next run.
fn stuff_bits(stream: u128, len: u32) -> u32 {
    let mut stuffed = 0;
    let mut run = 0;
    let mut last = 2;
    for k in (0..len).rev() {
        let bit = (stream >> k & 1) as u32;
        run = if bit == last { run + 1 } else { 1 };
        last = bit;
        if run == 5 {
            stuffed += 1;
            last = 1 - bit;
            run = 1;
        }
    }
    stuffed
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    /// CRC-15 bit by bit, as ISO 11898-1 writes it.
    fn crc_by_bits(bits: u128, len: u32) -> u16 {
        (0..len).rev().fold(0u16, |crc, k| {
            let next = (bits >> k & 1) as u16 ^ crc >> 14 & 1;
            (crc << 1 & 0x7FFF) ^ if next != 0 { CRC15 } else { 0 }
        })
    }

    proptest! {
        #[test]
        fn the_table_gives_the_crc_of_the_standard(id in 0..0x800u16, data: Vec<u8>) {
            let frame = Frame::data(id, &data[..data.len().min(8)]).unwrap();
            let (stream, len) = stuffable(&frame);
            prop_assert_eq!((stream & 0x7FFF) as u16, crc_by_bits(stream >> 15, len - 15));
        }

        #[test]
        fn no_frame_is_longer_than_55_and_10_bits_for_each_byte(id in 0..0x800u16, data: Vec<u8>) {
            let data = &data[..data.len().min(8)];
            let bits = bits(&Frame::data(id, data).unwrap());
            let n = data.len() as u32;
            prop_assert!((47 + 8 * n..=55 + 10 * n).contains(&bits), "{} bits", bits);
        }
    }

    #[test]
    fn the_check_value_of_the_catalogue_is_met() {
        // CRC-15/CAN of "123456789" (CRC catalogue, reveng): 0x059E.
        let bits = b"123456789".iter().fold(0u128, |bits, &byte| bits << 8 | byte as u128);
        assert_eq!(crc(bits, 72), 0x059E);
    }

    #[test]
    fn stuffing_follows_every_run_of_five() {
        // 11111 0000 1111 0000 ...: after the first five, each stuff bit begins the next run, so four more suffice: the
        // worst case of Tindell's bound.
        assert_eq!(stuff_bits(0b11111, 5), 1);
        assert_eq!(stuff_bits(0b1_1111_0000_1111_0000, 17), 4);
        assert_eq!(stuff_bits(0b1_0101_0101, 9), 0);
        assert_eq!(stuff_bits(0, 10), 2, "00000 1 00000 1");
    }

    #[test]
    fn a_sync_without_data_on_0x080_is_known_bit_by_bit() {
        // 0 00010000000 000 0000 + CRC: 19 bits 0000 1000 0000 0000 000. Stuffing of the header: none in 0000 1, then 14
        // zeros give two.
        let (stream, len) = stuffable(&Frame::of(0x080, []));
        assert_eq!((stream >> 15, len), (0x080 << 7, 34));
        assert_eq!(stuff_bits(stream >> 15, 19), 2);
    }
}
