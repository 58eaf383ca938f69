//! One teaching trial: controller and cell in lock step, the points collected from the bus, smoothed, and scored from the truth.

use super::collect::Collector;
use super::scenario::{self, TeachOptions};
use super::score::TrialScore;
use super::smooth::{Smoothed, smooth};
use crate::bus::Delivery;
use crate::campaign::Company;
use crate::model::{AXES, Model};
use crate::node::Nodes;
use crate::seal::cell::Cell;
use crate::seal::lockstep::{self, Ended, Job, Witness};
use crate::target::node::Node;
use crate::taught::TaughtSeam;
use firmware::fault::Fault;
use hal::process::{Inputs, Outputs};
use nalgebra::Vector3;

/// Time that the run-in and the sheet beyond the seam may take, s per m/s of speed: 0.2 m, and as much again for slowing down.
const RUN_IN: f64 = 0.3;
/// Time that looking round a corner may take, s.
const LOOK_ROUND: f64 = 20.0;

/// Those who keep points and score of a teaching trial.
struct Audience {
    collector: Collector,
    view: f64,
}

impl Witness for Audience {
    fn frame(&mut self, delivery: &Delivery) {
        if delivery.sender == Nodes::<AXES>::CONTROLLER {
            self.collector.hear(&delivery.frame);
        }
    }

    fn cycle(&mut self, _: &Cell, _: &Node, inputs: &Inputs<AXES>, _: &Outputs<AXES>) {
        let found = inputs.sighting.filter(|sighting| sighting.refusal == 0);
        let across = found.map_or(0.0, |sighting| f64::from(sighting.point()[1]).abs() * 1e3);
        self.view = self.view.max(across);
    }

    fn deviation(&self, cell: &Cell) -> (f64, f64, f64) {
        cell.deviation()
    }
}

/// What a trial came to.
#[derive(Clone, Debug)]
pub struct Taught {
    /// How good it was.
    pub score: TrialScore,
    /// What was taught, if anything came together.
    pub seam: Option<TaughtSeam>,
}

/// Runs the trial that `seed` draws.
pub fn run(options: &TeachOptions, model: &Model, seed: u64, company: Company) -> anyhow::Result<Taught> {
    let setup = scenario::setup(options, model, seed)?;
    let start = setup.params.teach.as_ref().map(|teach| teach.start.p.map(f64::from));
    let job = Job {
        name: "teach",
        options: &options.cell,
        setup: &setup,
        seed,
        length: setup.panel.path().length(),
        besides: RUN_IN / options.cell.speed + LOOK_ROUND,
    };
    let mut audience = Audience {
        collector: Collector::new(setup.master.master_node),
        view: 0.0,
    };
    let controller = Node::new(options.cell.on, &setup.master, setup.params.clone())?;
    let Ended { controller, run, .. } = lockstep::run(&job, model, controller, company, &mut audience)?;
    let Collector { points, missing, .. } = audience.collector;
    let mut score = TrialScore {
        run,
        lost: matches!(
            controller.state().trip().fault,
            Fault::SeamLost | Fault::CannotTurn | Fault::Blind
        ),
        points: points.len(),
        view: audience.view,
        ..TrialScore::default()
    };
    if missing > 0 {
        score.fail(format!("{missing} taught points missing on the bus"));
    }
    let seam = match smooth(&points, &start.unwrap_or(Vector3::zeros())) {
        Ok(Smoothed { seam, outliers, .. }) => {
            score.outliers = outliers;
            score.hold_against(&seam, &setup.panel);
            Some(seam)
        }
        Err(error) => {
            score.fail(format!("{error:#}"));
            None
        }
    };
    score.run.instruments = controller.finish()?;
    Ok(Taught { score, seam })
}
