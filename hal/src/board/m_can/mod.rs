//! Bosch's M_CAN, the CAN FD controller in many microcontrollers (ST calls it FDCAN), as far as it is arithmetic: bit
//! timing, filters, frames in its message memory, and which transmit buffer a frame goes to. Registers are the board's.
//!
//! Classic frames only, with 11-bit identifiers, as CANopen sends them; the controller could do more.
//! Source: Bosch, M_CAN user's manual; for the STM32H7 it is ST's RM0433, "FDCAN".

pub mod element;
pub mod filter;
pub mod mailboxes;
pub mod timing;
