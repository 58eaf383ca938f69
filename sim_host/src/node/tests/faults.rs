//! What breaks, who notices, and what the drives do.

use super::*;
use hal::canopen::emcy::code;
use hal::cia402::status;
use std::f64::consts::PI;

/// Revolutions per second as counts per second.
fn counts(revolutions: f64) -> i32 {
    (revolutions * crate::node::drive::data::ENCODER_COUNTS as f64) as i32
}

/// Turns all axes at 20 revolutions per second.
fn turning(mode: Mode) -> Cell {
    let mut cell = Cell::new(mode);
    cell.arm();
    if mode == Mode::Velocity {
        cell.cycles(40, &all(PowerRequest::Enable, counts(20.0)));
        assert!(
            cell.rotors
                .iter()
                .all(|(_, speed)| (speed / (2.0 * PI) - 20.0).abs() < 0.1),
            "{:?}",
            cell.rotors
        );
    }
    cell
}

fn first_emergency(cell: &mut Cell, cycles: u32, outputs: &Outputs<AXES>) -> Option<(u8, u16)> {
    (0..cycles)
        .map(|_| cell.cycle(|_| *outputs))
        .find(|inputs| inputs.emergency_node != 0)
        .map(|inputs| (inputs.emergency_node, inputs.emergency_code))
}

#[test]
fn when_the_master_dies_all_drives_quick_stop_on_their_ramp_and_hold() {
    let mut cell = turning(Mode::Velocity);
    cell.alive = false;
    // RPDO timeout 20 ms; from 20 rev/s on a ramp of 20e6 counts/s² (153 rev/s²) to a stand in 131 ms more.
    cell.cycles(5, &Outputs::default());
    assert_eq!(cell.states(), [PowerState::QuickStopActive; AXES]);
    cell.cycles(35, &Outputs::default());
    assert!(
        cell.rotors.iter().all(|(_, speed)| speed.abs() < 0.5),
        "{:?}",
        cell.rotors
    );
    assert_eq!(
        cell.states(),
        [PowerState::QuickStopActive; AXES],
        "they hold: an arm has a weight"
    );
    // Heartbeat lost is said as well, and by every drive.
    let said = |wanted: u16| {
        cell.trace
            .iter()
            .filter(|d| (0x081..=0x086).contains(&d.frame.cob()) && d.frame.bytes()[..2] == wanted.to_le_bytes())
            .count()
    };
    assert_eq!((said(code::RPDO_TIMEOUT), said(code::HEARTBEAT)), (AXES, AXES));
}

#[test]
fn after_a_pause_of_the_master_the_drives_arm_again() {
    let mut cell = turning(Mode::Velocity);
    cell.alive = false;
    cell.cycles(40, &Outputs::default());
    cell.alive = true;
    assert!(!enabled(&cell.cycle(|_| all(PowerRequest::QuickStop, 0))));
    let (up, armed) = cell.arm();
    assert!(up <= 10 && armed <= 10, "{up}, {armed} cycles");
}

#[test]
fn one_lost_command_is_no_fault() {
    let mut cell = turning(Mode::Velocity);
    for _ in 0..20 {
        // The controller misses its step: SYNC goes, commands do not.
        let Cell { bus, master, t_ns, .. } = &mut cell;
        let end = *t_ns + CYCLE_NS;
        master.sync(&mut |frame| bus.send(Nodes::<AXES>::CONTROLLER, frame));
        cell.run_until(end);
        let inputs = cell.cycle(|_| all(PowerRequest::Enable, counts(20.0)));
        assert!(enabled(&inputs));
    }
}

#[test]
fn a_drive_s_fault_reaches_the_controller_and_is_reset_only_when_its_cause_is_gone() {
    let mut cell = turning(Mode::Velocity);
    cell.nodes.drives[4].servo().fail(code::OVER_CURRENT);
    assert_eq!(
        first_emergency(&mut cell, 3, &all(PowerRequest::Enable, 0)),
        Some((5, code::OVER_CURRENT))
    );
    let inputs = cell.cycles(6, &all(PowerRequest::Enable, 0));
    assert_eq!(PowerState::of(inputs.axes[4].statusword), Some(PowerState::Fault));
    assert_eq!(inputs.axes[4].error_code, code::OVER_CURRENT);
    cell.cycles(10, &all(PowerRequest::ResetFault, 0));
    assert_eq!(cell.states()[4], PowerState::Fault, "its cause is there still");
    cell.nodes.drives[4].servo().clear();
    cell.cycles(10, &all(PowerRequest::ResetFault, 0));
    assert_eq!(cell.states()[4], PowerState::Fault, "one edge per request");
    cell.cycles(3, &all(PowerRequest::Off, 0));
    cell.cycles(5, &all(PowerRequest::ResetFault, 0));
    assert_eq!(cell.states(), [PowerState::SwitchOnDisabled; AXES]);
    let (_, armed) = cell.arm();
    assert!(armed <= 10);
}

#[test]
fn an_overheated_drive_stops_on_its_ramp_before_it_lets_go() {
    let mut cell = turning(Mode::Velocity);
    cell.nodes.drives[0].servo().fail(code::OVER_TEMPERATURE);
    cell.cycles(2, &all(PowerRequest::Enable, counts(20.0)));
    assert_eq!(cell.states()[0], PowerState::FaultReaction);
    cell.cycles(40, &all(PowerRequest::Enable, 0));
    assert_eq!((cell.states()[0], cell.rotors[0].1), (PowerState::Fault, 0.0));
}

#[test]
fn cut_motor_power_is_a_fault_that_leaves_the_bus_alive_and_clears_with_power() {
    let mut cell = turning(Mode::Torque);
    for drive in &mut cell.nodes.drives {
        drive.servo().set_voltage(false);
    }
    assert!(matches!(
        first_emergency(&mut cell, 3, &all(PowerRequest::Enable, 0)),
        Some((_, code::UNDER_VOLTAGE))
    ));
    let inputs = cell.cycles(50, &all(PowerRequest::Off, 0));
    assert!(inputs.bus_ready && inputs.axes.iter().all(|axis| axis.age == 0));
    assert!(inputs.axes.iter().all(|axis| axis.statusword & status::VOLTAGE == 0));
    for drive in &mut cell.nodes.drives {
        drive.servo().set_voltage(true);
    }
    cell.cycles(5, &all(PowerRequest::ResetFault, 0));
    let (_, armed) = cell.arm();
    assert!(armed <= 10);
}

#[test]
fn a_silent_drive_is_old_then_lost_and_never_taken_for_disabled() {
    let mut cell = turning(Mode::Velocity);
    // Its bus cable is cut: another drive, deaf and mute, sits in its place.
    cell.nodes.drives[2] = Drive::new(99, data(2));
    let mut ages = Vec::new();
    let mut codes = Vec::new();
    for _ in 0..60 {
        let inputs = cell.cycle(|_| all(PowerRequest::Enable, 0));
        ages.push(inputs.axes[2].age);
        codes.extend((inputs.emergency_node != 0).then_some((inputs.emergency_node, inputs.emergency_code)));
        assert_eq!(
            PowerState::of(inputs.axes[2].statusword),
            Some(PowerState::OperationEnabled),
            "its last word stands"
        );
    }
    assert_eq!(ages[..5], [1, 2, 3, 4, 5]);
    assert_eq!(codes, [(3, code::HEARTBEAT)]);
}

#[test]
fn a_silent_camera_or_io_node_is_old_then_lost() {
    let mut cell = turning(Mode::Velocity);
    cell.nodes.camera = CameraNode::new(98, CameraTiming::default(), Pcg32::new(1, 1));
    cell.nodes.io = IoNode::new(99);
    let inputs = cell.cycles(10, &all(PowerRequest::Enable, 0));
    assert_eq!(inputs.io_age, 10);
    assert!(
        (10..30).contains(&inputs.camera_age),
        "{} cycles: its heartbeat comes every 20",
        inputs.camera_age
    );
    let codes: Vec<_> = (0..60)
        .map(|_| cell.cycle(|_| all(PowerRequest::Enable, 0)))
        .filter(|inputs| inputs.emergency_node != 0)
        .map(|inputs| (inputs.emergency_node, inputs.emergency_code, inputs.bus_ready))
        .collect();
    assert!(
        codes.contains(&(32, code::HEARTBEAT, false)) && codes.contains(&(33, code::HEARTBEAT, false)),
        "{codes:?}"
    );
}

#[test]
fn a_broken_encoder_lets_go_at_once_and_over_speed_is_a_fault() {
    let mut cell = turning(Mode::Velocity);
    cell.nodes.drives[0].servo().fail(code::SENSOR);
    assert_eq!(cell.states()[0], PowerState::Fault);
    cell.cycles(2, &all(PowerRequest::Enable, 0));
    cell.rotors[3].1 = 2.0 * 3600.0 / 60.0 * 2.0 * PI;
    let said = (0..4)
        .map(|_| cell.cycle(|_| all(PowerRequest::Enable, 0)))
        .any(|inputs| inputs.emergency_code == code::OVER_SPEED);
    assert!(said);
}
