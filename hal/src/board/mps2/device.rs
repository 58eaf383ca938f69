//! The part of a peripheral access crate that is needed: interrupt numbers, the vector table's tail, and register access.
//!
//! Source: Arm DAI 0386 (application note AN386), tables of interrupts and of the memory map; Arm DDI 0479 (CMSDK) for
//! the timers' registers.

use crate::board::vector::Vector;
use core::ptr;
use cortex_m::interrupt::InterruptNumber;

/// Priority bits of which use is made. QEMU's NVIC has eight; three are what the least Cortex-M4 offers.
pub const NVIC_PRIO_BITS: u8 = 3;

/// Interrupts in use.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[repr(u16)]
pub enum Interrupt {
    /// CMSDK timer 0: the tick.
    TICK = 8,
    /// CMSDK timer 1: free-running, its interrupt stays off.
    TIMER1 = 9,
    /// CMSDK dual timer: the next frame is due.
    DUALTIMER = 10,
    /// Pin 13 of GPIO port 0, where nothing is: pended by the image alone, for work in the background.
    BACKGROUND = 29,
    /// Pin 14 of GPIO port 0, where a camera interface on the expansion header would pull: the image sensor has been read out.
    FRAME = 30,
    /// Pin 15 of GPIO port 0, where a CAN controller on the expansion header would pull: frames are there.
    CANRX = 31,
}

// SAFETY: the numbers are those of the machine's NVIC and below its 32 lines.
unsafe impl InterruptNumber for Interrupt {
    fn number(self) -> u16 {
        self as u16
    }
}

unsafe extern "C" {
    fn TICK();
    fn TIMER1();
    fn DUALTIMER();
    fn BACKGROUND();
    fn FRAME();
    fn CANRX();
}

/// The vector table behind the core's own exceptions.
// SAFETY: cortex-m-rt's script places this section right behind the exceptions; an entry without a handler is never
// taken, for its interrupt is never enabled.
#[unsafe(link_section = ".vector_table.interrupts")]
#[unsafe(no_mangle)]
pub static __INTERRUPTS: [Vector; 32] = {
    let mut table = [const { Vector::NONE }; 32];
    table[Interrupt::TICK as usize] = Vector { handler: TICK };
    table[Interrupt::TIMER1 as usize] = Vector { handler: TIMER1 };
    table[Interrupt::DUALTIMER as usize] = Vector { handler: DUALTIMER };
    table[Interrupt::BACKGROUND as usize] = Vector { handler: BACKGROUND };
    table[Interrupt::FRAME as usize] = Vector { handler: FRAME };
    table[Interrupt::CANRX as usize] = Vector { handler: CANRX };
    table
};

/// A 32-bit device register.
#[derive(Clone, Copy)]
pub(super) struct Register(u32);

impl Register {
    /// The register at `address`.
    ///
    /// # Safety
    /// `address` is that of a 32-bit register of this machine, and whoever holds the value is its only writer.
    pub(super) const unsafe fn at(address: u32) -> Self {
        Self(address)
    }

    pub(super) fn read(self) -> u32 {
        // SAFETY: a register of this machine, by the promise made to `at`.
        unsafe { ptr::read_volatile(self.0 as *const u32) }
    }

    pub(super) fn write(self, value: u32) {
        // SAFETY: as above.
        unsafe { ptr::write_volatile(self.0 as *mut u32, value) }
    }
}
