//! The tick, TIM2, and the free-running counter, TIM5: both count 200 MHz, so latencies need no conversion.
//!
//! The counter is not DWT's CYCCNT: that one stands still while the core sleeps, and the core sleeps whenever it is idle.

use super::TIMERS_HZ;
use crate::board::counter::CycleCounter;
use crate::board::stack;
use stm32h7xx_hal::pac;

/// The periodic tick.
pub struct Tick {
    timer: pac::TIM2,
}

impl Tick {
    pub(super) const fn new(timer: pac::TIM2) -> Self {
        Self { timer }
    }

    /// Counts since the timer's zero.
    pub fn since(&self) -> u32 {
        self.timer.cnt.read().bits()
    }

    /// Ends the interrupt.
    pub fn acknowledge(&mut self) {
        self.timer.sr.modify(|_, w| w.uif().clear_bit());
    }
}

/// The right to start the tick, once: for whoever runs when all else stands.
pub struct Starter(());

impl Starter {
    /// # Safety
    /// There is one `Starter`.
    pub(super) const unsafe fn new() -> Self {
        Self(())
    }

    /// Starts the tick; it comes the first time after one period.
    pub fn start(self, period_us: u32) {
        stack::booted();
        // SAFETY: TIM2, whose other user only reads the count and ends interrupts.
        unsafe {
            let timer = &*pac::TIM2::PTR;
            timer.arr.write(|w| w.bits(period_us * (TIMERS_HZ / 1_000_000) - 1));
            // The reload is taken over at an update, which is made here and is to raise no interrupt.
            timer.cr1.write(|w| w.urs().set_bit());
            timer.egr.write(|w| w.ug().set_bit());
            timer.dier.write(|w| w.uie().set_bit());
            timer.cr1.modify(|_, w| w.cen().set_bit());
        }
    }
}

/// The free-running counter.
pub struct Counter {
    timer: pac::TIM5,
}

impl Counter {
    pub(super) fn start(timer: pac::TIM5) -> Self {
        timer.arr.write(|w| w.bits(u32::MAX));
        timer.egr.write(|w| w.ug().set_bit());
        timer.cr1.write(|w| w.cen().set_bit());
        Self { timer }
    }
}

impl CycleCounter for Counter {
    const HERTZ: u32 = TIMERS_HZ;

    fn now(&self) -> u32 {
        self.timer.cnt.read().bits()
    }
}
