//! Exposure, latency, loss and repetition; inputs and outputs of the cell.

use super::*;
use hal::camera::NO_IMAGE;
use hal::canopen::sync;
use hal::io::output;

/// Asks for an exposure every 20 cycles; the sightings, and the SYNC count at which each came.
fn look(cell: &mut Cell, cycles: u32) -> Vec<(u8, Sighting)> {
    let mut seen = Vec::new();
    for _ in 0..cycles {
        let inputs = cell.cycle(|inputs| Outputs {
            exposure: (inputs.sync / 20 % 12 + 1) * 20,
            look: Look::Seam,
            ..Outputs::default()
        });
        seen.extend(inputs.sighting.map(|sighting| (inputs.sync, sighting)));
    }
    seen
}

fn up(loss: f64) -> Cell {
    let mut cell = Cell::with(
        config(Mode::Velocity),
        CameraTiming {
            loss,
            ..CameraTiming::default()
        },
    );
    while !cell.cycle(|_| Outputs::default()).bus_ready {}
    cell
}

#[test]
fn a_sighting_comes_whole_seven_cycles_after_its_exposure_at_the_commanded_count() {
    let mut cell = up(0.0);
    let seen_then = look(&mut cell, 480);
    assert!((23..=24).contains(&seen_then.len()), "{}", seen_then.len());
    for (now, sighting) in seen_then {
        assert_eq!(sighting.stamp % 20, 0);
        assert_eq!(sync::since(sighting.stamp, now), 7);
        assert_eq!(sighting, seen(sighting.stamp, 0));
    }
    assert!(cell.exposures.iter().all(|exposure| exposure.look == Look::Seam));
}

#[test]
fn the_second_slits_sighting_comes_in_the_cycle_after_the_firsts() {
    let mut cell = up(0.0);
    cell.slits = 2;
    let sightings = look(&mut cell, 240);
    assert!((22..=24).contains(&sightings.len()), "{}", sightings.len());
    for pair in sightings.chunks_exact(2) {
        let (now, first) = pair[0];
        assert_eq!(first, seen(first.stamp, 0));
        assert_eq!(pair[1], (sync::next(now), seen(first.stamp, 1)));
    }
}

#[test]
fn a_lost_image_is_taken_again_two_cycles_later_with_the_stamp_of_its_real_exposure() {
    let mut cell = up(0.05);
    let sightings = look(&mut cell, 20 * 500);
    let (taken, lost) = cell.nodes.camera.images();
    println!("{taken} images, {lost} lost");
    assert!((0.03..0.07).contains(&(lost as f64 / taken as f64)));
    assert!((499..=500).contains(&sightings.len()), "{}", sightings.len());
    let again = sightings
        .iter()
        .filter(|(_, sighting)| sighting.stamp % 20 != 0)
        .count();
    assert!(again > 10);
    for (now, sighting) in &sightings {
        assert_eq!((sighting.stamp % 20) % 2, 0);
        assert_eq!(sync::since(sighting.stamp, *now), 7);
    }
}

#[test]
fn a_camera_that_never_gets_an_image_says_so_after_four_tries() {
    let mut cell = up(1.0);
    let sightings = look(&mut cell, 100);
    assert!(cell.exposures.is_empty());
    assert!(!sightings.is_empty());
    assert!(
        sightings
            .iter()
            .all(|(now, s)| s.refusal == NO_IMAGE && s.stamp % 20 == 6 && sync::since(s.stamp, *now) == 7)
    );
}

#[test]
fn lamp_and_flow_follow_the_outputs_and_a_dead_master_closes_the_dispenser() {
    let mut cell = up(0.0);
    let run = Outputs {
        lamp: 2,
        flow: 950,
        ..Outputs::default()
    };
    cell.cycles(2, &run);
    assert_eq!(
        (cell.nodes.io.outputs(), cell.nodes.io.flow()),
        (output::RUNNING | output::VALVE, 950)
    );
    cell.alive = false;
    cell.cycles(15, &run);
    assert_eq!((cell.nodes.io.outputs(), cell.nodes.io.flow()), (output::FAULT, 0));
}

#[test]
fn an_opened_estop_chain_is_seen_in_the_cycle_it_is_read_in() {
    let mut cell = up(0.0);
    assert_eq!(cell.cycles(1, &Outputs::default()).digital, digital::ESTOP_CLOSED);
    cell.nodes.io.set_inputs(digital::START | digital::STOP);
    assert_eq!(
        cell.cycles(1, &Outputs::default()).digital,
        digital::START | digital::STOP
    );
}
