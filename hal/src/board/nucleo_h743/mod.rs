//! ST NUCLEO-H743ZI2: an STM32H743ZI, Cortex-M7 at 400 MHz, with CAN FD and a camera interface. Sold everywhere, with a probe on
//! board. **Never run on silicon**: built, linked, proven and read against the manuals, and no more.
//!
//! Why stm32h7xx-hal and not embassy-stm32: RTIC wants the peripherals and the interrupts, not an executor and a time driver of
//! its own. The layer sets up supply, clocks and pins. CAN is on the access crate: the layer's has three
//! transmit buffers and three receive elements, and a cycle sends nine frames.
//!
//! # Wiring
//!
//! | signal | pin | connector | goes to |
//! |---|---|---|---|
//! | FDCAN1_TX | PD1, AF9 | CN9 pin 27 | TXD of a 3.3 V CAN transceiver (TJA1051T/3, SN65HVD230) |
//! | FDCAN1_RX | PD0, AF9 | CN9 pin 25 | RXD of it |
//! | 3V3, 5V, GND | | CN8 pins 7, 9, 11 | its supplies |
//! | LD3, red | PB14 | on the board | on when the image has halted |
//! | HSE in, 8 MHz | PH0 | on the board | MCO of the ST-LINK, as shipped |
//!
//! No transceiver is on the board. The bus is terminated with 120 Ω at both ends.
//!
//! # Clocks
//!
//! | | Hz | from |
//! |---|---|---|
//! | core | 400 M | PLL1 P, supply scale 1 |
//! | AXI, AHB | 200 M | core / 2 |
//! | APB 1–4 | 100 M | AHB / 2 |
//! | TIM2 (tick), TIM5 (counter) | 200 M | 2 × APB1 |
//! | FDCAN | 80 M | PLL1 Q |
//!
//! # Memory
//!
//! `link.x` beside this file: the image in flash bank 1, parameters in the first sector of bank 2, stack and variables in the
//! DTCM, which needs no cache and which no DMA controller reaches. The instruction cache is on, the data cache off: all that
//! a DMA controller writes is then what the core reads.
//!
//! Interrupts, by logical priority (3 is highest): the tick 3, "CAN receive" 2; the image binds [`Interrupt::TICK`] and
//! [`Interrupt::CANRX`].

mod can;
#[cfg(not(feature = "panic-proof"))]
mod clock;
mod device;
mod timer;

pub use can::{Port, Receive};
pub use device::{__INTERRUPTS, Interrupt, Interrupt as interrupt, NVIC_PRIO_BITS};
pub use timer::{Counter, Starter, Tick};

use super::m_can::filter;
use super::stack;
use core::slice;
use stm32h7xx_hal::pac;

/// Rate of the core: the highest without the overdrive of supply scale 0, which the data sheet gives a narrower temperature range.
const CORE_HZ: u32 = 400_000_000;
/// Rate of the timers on APB1.
const TIMERS_HZ: u32 = CORE_HZ / 2;
/// Rate of the CAN controller: what CiA 601-3 recommends, and 80 quanta to a bit.
const CAN_HZ: u32 = 80_000_000;

/// All handles of the board.
pub struct Board {
    /// The timer event.
    pub tick: Tick,
    /// Starts it.
    pub starter: Starter,
    /// The free-running counter.
    pub counter: Counter,
    /// The half of the CAN port that the timer events use.
    pub port: Port,
    /// The half that "CAN receive" uses.
    pub receive: Receive,
    /// The parameter region, whatever is in it.
    pub parameters: &'static [u8],
}

impl Board {
    /// Opens the board. The tick stands until it is started.
    ///
    /// Called once, before interrupts are enabled: RTIC's `init`. Takes the core's peripherals as the proof of that.
    pub fn open(core: &mut cortex_m::Peripherals) -> Self {
        core.SCB.enable_icache();
        // SAFETY: `core` exists once and is held here, so this runs once, and with interrupts off. Clock and pins are set up
        // by one owner of the peripherals, which forgets them; the timers are then owned by the handles.
        unsafe {
            stack::paint();
            #[cfg(not(feature = "panic-proof"))]
            clock::start(pac::Peripherals::steal());
            can::open(&filter::MASTER);
            let device = pac::Peripherals::steal();
            Self {
                tick: Tick::new(device.TIM2),
                starter: Starter::new(),
                counter: Counter::start(device.TIM5),
                port: Port::new(),
                receive: Receive::new(),
                parameters: parameters(),
            }
        }
    }
}

/// The parameter region.
fn parameters() -> &'static [u8] {
    unsafe extern "C" {
        static __parameters_start: u8;
        static __parameters_end: u8;
    }
    let (start, end) = (&raw const __parameters_start, &raw const __parameters_end);
    // SAFETY: link.x gives both ends of a flash sector that no image writes.
    unsafe { slice::from_raw_parts(start, end as usize - start as usize) }
}

/// What to do when there is nothing to do: sleep until the next interrupt.
pub fn idle() {
    cortex_m::asm::wfi();
}

/// Ends everything: off the bus, so that nobody sends SYNC any more, and the red lamp on.
pub fn halt() -> ! {
    cortex_m::interrupt::disable();
    can::leave();
    // SAFETY: sets one pin; its port's other pins are not in use.
    unsafe { (*pac::GPIOB::PTR).bsrr.write(|w| w.bs14().set_bit()) };
    loop {
        cortex_m::asm::wfi();
    }
}
