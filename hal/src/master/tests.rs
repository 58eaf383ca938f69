//! The master alone: mailboxes, ages, what is said once. With nodes on a bus it is tested in the simulator.

use super::*;
use crate::canopen::emcy::Emergency;
use crate::cia402::Mode;
use crate::process::PowerRequest;
use std::string::ToString;
use std::vec::Vec;

extern crate std;

const DRIVE: DriveConfig = DriveConfig {
    vendor_product: [0, 1],
    rated_torque_mnm: 955,
    encoder_counts: 131_072,
    gear: [1, 1],
    max_torque: 3000,
    max_speed_rpm: 4500,
    position_limits: [-1000, 1000],
    quick_stop: 1,
    following_window: 0,
    following_time_ms: 0,
};

fn config() -> MasterConfig<2> {
    MasterConfig::new(Mode::Velocity, [DRIVE; 2])
}

fn sync(master: &mut Master<2>) -> Vec<Frame> {
    let mut sent = Vec::new();
    master.sync(&mut |frame| sent.push(frame));
    sent
}

fn outputs(master: &mut Master<2>) -> Vec<Frame> {
    let mut sent = Vec::new();
    master.outputs(&Outputs::default(), &mut |frame| sent.push(frame));
    sent
}

fn image<const N: usize>(master: &mut Master<N>) -> Inputs<N> {
    *master.inputs(0)
}

#[test]
fn every_cycle_opens_with_a_counted_sync_and_ages_all_that_is_known() {
    let mut master = Master::new(&config()).unwrap();
    assert_eq!(sync(&mut master), [Frame::of(0x080, [1])]);
    assert_eq!(image(&mut master).axes[0].age, NEVER);
    master.receive(&Frame::of(0x182, [0x27, 0x12, 1, 0, 0, 0, 5, 0]));
    for age in 0..=254u8 {
        let inputs = image(&mut master);
        assert_eq!((inputs.axes[0].age, inputs.axes[1].age), (NEVER, age));
        assert_eq!(
            (
                inputs.axes[1].statusword,
                inputs.axes[1].position,
                inputs.axes[1].torque
            ),
            (0x1227, 1, 5)
        );
        sync(&mut master);
    }
    assert_eq!(image(&mut master).axes[1].age, 254, "old is not never");
}

#[test]
fn of_two_frames_of_a_kind_the_newest_wins() {
    let mut master = Master::new(&config()).unwrap();
    sync(&mut master);
    for position in 1..=9 {
        master.receive(&Frame::of(0x181, [0x27, 0, position, 0, 0, 0, 0, 0]));
    }
    assert_eq!(image(&mut master).axes[0].position, 9);
}

#[test]
fn of_several_failures_in_a_cycle_the_first_is_said_and_only_once() {
    let mut master = Master::new(&config()).unwrap();
    for (node, code) in [(2, 0x2310), (1, 0x4310)] {
        master.receive(&Frame::of(0x080 + node, Emergency::new(code).encode()));
    }
    let inputs = image(&mut master);
    assert_eq!((inputs.emergency_node, inputs.emergency_code), (2, 0x2310));
    assert_eq!(image(&mut master).emergency_node, 0);
    assert_eq!(master.last_failure().unwrap().to_string(), "node 1: too hot (0x4310)");
    master.receive(&Frame::of(0x081, Emergency::new(0).encode()));
    assert_eq!(image(&mut master).emergency_node, 0, "all is well again: no emergency");
}

#[test]
fn frames_of_wrong_length_or_unknown_nodes_change_nothing() {
    let mut master = Master::new(&config()).unwrap();
    let before = image(&mut master);
    for cob in 0..=0x7FF {
        for len in [0, 1, 3, 7] {
            // Emergencies of eight bytes and heartbeats of known nodes mean something; these do not.
            if cob & 0x780 != 0x700 && cob != 0x180 + 33 {
                master.receive(&Frame::data(cob, &[0x55; 8][..len]).unwrap());
            }
        }
    }
    let after = image(&mut master);
    // But a TPDO1 of a drive that is too short is reported, and TPDO2 is seven bytes.
    assert_eq!((after.emergency_node, after.emergency_code), (1, code::PDO_LENGTH));
    assert_eq!(after.axes[0].age, before.axes[0].age);
    assert_eq!(after.sighting, None);
}

#[test]
fn no_drive_gets_a_command_before_it_is_set_up_and_one_reset_goes_in_a_cycle() {
    let mut master = Master::new(&config()).unwrap();
    let mut resets = Vec::new();
    for _ in 0..10 {
        sync(&mut master);
        let sent = outputs(&mut master);
        assert!(
            sent.iter()
                .all(|frame| !matches!(Service::of(frame.cob()), Some(Service::Rpdo(..))))
        );
        let nmt: Vec<u8> = sent.iter().filter(|f| f.cob() == 0).map(|f| f.bytes()[1]).collect();
        assert!(nmt.len() <= 1);
        resets.extend(nmt);
    }
    resets.sort();
    assert_eq!(resets, [1, 2, 32, 33]);
}

#[test]
fn a_drive_is_asked_and_told_54_things_and_the_mode_in_force_last() {
    let config = config();
    let steps = |node| (0..).map_while(move |at| script::step(&config, node, at));
    assert_eq!([1, 2, 32, 33].map(|node| steps(node).count()), [54, 54, 53, 19]);
    assert_eq!(
        steps(2).last(),
        Some(script::Step::Check {
            object: crate::canopen::object::at(0x6061, 0),
            mask: u32::MAX,
            expected: 9,
            reason: reason::MODE,
        })
    );
    assert_eq!(script::step(&config, 3, 0), None, "no such node");
}

#[test]
fn a_configuration_out_of_range_names_field_value_and_range() {
    let refuse = |change: &dyn Fn(&mut MasterConfig<2>)| {
        let mut config = config();
        change(&mut config);
        Master::new(&config).err().unwrap().to_string()
    };
    assert_eq!(
        refuse(&|config| config.cycle_us = 500),
        "bus configuration: cycle_us is 500, allowed 1000..=100000"
    );
    assert_eq!(
        refuse(&|config| config.camera_node = 2),
        "bus configuration: camera_node is 2, allowed 3..=127"
    );
    assert!(refuse(&|config| config.drives[1].rated_torque_mnm = 0).contains("rated_torque_mnm is 0"));
    assert!(refuse(&|config| config.io_node = config.camera_node).contains("distinct nodes"));
}

#[test]
fn requests_of_the_core_reach_no_drive_that_is_not_operational() {
    let mut master = Master::new(&config()).unwrap();
    let mut wish = Outputs::default();
    wish.axes[0].request = PowerRequest::Enable;
    wish.axes[0].velocity = 1000;
    sync(&mut master);
    master.receive(&Frame::of(0x181, [0x27, 0x12, 0, 0, 0, 0, 0, 0]));
    master.outputs(&wish, &mut |frame| assert_ne!(frame.cob(), 0x201));
}
