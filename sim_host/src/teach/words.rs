//! The figures of teaching in words, against the bars and what the paper says.

use super::score::{Bars, TeachScore};
use crate::campaign::words::{Figure, UNPUBLISHED, figure, head, most, page, tail};

/// The figures of a score.
pub fn figures(score: &TeachScore) -> Vec<Figure> {
    let bars = Bars::at(score.tally.speed_m_per_s);
    let mm = |name: &str, value: f64, bar: Option<f64>, paper: &str| {
        figure(name, format!("{value:.3}"), "mm", most(bar), paper)
    };
    let turn = format!("{:.2}", score.orientation_max_deg);
    let view = format!("{:.1}", score.view_mm);
    let mut rows = head(&score.tally, "0.02 to 0.04").to_vec();
    rows.extend([
        mm(
            "taught seam off the true one, rms",
            score.taught_rms_mm,
            bars.rms,
            UNPUBLISHED,
        ),
        mm("  max", score.taught_max_mm, Some(bars.max), "±1"),
        figure("orientation, max", turn, "°", most(bars.orientation), UNPUBLISHED),
        figure("seam lost before its end", score.seam_lost, "trials", "0", UNPUBLISHED),
        figure("points over the bus", score.points, "", "", "one in 100 ms"),
        figure("  of these left out", score.outliers, "", "", UNPUBLISHED),
        figure("seam off the image's middle, max", view, "mm", "< 15", UNPUBLISHED),
    ]);
    rows.extend(tail(&score.tally, None));
    rows
}

/// The table of a campaign, its failures and its hash.
pub fn score_table(score: &TeachScore) -> String {
    let [path, joint, surface, law] = &score.names;
    let title = format!("{path} path, {joint} joint, {surface} surface, {law} law");
    page(&title, figures(score), &score.tally, &[], score.tally.all_succeeded())
}
