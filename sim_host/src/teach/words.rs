//! The figures of teaching in words: a table for the terminal and for the report, against the bars and what the paper says.

use super::score::{Bars, TeachScore};
use crate::seal::words::Figure;
use crate::table::Table;

/// The figures of a score.
pub fn figures(score: &TeachScore) -> Vec<Figure> {
    let bars = Bars::at(score.speed_m_per_s);
    let more = &score.particulars;
    let row = |name: &str, value: String, unit: &str, bar: String, paper: &str| {
        [name.into(), value, unit.into(), bar, paper.into()]
    };
    let most = |bar: f64| format!("≤ {bar}");
    let mut rows = vec![
        row(
            "trials succeeded",
            format!("{} of {}", score.succeeded, score.trials),
            "",
            "all".into(),
            "not published",
        ),
        row(
            "speed along the seam",
            format!("{:.2}", score.speed_m_per_s),
            "m/s",
            String::new(),
            "0.02 to 0.04",
        ),
        row(
            "taught seam off the true one, rms",
            format!("{:.3}", score.taught_rms_mm),
            "mm",
            bars.rms.map_or_else(String::new, most),
            "not published",
        ),
        row(
            "  max",
            format!("{:.3}", score.taught_max_mm),
            "mm",
            most(bars.max),
            "±1",
        ),
        row(
            "orientation, max",
            format!("{:.2}", score.orientation_max_deg),
            "°",
            most(bars.orientation),
            "not published",
        ),
        row(
            "seam lost before its end",
            score.seam_lost.to_string(),
            "trials",
            "0".into(),
            "not published",
        ),
        row(
            "points over the bus",
            more.points.to_string(),
            "",
            String::new(),
            "one in 100 ms",
        ),
        row(
            "  of these left out",
            more.outliers.to_string(),
            "",
            String::new(),
            "not published",
        ),
        row(
            "seam off the image's middle, max",
            format!("{:.1}", more.view_mm),
            "mm",
            "< 15".into(),
            "not published",
        ),
        row(
            "bus load, busiest cycle",
            format!("{:.1}", more.bus_load_percent),
            "%",
            String::new(),
            "no bus",
        ),
        row(
            "simulated over real time",
            format!("{:.0}", more.sim_speed),
            "×",
            String::new(),
            "",
        ),
    ];
    if let Some(instructions) = more.cycle_max_instructions {
        rows.push(row(
            "Cortex-M4F: control cycle, max",
            instructions.to_string(),
            "instructions",
            "≤ 10000".into(),
            "",
        ));
    }
    rows
}

/// The table of a campaign, its failures and its hash.
pub fn score_table(score: &TeachScore) -> String {
    let mut table = Table::new(["figure", "value", "unit", "bar", "paper 003"]);
    for figure in figures(score) {
        table.row(figure);
    }
    let [path, joint, surface, law] = &score.particulars.names;
    let mut text = format!(
        "teach: {path} path, {joint} joint, {surface} surface, {law} law, seed {}\n{table}",
        score.seed
    );
    for failure in &score.failures {
        text += &format!("failed: seed {}: {}\n", failure.seed, failure.reason);
    }
    text += &format!(
        "{}, hash {}\n",
        if score.passed() { "passed" } else { "did not pass" },
        score.particulars.log_hash
    );
    text
}
