//! Controller and cell in lock step, whatever the job.
//!
//! Time is counted in cycles of 5 ms, each in 20 ticks of 0.25 ms. In a tick the bus delivers what ends in it, then drives and arm move on. The
//! controller is called as a board would call it: the SYNC at the cycle's start, frames as they come, the cycle half a period later. It is
//! wired to the bus alone.

use super::cell::{Cell, TICKS};
use crate::bus::Delivery;
use crate::model::AXES;
use crate::target::node::Node;
use firmware::fault::Fault;
use firmware::job::seal::Phase;
use firmware::safety::State;
use hal::process::{Inputs, Outputs};

/// Tick after which the controller computes: 2.5 ms after the SYNC.
pub const STEP_PHASE: u32 = TICKS / 2;

/// Who looks on.
pub trait Witness {
    /// A frame was on the bus.
    fn frame(&mut self, delivery: &Delivery) -> anyhow::Result<()>;
    /// The controller has done a cycle; seen in the middle of it.
    fn cycle(
        &mut self,
        cell: &Cell,
        controller: &Node,
        inputs: &Inputs<AXES>,
        outputs: &Outputs<AXES>,
    ) -> anyhow::Result<()>;
}

/// Runs up to `patience` cycles, or until the job is over and the arm without power. `error_frames` are injected in every cycle; `upset` is called at
/// the beginning of each, with its number and the nozzle's station (m), and breaks what it likes.
pub fn run(
    cell: &mut Cell,
    controller: &mut Node,
    patience: u64,
    error_frames: u8,
    upset: &mut dyn FnMut(u64, f64, &mut Cell),
    witness: &mut dyn Witness,
) -> anyhow::Result<()> {
    let mut station = 0.0;
    for cycle in 0..patience {
        upset(cycle, station, cell);
        cell.press(controller.state().safety());
        cell.start_cycle(error_frames);
        controller.sync(&mut |frame| cell.send(frame))?;
        for tick in 1..=TICKS {
            let mut heard = Ok(());
            cell.run_tick(controller, &mut |delivery| {
                if heard.is_ok() {
                    heard = witness.frame(delivery);
                }
            });
            heard?;
            cell.nodes.camera.check()?;
            if tick == STEP_PHASE {
                let (inputs, outputs) = controller.cycle(&mut |frame| cell.send(frame))?;
                witness.cycle(cell, controller, &inputs, &outputs)?;
                station = f64::from(outputs.station_um) * 1e-6;
            }
        }
        if is_over(cell, controller) {
            break;
        }
    }
    Ok(())
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
