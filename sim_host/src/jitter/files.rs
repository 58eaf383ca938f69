//! What a measurement leaves in a folder: text, JSON, the distributions as CSV, and plots of them as SVG.

use super::figures::JitterFigures;
use super::words;
use crate::report::chart::{Chart, Curve};
use crate::whole_file;
use hal::board::histogram::Histogram;
use std::fmt::Write;
use std::path::{Path, PathBuf};

/// Writes everything into `folder`, which is made if there is none; gives the files.
pub fn write(figures: &JitterFigures, folder: &Path) -> anyhow::Result<Vec<PathBuf>> {
    let json = serde_json::to_string_pretty(figures)? + "\n";
    let mut files = vec![
        ("jitter.txt", words::text(figures)),
        ("jitter.json", json),
        ("jitter.csv", csv(figures)),
    ];
    let [start_error, execution] = charts(figures)?;
    files.push(("start_error.svg", start_error));
    files.push(("execution.svg", execution));
    let write = |(name, text): (&str, String)| whole_file::write(&folder.join(name), text.as_bytes());
    files.into_iter().map(write).collect()
}

/// Every distribution with its unit, µs.
fn distributions(figures: &JitterFigures) -> Vec<(&'static str, Vec<(f64, u32)>)> {
    let all = &figures.distributions;
    let counts = |histogram: &Histogram| histogram.taken().map(|(top, n)| (all.scale.us(top), n)).collect();
    let plain = |histogram: &Histogram| histogram.taken().map(|(top, n)| (f64::from(top), n)).collect();
    let mut list = vec![
        ("start_error", counts(&all.instruments.start_error)),
        ("latency", counts(&all.instruments.latency)),
        ("cycle", counts(&all.instruments.cycle)),
        ("sync", counts(&all.instruments.sync)),
        ("vision_age", plain(&all.vision)),
    ];
    if let Some((feedback, command)) = &all.bus {
        list.push(("feedback_age", plain(feedback)));
        list.push(("command_age", plain(command)));
    }
    list
}

/// A line per bin that holds values.
fn csv(figures: &JitterFigures) -> String {
    let mut csv = String::from("quantity,up_to_us,values\n");
    for (name, bins) in distributions(figures) {
        for (us, values) in bins {
            // Writing to a string does not fail.
            let _ = writeln!(csv, "{name},{us:.3},{values}");
        }
    }
    csv
}

/// How often the start error, and the time of cycle and SYNC event, are over a value: the tail is what counts, so the share is drawn
/// as its logarithm.
fn charts(figures: &JitterFigures) -> anyhow::Result<[String; 2]> {
    let list = distributions(figures);
    let bins = |name: &str| {
        list.iter()
            .find(|(other, _)| *other == name)
            .map(|(_, bins)| bins.as_slice())
    };
    let curve = |name: &str, colour| Curve::new(tail(bins(name).unwrap_or_default()), colour);
    let chart = |x, curves| Chart {
        size: (720, 300),
        x,
        y: "events over it, log₁₀ of the share".into(),
        y_least: Some((-4.0, 0.0)),
        curves,
        allowed: None,
        marks: vec![],
    };
    Ok([
        chart("start to start, error (µs)", vec![curve("start_error", 0)]).svg()?,
        chart(
            "time of the control cycle (blue) and of the SYNC event (orange) (µs)",
            vec![curve("cycle", 0), curve("sync", 1)],
        )
        .svg()?,
    ])
}

/// Steps of the share of values over each, as log10; ends where nothing is left.
fn tail(bins: &[(f64, u32)]) -> Vec<(f64, f64)> {
    let all: f64 = bins.iter().map(|(_, values)| f64::from(*values)).sum();
    let mut over = all;
    let mut points = vec![(0.0, 0.0)];
    for (us, values) in bins {
        points.push((*us, (over / all).log10()));
        over -= f64::from(*values);
        if over > 0.0 {
            points.push((*us, (over / all).log10()));
        }
    }
    points
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_tail_steps_down_at_each_value_and_ends_at_the_greatest() {
        let points = tail(&[(1.0, 90), (2.0, 9), (5.0, 1)]);
        let expected = [
            (0.0, 0.0),
            (1.0, 0.0),
            (1.0, -1.0),
            (2.0, -1.0),
            (2.0, -2.0),
            (5.0, -2.0),
        ];
        assert_eq!(points, expected);
    }
}
