//! The figures in words.

use super::LatencyScore;
use crate::table::Table;

/// The table of a measurement, and how it ended.
pub fn score_table(score: &LatencyScore) -> String {
    let mut table = Table::new(["figure", "value", "±", "unit", "in the emulated cell"]);
    let ms = |value: f64| format!("{value:.2}");
    let mut row = |name: &str, value: String, deviation: String, unit: &str, truth: String| {
        table.row([name.into(), value, deviation, unit.into(), truth]);
    };
    row(
        "exposure's middle after its SYNC",
        ms(score.exposure_delay_ms),
        ms(score.exposure_delay_deviation_ms),
        "ms",
        ms(score.true_exposure_delay_ms),
    );
    row(
        "exposure to use, median",
        ms(score.latency_median_ms),
        String::new(),
        "ms",
        String::new(),
    );
    row(
        "exposure to use, max",
        ms(score.latency_max_ms),
        String::new(),
        "ms",
        String::new(),
    );
    row(
        "sightings across the seam, rms",
        format!("{:.3}", score.residual_rms_mm),
        String::new(),
        "mm",
        String::new(),
    );
    row(
        "sightings",
        score.sightings.to_string(),
        String::new(),
        "",
        String::new(),
    );
    let mut text = format!("latency: {} runs, seed {}\n{table}", score.trials, score.seed);
    for failure in &score.failures {
        text += &format!("failed: seed {}: {}\n", failure.seed, failure.reason);
    }
    text + if score.passed { "passed\n" } else { "did not pass\n" }
}
