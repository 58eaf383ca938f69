//! Starting again: after a stop on the bead, and after a whole panel, from wherever the arm then stands.

use firmware::fault::Fault;
use firmware::job::phase::Phase;
use firmware::safety::State;
use nalgebra::Vector3;
use sim_host::jitter::lockstep::Lockstep;
use sim_host::model::Model;
use sim_host::seal::scenario::{Options, PathName};

/// Cycles within which a job must be over.
const PATIENCE: u32 = 6000;

fn cell(path: PathName) -> Lockstep {
    let options = Options {
        path,
        ..Options::told()
    };
    Lockstep::new(&options, &Model::k3s(), 3).expect("the cell is set up")
}

#[test]
fn an_arm_that_was_stopped_on_the_bead_first_rises_clear_of_it_then_seals_the_whole_seam() {
    let mut run = cell(PathName::Straight);
    let mut stopped: Option<Vector3<f64>> = None;
    let (mut phases, mut rise) = (Vec::new(), Vector3::zeros());
    let mut bead = Vec::new();
    for _ in 0..PATIENCE {
        let (_, outputs) = run.cycle(None, &mut |_| {}).expect("the cell runs");
        let state = run.node.state();
        let tip = run.cell.plant.T_b_n();
        match stopped {
            None if state.phase() == Phase::Follow && outputs.station_um > 200_000 => run.cell.estop_open = true,
            None => {}
            Some(place) => {
                if state.safety() == State::Running && phases.last() != Some(&state.phase()) {
                    phases.push(state.phase());
                }
                if state.phase() == Phase::Rise {
                    rise = tip.inverse_transform_vector(&(tip.translation.vector - place));
                }
                if run.cell.flow() > 0 {
                    bead.push(run.cell.deviation());
                }
            }
        }
        if run.cell.estop_open && run.cell.at_rest() {
            assert_eq!(state.trip().fault, Fault::EStop);
            run.cell.estop_open = false;
            stopped = Some(tip.translation.vector);
        }
        if run.jobs > 0 {
            break;
        }
    }
    assert_eq!(run.jobs, 1, "phases {phases:?}");
    let expected = [Phase::Rise, Phase::Approach, Phase::Descend, Phase::Follow, Phase::Lift];
    assert_eq!(phases, expected);
    // Up by the clearance of 40 mm, and on the way never aside by more than a joint-space motion bends: 5 mm.
    assert!((rise.z - 0.040).abs() < 0.002, "risen by {rise:?} m");
    assert!(rise.xy().norm() < 0.005, "risen by {rise:?} m");
    let (first, last) = (bead[0].0, bead[bead.len() - 1].0);
    assert!(first < 0.004 && last > 0.496, "bead from {first} to {last} m");
    let aside = bead.iter().map(|(_, lateral, _)| lateral.abs()).fold(0.0, f64::max);
    assert!(aside < 0.5e-3, "{aside} m off the seam");
}

#[test]
fn after_a_whole_panel_which_turns_the_wrist_by_more_than_half_a_turn_the_next_can_be_sealed() {
    let mut run = cell(PathName::Panel);
    for _ in 0..2 * PATIENCE {
        run.cycle(None, &mut |_| {}).expect("the cell runs");
        let trip = run.node.state().trip();
        assert_eq!(trip.fault, Fault::None, "axis {} in cycle {}", trip.place, trip.cycle);
        if run.jobs == 2 {
            return;
        }
    }
    panic!("{} jobs done", run.jobs);
}
