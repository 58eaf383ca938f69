//! One sealing trial: the controller and the cell in lock step, scored from the truth.

use super::cell::Cell;
use super::lockstep::{self, Ended, Job, Witness};
use super::scenario::{Options, StartName};
use super::score::TrialScore;
use super::setup::Setup;
use super::watch::Watch;
use crate::campaign::Company;
use crate::model::{AXES, Model};
use crate::target::node::Node;
use hal::cia402::PowerState;
use hal::process::{AxisInput, Inputs, Outputs};

/// Time that measuring the start may take, s: ten views and every place of the searches; most parts take 16 s.
const MEASURING: f64 = 180.0;

/// Those who keep score of a sealing trial.
struct Audience<'a> {
    watch: Watch,
    after: &'a mut dyn FnMut(&Node, &Outputs<AXES>),
    /// Furthest that the second arm's tip was from its reference, m.
    second: Option<f64>,
}

impl Witness for Audience<'_> {
    fn cycle(&mut self, cell: &Cell, controller: &Node, inputs: &Inputs<AXES>, outputs: &Outputs<AXES>) {
        (self.after)(controller, outputs);
        self.watch.cycle(cell, controller, inputs, outputs);
        // Without power there is no reference to follow.
        let enabled = |axis: &AxisInput| PowerState::of(axis.statusword) == Some(PowerState::OperationEnabled);
        let powered = inputs.axes.iter().all(enabled);
        if let (Some(body), Some(state), true) = (&cell.second, controller.second(), powered) {
            let deviation = body.deviation(state.reference());
            self.second = Some(self.second.unwrap_or(0.0).max(deviation));
        }
    }

    fn deviation(&self, _: &Cell) -> (f64, f64, f64) {
        self.watch.deviation()
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
    let setup = Setup::new(options, model, seed)?;
    let measured = options.start == StartName::Measured;
    let job = Job {
        name: "seal",
        options,
        setup: &setup,
        seed,
        length: f64::from(setup.params.seal.path.length()),
        besides: if measured { MEASURING } else { 0.0 },
    };
    let mut audience = Audience {
        watch: Watch::new(&setup),
        after,
        second: None,
    };
    let Ended {
        mut cell,
        controller,
        run,
    } = lockstep::run(&job, model, node(&setup)?, company, &mut audience)?;
    let mut score = audience.watch.score(&cell, &controller, run);
    score.second_max = audience.second.map(|deviation| deviation * 1e3);
    score.run.instruments = controller.finish()?;
    score.camera = cell.nodes.camera.finish()?;
    Ok(score)
}
