//! The figures of a measurement in words.

use super::LatencyScore;
use crate::campaign::words::{Figure, UNPUBLISHED, figure, head, most, page, tail};

/// The figures of a score.
pub fn figures(score: &LatencyScore) -> Vec<Figure> {
    let ms = |name: &str, value: f64, bar: Option<f64>, paper: &str| {
        figure(name, format!("{value:.2}"), "ms", most(bar), paper)
    };
    let mut rows = head(&score.tally, "").to_vec();
    rows.push(ms(
        "exposure after its SYNC",
        score.exposure_delay_ms,
        None,
        UNPUBLISHED,
    ));
    rows.extend(score.bars().map(|bar| ms(bar.name, bar.value, bar.most, UNPUBLISHED)));
    rows.extend([
        ms("exposure to use, median", score.latency_median_ms, None, "32"),
        ms("  max", score.latency_max_ms, None, UNPUBLISHED),
        figure("sightings of the seam", score.sightings, "", "", ""),
        figure(
            "  about its course, rms",
            format!("{:.3}", score.residual_rms_mm),
            "mm",
            "",
            UNPUBLISHED,
        ),
    ]);
    rows.extend(tail(&score.tally, None));
    rows
}

/// The table of a measurement, its failures and its hash.
pub fn score_table(score: &LatencyScore) -> String {
    page(
        "swinging across a straight seam",
        figures(score),
        &score.tally,
        &[],
        score.passed(),
    )
}
