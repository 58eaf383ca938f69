//! Which charts a run is shown in.

use anyhow::Result;

use super::chart::{Chart, Curve};
use super::{CycleTrace, RunReport};

/// Width of a chart over the whole page, px.
const WIDE: u32 = 980;
/// Width of one of two charts side by side, px.
const HALF: u32 = 480;
/// Greatest deviation that a sealed seam may have, mm, lateral and in height: the requirement on the sealing job.
const ALLOWED_MM: f64 = 0.6;
/// Greatest bus load that six axes may cause, percent: the requirement on the sealing job.
const ALLOWED_LOAD_PERCENT: f64 = 45.0;

const STATION: &str = "station along the seam (m)";
const TIME: &str = "time (s)";

/// A named group of charts.
pub struct Plot {
    /// Heading.
    pub title: &'static str,
    /// What is seen, in a sentence.
    pub caption: &'static str,
    /// Name and colour of the curves; empty where there is but one.
    pub key: Vec<(&'static str, usize)>,
    /// The charts, SVG.
    pub charts: Vec<String>,
    /// Two charts in a row.
    pub side_by_side: bool,
}

/// All plots of a run, in the order of the page.
pub fn all(report: &RunReport) -> Result<Vec<Plot>> {
    Ok(vec![
        deviation(report)?,
        corrections(report)?,
        joints(report)?,
        torques(report)?,
        speed(report)?,
        bus(report)?,
    ])
}

fn deviation(report: &RunReport) -> Result<Plot> {
    let marks: Vec<_> = report
        .frames
        .iter()
        .filter_map(|frame| Some((report.cycles.get(frame.cycle)?.station_m, !frame.found_px.is_empty())))
        .collect();
    let chart = |x, y: &str, colour, value: fn(&CycleTrace) -> f64| {
        let points = along_seam(report, value);
        Chart {
            size: (WIDE, 200),
            x,
            y: y.into(),
            y_least: Some((-1.25 * ALLOWED_MM, 1.25 * ALLOWED_MM)),
            curves: vec![Curve::new(points, colour)],
            allowed: Some((-ALLOWED_MM, ALLOWED_MM)),
            marks: marks.clone(),
        }
        .svg()
    };
    Ok(Plot {
        title: "Deviation along the seam",
        caption: "Nozzle tip to true seam while the dispenser is on; the band is ±0.6 mm. Marks along the bottom: \
                  where the nozzle was at each exposure, green if the seam was found, red and longer if the frame was \
                  refused.",
        key: vec![],
        charts: vec![
            chart("", "lateral (mm)", 0, |cycle| cycle.lateral_mm)?,
            chart(STATION, "height (mm)", 1, |cycle| cycle.height_mm)?,
        ],
        side_by_side: false,
    })
}

fn corrections(report: &RunReport) -> Result<Plot> {
    let curve = |axis: usize| Curve::new(along_seam(report, move |cycle| cycle.correction_mm[axis]), axis);
    Ok(Plot {
        title: "Corrections of the taught path",
        caption: "What the sightings moved the taught path by, where the nozzle is.",
        key: vec![("lateral", 0), ("height", 1)],
        charts: vec![plain(WIDE, 200, STATION, "correction (mm)", vec![curve(0), curve(1)]).svg()?],
        side_by_side: false,
    })
}

fn joints(report: &RunReport) -> Result<Plot> {
    let mut charts = Vec::new();
    // Angles and errors of two axes side by side, so that an error stands under its angle.
    for pair in [[0, 1], [2, 3], [4, 5]] {
        for axis in pair {
            let reference = over_time(report, |cycle| cycle.q_ref[axis].to_degrees());
            let answer = over_time(report, |cycle| cycle.q[axis].to_degrees());
            let curves = vec![Curve::broad(reference, 5), Curve::new(answer, 0)];
            let angle = plain(HALF, 150, "", &format!("axis {} (°)", axis + 1), curves);
            // An axis may turn by a few degrees far from zero.
            charts.push(Chart { y_least: None, ..angle }.svg()?);
        }
        for axis in pair {
            let error = over_time(report, |cycle| 1e3 * (cycle.q_ref[axis] - cycle.q[axis]));
            let curves = vec![Curve::new(error, 1)];
            charts.push(plain(HALF, 120, TIME, "error (mrad)", curves).svg()?);
        }
    }
    Ok(Plot {
        title: "Joint references and answers",
        caption: "Under each axis its error, reference less answer.",
        key: vec![("reference", 5), ("answer", 0), ("error", 1)],
        charts,
        side_by_side: true,
    })
}

fn torques(report: &RunReport) -> Result<Plot> {
    let curve = |axis: usize| {
        let points = over_time(report, move |cycle| cycle.torque_permille[axis].into());
        Curve::new(points, axis)
    };
    let chart = plain(WIDE, 240, TIME, "torque (‰ of rated)", (0..6).map(curve).collect());
    Ok(Plot {
        title: "Motor torques",
        caption: "As the drives report them.",
        key: ["axis 1", "axis 2", "axis 3", "axis 4", "axis 5", "axis 6"]
            .into_iter()
            .zip(0..)
            .collect(),
        charts: vec![chart.svg()?],
        side_by_side: false,
    })
}

fn speed(report: &RunReport) -> Result<Plot> {
    let speed = |cycle: &CycleTrace| cycle.speed_m_per_s;
    let sealed = Curve::new(along_seam(report, speed), 2);
    let whole = Curve::new(over_time(report, speed), 2);
    Ok(Plot {
        title: "Speed of the nozzle tip",
        caption: "In the base frame: along the seam where the dispenser is on, and over the whole run.",
        key: vec![],
        charts: vec![
            plain(WIDE, 180, STATION, "speed (m/s)", vec![sealed]).svg()?,
            plain(WIDE, 180, TIME, "speed (m/s)", vec![whole]).svg()?,
        ],
        side_by_side: false,
    })
}

fn bus(report: &RunReport) -> Result<Plot> {
    let points = over_time(report, |cycle| cycle.bus_load_percent);
    let mut chart = plain(WIDE, 180, TIME, "bus load (%)", vec![Curve::new(points, 4)]);
    chart.allowed = Some((f64::NEG_INFINITY, ALLOWED_LOAD_PERCENT));
    chart.y_least = Some((0.0, ALLOWED_LOAD_PERCENT));
    Ok(Plot {
        title: "Bus load",
        caption: "Share of each 5 ms cycle in which the bus is busy, stuff bits and error frames included; at most 45 %.",
        key: vec![],
        charts: vec![chart.svg()?],
        side_by_side: false,
    })
}

fn plain(width: u32, height: u32, x: &'static str, y: &str, curves: Vec<Curve>) -> Chart {
    Chart {
        size: (width, height),
        x,
        y: y.into(),
        y_least: Some((0.0, 0.0)),
        curves,
        allowed: None,
        marks: vec![],
    }
}

fn over_time(report: &RunReport, value: impl Fn(&CycleTrace) -> f64) -> Vec<(f64, f64)> {
    report.cycles.iter().map(|cycle| (cycle.t_s, value(cycle))).collect()
}

fn along_seam(report: &RunReport, value: impl Fn(&CycleTrace) -> f64) -> Vec<(f64, f64)> {
    let sealed = report.cycles.iter().filter(|cycle| cycle.dispensing);
    sealed.map(|cycle| (cycle.station_m, value(cycle))).collect()
}
