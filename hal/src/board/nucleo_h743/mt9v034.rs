//! How the image sensor is told what it is to do: registers of onsemi's MT9V034 (data sheet MT9V034/D), context A, written over
//! I²C once.

use super::sensor::FULL;

/// Its address with both S_CTRL_ADR pins low.
pub const ADDRESS: u8 = 0x48;

/// Columns and rows that it has.
const ARRAY: [u16; 2] = [752, 480];
/// First column and row that may be put out: what lies before is dark or a border.
const FIRST: [u16; 2] = [1, 4];
/// Pixel clocks of a row, blanking included; at least 690. 26.3 µs at 26.6 MHz.
const ROW: u16 = 700;
/// Rows' times that it exposes: 2.0 ms. Assumed, as the simulator's exposure.
const EXPOSURE: u16 = 76;

/// Snapshot by pin (bits 3, 4), parallel output (7), exposure and read-out one after the other (8 off), defective pixels corrected (9).
const CHIP_CONTROL: u16 = 0b11 << 3 | 1 << 7 | 1 << 9;

/// Register and value, in the order to be written.
pub const REGISTERS: [(u8, u16); 12] = [
    (0x0C, 1), // reset
    (0x07, CHIP_CONTROL),
    (0x01, FIRST[0] + (ARRAY[0] - FULL[0]) / 2),
    (0x02, FIRST[1] + (ARRAY[1] - FULL[1]) / 2),
    (0x03, FULL[1]),
    (0x04, FULL[0]),
    (0x05, ROW - FULL[0]),
    (0x0B, EXPOSURE),
    (0x0F, 0),    // linear response
    (0x1C, 0b10), // linear 10 bits, of which the upper eight are wired
    (0x35, 16),   // analogue gain 1
    (0xAF, 0),    // neither exposure nor gain by itself: light is ours
];
