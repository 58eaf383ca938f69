//! The vision latency of the loop, measured by the loop itself: how long after its SYNC an exposure really is, and how old a
//! sighting is when it can be used.
//!
//! The arm plays a path that swings across a straight seam ([`weave`]), without corrections, as fast as it seals. What comes of it is
//! what the controller reads: positions and sightings. They tell the exposure's delay ([`estimate`]), which the controller then takes
//! off, and the ages. The controller, its drives and its camera are those of sealing; in the emulated cell the truth stands
//! beside the result.

pub mod estimate;
mod weave;
pub mod words;

use crate::bus::Delivery;
use crate::model::{AXES, Model};
use crate::progress;
use crate::seal::cell::Cell;
use crate::seal::lockstep::{self, Witness};
use crate::seal::scenario::{Options, PathName};
use crate::seal::score::Failure;
use crate::seal::setup::Setup;
use crate::seal::trial::PATIENCE;
use crate::target::node::Node;
use anyhow::Result;
use estimate::{Delay, Seen};
use firmware::cycle::Params;
use firmware::fault::Fault;
use firmware::job::seal::{PERIOD, Phase};
use hal::process::{Inputs, Look, Outputs};
use nalgebra::Vector3;
use rayon::prelude::*;
use serde::Serialize;

/// Largest standard deviation of a delay that is good enough, s: at 0.3 m/s it moves a sighting by 0.03 mm.
const GOOD: f64 = 0.1e-3;
/// Largest error against the truth, where it is known, s.
const RIGHT: f64 = 0.2e-3;
/// From the SYNC of a cycle to where the controller uses what came in it, s: half a period.
const STEP: f64 = 0.5 * PERIOD as f64;

/// The JSON of `latency`.
#[derive(Clone, Debug, Serialize)]
pub struct LatencyScore {
    /// Always `latency`.
    pub job: &'static str,
    /// First seed; trial i has seed + i.
    pub seed: u64,
    /// Times that the seam was crossed to and fro along its length.
    pub trials: usize,
    /// Of these, measured.
    pub succeeded: usize,
    /// The others.
    pub failures: Vec<Failure>,
    /// Sightings of the seam that the delay was fitted to.
    pub sightings: usize,
    /// From an exposure's SYNC to its middle.
    pub exposure_delay_ms: f64,
    /// Its standard deviation.
    pub exposure_delay_deviation_ms: f64,
    /// In the emulated cell: the true one.
    pub true_exposure_delay_ms: f64,
    /// Scatter of the sightings across the seam about its course, once the delay is taken off.
    pub residual_rms_mm: f64,
    /// From the middle of an exposure to where the controller can use its sighting.
    pub latency_median_ms: f64,
    /// The largest.
    pub latency_max_ms: f64,
    /// Whether every run was measured, well enough, and right.
    pub passed: bool,
}

/// What one run recorded.
#[derive(Default)]
struct Record {
    joints: Vec<[f32; AXES]>,
    sightings: Vec<Seen>,
    /// Ages of the sightings at their use since their SYNC, s; the refused too.
    ages: Vec<f64>,
}

/// A run that was measured, or why it was not.
type Run = std::result::Result<(Record, Delay), String>;

/// Keeps what the controller reads while it follows the path.
struct Recorder<'a> {
    params: &'a Params,
    record: Record,
}

impl Witness for Recorder<'_> {
    fn frame(&mut self, _: &Delivery) -> Result<()> {
        Ok(())
    }

    fn cycle(&mut self, _: &Cell, controller: &Node, inputs: &Inputs<AXES>, _: &Outputs<AXES>) -> Result<()> {
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
            return Ok(());
        };
        let age = usize::from(hal::canopen::sync::since(sighting.stamp, inputs.sync));
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
        Ok(())
    }
}

/// The cell to measure in: sealing's, with a straight and unbent seam.
pub fn cell() -> Options {
    Options {
        path: PathName::Straight,
        deform: 0.0,
        // A burst as soon as the camera is through with the last.
        vision_period: 4,
        ..Options::default()
    }
}

/// Measures in the cell of `options`, made of [`cell`], `trials` times; trial i draws from seed + i.
pub fn run(options: &Options, model: &Model, seed: u64, trials: usize) -> Result<LatencyScore> {
    let options = Options {
        // Played until the process ends.
        taught: Some(Box::leak(Box::new(weave::weave()?))),
        preview: false,
        ..*options
    };
    let bar = progress::bar(trials as u64, "runs");
    let runs: Result<Vec<_>> = (0..trials)
        .into_par_iter()
        .map(|index| {
            let seed = seed.wrapping_add(index as u64);
            let run = one(&options, model, seed);
            bar.inc(1);
            Ok((seed, run?))
        })
        .collect();
    bar.finish_and_clear();
    Ok(add_up(&options, seed, runs?))
}

/// One run; a failure of the job is a reason.
fn one(options: &Options, model: &Model, seed: u64) -> Result<Run> {
    let mut setup = Setup::new(options, model, seed)?;
    // At a speed that is never reached the dispenser stays shut: nothing is to be laid.
    setup.params.seal.speed = f32::MAX;
    let mut controller = Node::new(options.on, &setup.master, setup.params.clone())?;
    let mut cell = Cell::new(options, model, &setup, seed);
    cell.wire(options, &setup)?;
    let mut recorder = Recorder {
        params: &setup.params,
        record: Record::default(),
    };
    let length = f64::from(setup.params.seal.path.length());
    let patience = PATIENCE + (1.5 * (length + 0.2) / options.speed / f64::from(PERIOD)) as u64;
    lockstep::run(
        &mut cell,
        &mut controller,
        patience,
        options.error_frames,
        &mut |_, _, _| {},
        &mut recorder,
    )?;
    let trip = controller.state().trip();
    if trip.fault != Fault::None {
        return Ok(Err(format!("fault {}: {}", trip.fault as u8, trip.fault.line())));
    }
    let Record { joints, sightings, .. } = &recorder.record;
    let found = estimate::delay(&setup.params.arm, &setup.mount.pose, joints, sightings);
    Ok(found
        .map(|delay| (recorder.record, delay))
        .map_err(|error| format!("{error:#}")))
}

fn add_up(options: &Options, seed: u64, runs: Vec<(u64, Run)>) -> LatencyScore {
    let trials = runs.len();
    let mut failures = Vec::new();
    let mut measured = Vec::new();
    for (seed, run) in runs {
        match run {
            Ok(run) => measured.push(run),
            Err(reason) => failures.push(Failure { seed, reason }),
        }
    }
    // Each run counts by its certainty.
    let weight = |delay: &Delay| 1.0 / (delay.deviation * delay.deviation);
    let sum: f64 = measured.iter().map(|(_, delay)| weight(delay)).sum();
    let mean = |of: fn(&Delay) -> f64| measured.iter().map(|(_, delay)| of(delay) * weight(delay)).sum::<f64>() / sum;
    let value = mean(|delay| delay.value);
    let deviation = sum.sqrt().recip();
    let mut ages: Vec<f64> = measured
        .iter()
        .flat_map(|(record, _)| &record.ages)
        .map(|age| age - value)
        .collect();
    ages.sort_by(f64::total_cmp);
    let right = (value - options.exposure_delay).abs() <= RIGHT;
    LatencyScore {
        job: "latency",
        seed,
        trials,
        succeeded: measured.len(),
        sightings: measured.iter().map(|(record, _)| record.sightings.len()).sum(),
        exposure_delay_ms: value * 1e3,
        exposure_delay_deviation_ms: deviation * 1e3,
        true_exposure_delay_ms: options.exposure_delay * 1e3,
        residual_rms_mm: mean(|delay| delay.residual * delay.residual).sqrt() * 1e3,
        latency_median_ms: ages.get(ages.len() / 2).map_or(0.0, |age| age * 1e3),
        latency_max_ms: ages.last().map_or(0.0, |age| age * 1e3),
        passed: failures.is_empty() && deviation <= GOOD && right,
        failures,
    }
}
