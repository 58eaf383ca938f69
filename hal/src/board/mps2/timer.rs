//! The three timers: the tick, the counter, and the alarm of the next frame. All count 25 MHz.

use super::device::Register;
use crate::board::counter::CycleCounter;

/// Rate of every timer of the machine (Arm DAI 0386: main clock).
pub const HERTZ: u32 = 25_000_000;

/// Counts per microsecond.
pub(super) const PER_US: u32 = HERTZ / 1_000_000;

const ENABLE: u32 = 1 << 0;
const INTERRUPT: u32 = 1 << 3;

/// A CMSDK timer's registers: counts from RELOAD down to zero.
struct Registers {
    control: Register,
    value: Register,
    reload: Register,
    clear: Register,
}

impl Registers {
    /// # Safety
    /// `base` is that of a CMSDK timer, and its registers are not written by anyone else.
    const unsafe fn at(base: u32) -> Self {
        // SAFETY: offsets of the timer's four registers (Arm DDI 0479), by the caller's promise.
        unsafe {
            Self {
                control: Register::at(base),
                value: Register::at(base + 4),
                reload: Register::at(base + 8),
                clear: Register::at(base + 12),
            }
        }
    }
}

/// Timer 0, the tick's.
const TICK: u32 = 0x4000_0000;

/// Timer 1, the counter's.
const COUNTER: u32 = 0x4000_1000;

/// Counts since the tick last came to zero.
pub(super) fn since_tick() -> u32 {
    // SAFETY: registers of timer 0, only read.
    let timer = unsafe { Registers::at(TICK) };
    timer.reload.read().wrapping_sub(timer.value.read())
}

/// Lets `counts` pass.
pub(super) fn wait(counts: u32) {
    // SAFETY: registers of timer 1, only read.
    let timer = unsafe { Registers::at(COUNTER) };
    let start = timer.value.read();
    while start.wrapping_sub(timer.value.read()) < counts {}
}

/// The periodic tick.
pub struct Tick {
    timer: Registers,
}

impl Tick {
    /// # Safety
    /// There is one `Tick`.
    pub(super) const unsafe fn new() -> Self {
        // SAFETY: timer 0, which nothing else writes.
        let timer = unsafe { Registers::at(TICK) };
        Self { timer }
    }

    /// Counts since the timer's zero.
    pub fn since(&self) -> u32 {
        since_tick()
    }

    /// Ends the interrupt.
    pub fn acknowledge(&mut self) {
        self.timer.clear.write(1);
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
        crate::board::stack::booted();
        let reload = period_us * PER_US - 1;
        // SAFETY: timer 0, whose other user only reads and ends interrupts.
        let timer = unsafe { Registers::at(TICK) };
        timer.reload.write(reload);
        timer.value.write(reload);
        timer.control.write(ENABLE | INTERRUPT);
    }
}

/// The free-running counter. DWT's CYCCNT reads zero in QEMU.
pub struct Counter {
    timer: Registers,
}

impl Counter {
    /// # Safety
    /// There is one `Counter`.
    pub(super) unsafe fn start() -> Self {
        // SAFETY: timer 1, which nothing else uses.
        let timer = unsafe { Registers::at(COUNTER) };
        timer.reload.write(u32::MAX);
        timer.value.write(u32::MAX);
        timer.control.write(ENABLE);
        Self { timer }
    }
}

impl CycleCounter for Counter {
    const HERTZ: u32 = HERTZ;

    fn now(&self) -> u32 {
        !self.timer.value.read() // it counts down
    }
}

/// The alarm of the shim: first half of the dual timer (Arm DDI 0479), one shot.
pub(super) struct Alarm(());

impl Alarm {
    // SAFETY: nothing else uses the dual timer.
    const LOAD: Register = unsafe { Register::at(0x4000_2000) };
    // SAFETY: as above.
    const CONTROL: Register = unsafe { Register::at(0x4000_2008) };
    // SAFETY: as above.
    const CLEAR: Register = unsafe { Register::at(0x4000_200C) };

    const ONE_SHOT: u32 = 1 << 0;
    const WIDE: u32 = 1 << 1;
    const INTERRUPT: u32 = 1 << 5;
    const ENABLE: u32 = 1 << 7;

    /// # Safety
    /// There is one `Alarm`.
    pub(super) const unsafe fn new() -> Self {
        Self(())
    }

    /// Rings once after `counts`.
    pub(super) fn set(&self, counts: u32) {
        Self::CONTROL.write(0);
        Self::LOAD.write(counts.max(1));
        Self::CONTROL.write(Self::ONE_SHOT | Self::WIDE | Self::INTERRUPT | Self::ENABLE);
    }

    pub(super) fn acknowledge(&self) {
        Self::CLEAR.write(1);
    }
}
