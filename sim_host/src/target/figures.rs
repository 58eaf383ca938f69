//! What the board measured of itself, in units for people.

use super::emulator::SHIFT;
use hal::board::histogram::Histogram;
use hal::board::report::Instruments;
use serde::Serialize;

/// Nanoseconds of one count of the emulated board's counter, 25 MHz.
const COUNT_NS: f64 = 40.0;

/// Per million, for [`Histogram::percentile`].
pub const MEDIAN: u32 = 500_000;
/// The same.
pub const P9999: u32 = 999_900;

/// The controller's image under QEMU, in instructions of the Cortex-M4F; µs are those of the emulated 15.6 million instructions a second.
/// Percentiles are at most 1/16 high, greatest values exact to one instruction.
#[derive(Clone, Debug, Serialize)]
pub struct TargetFigures {
    /// Control cycles measured.
    pub cycles: u64,
    /// Error of the time from start to start of the same timer event, 99.99 %.
    pub start_error_p9999_us: f64,
    /// The same, greatest.
    pub start_error_max_us: f64,
    /// From the timer's zero to the task's first reading of it, greatest.
    pub latency_max_instructions: u64,
    /// Control cycle from the first reading to the last frame handed over: taking in of frames, core, sending.
    pub cycle_median_instructions: u64,
    /// The same, greatest.
    pub cycle_max_instructions: u64,
    /// The SYNC event, greatest.
    pub sync_max_instructions: u64,
    /// Deepest stack up to the first timer event, painted and looked at.
    pub stack_boot_bytes: u32,
    /// Deepest stack from then on.
    pub stack_painted_bytes: u32,
}

impl TargetFigures {
    /// The figures of distributions in counts.
    pub fn new(instruments: &Instruments) -> Self {
        let [stack_boot_bytes, stack_painted_bytes] = instruments.stack;
        Self {
            stack_boot_bytes,
            stack_painted_bytes,
            cycles: instruments.cycle.count(),
            start_error_p9999_us: microseconds(instruments.start_error.percentile(P9999)),
            start_error_max_us: microseconds(instruments.start_error.greatest),
            latency_max_instructions: instructions(instruments.latency.greatest),
            cycle_median_instructions: median(&instruments.cycle),
            cycle_max_instructions: instructions(instruments.cycle.greatest),
            sync_max_instructions: instructions(instruments.sync.greatest),
        }
    }
}

fn median(histogram: &Histogram) -> u64 {
    instructions(histogram.percentile(MEDIAN))
}

/// Time of that many counts.
pub fn microseconds(counts: u32) -> f64 {
    f64::from(counts) * COUNT_NS * 1e-3
}

/// Instructions that take that many counts, to the nearest.
pub fn instructions(counts: u32) -> u64 {
    (f64::from(counts) * COUNT_NS / f64::from(1u32 << SHIFT)).round() as u64
}
