//! Controller and cell in lock step, whatever the job.
//!
//! Time is counted in cycles of 5 ms, each in 20 ticks of 0.25 ms. In a tick the bus delivers what ends in it, then drives and arm move on. The
//! controller is called as a board would call it: the SYNC at the cycle's start, frames as they come, the cycle half a period later. It is
//! wired to the bus alone. Every input and output goes into the run's hash, and into its recording if there is one.

use super::cell::{Cell, TICKS};
use super::recording::Recording;
use super::scenario::Options;
use super::setup::Setup;
use crate::bus::Delivery;
use crate::campaign::Company;
use crate::campaign::tally::Run;
use crate::log::{RunHash, bytes_of};
use crate::model::{AXES, Model};
use crate::target::node::Node;
use anyhow::Context;
use firmware::fault::Fault;
use firmware::job::phase::Phase;
use firmware::job::seal::PERIOD;
use firmware::safety::State;
use hal::process::{Inputs, Outputs};

/// Tick after which the controller computes: 2.5 ms after the SYNC.
pub const STEP_PHASE: u32 = TICKS / 2;
/// Time beyond the seam's own that a job may take, for arming and the way there and back, s.
const PATIENCE: f64 = 20.0;
/// Share of the seam's own time that it may take longer.
const SLOW: f64 = 1.5;

/// Who keeps the score.
pub trait Witness {
    /// A frame was on the bus.
    fn frame(&mut self, _: &Delivery) {}
    /// The controller has done a cycle; seen in the middle of it.
    fn cycle(&mut self, cell: &Cell, controller: &Node, inputs: &Inputs<AXES>, outputs: &Outputs<AXES>);
    /// The nozzle tip against the true seam, for the recording: nominal arc length, lateral and height, m.
    fn deviation(&self, cell: &Cell) -> (f64, f64, f64);
}

/// A job that is to be run.
pub struct Job<'a> {
    /// The verb.
    pub name: &'static str,
    /// The cell.
    pub options: &'a Options,
    /// What the controller is told, and the true part.
    pub setup: &'a Setup,
    /// The seed of everything that is left to chance.
    pub seed: u64,
    /// Length of the seam, m.
    pub length: f64,
    /// Time that it may take besides following the seam, s.
    pub besides: f64,
}

/// A job that was run.
pub struct Ended {
    /// The cell as it was left.
    pub cell: Cell,
    /// The controller likewise.
    pub controller: Node,
    /// How it ran; without what the board measured of itself, which it tells when the controller is let go.
    pub run: Run,
}

/// Runs `job` by `controller`, until it is over and the arm without power, or its time is.
pub fn run(
    job: &Job,
    model: &Model,
    mut controller: Node,
    company: Company,
    witness: &mut dyn Witness,
) -> anyhow::Result<Ended> {
    let Job {
        options, setup, seed, ..
    } = *job;
    let Company {
        mut recording,
        progress,
        upset,
    } = company;
    let mut cell = Cell::new(options, model, setup, seed);
    cell.wire(options, setup)?;
    let parameters = bytes_of(&setup.params);
    if let Some(recording) = recording.as_deref_mut() {
        recording.begin(job.name, options, seed, &parameters)?;
        recording.settings(options, setup);
    }
    let mut hash = RunHash::new(&parameters);
    let patience = PATIENCE + job.besides + SLOW * (job.length + 0.2) / options.speed;
    let (mut station, mut cycles) = (0.0, 0);
    while !is_over(&cell, &controller) && (cycles as f64) < patience / f64::from(PERIOD) {
        upset(cycles, station, &mut cell);
        cell.press(controller.state().safety());
        cell.start_cycle(options.error_frames);
        controller.sync(&mut |frame| cell.send(frame))?;
        for tick in 1..=TICKS {
            listen(&mut cell, &mut controller, witness, recording.as_deref_mut())?;
            cell.nodes.camera.check()?;
            if tick == STEP_PHASE {
                let (inputs, outputs) = controller.cycle(&mut |frame| cell.send(frame))?;
                hash.take(&inputs);
                hash.take(&outputs);
                witness.cycle(&cell, &controller, &inputs, &outputs);
                if let Some(recording) = recording.as_deref_mut() {
                    let deviation = witness.deviation(&cell);
                    recording
                        .cycle(&cell, &controller, &inputs, &outputs, deviation)
                        .context("log")?;
                }
                station = f64::from(outputs.station_um) * 1e-6;
                progress((station / job.length).clamp(0.0, 1.0));
            }
        }
        cycles += 1;
    }
    let run = Run::of(seed, &cell, &controller, cycles, hash.value());
    Ok(Ended { cell, controller, run })
}

/// A tick of the cell, with all that is on the bus in it.
fn listen(
    cell: &mut Cell,
    controller: &mut Node,
    witness: &mut dyn Witness,
    mut recording: Option<&mut Recording>,
) -> anyhow::Result<()> {
    let mut heard = Ok(());
    cell.run_tick(controller, &mut |delivery| {
        witness.frame(delivery);
        if let Some(recording) = recording.as_deref_mut().filter(|_| heard.is_ok()) {
            heard = recording.frame(delivery).context("candump");
        }
    });
    heard
}

fn is_over(cell: &Cell, controller: &Node) -> bool {
    let state = controller.state();
    match state.safety() {
        State::Faulted => cell.at_rest(),
        // Latched by the E-stop, and not for want of a first reset.
        State::EStop => state.trip().fault == Fault::EStop && cell.at_rest(),
        State::NotArmed => state.phase() == Phase::Done && cell.powered_down(),
        _ => false,
    }
}
