//! One teaching trial: controller and cell in lock step, the points collected from the bus, smoothed, and scored from the truth.

use super::collect::Collector;
use super::scenario::{self, TeachOptions};
use super::score::TrialScore;
use super::smooth::{Smoothed, smooth};
use crate::bus::Delivery;
use crate::log::{RunHash, bytes_of};
use crate::model::{AXES, Model};
use crate::node::Nodes;
use crate::seal::cell::Cell;
use crate::seal::lockstep::{self, Witness};
use crate::seal::recording::Recording;
use crate::seal::trial::{Company, PATIENCE};
use crate::target::node::Node;
use crate::taught::TaughtSeam;
use anyhow::Context;
use firmware::fault::Fault;
use firmware::job::seal::{PERIOD, Phase};
use hal::process::{Inputs, Outputs};
use nalgebra::Vector3;

/// Those who keep score, points, hash and recording of a teaching trial.
struct Audience<'a> {
    collector: Collector,
    hash: RunHash,
    recording: Option<&'a mut Recording>,
    progress: &'a dyn Fn(f64),
    length: f64,
    cycles: u64,
    view: f64,
}

impl Witness for Audience<'_> {
    fn frame(&mut self, delivery: &Delivery) -> anyhow::Result<()> {
        if delivery.sender == Nodes::<AXES>::CONTROLLER {
            self.collector.hear(&delivery.frame);
        }
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
        self.hash.take(inputs);
        self.hash.take(outputs);
        self.cycles += 1;
        let found = inputs.sighting.filter(|sighting| sighting.refusal == 0);
        let across = found.map_or(0.0, |sighting| f64::from(sighting.point()[1]).abs() * 1e3);
        self.view = self.view.max(across);
        if let Some(recording) = &mut self.recording {
            let deviation = cell.deviation();
            recording
                .cycle(cell, controller, inputs, outputs, deviation)
                .context("log")?;
        }
        (self.progress)((f64::from(outputs.station_um) * 1e-6 / self.length).clamp(0.0, 1.0));
        Ok(())
    }
}

/// Runs the trial that `seed` draws; the seam is what was taught, if anything came together.
pub fn run(
    options: &TeachOptions,
    model: &Model,
    seed: u64,
    company: Company,
) -> anyhow::Result<(TrialScore, Option<TaughtSeam>)> {
    let Company {
        mut recording,
        progress,
        upset,
    } = company;
    let cell_options = &options.cell;
    let setup = scenario::setup(options, model, seed)?;
    let start = setup.params.teach.as_ref().map(|teach| teach.start.p.map(f64::from));
    let mut controller = Node::new(cell_options.on, &setup.master, setup.params.clone())?;
    let mut cell = Cell::new(cell_options, model, &setup, seed);
    cell.wire(cell_options, &setup)?;
    let parameters = bytes_of(&setup.params);
    if let Some(recording) = recording.as_deref_mut() {
        recording.begin("teach", cell_options, seed, &parameters)?;
        recording.settings(cell_options, &setup)?;
    }
    let length = setup.panel.path().length();
    let mut audience = Audience {
        collector: Collector::new(setup.master.master_node),
        hash: RunHash::new(&parameters),
        recording,
        progress,
        length,
        cycles: 0,
        view: 0.0,
    };
    let patience = PATIENCE + (1.5 * (length + 0.4) / cell_options.speed / f64::from(PERIOD)) as u64;
    lockstep::run(
        &mut cell,
        &mut controller,
        patience,
        cell_options.error_frames,
        upset,
        &mut audience,
    )?;
    let mut score = TrialScore {
        seed,
        failure: failure(&cell, &controller, &audience.collector),
        lost: matches!(controller.state().trip().fault, Fault::SeamLost | Fault::Blind),
        points: audience.collector.points.len(),
        view: audience.view,
        cycles: audience.cycles,
        deadline_misses: cell.late(),
        bus_load: 100.0 * cell.bus.load().max(),
        simulated: cell.now(),
        hash: audience.hash.value(),
        ..TrialScore::default()
    };
    let taught = match smooth(&audience.collector.points, &start.unwrap_or(Vector3::zeros())) {
        Ok(Smoothed { seam, outliers, .. }) => {
            score.outliers = outliers;
            score.hold_against(&seam, &setup.panel);
            Some(seam)
        }
        Err(error) => {
            score.failure.get_or_insert(format!("{error:#}"));
            None
        }
    };
    score.instruments = controller.finish()?;
    Ok((score, taught))
}

fn failure(cell: &Cell, controller: &Node, collector: &Collector) -> Option<String> {
    let state = controller.state();
    let trip = state.trip();
    if trip.fault != Fault::None {
        let seconds = f64::from(trip.cycle) * f64::from(PERIOD);
        Some(format!(
            "fault {} at {seconds:.3} s, place {}: {}",
            trip.fault as u8,
            trip.place,
            trip.fault.line()
        ))
    } else if state.phase() != Phase::Done {
        Some(format!("not done in time: phase {:?}", state.phase()))
    } else if !cell.powered_down() {
        Some("drives still powered at the end".into())
    } else if collector.missing > 0 {
        Some(format!("{} taught points missing on the bus", collector.missing))
    } else {
        None
    }
}
