//! The figures of a measurement, as JSON has them, and the distributions behind them.

use super::cyclictest::Latencies;
use super::faults::Account;
use super::{Load, Measurement, verdict};
use crate::target::figures::{MEDIAN, P9999, instructions, microseconds};
use crate::target::node::On;
use hal::board::histogram::Histogram;
use hal::board::report::Instruments;
use serde::Serialize;

/// What a count of the instruments is.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Scale {
    /// A count of the emulated board's counter, of which instructions can be told.
    Instructions,
    /// A nanosecond.
    Nanoseconds,
}

impl Scale {
    /// Microseconds of so many counts.
    pub fn us(self, counts: u32) -> f64 {
        match self {
            Self::Instructions => microseconds(counts),
            Self::Nanoseconds => f64::from(counts) * 1e-3,
        }
    }

    /// Instructions of so many counts, where they can be told.
    pub fn instructions(self, counts: u32) -> Option<u64> {
        (self == Self::Instructions).then(|| instructions(counts))
    }
}

/// What was measured, whole.
#[derive(Clone, Debug)]
pub struct Distributions {
    /// Timing of the events, in counts.
    pub instruments: Instruments,
    /// What a count is.
    pub scale: Scale,
    /// Age of a sighting when it first acts, µs.
    pub vision: Histogram,
    /// Ages of feedback and of commands, µs, where there was a bus.
    pub bus: Option<(Histogram, Histogram)>,
}

/// The JSON of `jitter`. Percentiles are at most 1/16 high, greatest values exact.
#[derive(Clone, Debug, Serialize)]
pub struct JitterFigures {
    /// Where the cycle ran.
    pub on: On,
    /// Control cycles measured.
    pub cycles: u64,
    /// What else ran.
    pub load: Load,
    /// Error of the time from start to start of the same timer event: median.
    pub start_error_p50_us: f64,
    /// The same, 99.99 %.
    pub start_error_p9999_us: f64,
    /// The same, greatest.
    pub start_error_max_us: f64,
    /// From the timer's zero to the task's first reading, greatest; none where instructions cannot be counted.
    pub latency_max_instructions: Option<u64>,
    /// Time of a control cycle, from the first reading to the last frame handed over: median.
    pub exec_p50_us: f64,
    /// The same, greatest.
    pub exec_max_us: f64,
    /// Events that began or ended too late, and cycles whose targets missed their SYNC.
    pub deadline_misses: u64,
    /// Greatest age of a sighting when the drives act on the first command that it has a part in.
    pub vision_age_max_ms: f64,
    /// Band of the greatest start error ([`verdict`]).
    pub verdict: &'static str,
    /// What makes these figures say less than they seem to.
    pub caveats: Vec<String>,
    /// What a mix of faults did, if there was one.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub faults: Option<Account>,
    /// What cyclictest measured beside.
    #[serde(skip)]
    pub cyclictest: Option<Latencies>,
    /// What the figures are of.
    #[serde(skip)]
    pub distributions: Distributions,
}

impl JitterFigures {
    /// The figures of what was measured.
    pub fn new(
        measurement: &Measurement,
        distributions: Distributions,
        deadline_misses: u64,
        caveats: Vec<String>,
        faults: Option<Account>,
        cyclictest: Option<Latencies>,
    ) -> Self {
        let Instruments {
            start_error,
            latency,
            cycle,
            ..
        } = &distributions.instruments;
        let us = |counts| distributions.scale.us(counts);
        Self {
            on: measurement.on,
            cycles: cycle.count(),
            load: measurement.load,
            start_error_p50_us: us(start_error.percentile(MEDIAN)),
            start_error_p9999_us: us(start_error.percentile(P9999)),
            start_error_max_us: us(start_error.greatest),
            latency_max_instructions: distributions.scale.instructions(latency.greatest),
            exec_p50_us: us(cycle.percentile(MEDIAN)),
            exec_max_us: us(cycle.greatest),
            deadline_misses,
            vision_age_max_ms: f64::from(distributions.vision.greatest) * 1e-3,
            verdict: verdict::of(us(start_error.greatest)),
            caveats,
            faults,
            cyclictest,
            distributions,
        }
    }

    /// The measurement met its criterion: no deadline was missed; or, where they were missed on purpose, every stop is explained.
    pub fn passed(&self) -> bool {
        match &self.faults {
            Some(account) => account.unexplained.is_empty(),
            None => self.deadline_misses == 0,
        }
    }
}
