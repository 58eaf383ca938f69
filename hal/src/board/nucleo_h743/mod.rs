//! ST NUCLEO-H743ZI2: an STM32H743ZI, Cortex-M7 at 400 MHz, with CAN FD and a camera interface. Easily bought, with a probe on
//! board. **Never run on silicon.** Its images were built, linked, proven free of panics, and executed instruction by
//! instruction over a model of the registers they use: `scripts/nucleo_h743_replay.py`.
//!
//! One board is the controller, another the camera; both are set up alike, and pins that an image does not use stay open.
//!
//! Why stm32h7xx-hal and not embassy-stm32: RTIC wants the peripherals and the interrupts, not an executor and a time driver of
//! the layer's own. The layer sets up supply, clocks and pins. CAN and camera are on its access crate: the layer's CAN has three
//! transmit buffers and three receive elements, where a cycle sends nine frames, and it has no camera interface.
//!
//! # Wiring
//!
//! | signal | pin | on the board | goes to |
//! |---|---|---|---|
//! | FDCAN1_TX | PD1, AF9 | D66 | TXD of a 3.3 V CAN transceiver (TJA1051T/3, SN65HVD230) |
//! | FDCAN1_RX | PD0, AF9 | D67 | RXD of it |
//! | DCMI_D0 … D3 | PC6, PC7, PC8, PC9, AF13 | D16, D21, D43, D44 | DOUT2 … DOUT5 of an MT9V034 with a clock of its own |
//! | DCMI_D4 … D7 | PC11, PB6, PB8, PB9, AF13 | D46, D1, D15, D14 | DOUT6 … DOUT9 |
//! | DCMI_PIXCLK | PA6, AF13 | D12 | PIXCLK, 26.6 MHz |
//! | DCMI_HSYNC, DCMI_VSYNC | PA4, PB7, AF13 | D24, D0 | LINE_VALID, FRAME_VALID |
//! | I2C2_SCL, I2C2_SDA | PF1, PF0, AF4 | D69, D68 | SCLK, SDATA; both S_CTRL_ADR pins to ground |
//! | trigger | PE9 | D6 | EXPOSURE |
//! | slit, lamp | PE11, PE13 | D5, D3 | drivers of slit projector and lamp, on while high |
//! | LD3, red | PB14 | on it | lit when the image has halted |
//! | HSE in, 8 MHz | PH0 | on it | MCO of the ST-LINK, as shipped |
//!
//! No transceiver is on the board. The bus is terminated with 120 Ω at both ends. Pixels are 8 bit, the upper eight of ten.
//!
//! # Clocks
//!
//! | | Hz | from |
//! |---|---|---|
//! | core | 400 M | PLL1 P, supply scale 1 |
//! | AXI, AHB | 200 M | core / 2 |
//! | APB 1–4 | 100 M | AHB / 2 |
//! | TIM2 (tick), TIM5 (counter), TIM7 (read-out's time-out) | 200 M | 2 × APB1 |
//! | FDCAN | 80 M | PLL1 Q |
//!
//! # Memory
//!
//! `link.x` beside this file: the image in flash bank 1, parameters in the first sector of bank 2, stack and variables in the
//! DTCM, which needs no cache and which no DMA controller reaches, images of the camera, and the memory that it takes to look at
//! a large one, in the AXI SRAM. The instruction cache
//! is on, the data cache off: what a DMA controller writes is what the core reads.
//!
//! # Interrupts
//!
//! By logical priority (3 is highest) an image binds [`Interrupt::TICK`], [`Interrupt::CANRX`], and one with a camera
//! [`Interrupt::FRAME`] with priority 2; below them, [`Interrupt::BACKGROUND`].
//!
//! # What is not here
//!
//! The trace goes nowhere; a probe reads an image's variables. There is no watchdog: when the image stops, so does SYNC,
//! and the drives stop by themselves.

mod can;
#[cfg(not(feature = "panic-proof"))]
mod clock;
mod device;
mod memory;
#[cfg(not(feature = "panic-proof"))]
mod mt9v034;
mod sensor;
mod timer;

pub use can::{Port, Receive};
pub use device::{__INTERRUPTS, Interrupt, Interrupt as interrupt, NVIC_PRIO_BITS};
pub use sensor::Sensor;
pub use timer::{Counter, Starter, Tick};

use super::m_can::filter::Range;
use super::stack;
use core::slice;
use cortex_m::peripheral::NVIC;
use stm32h7xx_hal::pac;

/// Rate of the core: the highest without the overdrive of supply scale 0, which the data sheet gives a narrower temperature range.
const CORE_HZ: u32 = 400_000_000;
/// Rate of the timers on APB1.
const TIMERS_HZ: u32 = CORE_HZ / 2;
/// Rate of the CAN controller: what CiA 601-3 recommends, and 80 quanta to a bit.
const CAN_HZ: u32 = 80_000_000;

/// Priority of what [`Interrupt::FRAME`] is bound to, 2 of 3, as the interrupt controller has it: time-outs come with it.
const FRAME_PRIORITY: u8 = ((1 << NVIC_PRIO_BITS) - 2) << (8 - NVIC_PRIO_BITS);

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
    /// The image sensor.
    pub sensor: Sensor,
    /// The parameter region, whatever is in it.
    pub parameters: &'static [u8],
}

impl Board {
    /// Opens the board, and lets frames in whose identifiers are `heard`, at most 32 ranges. The tick stands until it is started.
    ///
    /// Called once, before interrupts are enabled: RTIC's `init`. Takes the core's peripherals as the proof of that.
    pub fn open(core: &mut cortex_m::Peripherals, heard: &[Range]) -> Self {
        core.SCB.enable_icache();
        // SAFETY: `core` exists once and is held here, so this runs once, and with interrupts off. Clock and pins are set up
        // by one owner of the peripherals, which forgets them; the timers are then owned by the handles.
        unsafe {
            stack::paint();
            #[cfg(not(feature = "panic-proof"))]
            clock::start(pac::Peripherals::steal());
            can::open(heard);
            let device = pac::Peripherals::steal();
            device.RCC.ahb1enr.modify(|_, w| w.dma1en().set_bit());
            device.RCC.ahb2enr.modify(|_, w| w.dcmien().set_bit());
            device.RCC.apb1lenr.modify(|_, w| w.tim7en().set_bit());
            core.NVIC.set_priority(device::TIMEOUT, FRAME_PRIORITY);
            NVIC::unmask(device::TIMEOUT);
            Self {
                tick: Tick::new(device.TIM2),
                starter: Starter::new(),
                counter: Counter::start(device.TIM5),
                port: Port::new(),
                receive: Receive::new(),
                sensor: Sensor::new(device.DCMI, device.DMA1, &device.DMAMUX1, device.TIM7, device.GPIOE),
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
