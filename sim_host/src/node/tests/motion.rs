//! Commands become motion, one cycle later, within the limits that were set.

use super::*;
use crate::node::drive::data::ENCODER_COUNTS;
use hal::canopen::emcy::code;
use hal::cia402::status;
use std::f64::consts::PI;

const COUNTS_PER_RAD: f64 = ENCODER_COUNTS as f64 / (2.0 * PI);

#[test]
fn positions_are_those_of_the_sync_to_two_counts_at_3000_rpm() {
    let mut cell = Cell::new(Mode::Velocity);
    cell.arm();
    let outputs = all(PowerRequest::Enable, 50 * ENCODER_COUNTS as i32);
    cell.cycles(60, &outputs);
    for _ in 0..100 {
        let start_ns = cell.t_ns;
        let rotors = cell.rotors;
        let from = cell.trace.len();
        let inputs = cell.cycle(|_| outputs);
        let sync = cell.trace[from..].iter().find(|d| d.frame.cob() == 0x080).unwrap();
        for (axis, (angle, speed)) in inputs.axes.iter().zip(rotors) {
            let at_sync = (angle + speed * (sync.t_ns - start_ns) as f64 * 1e-9) * COUNTS_PER_RAD;
            assert!(
                (axis.position as f64 - at_sync).abs() <= 2.0,
                "{} counts",
                axis.position as f64 - at_sync
            );
            assert!((axis.velocity as f64 / COUNTS_PER_RAD - speed).abs() < 0.02 * speed);
        }
    }
}

#[test]
fn a_command_acts_on_the_next_sync_not_before() {
    let mut cell = Cell::new(Mode::Torque);
    cell.arm();
    cell.cycles(20, &all(PowerRequest::Enable, 0));
    let mut push = all(PowerRequest::Enable, 0);
    push.axes[0].torque = 500;
    let before = cell.cycle(|_| push);
    assert_eq!((before.axes[0].torque, cell.rotors[0].1), (0, 0.0));
    let acting = cell.cycle(|_| push);
    assert_eq!(acting.axes[0].torque, 0, "the torque of its SYNC");
    let after = cell.cycle(|_| push);
    assert_eq!(after.axes[0].torque, 500);
    // Two cycles of 0.4775 N·m on 3e-4 kg·m², less the current loop's lag and the 60 µs of the SYNC.
    let speed = cell.rotors[0].1;
    assert!((14.5..15.9).contains(&speed), "{speed} rad/s");
}

#[test]
fn what_is_asked_before_operation_is_enabled_is_not_followed_when_it_is() {
    let mut cell = Cell::new(Mode::Torque);
    while !cell.cycle(|_| Outputs::default()).bus_ready {}
    let mut push = all(PowerRequest::Enable, 0);
    push.axes.iter_mut().for_each(|axis| axis.torque = 900);
    let mut moved_before = false;
    while !enabled(&cell.cycle(|_| push)) {
        moved_before |= cell.rotors.iter().any(|(_, speed)| *speed != 0.0);
    }
    assert!(!moved_before);
    let targets: Vec<i16> = cell
        .trace
        .iter()
        .filter(|d| d.frame.cob() == 0x201 && d.frame.bytes()[0] != 0x0F)
        .map(|d| i16::from_le_bytes([d.frame.bytes()[2], d.frame.bytes()[3]]))
        .collect();
    assert!(!targets.is_empty() && targets.iter().all(|&torque| torque == 0));
}

#[test]
fn torque_and_speed_stay_within_the_limits_that_the_master_set() {
    let mut limited = config(Mode::Velocity);
    limited.drives[0].max_torque = 1500;
    limited.drives[0].max_speed_rpm = 1200;
    let mut cell = Cell::with(limited, CameraTiming::default());
    cell.arm();
    let mut worst = (0i16, 0.0f64, false);
    for _ in 0..60 {
        let inputs = cell.cycle(|_| all(PowerRequest::Enable, 40 * ENCODER_COUNTS as i32));
        let axis = &inputs.axes[0];
        worst.0 = worst.0.max(axis.torque);
        worst.1 = worst.1.max(cell.rotors[0].1);
        worst.2 |= axis.statusword & status::LIMIT != 0;
    }
    assert_eq!(worst.0, 1500);
    let limit = 1200.0 * 2.0 * PI / 60.0;
    // A long rise at the torque limit ends with the speed loop's overshoot.
    assert!(
        (0.99 * limit..1.15 * limit).contains(&worst.1),
        "{} rad/s of {limit}",
        worst.1
    );
    assert!((cell.rotors[0].1 - limit).abs() < 0.01 * limit);
    assert!(worst.2, "the statusword says that a limit acts");
}

#[test]
fn a_position_limit_stops_csv_before_it_and_faults_cst() {
    let limit = 4 * ENCODER_COUNTS as i32;
    for mode in [Mode::Velocity, Mode::Torque] {
        let mut fenced = config(mode);
        fenced.drives[0].position_limits = [-limit, limit];
        let mut cell = Cell::with(fenced, CameraTiming::default());
        cell.arm();
        let mut push = all(PowerRequest::Enable, 20 * ENCODER_COUNTS as i32);
        push.axes
            .iter_mut()
            .for_each(|axis| axis.torque = if mode == Mode::Torque { 200 } else { 0 });
        let mut codes = Vec::new();
        for _ in 0..200 {
            codes.push(cell.cycle(|_| push).emergency_code);
        }
        let counts = cell.rotors[0].0 * COUNTS_PER_RAD;
        match mode {
            Mode::Velocity => assert!((0.98..1.01).contains(&(counts / limit as f64)), "{counts}"),
            Mode::Torque => {
                assert!(codes.contains(&code::POSITION_LIMIT));
                assert_eq!((cell.states()[0], cell.rotors[0].1), (PowerState::Fault, 0.0));
            }
        }
    }
}

#[test]
fn the_brake_is_open_20_ms_after_torque_and_closed_without_it() {
    let mut cell = Cell::new(Mode::Velocity);
    while !cell.cycle(|_| Outputs::default()).bus_ready {}
    let mut open = None;
    let mut enabled_ns = 0;
    let closed = |cell: &Cell| cell.commands[0].brake_closed;
    assert!(closed(&cell));
    for _ in 0..20 {
        cell.cycle(|_| all(PowerRequest::Enable, 0));
        if cell.states()[0] == PowerState::OperationEnabled && enabled_ns == 0 {
            enabled_ns = cell.t_ns;
        }
        if open.is_none() && !closed(&cell) {
            open = Some(cell.t_ns - enabled_ns);
        }
    }
    let open = open.expect("open within 100 ms");
    assert!((15_000_000..=20_000_000).contains(&open), "{open} ns");
    cell.cycles(2, &all(PowerRequest::Off, 0));
    assert!(closed(&cell));
}

#[test]
fn interpolated_velocity_takes_the_steps_out_of_the_torque() {
    // 20 000 counts/s more in each 5 ms are 192 rad/s², 0.0575 N·m. Held, each step is 0.96 rad/s at once.
    let peak = [false, true].map(|interpolate| {
        let mut cell = Cell::new(Mode::Velocity);
        cell.nodes.drives = std::array::from_fn(|k| Drive::new(k as u8 + 1, DriveData { interpolate, ..data(k) }));
        let Cell { bus, nodes, .. } = &mut cell;
        nodes.power_on(bus);
        cell.arm();
        cell.cycles(10, &all(PowerRequest::Enable, 0));
        for k in 0..100 {
            cell.cycle(|_| all(PowerRequest::Enable, k * 20_000));
        }
        cell.peak_torque[0]
    });
    println!("peak torque held and interpolated: {peak:.4?} N·m");
    assert!(peak[0] > 0.085 && peak[1] < 0.075, "{peak:?}");
}
