//! The report of one sealing run: a single HTML file with its plots and camera frames inside, to be opened, mailed and
//! kept. It needs nothing beside it and loads nothing.
//!
//! The report is drawn from plain data that the runner collects. What is in it is truth and reading alike: it is made for
//! people after the run, and nothing of it goes back to the controller.

pub mod chart;
mod data_uri;
mod escape;
mod frames;
mod page;
mod plots;

use std::path::{Path, PathBuf};

use anyhow::Result;
use hal::process::Look;

use crate::image_file::GreyImage;
use crate::whole_file;

/// Name of the report in its folder.
const FILE_NAME: &str = "report.html";

/// All that the report of a run shows.
#[derive(Clone, Debug, Default)]
pub struct RunReport {
    /// What was done: "Sealing of the panel at 0.3 m/s".
    pub title: String,
    /// Whether the run met its own criterion.
    pub succeeded: bool,
    /// How it went, in a sentence or two; for a run that failed, why.
    pub summary: String,
    /// What repeats the run: name and value of seed, path, surface, hash of the log.
    pub facts: Vec<(String, String)>,
    /// The figures, beside the paper's.
    pub figures: Vec<Figure>,
    /// Every cycle, in order.
    pub cycles: Vec<CycleTrace>,
    /// Every exposure, in order.
    pub frames: Vec<FrameTrace>,
}

/// One line of the table of figures.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Figure {
    /// What was measured.
    pub name: String,
    /// The value, in as many digits as it deserves.
    pub value: String,
    /// Its unit.
    pub unit: String,
    /// What it may be at most; empty for no bar.
    pub bar: String,
    /// What the paper says; empty for nothing.
    pub paper: String,
}

/// What happened in one cycle.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct CycleTrace {
    /// Time since the beginning of the run, s.
    pub t_s: f64,
    /// Distance of the nozzle along the taught path, m.
    pub station_m: f64,
    /// Speed of the nozzle tip, m/s.
    pub speed_m_per_s: f64,
    /// Joint references, rad.
    pub q_ref: [f64; 6],
    /// Joint angles of the plant, rad.
    pub q: [f64; 6],
    /// Motor torques, per mille of rated torque.
    pub torque_permille: [i16; 6],
    /// Nozzle to seam, across the seam in the sheet's tangent plane, mm, left positive.
    pub lateral_mm: f64,
    /// Nozzle to seam along the sheet's normal, mm, away from the sheet positive.
    pub height_mm: f64,
    /// Whether the dispenser was on; deviations count, and are drawn, only then.
    pub dispensing: bool,
    /// Share of the cycle in which the bus was busy, percent.
    pub bus_load_percent: f64,
    /// Correction of the taught path in force: lateral and height, mm.
    pub correction_mm: [f64; 2],
}

/// What the camera saw in one exposure.
#[derive(Clone, Debug, PartialEq)]
pub struct FrameTrace {
    /// Cycle of the exposure: an index into [`RunReport::cycles`].
    pub cycle: usize,
    /// The frame.
    pub image: GreyImage,
    /// What it was to show, and by which light.
    pub look: Look,
    /// The seam by each slit that found it, px from the centre of the top-left pixel, x right, y down; empty if the frame was refused.
    pub found_px: Vec<(f64, f64)>,
    /// Centres of the slit line, px.
    pub line_px: Vec<(f64, f64)>,
    /// What was made of it: "sure, quality 212", or why the frame was refused.
    pub verdict: String,
}

/// Writes the report into the folder `dir`, which is made if there is none, and returns the path of the file.
pub fn write(report: &RunReport, dir: &Path) -> Result<PathBuf> {
    whole_file::write(&dir.join(FILE_NAME), page::html(report)?.as_bytes())
}

#[cfg(test)]
mod tests;
