//! What a trial leaves for people and other tools: log, candump and report.

use super::cell::{Cell, camera_params};
use super::scenario::{Options, name_of};
use super::setup::Setup;
use super::words;
use crate::bus::Delivery;
use crate::campaign::tally::Tally;
use crate::campaign::words::Figure;
use crate::candump::CandumpWriter;
use crate::log::{LogWriter, bytes_of};
use crate::model::AXES;
use crate::report::{self, CycleTrace, FrameTrace, RunReport};
use crate::target::node::Node;
use crate::target::region;
use crate::whole_file;
use anyhow::Context;
use firmware::safety::State;
use hal::process::{Inputs, Look, Outputs};
use serde_json::json;
use std::path::{Path, PathBuf};
use std::{fs, io};

/// How the names of frames begin.
const SEAM: &str = "seam-";
const START: &str = "start-";

/// What a campaign came to, for its report.
pub struct Summary<'a> {
    /// It kept its bars.
    pub passed: bool,
    /// Bars over all trials that were not kept, each in a line.
    pub shortfalls: Vec<String>,
    /// What every job adds up.
    pub tally: &'a Tally,
    /// What repeats the run, besides seed and hash: name and value.
    pub facts: Vec<(&'static str, String)>,
    /// The figures.
    pub figures: Vec<Figure>,
}

/// A recording in progress.
pub struct Recording {
    dir: PathBuf,
    log: Option<LogWriter>,
    candump: CandumpWriter,
    report: RunReport,
    shots: usize,
    parameters: Vec<(&'static str, Vec<u8>)>,
}

impl Recording {
    /// Into the folder `dir`, which is made if there is none.
    pub fn create(dir: &Path) -> anyhow::Result<Self> {
        fs::create_dir_all(dir).with_context(|| format!("--out {}: cannot be made", dir.display()))?;
        let candump = CandumpWriter::create(&dir.join("bus.log"))?;
        Ok(Self {
            dir: dir.into(),
            log: None,
            candump,
            report: RunReport::default(),
            shots: 0,
            parameters: Vec::new(),
        })
    }

    /// The run begins.
    pub fn begin(&mut self, job: &str, options: &Options, seed: u64, parameters: &[u8]) -> anyhow::Result<()> {
        let description = json!({
            "job": job, "seed": seed, "path": name_of(&options.path), "joint": name_of(&options.joint),
            "surface": name_of(&options.surface), "hold": name_of(&options.hold), "speed_m_per_s": options.speed,
        });
        self.log = Some(LogWriter::create(&self.dir.join("run.tlog"), parameters, &description)?);
        let what = if job == "teach" { "Teaching" } else { "Sealing" };
        self.report.title = format!("{what} of the {} at {} m/s", name_of(&options.path), options.speed);
        Ok(())
    }

    /// The parameter region of each image, with which it does the same on a board: `cargo xtask flash --params` writes it there.
    pub fn settings(&mut self, options: &Options, setup: &Setup) {
        let controller = region::of_controller(&setup.master, &setup.params, &());
        let camera = bytes_of(&camera_params(options, setup));
        self.parameters = [("controller.params", controller), ("camera.params", camera)]
            .map(|(name, body)| (name, region::with_head(&body)))
            .into();
    }

    /// A frame on the bus.
    pub fn frame(&mut self, delivery: &Delivery) -> anyhow::Result<()> {
        self.candump.frame(delivery.t_ns, &delivery.frame)
    }

    /// A cycle of the controller.
    pub fn cycle(
        &mut self,
        cell: &Cell,
        controller: &Node,
        inputs: &Inputs<AXES>,
        outputs: &Outputs<AXES>,
        deviation: (f64, f64, f64),
    ) -> anyhow::Result<()> {
        if let Some(log) = &mut self.log {
            log.cycle(inputs, outputs, &controller.trail())?;
        }
        let state = controller.state();
        let (linear, _) = cell.plant.tip_velocity();
        let [lateral, height, _] = state.correction();
        let powered = !matches!(
            state.safety(),
            State::EStop | State::NotArmed | State::Arming | State::Faulted
        );
        let (_, off_lateral, off_height) = deviation;
        self.report.cycles.push(CycleTrace {
            t_s: cell.now(),
            station_m: f64::from(outputs.station_um) * 1e-6,
            speed_m_per_s: linear.norm(),
            // Unpowered, the arm has no reference.
            q_ref: if powered {
                state.reference().map(f64::from)
            } else {
                cell.joints_at_sync
            },
            q: cell.joints_at_sync,
            torque_permille: inputs.axes.map(|axis| axis.torque),
            lateral_mm: off_lateral * 1e3,
            height_mm: off_height * 1e3,
            dispensing: cell.flow() > 0,
            bus_load_percent: 100.0 * cell.last_load,
            correction_mm: [lateral, height].map(|m| f64::from(m) * 1e3),
        });
        for shot in cell.shots.iter().skip(self.shots) {
            let (line_px, found_px) = cell.look_again(shot);
            let look = match shot.look {
                Look::Seam | Look::Dark => "",
                Look::StartGrey => "start in grey: ",
                Look::StartSlit => "section: ",
            };
            let verdicts = shot.seen.iter().map(|seen| {
                let sighting = &seen.sighting;
                let sure = if sighting.is_sure() { "sure" } else { "doubtful" };
                match (sighting.refusal, seen.off) {
                    (0, Some(off)) => format!("{sure}, quality {}, {:.2} mm off", sighting.quality, off * 1e3),
                    (0, None) => format!("{sure}, quality {}", sighting.quality),
                    (number, _) => format!("refused: {}", words::refusal(number)),
                }
            });
            self.report.frames.push(FrameTrace {
                look: shot.look,
                cycle: self.report.cycles.len() - 1,
                image: shot.image.clone(),
                found_px,
                line_px,
                verdict: format!("{look}{}", verdicts.collect::<Vec<_>>().join("; ")),
            });
        }
        self.shots = cell.shots.len();
        Ok(())
    }

    /// The run is over: writes everything, the report first in the list.
    pub fn finish(mut self, summary: Summary) -> anyhow::Result<Vec<PathBuf>> {
        let report = &mut self.report;
        let tally = summary.tally;
        report.succeeded = summary.passed;
        report.summary = match (tally.failures.first(), summary.shortfalls.first()) {
            (Some(failure), _) => format!("Seed {}: {}.", failure.seed, failure.reason),
            (None, Some(_)) => format!("Over all trials: {}.", summary.shortfalls.join("; ")),
            (None, None) => format!(
                "{} of {} trials kept every bar. This page shows the first; the figures are over all of them.",
                tally.succeeded, tally.trials
            ),
        };
        report.facts = summary
            .facts
            .into_iter()
            .chain([("seed", tally.seed.to_string()), ("hash", tally.log_hash.clone())])
            .map(|(name, value)| (name.to_string(), value))
            .collect();
        report.figures = summary
            .figures
            .into_iter()
            .map(|[name, value, unit, bar, paper]| report::Figure {
                name,
                value,
                unit,
                bar,
                paper,
            })
            .collect();
        let mut files = vec![report::write(report, &self.dir)?];
        let frames = self.dir.join("frames");
        empty(&frames).with_context(|| format!("--out {}: cannot be made", frames.display()))?;
        for (number, frame) in self.report.frames.iter().enumerate() {
            let [of, light] = match frame.look {
                Look::Seam | Look::Dark => [SEAM, ""],
                Look::StartGrey => [START, "-grey"],
                Look::StartSlit => [START, "-slit"],
            };
            let name = format!("{of}{number:03}{light}.png");
            whole_file::write(&frames.join(name), &frame.image.to_png()?)?;
        }
        files.push(frames);
        if let Some(log) = self.log.take() {
            log.finish()?;
            files.push(self.dir.join("run.tlog"));
        }
        files.push(self.candump.finish()?);
        for (name, region) in &self.parameters {
            files.push(whole_file::write(&self.dir.join(name), region)?);
        }
        Ok(files)
    }
}

/// The folder `frames`, made if there is none, without the frames of an earlier run.
fn empty(frames: &Path) -> io::Result<()> {
    fs::create_dir_all(frames)?;
    for entry in fs::read_dir(frames)? {
        let entry = entry?;
        let name = entry.file_name();
        let name = name.to_string_lossy();
        if name.ends_with(".png") && [SEAM, START].iter().any(|of| name.starts_with(of)) {
            fs::remove_file(entry.path())?;
        }
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use crate::model::Model;
    use crate::seal::campaign::{self, Campaign};
    use crate::seal::scenario::{Options, PathName};
    use crate::whole_file::tests::folder;
    use std::fs;

    #[test]
    fn a_start_that_was_measured_leaves_frames_named_by_their_light_and_shown_as_what_they_were() {
        let options = Options {
            path: PathName::Straight,
            ..Options::default()
        };
        let campaign = Campaign {
            options,
            seed: 1,
            trials: 1,
        };
        let folder = folder("recording");
        fs::create_dir(folder.join("frames")).unwrap();
        fs::write(folder.join("frames/seam-999.png"), "of an earlier run").unwrap();
        fs::write(folder.join("frames/notes.txt"), "somebody's").unwrap();
        campaign::run(&campaign, &Model::k3s(), Some(&folder)).unwrap();
        let frames = fs::read_dir(folder.join("frames")).unwrap();
        let names: Vec<_> = frames
            .map(|entry| entry.unwrap().file_name().into_string().unwrap())
            .collect();
        let count = |begin: &str, end: &str| {
            let named = names
                .iter()
                .filter(|name| name.starts_with(begin) && name.ends_with(end));
            named.count()
        };
        let (grey, slit, seam) = (
            count("start-", "-grey.png"),
            count("start-", "-slit.png"),
            count("seam-", ".png"),
        );
        assert!(grey >= 2 && slit >= 6 && seam >= 30, "{grey}, {slit}, {seam} frames");
        assert_eq!(grey + slit + seam + 1, names.len());
        assert!(names.iter().any(|name| name == "notes.txt") && !names.iter().any(|name| name == "seam-999.png"));
        let html = fs::read_to_string(folder.join("report.html")).unwrap();
        assert!(html.contains("<span class=\"found\">section: sure"));
        assert!(!html.contains("<span class=\"refused\">section: sure"));
    }
}
