//! The free-running counter by which an image measures itself.

/// A counter that runs at a constant rate, never stops and wraps at 2³².
///
/// A timer's. DWT's CYCCNT is none: it stands still while the core sleeps, and in QEMU always.
pub trait CycleCounter {
    /// Counts per second.
    const HERTZ: u32;

    /// The count now.
    fn now(&self) -> u32;
}
