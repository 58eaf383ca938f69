//! Arm MPS2 with the FPGA image AN386, a Cortex-M4F, as QEMU's `mps2-an386`: the reference machine.
//!
//! No CAN controller is on it: [`shim`] stands in. Interrupts, by logical priority (3 is highest): the tick and the
//! shim's alarm 3, "CAN receive" 2, the background 1; the image binds [`Interrupt::TICK`], [`Interrupt::CANRX`] and
//! [`Interrupt::BACKGROUND`], and one with a camera [`Interrupt::FRAME`]. No camera is on it either: the shim again.
//! Clocks: 25 MHz for everything (Arm DAI 0386). Memory: `memory.x`.
//!
//! Under QEMU [`idle`] must not wait for an interrupt: with `-icount …,sleep=off` WFI loses every second tick.

mod device;
mod link;
mod semihosting;
mod sensor;
mod shim;
mod timer;

pub use device::{__INTERRUPTS, Interrupt, Interrupt as interrupt, NVIC_PRIO_BITS};
pub use link::Link;
pub use sensor::Sensor;
pub use timer::{Counter, HERTZ, Starter, Tick};

use super::m_can::filter::Range;
use super::stack;
use crate::can::Frame;
use crate::wire::Wire;
use core::slice;
use cortex_m::peripheral::NVIC;

/// Logical priority of the tick's task, and of the shim's alarm.
const TICK_PRIORITY: u8 = 3;

/// All handles of the board.
pub struct Board {
    /// The timer event.
    pub tick: Tick,
    /// Starts it.
    pub starter: Starter,
    /// The free-running counter.
    pub counter: Counter,
    /// The half of the CAN port that the timer events use, and the trace.
    pub port: Port,
    /// The half that "CAN receive" uses.
    pub receive: Receive,
    /// The image sensor.
    pub sensor: Sensor,
    /// The parameter region, whatever is in it.
    pub parameters: &'static [u8],
}

impl Board {
    /// Opens the board. All frames are let in, not only those that an image says it wants to be heard; the tick stands until it
    /// is started.
    ///
    /// Called once, before interrupts are enabled: RTIC's `init`. Takes the core's peripherals as the proof of that.
    pub fn open(core: &mut cortex_m::Peripherals, _heard: &[Range]) -> Self {
        let priority = ((1 << NVIC_PRIO_BITS) - TICK_PRIORITY) << (8 - NVIC_PRIO_BITS);
        // SAFETY: `core` exists once and is held here, so this runs once; interrupts are off until RTIC enables them.
        // The alarm's handler exists and gets the tick's priority before it is enabled.
        unsafe {
            stack::paint();
            shim::open();
            core.NVIC.set_priority(Interrupt::DUALTIMER, priority);
            NVIC::unmask(Interrupt::DUALTIMER);
            let counter = Counter::start();
            Self {
                tick: Tick::new(),
                starter: Starter::new(),
                counter,
                port: Port(()),
                receive: Receive(()),
                sensor: Sensor::new(),
                parameters: parameters(),
            }
        }
    }
}

/// CAN, sending, and the trace.
pub struct Port(());

impl Port {
    /// Puts a frame into the transmit FIFO.
    pub fn send(&mut self, frame: Frame) {
        let at = timer::since_tick();
        shim::with(|shim| shim.send(frame, at));
    }

    /// Adds to what is traced with this timer event.
    pub fn trace(&mut self, value: &impl Wire) {
        shim::with(|shim| value.write(shim.trace()));
    }

    /// What whoever traces has asked for, bits of [`ask`](crate::board::frames::ask).
    pub fn asked(&self) -> u8 {
        shim::with(|shim| shim.asked())
    }

    /// Ends the timer event: what was put is on its way.
    pub fn commit(&mut self) {
        shim::with(shim::Shim::exchange);
    }
}

/// CAN, receiving.
pub struct Receive(());

impl Receive {
    /// The oldest frame in the receive FIFO.
    pub fn take(&mut self) -> Option<Frame> {
        shim::FIFO.take()
    }
}

/// The parameter region, whatever is in it.
pub fn parameters() -> &'static [u8] {
    unsafe extern "C" {
        static __parameters_start: u8;
        static __parameters_end: u8;
    }
    let (start, end) = (&raw const __parameters_start, &raw const __parameters_end);
    // SAFETY: memory.x gives both ends of a region that nothing writes after the start.
    unsafe { slice::from_raw_parts(start, end as usize - start as usize) }
}

/// What to do when there is nothing to do. A run of instructions that do nothing is one block to the emulator, and so
/// costs it hardly more time than one. A function of its own: the compiler takes the run for three instructions, and would lay constants
/// out of reach behind it.
#[inline(never)]
pub fn idle() {
    // SAFETY: changes nothing.
    unsafe { core::arch::asm!(".rept 256", "nop", ".endr", options(nomem, nostack, preserves_flags)) };
}

/// Ends everything: the emulator ends with exit code 1, and nobody sends SYNC any more.
pub fn halt() -> ! {
    semihosting::stop()
}
