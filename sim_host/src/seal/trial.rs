//! One sealing trial: the controller and the cell in lock step, scored from the truth.
//!
//! Time is counted in cycles of 5 ms, each in 20 ticks of 0.25 ms. In a tick the bus delivers what ends in it, then drives and arm move on. The controller is
//! called as a board would call it: the SYNC at the cycle's start, frames as they come, the cycle half a period later. It is
//! wired to the bus alone.

use super::cell::{Cell, TICKS, camera_params};
use super::recording::Recording;
use super::scenario::Options;
use super::score::TrialScore;
use super::setup::Setup;
use super::watch::Watch;
use crate::log::{RunHash, bytes_of};
use crate::model::{AXES, Model};
use crate::target::camera::TargetCamera;
use crate::target::node::{Node, On};
use crate::target::{image, region};
use anyhow::Context;
use firmware::fault::Fault;
use firmware::job::seal::Phase;
use firmware::safety::State;
use hal::process::Outputs;

/// Tick after which the controller computes: 2.5 ms after the SYNC.
pub const STEP_PHASE: u32 = TICKS / 2;
/// Cycles beyond the path's own time that a trial may take, for arming and the way there and back: 20 s.
const PATIENCE: u64 = 4000;

/// Who looks on, and who interferes.
pub struct Company<'a> {
    /// Keeps everything for people and other tools.
    pub recording: Option<&'a mut Recording>,
    /// Is told how far along the seam the nozzle is, 0 to 1.
    pub progress: &'a dyn Fn(f64),
    /// Is called at the beginning of each cycle, with its number and the nozzle's station (m): breaks what it likes.
    pub upset: &'a mut dyn FnMut(u64, f64, &mut Cell),
}

/// Runs the trial that `seed` draws.
pub fn run(options: &Options, model: &Model, seed: u64, company: Company) -> anyhow::Result<TrialScore> {
    let node = |setup: &Setup| Node::new(options.on, &setup.master, setup.params.clone());
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
    if options.on == On::Qemu {
        let board = TargetCamera::start(&image::find("camera")?, &camera_params(options, &setup))?;
        cell.nodes.camera.move_to(board)?;
    }
    let mut watch = Watch::new(&setup, seed);
    let parameters = bytes_of(&setup.params);
    let mut hash = RunHash::new(&parameters);
    if let Some(recording) = recording.as_deref_mut() {
        recording.begin(options, seed, &parameters)?;
        let bodies = [
            ("controller", region::of_controller(&setup.master, &setup.params)),
            ("camera", bytes_of(&camera_params(options, &setup))),
        ];
        for (image, body) in bodies {
            recording.parameters(image, &region::with_head(&body))?;
        }
    }
    let length = f64::from(setup.params.seal.path.length());
    let patience = PATIENCE + (1.5 * (length + 0.2) / options.speed / 0.005) as u64;

    let mut station = 0.0;
    for cycle in 0..patience {
        upset(cycle, station, &mut cell);
        cell.press(controller.state().safety());
        cell.start_cycle(options.error_frames);
        controller.sync(&mut |frame| cell.send(frame))?;
        for tick in 1..=TICKS {
            let mut written = Ok(());
            cell.run_tick(&mut controller, &mut |delivery| {
                if let (Some(recording), Ok(())) = (recording.as_deref_mut(), &written) {
                    written = recording.frame(delivery);
                }
            });
            written.context("candump")?;
            cell.nodes.camera.check()?;
            if tick == STEP_PHASE {
                let (inputs, outputs) = controller.cycle(&mut |frame| cell.send(frame))?;
                after(&controller, &outputs);
                hash.take(&inputs);
                hash.take(&outputs);
                watch.cycle(&cell, &controller, &inputs, &outputs);
                if let Some(recording) = recording.as_deref_mut() {
                    recording
                        .cycle(&cell, &controller, &inputs, &outputs, watch.deviation())
                        .context("log")?;
                }
                station = f64::from(outputs.station_um) * 1e-6;
                progress((station / length).clamp(0.0, 1.0));
            }
        }
        let state = controller.state();
        let over = match state.safety() {
            State::Faulted => cell.at_rest(),
            // Latched by the E-stop, and not for want of a first reset.
            State::EStop => state.trip().fault == Fault::EStop && cell.at_rest(),
            State::NotArmed => state.phase() == Phase::Done && cell.powered_down(),
            _ => false,
        };
        if over {
            break;
        }
    }
    let mut score = watch.score(&cell, &controller, hash.value());
    score.instruments = controller.finish()?;
    Ok(score)
}
