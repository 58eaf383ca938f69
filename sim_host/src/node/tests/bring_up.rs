//! From power-on to operation enabled, and what keeps a node from it.

use super::*;
use crate::node::drive::Drive;
use hal::master::reason;

#[test]
fn the_bus_comes_up_within_a_second_and_six_drives_arm_within_ten_cycles_and_stay() {
    for mode in [Mode::Velocity, Mode::Torque] {
        let mut cell = Cell::new(mode);
        let (up, armed) = cell.arm();
        assert!(up <= 200, "{up} cycles");
        assert!(armed <= 10, "{armed} cycles");
        for _ in 0..400 {
            let inputs = cell.cycle(|_| all(PowerRequest::Enable, 0));
            assert!(enabled(&inputs) && inputs.bus_ready);
            assert_eq!(inputs.emergency_node, 0);
            assert!(inputs.axes.iter().all(|axis| axis.age == 0 && axis.mode == mode.code()));
            assert_eq!((inputs.io_age, inputs.digital), (0, digital::ESTOP_CLOSED));
        }
    }
}

#[test]
fn a_master_that_starts_late_or_again_takes_over_nodes_that_are_already_up() {
    let mut cell = Cell::new(Mode::Velocity);
    cell.arm();
    cell.master = Master::new(&config(Mode::Torque)).unwrap();
    let (up, armed) = cell.arm();
    assert!(up <= 200 && armed <= 10, "{up}, {armed} cycles");
}

/// Runs a cell whose configuration was changed, and tells what the master first said.
fn refusal(change: impl FnOnce(&mut MasterConfig<AXES>)) -> (u8, u16, String) {
    let mut config = config(Mode::Velocity);
    change(&mut config);
    let mut cell = Cell::with(config, CameraTiming::default());
    for _ in 0..100 {
        let inputs = cell.cycle(|_| Outputs::default());
        assert!(!inputs.bus_ready);
        if inputs.emergency_node != 0 {
            let line = cell.master.last_failure().unwrap().to_string();
            assert!(!cell.cycles(200, &Outputs::default()).bus_ready, "refused for good");
            return (inputs.emergency_node, inputs.emergency_code, line);
        }
    }
    panic!("nothing was refused");
}

#[test]
fn a_drive_that_is_not_the_one_expected_is_refused_with_its_number_and_a_line() {
    let (node, code, line) = refusal(|config| config.drives[3].rated_torque_mnm = 640);
    assert_eq!((node, code), (4, reason::RATED_TORQUE));
    assert_eq!(
        line,
        "node 4: unexpected rated torque (0xFF14), object 0x6076:0, 0x0000009F"
    );
    assert_eq!(
        refusal(|config| config.drives[0].encoder_counts = 8192).1,
        reason::ENCODER
    );
    assert_eq!(
        refusal(|config| config.drives[0].vendor_product = [0x5F, 1]).1,
        reason::VENDOR
    );
    assert_eq!(refusal(|config| config.drives[5].gear = [50, 1]).1, reason::GEAR);
}

#[test]
fn a_drive_that_is_gone_is_reported_once_by_its_silence_and_once_for_not_coming_back() {
    let mut cell = Cell::new(Mode::Velocity);
    cell.nodes.drives[2] = Drive::new(99, data(2));
    let codes: Vec<_> = (0..400)
        .map(|_| cell.cycle(|_| Outputs::default()))
        .filter(|inputs| inputs.emergency_node != 0)
        .map(|inputs| (inputs.emergency_node, inputs.emergency_code))
        .collect();
    // Its boot-up message was still under way when it left.
    assert_eq!(codes, [(3, reason::SDO_TIMEOUT), (3, reason::NO_BOOT_UP)]);
}

#[test]
fn a_drive_whose_logic_reboots_is_reported_and_brought_up_again() {
    let mut cell = Cell::new(Mode::Velocity);
    cell.arm();
    let Cell { bus, nodes, .. } = &mut cell;
    nodes.drives[1].power_on(&mut |frame| bus.send(1, frame));
    let inputs = cell.cycle(|_| all(PowerRequest::Enable, 0));
    assert_eq!(
        (inputs.emergency_node, inputs.emergency_code, inputs.bus_ready),
        (2, reason::REBOOTED, false)
    );
    let (up, armed) = cell.arm();
    assert!(up <= 200 && armed <= 10, "{up}, {armed} cycles");
}
