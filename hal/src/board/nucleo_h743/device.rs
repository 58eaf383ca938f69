//! Interrupts by what they mean to an image, and the vector table's tail.
//!
//! The peripheral access crate has them by the peripherals' names. An image is the same source on every board, so it binds the
//! names below, and the table is made here (source: RM0433; the crate's feature `rt` would make another).

use crate::board::vector::Vector;
use cortex_m::interrupt::InterruptNumber;
use stm32h7xx_hal::pac;

pub use pac::NVIC_PRIO_BITS;

/// Interrupts in use.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[repr(u16)]
pub enum Interrupt {
    /// DMA 1, stream 0: the image sensor has been read out. [`TIMEOUT`] leads to the same handler.
    FRAME = pac::Interrupt::DMA1_STR0 as u16,
    /// FDCAN1, line 0: frames are there.
    CANRX = pac::Interrupt::FDCAN1_IT0 as u16,
    /// TIM2: the tick.
    TICK = pac::Interrupt::TIM2 as u16,
    /// LPTIM5, which is not clocked: pended by the image alone, for work in the background.
    BACKGROUND = pac::Interrupt::LPTIM5 as u16,
}

/// TIM7: the read-out took too long.
pub(super) const TIMEOUT: pac::Interrupt = pac::Interrupt::TIM7;

// SAFETY: the numbers are the access crate's, below the device's 150 lines.
unsafe impl InterruptNumber for Interrupt {
    fn number(self) -> u16 {
        self as u16
    }
}

unsafe extern "C" {
    fn FRAME();
    fn CANRX();
    fn TICK();
    fn BACKGROUND();
}

/// The vector table behind the core's own exceptions.
// SAFETY: link.x places this section right behind the exceptions; an entry without a handler is never taken, for its
// interrupt is never enabled.
#[unsafe(link_section = ".vector_table.interrupts")]
#[unsafe(no_mangle)]
pub static __INTERRUPTS: [Vector; 150] = {
    let mut table = [const { Vector::NONE }; 150];
    table[Interrupt::FRAME as usize] = Vector { handler: FRAME };
    table[TIMEOUT as usize] = Vector { handler: FRAME };
    table[Interrupt::CANRX as usize] = Vector { handler: CANRX };
    table[Interrupt::TICK as usize] = Vector { handler: TICK };
    table[Interrupt::BACKGROUND as usize] = Vector { handler: BACKGROUND };
    table
};
