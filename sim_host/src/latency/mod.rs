//! The vision latency of the loop, measured by the loop itself: how long after its SYNC an exposure really is, and how old a
//! sighting is when it can be used.
//!
//! The arm plays a path that swings across a straight seam (`weave`), without corrections, as fast as it seals. What comes of it is
//! what the controller reads: positions and sightings. They tell the exposure's delay ([`estimate`]), which the controller then takes
//! off, and the ages. The controller, its drives and its camera are those of sealing; in the emulated cell the truth stands
//! beside the result.

pub mod estimate;
mod weave;
pub mod words;

use crate::campaign::tally::{Bar, Run, Tally};
use crate::campaign::{self, Company, Trials};
use crate::model::{AXES, Model};
use crate::seal::cell::Cell;
use crate::seal::lockstep::{self, Ended, Job, Witness};
use crate::seal::recording::{Recording, Summary};
use crate::seal::scenario::{Options, PathName};
use crate::seal::setup::Setup;
use crate::target::node::Node;
use anyhow::Result;
use estimate::{Delay, Seen};
use firmware::cycle::Params;
use firmware::job::phase::Phase;
use firmware::job::seal::PERIOD;
use hal::canopen::sync::since;
use hal::process::{Inputs, Look, Outputs};
use nalgebra::Vector3;
use serde::Serialize;
use std::path::{Path, PathBuf};

/// Largest standard deviation of a delay that is good enough, ms: at 0.3 m/s it moves a sighting by 0.03 mm.
pub const DEVIATION_MAX_MS: f64 = 0.1;
/// Largest error against the truth, where it is known, ms.
pub const ERROR_MAX_MS: f64 = 0.2;
/// From the SYNC of a cycle to where the controller uses what came in it, s: half a period.
const STEP: f64 = 0.5 * PERIOD as f64;

/// What is to be run.
pub type Campaign = campaign::Campaign<Options>;

/// What came out.
pub struct CampaignResult {
    /// The figures.
    pub score: LatencyScore,
    /// Files written, the report first.
    pub files: Vec<PathBuf>,
}

/// The JSON of `latency`.
#[derive(Clone, Debug, Serialize)]
pub struct LatencyScore {
    /// What every job adds up.
    #[serde(flatten)]
    pub tally: Tally,
    /// Sightings of the seam that the delay was fitted to.
    pub sightings: usize,
    /// From an exposure's SYNC to its middle.
    pub exposure_delay_ms: f64,
    /// Its standard deviation.
    pub exposure_delay_deviation_ms: f64,
    /// In the emulated cell: how far that is off.
    pub exposure_delay_error_ms: f64,
    /// Scatter of the sightings across the seam about its course, once the delay is taken off.
    pub residual_rms_mm: f64,
    /// From the middle of an exposure to where the controller can use its sighting.
    pub latency_median_ms: f64,
    /// The largest.
    pub latency_max_ms: f64,
}

impl LatencyScore {
    /// The delay against its bars.
    pub fn bars(&self) -> [Bar; 2] {
        let bar = |name, value, most| Bar {
            name,
            value,
            unit: "ms",
            most: Some(most),
        };
        [
            bar(
                "  its standard deviation",
                self.exposure_delay_deviation_ms,
                DEVIATION_MAX_MS,
            ),
            bar("  off the true one", self.exposure_delay_error_ms.abs(), ERROR_MAX_MS),
        ]
    }

    /// Every run was measured, and the delay is known well enough, and right.
    pub fn passed(&self) -> bool {
        self.tally.all_succeeded() && self.bars().iter().all(|bar| bar.shortfall().is_none())
    }
}

/// What one run recorded.
#[derive(Default)]
struct Record {
    joints: Vec<[f32; AXES]>,
    sightings: Vec<Seen>,
    /// Ages of the sightings at their use since their SYNC, s; the refused too.
    ages: Vec<f64>,
}

/// What one run showed.
struct TrialScore {
    run: Run,
    record: Record,
    delay: Option<Delay>,
}

/// Keeps what the controller reads while it follows the path.
struct Recorder<'a> {
    params: &'a Params,
    record: Record,
}

impl Witness for Recorder<'_> {
    fn cycle(&mut self, _: &Cell, controller: &Node, inputs: &Inputs<AXES>, _: &Outputs<AXES>) {
        let Record {
            joints,
            sightings,
            ages,
        } = &mut self.record;
        let drives = &self.params.servo.drives;
        let actuators = std::array::from_fn(|axis| drives[axis].angle(inputs.axes[axis].position));
        let now = joints.len();
        joints.push(self.params.arm.coupling.to_joints(&actuators));
        let Some(sighting) = inputs.sighting.filter(|sighting| sighting.look == Look::Seam) else {
            return;
        };
        let age = usize::from(since(sighting.stamp, inputs.sync));
        ages.push(age as f64 * f64::from(PERIOD) + STEP);
        if let Some(cycle) = now.checked_sub(age)
            && sighting.refusal == 0
            && controller.state().phase() == Phase::Follow
        {
            sightings.push(Seen {
                cycle,
                point: Vector3::from(sighting.point()),
            });
        }
    }

    fn deviation(&self, cell: &Cell) -> (f64, f64, f64) {
        cell.deviation()
    }
}

/// Height over the seam at which the nozzle swings, m: over the upper sheet, and what half a metre makes of a start pose's error.
const RAISE_M: f32 = 0.006;

/// The cell to measure in: sealing's, with a straight and unbent seam.
pub fn cell() -> Options {
    Options {
        path: PathName::Straight,
        deform: 0.0,
        preview: false,
        // A burst as soon as the camera is through with the last.
        vision_period: 4,
        ..Options::told()
    }
}

/// Measures in a [`cell`]; with `out`, the first run leaves its report, log and candump there.
pub fn run(campaign: &Campaign, model: &Model, out: Option<&Path>) -> Result<CampaignResult> {
    let mut recording = out.map(Recording::create).transpose()?;
    // Played until the process ends.
    let taught = Some(&*Box::leak(Box::new(weave::weave()?)));
    let trials = campaign.run(recording.as_mut(), |options, seed, company| {
        trial(&Options { taught, ..*options }, model, seed, company)
    })?;
    let score = add_up(campaign, &trials);
    let summary = Summary {
        passed: score.passed(),
        shortfalls: Vec::new(),
        tally: &score.tally,
        facts: Vec::new(),
        figures: words::figures(&score),
    };
    let files = recording
        .map(|recording| recording.finish(summary))
        .transpose()?
        .unwrap_or_default();
    Ok(CampaignResult { score, files })
}

fn trial(options: &Options, model: &Model, seed: u64, company: Company) -> Result<TrialScore> {
    let mut setup = Setup::new(options, model, seed)?;
    // At a nominal speed that is never reached the dispenser stays shut: nothing is to be laid.
    setup.params.seal.speed = f32::MAX;
    // And the part is told to lie higher, so that the nozzle swings over it.
    setup.params.seal.start.shift[2] += RAISE_M;
    let job = Job {
        name: "latency",
        options,
        setup: &setup,
        seed,
        length: f64::from(setup.params.seal.path.length()),
        besides: 0.0,
    };
    let mut recorder = Recorder {
        params: &setup.params,
        record: Record::default(),
    };
    let controller = Node::new(options.on, &setup.master, setup.params.clone())?;
    let Ended {
        controller, mut run, ..
    } = lockstep::run(&job, model, controller, company, &mut recorder)?;
    run.instruments = controller.finish()?;
    let record = recorder.record;
    let found = estimate::delay(&setup.params.arm, &setup.mount.pose, &record.joints, &record.sightings);
    if let Err(error) = &found {
        run.failure.get_or_insert(format!("{error:#}"));
    }
    Ok(TrialScore {
        run,
        record,
        delay: found.ok(),
    })
}

fn add_up(campaign: &Campaign, trials: &Trials<TrialScore>) -> LatencyScore {
    let options = &campaign.options;
    let tally = Tally::of(
        "latency",
        campaign,
        options.speed,
        trials,
        |score| &score.run,
        |score| score.run.verdict(&[]),
    );
    let records = || trials.each.iter().map(|score| &score.record);
    let delays: Vec<Delay> = trials.each.iter().filter_map(|score| score.delay).collect();
    // Each run counts by its certainty.
    let weight = |delay: &Delay| delay.deviation.powi(-2);
    let sum: f64 = delays.iter().map(weight).sum();
    let mean = |of: fn(&Delay) -> f64| delays.iter().map(|delay| of(delay) * weight(delay)).sum::<f64>() / sum;
    let delay = mean(|delay| delay.value);
    let mut latencies: Vec<f64> = records()
        .flat_map(|record| &record.ages)
        .map(|age| (age - delay) * 1e3)
        .collect();
    latencies.sort_by(f64::total_cmp);
    LatencyScore {
        tally,
        sightings: records().map(|record| record.sightings.len()).sum(),
        exposure_delay_ms: delay * 1e3,
        exposure_delay_deviation_ms: sum.sqrt().recip() * 1e3,
        exposure_delay_error_ms: (delay - options.exposure_delay) * 1e3,
        residual_rms_mm: mean(|delay| delay.residual * delay.residual).sqrt() * 1e3,
        latency_median_ms: latencies.get(latencies.len() / 2).copied().unwrap_or(0.0),
        latency_max_ms: latencies.last().copied().unwrap_or(0.0),
    }
}
