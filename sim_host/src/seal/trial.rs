//! One sealing trial: the controller and the cell in lock step, scored from the truth.

use super::cell::Cell;
use super::lockstep::{self, Witness};
use super::recording::Recording;
use super::scenario::Options;
use super::score::TrialScore;
use super::setup::Setup;
use super::watch::Watch;
use crate::bus::Delivery;
use crate::log::{RunHash, bytes_of};
use crate::model::{AXES, Model};
use crate::target::node::Node;
use anyhow::Context;
use hal::cia402::PowerState;
use hal::process::{Inputs, Outputs};

/// Cycles beyond the path's own time that a trial may take, for arming and the way there and back: 20 s.
pub const PATIENCE: u64 = 4000;
/// And for measuring the start: 60 s, ten views with a search, of which most parts take 13 s.
const MEASURING: u64 = 12_000;

/// Who looks on, and who interferes.
pub struct Company<'a> {
    /// Keeps everything for people and other tools.
    pub recording: Option<&'a mut Recording>,
    /// Is told how far along the seam the nozzle is, 0 to 1.
    pub progress: &'a dyn Fn(f64),
    /// Is called at the beginning of each cycle, with its number and the nozzle's station (m): breaks what it likes.
    pub upset: &'a mut dyn FnMut(u64, f64, &mut Cell),
}

/// Those who keep score, hash and recording of a sealing trial.
struct Audience<'a> {
    watch: Watch,
    hash: RunHash,
    recording: Option<&'a mut Recording>,
    progress: &'a dyn Fn(f64),
    after: &'a mut dyn FnMut(&Node, &Outputs<AXES>),
    length: f64,
    /// Furthest that the second arm's tip was from its reference, m.
    second: Option<f64>,
}

impl Witness for Audience<'_> {
    fn frame(&mut self, delivery: &Delivery) -> anyhow::Result<()> {
        match &mut self.recording {
            Some(recording) => recording.frame(delivery).context("candump"),
            None => Ok(()),
        }
    }

    fn cycle(
        &mut self,
        cell: &Cell,
        controller: &Node,
        inputs: &Inputs<AXES>,
        outputs: &Outputs<AXES>,
    ) -> anyhow::Result<()> {
        (self.after)(controller, outputs);
        self.hash.take(inputs);
        self.hash.take(outputs);
        self.watch.cycle(cell, controller, inputs, outputs);
        // Without power there is no reference to follow.
        let powered = inputs
            .axes
            .iter()
            .all(|axis| PowerState::of(axis.statusword) == Some(PowerState::OperationEnabled));
        if let (Some(body), Some(state), true) = (&cell.second, controller.second(), powered) {
            let deviation = body.deviation(state.reference());
            self.second = Some(self.second.unwrap_or(0.0).max(deviation));
        }
        if let Some(recording) = &mut self.recording {
            recording
                .cycle(cell, controller, inputs, outputs, self.watch.deviation())
                .context("log")?;
        }
        let station = f64::from(outputs.station_um) * 1e-6;
        (self.progress)((station / self.length).clamp(0.0, 1.0));
        Ok(())
    }
}

/// Runs the trial that `seed` draws.
pub fn run(options: &Options, model: &Model, seed: u64, company: Company) -> anyhow::Result<TrialScore> {
    let node = |setup: &Setup| Node::for_setup(options.on, setup, false);
    run_with(options, model, seed, company, node, &mut |_, _| {})
}

/// The same with another controller node; `after` is called at the end of each of its cycles.
pub fn run_with(
    options: &Options,
    model: &Model,
    seed: u64,
    company: Company,
    node: impl FnOnce(&Setup) -> anyhow::Result<Node>,
    after: &mut dyn FnMut(&Node, &Outputs<AXES>),
) -> anyhow::Result<TrialScore> {
    let Company {
        mut recording,
        progress,
        upset,
    } = company;
    let setup = Setup::new(options, model, seed)?;
    let mut controller = node(&setup)?;
    let mut cell = Cell::new(options, model, &setup, seed);
    cell.wire(options, &setup)?;
    let parameters = bytes_of(&setup.params);
    if let Some(recording) = recording.as_deref_mut() {
        recording.begin("seal", options, seed, &parameters)?;
        recording.settings(options, &setup)?;
    }
    let length = f64::from(setup.params.seal.path.length());
    let measuring = if options.start == super::scenario::StartName::Measured {
        MEASURING
    } else {
        0
    };
    let patience = PATIENCE + measuring + (1.5 * (length + 0.2) / options.speed / 0.005) as u64;
    let mut audience = Audience {
        watch: Watch::new(&setup, seed),
        hash: RunHash::new(&parameters),
        recording,
        progress,
        after,
        length,
        second: None,
    };
    lockstep::run(
        &mut cell,
        &mut controller,
        patience,
        options.error_frames,
        upset,
        &mut audience,
    )?;
    let mut score = audience.watch.score(&cell, &controller, audience.hash.value());
    score.second_max = audience.second.map(|deviation| deviation * 1e3);
    score.instruments = controller.finish()?;
    score.camera = cell.nodes.camera.finish()?;
    Ok(score)
}
