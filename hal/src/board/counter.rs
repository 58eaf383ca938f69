//! The free-running counter by which an image measures itself.

/// A counter that runs at a constant rate, never stops and wraps at 2³².
///
/// On silicon it is DWT's CYCCNT. QEMU has none (it reads zero), there a timer stands in.
pub trait CycleCounter {
    /// Counts per second.
    const HERTZ: u32;

    /// The count now.
    fn now(&self) -> u32;
}
