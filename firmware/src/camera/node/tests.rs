//! The node between a master's frames and a vision that takes its time.

use super::*;
use hal::camera::{COMMAND, RPDO1, place_map};
use hal::canopen::pdo::{ACYCLIC, INVALID, Mapped};
use hal::process::Look;
use std::vec::Vec;

extern crate std;

const NODE: u8 = 0x20;

struct Rig {
    node: CameraNode,
    sync: u8,
}

impl Rig {
    /// Operational, RPDO1 and TPDO1 mapped.
    fn new(timing: Timing) -> Self {
        let mut rig = Self {
            node: CameraNode::new(NODE, timing),
            sync: 0,
        };
        let mut boot = Vec::new();
        rig.node.power_on(&mut |frame| boot.push(frame));
        assert_eq!(boot, [Frame::of(cob::heartbeat(NODE), [0])]);
        rig.map([0x1400, 0x1600], cob::rpdo(1, NODE), 1, &RPDO1);
        rig.map([0x1800, 0x1A00], cob::tpdo(1, NODE), ACYCLIC, &place_map(0));
        rig.node.receive(&Frame::of(cob::NMT, [1, NODE]), &mut |_| {});
        rig
    }

    /// Sets a PDO up, at the indices of its communication and mapping records.
    fn map(&mut self, [record, mapping]: [u16; 2], cob: u16, transmission: u8, map: &[Mapped]) {
        self.write(record, 1, 4, u32::from(cob) | INVALID);
        self.write(record, 2, 1, u32::from(transmission));
        self.write(mapping, 0, 1, 0);
        for (sub, entry) in (1..).zip(map) {
            self.write(mapping, sub, 4, entry.encode());
        }
        self.write(mapping, 0, 1, map.len() as u32);
        self.write(record, 1, 4, u32::from(cob));
    }

    /// Expedited download of `bytes` bytes; the node must accept it.
    fn write(&mut self, index: u16, sub: u8, bytes: u8, value: u32) {
        let [low, high] = index.to_le_bytes();
        let [a, b, c, d] = value.to_le_bytes();
        let request = [0x23 | (4 - bytes) << 2, low, high, sub, a, b, c, d];
        let mut answer = Vec::new();
        self.node
            .receive(&Frame::of(cob::sdo_request(NODE), request), &mut |frame| {
                answer.push(frame)
            });
        assert_eq!(answer[0].bytes()[0], 0x60, "0x{index:04X} sub {sub}: {:?}", answer[0]);
    }

    /// One SYNC; the exposure it triggers and the stamps of the sightings that go with it, with their refusals.
    fn sync(&mut self) -> (Option<Exposure>, Vec<(u8, u8)>) {
        self.sync += 1;
        let mut sent = Vec::new();
        let exposure = self.node.receive(&Frame::of(cob::SYNC, [self.sync]), &mut |frame| {
            assert_eq!(frame.cob(), cob::tpdo(1, NODE));
            sent.push((frame.bytes()[0], frame.bytes()[1]));
        });
        (exposure, sent)
    }

    /// Commands an exposure at the next SYNC, and runs it.
    fn expose(&mut self) -> Option<Exposure> {
        self.expose_for(Look::Seam)
    }

    fn expose_for(&mut self, look: Look) -> Option<Exposure> {
        let command = hal::camera::encode_command(self.sync + 1, look);
        self.node.receive(&Frame::of(cob::rpdo(1, NODE), command), &mut |_| {});
        self.sync().0
    }

    fn see(&mut self, stamp: u8) {
        self.node.hand_back(Sighting {
            stamp,
            ..Sighting::default()
        });
    }
}

fn timing(latency_cycles: u8, retries: u8) -> Timing {
    Timing {
        latency_cycles,
        grey_latency_cycles: 2 * latency_cycles,
        vision_cycles: latency_cycles / 2,
        retries,
    }
}

#[test]
fn a_sighting_that_is_in_time_goes_with_the_sync_it_is_due_at() {
    let mut rig = Rig::new(timing(4, 0));
    let exposure = rig.expose().unwrap();
    assert_eq!((exposure.stamp, exposure.look), (1, Look::Seam));
    assert_eq!(rig.node.read_out(true), Some(exposure));
    rig.see(1);
    let sent: Vec<_> = (2..=6).map(|_| rig.sync().1).collect();
    assert_eq!(sent, [[].as_slice(), &[], &[], &[(1, 0)], &[]]);
}

#[test]
fn an_image_waits_for_the_one_before_it_only_as_long_as_the_processor_is_busy_with_that() {
    // 4 cycles are 2 of read-out and 2 of vision: a second image two cycles later loses nothing, one a cycle later one cycle.
    for (apart, due) in [(2, 7), (1, 7)] {
        let mut rig = Rig::new(timing(4, 0));
        rig.expose().unwrap();
        rig.node.read_out(true).unwrap();
        rig.see(1);
        (1..apart).for_each(|_| drop(rig.sync()));
        let second = rig.expose().unwrap().stamp;
        rig.node.read_out(true).unwrap();
        rig.see(second);
        while rig.sync().1 != [(second, 0)] {}
        assert_eq!(rig.sync, due, "{apart} apart");
    }
}

#[test]
fn a_late_sighting_goes_with_the_first_sync_after_it_and_keeps_its_stamp() {
    let mut rig = Rig::new(timing(2, 0));
    rig.expose().unwrap();
    rig.node.read_out(true);
    for _ in 2..=7 {
        assert_eq!(rig.sync().1, []);
    }
    rig.see(1);
    assert_eq!(rig.sync().1, [(1, 0)]);
    assert_eq!(rig.sync().1, []);
}

#[test]
fn of_two_late_sightings_the_older_goes_first() {
    let mut rig = Rig::new(timing(2, 0));
    // A first image frees the first place again, so that places and ages are not in the same order.
    rig.expose().unwrap();
    rig.node.read_out(true);
    rig.expose().unwrap();
    rig.node.read_out(true);
    rig.see(1);
    assert_eq!(rig.sync().1, [(1, 0)]);
    rig.expose().unwrap();
    rig.node.read_out(true);
    for _ in 0..10 {
        assert_eq!(rig.sync().1, []);
    }
    rig.see(4);
    rig.see(2);
    assert_eq!([rig.sync().1, rig.sync().1], [[(2, 0)], [(4, 0)]]);
}

#[test]
fn no_exposure_is_taken_while_the_sensor_is_read_out_or_two_images_are_under_way() {
    let mut rig = Rig::new(timing(4, 0));
    assert!(rig.expose().is_some());
    assert!(rig.expose().is_none(), "the sensor is still read out");
    rig.node.read_out(true);
    assert!(rig.expose().is_some());
    rig.node.read_out(true);
    assert!(rig.expose().is_none(), "two are under way");
}

#[test]
fn a_lost_image_is_taken_again_until_the_node_gives_up_and_says_so() {
    let mut rig = Rig::new(timing(4, 2));
    assert_eq!(rig.expose().map(|exposure| exposure.stamp), Some(1));
    assert_eq!(rig.node.read_out(false), None);
    for stamp in [2, 3] {
        assert_eq!(rig.sync().0.map(|exposure| exposure.stamp), Some(stamp));
        assert_eq!(rig.node.read_out(false), None);
    }
    let sent: Vec<_> = (4..=8).flat_map(|_| rig.sync().1).collect();
    assert_eq!(sent, [(3, NO_IMAGE)]);
}

#[test]
fn it_hears_what_is_for_it_and_nothing_else() {
    let rig = Rig::new(timing(4, 0));
    for id in [cob::NMT, cob::SYNC, cob::sdo_request(NODE), cob::rpdo(1, NODE)] {
        assert!(rig.node.hears(id), "0x{id:03X}");
    }
    for id in [cob::tpdo(1, 1), cob::sdo_request(1), cob::rpdo(1, 1), COMMAND] {
        assert!(!rig.node.hears(id), "0x{id:03X}");
    }
}

#[test]
fn an_image_of_the_start_is_taken_only_while_no_other_is_under_way() {
    let mut rig = Rig::new(timing(3, 0));
    let first = rig.expose_for(Look::StartGrey).unwrap();
    rig.node.read_out(true).unwrap();
    assert_eq!(rig.expose_for(Look::StartSlit), None);
    // A smaller one has a memory of its own.
    let second = rig.expose_for(Look::Seam).unwrap();
    rig.node.read_out(true).unwrap();
    rig.see(first.stamp);
    // A seam's image would be due at the next SYNC; that of the start has twice the time.
    assert!((0..3).all(|_| rig.sync().1.is_empty()));
    assert_eq!(rig.sync().1, [(first.stamp, 0)]);
    assert_eq!(rig.expose_for(Look::StartGrey), None);
    rig.see(second.stamp);
    while !rig.sync().1.contains(&(second.stamp, 0)) {}
    assert!(rig.expose_for(Look::StartGrey).is_some());
}
