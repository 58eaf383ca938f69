//! When frames come, and how busy the bus is.

use super::*;
use hal::canopen::cob::{self, Service};
use hal::process::AxisOutput;

/// Outputs as in a seam: all axes move, torques and flow change each cycle, the camera exposes every 20 cycles.
fn seam(k: u32, sync: u8) -> Outputs<AXES> {
    let wave = |amplitude: f64, phase: f64| (amplitude * (k as f64 * 0.02 + phase).sin()) as i32;
    Outputs {
        axes: std::array::from_fn(|axis| AxisOutput {
            request: PowerRequest::Enable,
            velocity: wave(3.0e6, axis as f64),
            torque: wave(300.0, axis as f64 * 0.7) as i16,
        }),
        exposure: sync.div_ceil(20) * 20,
        look: Look::Seam,
        flow: (900 + wave(99.0, 0.3)) as u16,
        lamp: 2,
        ..Outputs::default()
    }
}

#[test]
fn with_six_axes_in_a_seam_no_cycle_s_load_is_over_45_percent() {
    for (mode, bar) in [(Mode::Velocity, 0.45), (Mode::Torque, 0.40)] {
        let mut cell = Cell::new(mode);
        cell.arm();
        let set_up = cell.bus.load().max();
        println!("set-up: max {set_up:.3}");
        cell.bus.restart_load();
        let mut sightings = 0;
        for k in 0..2000 {
            let inputs = cell.cycle(|inputs| seam(k, inputs.sync));
            assert!(enabled(&inputs), "cycle {k}: {inputs:?}");
            sightings += u32::from(inputs.sighting.is_some());
        }
        let load = cell.bus.load();
        let (mean, max) = (load.mean(cell.t_ns), load.max());
        println!("{mode:?}: mean {mean:.3}, max {max:.3}, {} frames in 10 s", load.frames);
        assert!(max <= bar, "{max}");
        assert!(mean > 0.6 * max, "{mean}");
        assert!(sightings >= 98);
    }
}

/// Time from each SYNC's due time to the frames of its cycle that `wanted` picks, µs.
fn arrivals(cell: &Cell, from_ns: u64, wanted: impl Fn(Service) -> bool) -> impl Iterator<Item = u64> {
    cell.trace
        .iter()
        .filter(move |delivery| delivery.t_ns >= from_ns && Service::of(delivery.frame.cob()).is_some_and(&wanted))
        .map(|delivery| delivery.t_ns % CYCLE_NS / 1000)
}

#[test]
fn three_error_frames_in_a_cycle_make_no_tpdo_miss_the_step_and_no_rpdo_the_next_sync() {
    let mut cell = Cell::new(Mode::Velocity);
    cell.arm();
    let from_ns = cell.t_ns;
    for k in 0..1000 {
        cell.bus.disturb(3);
        let inputs = cell.cycle(|inputs| seam(k, inputs.sync));
        assert!(
            inputs.axes.iter().all(|axis| axis.age == 0),
            "cycle {k}: a TPDO1 came late"
        );
        assert!(enabled(&inputs));
    }
    assert_eq!(cell.bus.load().errors, 3000);
    let tpdo = arrivals(&cell, from_ns, |s| matches!(s, Service::Tpdo(..)))
        .max()
        .unwrap();
    let rpdo = arrivals(&cell, from_ns, |s| matches!(s, Service::Rpdo(..)))
        .max()
        .unwrap();
    println!("last TPDO {tpdo} µs, last RPDO {rpdo} µs after SYNC");
    assert!(tpdo < 2500, "{tpdo} µs");
    assert!(rpdo < 5000 - 135, "{rpdo} µs");
}

#[test]
fn once_up_nothing_but_sync_is_sent_in_the_guard_before_it() {
    let mut cell = Cell::new(Mode::Velocity);
    cell.arm();
    let from_ns = cell.t_ns;
    for k in 0..1000 {
        cell.cycle(|inputs| seam(k, inputs.sync));
    }
    let last = arrivals(&cell, from_ns, |s| s != Service::Sync).max().unwrap();
    assert!(last < 5000 - 135, "{last} µs");
    let latest_sync = arrivals(&cell, from_ns, |s| s == Service::Sync).max().unwrap();
    assert!(latest_sync <= 65, "SYNC is on the bus at once: {latest_sync} µs");
}

#[test]
fn the_second_tpdos_are_spread_over_four_cycles() {
    let mut cell = Cell::new(Mode::Velocity);
    cell.arm();
    let from = cell.trace.len();
    cell.cycles(400, &all(PowerRequest::Enable, 0));
    let mut count = 0;
    let mut nodes_of_slot = [const { Vec::new() }; 4];
    for delivery in &cell.trace[from..] {
        match Service::of(delivery.frame.cob()) {
            Some(Service::Sync) => count = delivery.frame.bytes()[0],
            Some(Service::Tpdo(2, node @ 1..=6)) => nodes_of_slot[count as usize % 4].push(node),
            _ => {}
        }
    }
    for (nodes, of_slot) in nodes_of_slot.iter().zip([vec![4], vec![1, 5], vec![2, 6], vec![3]]) {
        assert_eq!(nodes, &of_slot.repeat(100));
    }
}

#[test]
fn of_commands_sent_in_one_cycle_only_the_newest_reaches_the_drive() {
    let mut cell = Cell::new(Mode::Velocity);
    cell.arm();
    let Cell { bus, master, .. } = &mut cell;
    for velocity in [1, 2, 3] {
        master.outputs(&all(PowerRequest::Enable, velocity), &mut |frame| {
            bus.send(Nodes::<AXES>::CONTROLLER, frame)
        });
    }
    let from = cell.trace.len();
    cell.run_until(cell.t_ns + STEP_NS);
    let sent: Vec<u8> = cell.trace[from..]
        .iter()
        .filter(|d| d.frame.cob() == cob::rpdo(1, 1))
        .map(|d| d.frame.bytes()[2])
        .collect();
    assert_eq!(sent, [3]);
}
