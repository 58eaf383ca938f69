//! The figures of a campaign in words: rows for the terminal and for the report, against the bars and what the paper says.

use super::tally::Tally;
use crate::table::Table;

/// One figure: what, value, unit, bar (empty for none), the paper's (empty where it prints none).
pub type Figure = [String; 5];

/// What stands in the paper's column where it could, and does not.
pub const UNPUBLISHED: &str = "not published";

/// A figure of these five.
pub fn figure(name: &str, value: impl ToString, unit: &str, bar: impl Into<String>, paper: &str) -> Figure {
    [name.into(), value.to_string(), unit.into(), bar.into(), paper.into()]
}

/// A bar in words, if there is one.
pub fn most(bar: impl Into<Option<f64>>) -> String {
    bar.into().map_or_else(String::new, |bar| format!("≤ {bar}"))
}

/// The first figures of every job; `paper` is the speed that it prints.
pub fn head(tally: &Tally, paper: &str) -> [Figure; 2] {
    let succeeded = format!("{} of {}", tally.succeeded, tally.trials);
    let speed = format!("{:.2}", tally.speed_m_per_s);
    [
        figure("trials succeeded", succeeded, "", "all", UNPUBLISHED),
        figure("speed along the seam", speed, "m/s", "", paper),
    ]
}

/// The last figures of every job; `bus_load` is its bar, percent.
pub fn tail(tally: &Tally, bus_load: Option<f64>) -> Vec<Figure> {
    let load = format!("{:.1}", tally.bus_load_max_percent);
    let speed = format!("{:.0}", tally.sim_speed_x);
    let real_time = if tally.target.is_some() { "≥ 1" } else { "≥ 20" };
    let mut rows = vec![
        figure("control cycles of 5 ms", tally.cycles, "", "", "5 ms"),
        figure("deadlines missed", tally.deadline_misses, "", "0", UNPUBLISHED),
        figure("bus load, busiest cycle", load, "%", most(bus_load), "no bus"),
        figure("simulated over real time", speed, "×", real_time, ""),
    ];
    if let Some(clearance) = tally.clearance_min_mm {
        let clearance = format!("{clearance:.1}");
        rows.push(figure(
            "nozzle over the sheet beside the seam, min",
            clearance,
            "mm",
            "≥ 0",
            UNPUBLISHED,
        ));
    }
    if let Some(target) = &tally.target {
        let count = |name: &str, value: u64, bar: &str| figure(name, value, "instructions", bar, "");
        let bytes = |name: &str, value: u32| figure(name, value, "bytes", "", "");
        let start_error = format!("{:.2}", target.start_error_max_us);
        rows.extend([
            count(
                "Cortex-M4F: control cycle, median",
                target.cycle_median_instructions,
                "≤ 6000",
            ),
            count("  control cycle, max", target.cycle_max_instructions, "≤ 10000"),
            count("  SYNC event, max", target.sync_max_instructions, ""),
            count("  timer to task, max", target.latency_max_instructions, ""),
            figure("  start to start, error, max", start_error, "µs", "0", ""),
            bytes("  stack, deepest in a cycle", target.stack_painted_bytes),
            bytes("  stack, deepest at boot", target.stack_boot_bytes),
        ]);
    }
    rows
}

/// All of it: `title`, the figures in a table, the trials that failed, `shortfalls` of the whole, whether it `passed`, and the hash.
pub fn page(title: &str, figures: Vec<Figure>, tally: &Tally, shortfalls: &[String], passed: bool) -> String {
    let mut table = Table::new(["figure", "value", "unit", "bar", "paper 003"]);
    figures.into_iter().for_each(|figure| table.row(figure));
    let mut text = format!("{}: {title}, seed {}\n{table}", tally.job, tally.seed);
    for failure in &tally.failures {
        text += &format!("failed: seed {}: {}\n", failure.seed, failure.reason);
    }
    for shortfall in shortfalls {
        text += &format!("over its bar: {shortfall}\n");
    }
    let verdict = if passed { "passed" } else { "did not pass" };
    text + &format!("{verdict}, hash {}\n", tally.log_hash)
}
