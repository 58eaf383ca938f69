//! The slave by itself, with a small device.

use super::*;
use crate::canopen::object::{Address, at};
use crate::canopen::pdo::{EVENT, INVALID, mapped};
use crate::canopen::sdo::{Abort, Request, Response};
use std::vec::Vec;

extern crate std;

/// A device of one u16 to write and its double to read; it notes what happens to it.
#[derive(Default)]
struct Doubler {
    value: u16,
    latched: u16,
    events: Vec<Event>,
}

impl Device for Doubler {
    fn read(&self, at: Address) -> Result<Value, Abort> {
        match (at.index, at.sub) {
            (0x2000, 0) => Ok(self.value.into()),
            (0x2001, 0) => Ok(self.latched.into()),
            (0x2000 | 0x2001, _) => Err(Abort::NO_SUB),
            _ => Err(Abort::NO_OBJECT),
        }
    }
    fn write(&mut self, at: Address, number: Number) -> Result<(), Abort> {
        match (at.index, at.sub) {
            (0x2000, 0) => self.value = number.try_into()?,
            _ => return Err(self.read(at).err().unwrap_or(Abort::READ_ONLY)),
        }
        Ok(())
    }
    fn sync(&mut self, _count: u8) {
        self.latched = self.value * 2;
    }
    fn event(&mut self, event: Event) {
        self.events.push(event);
    }
}

const NODE: u8 = 5;

struct Rig {
    slave: Slave,
    device: Doubler,
}

impl Rig {
    fn new() -> Self {
        let identity = Identity {
            device_type: 0x0002_0192,
            name: "a doubler of numbers",
            numbers: [1, 2, 3, 4],
        };
        let mut rig = Self {
            slave: Slave::new(NODE, identity),
            device: Doubler::default(),
        };
        let boot = rig.sent(|slave, device, mut tx| slave.boot(device, &mut tx));
        assert_eq!(boot, [Frame::of(0x705, [0x00])]);
        rig
    }

    fn sent(&mut self, act: impl FnOnce(&mut Slave, &mut Doubler, &mut dyn FnMut(Frame))) -> Vec<Frame> {
        let mut frames = Vec::new();
        act(&mut self.slave, &mut self.device, &mut |frame| frames.push(frame));
        frames
    }

    fn give<const L: usize>(&mut self, cob: u16, bytes: [u8; L]) -> Vec<Frame> {
        self.sent(|slave, device, mut tx| {
            slave.receive(&Frame::of(cob, bytes), device, &mut tx);
        })
    }

    fn ask(&mut self, request: Request) -> Response {
        let frames = self.give(cob::sdo_request(NODE), request.encode());
        assert_eq!((frames.len(), frames[0].cob()), (1, cob::sdo_response(NODE)));
        Response::decode(frames[0].bytes().try_into().unwrap()).unwrap()
    }

    fn write(&mut self, index: u16, sub: u8, number: impl Into<Number>) {
        let answer = self.ask(Request::Download(at(index, sub), number.into()));
        assert_eq!(answer, Response::Downloaded(at(index, sub)), "0x{index:04X}:{sub}");
    }

    fn abort(&mut self, request: Request) -> Abort {
        match self.ask(request) {
            Response::Abort(_, abort) => abort,
            other => panic!("{other:?}"),
        }
    }

    /// Maps the device's objects to RPDO1 and TPDO1 of this transmission type and starts the node.
    fn start(&mut self, transmission: u8) {
        for (index, cob, object) in [(0x1400, 0x205u32, 0x2000), (0x1800, 0x185, 0x2001)] {
            self.write(index, 1, INVALID | cob);
            self.write(index, 2, transmission);
            self.write(index + 0x200, 0, 0u8);
            self.write(index + 0x200, 1, mapped(object, 0, 16).encode());
            self.write(index + 0x200, 0, 1u8);
            self.write(index, 1, cob);
        }
        self.give(0x000, [0x01, NODE]);
        assert_eq!(self.slave.state(), NmtState::Operational);
    }

    fn elapse(&mut self, us: u32) -> Vec<Frame> {
        self.sent(|slave, device, mut tx| slave.elapse(us, device, &mut tx))
    }
}

#[test]
fn a_synchronous_command_acts_at_the_sync_and_the_answer_is_latched_after_it() {
    let mut rig = Rig::new();
    rig.start(1);
    assert!(rig.give(0x205, 20u16.to_le_bytes()).is_empty());
    assert!(rig.give(0x205, 21u16.to_le_bytes()).is_empty());
    assert_eq!(rig.device.value, 0, "not before the SYNC");
    assert_eq!(rig.give(0x080, [7]), [Frame::of(0x185, 42u16.to_le_bytes())]);
    assert_eq!((rig.device.value, rig.slave.count()), (21, 7));
}

#[test]
fn an_event_driven_command_acts_at_once_and_its_answer_goes_when_asked_for() {
    let mut rig = Rig::new();
    rig.start(EVENT);
    rig.give(0x205, 20u16.to_le_bytes());
    assert_eq!(rig.device.value, 20);
    assert!(rig.give(0x080, [7]).is_empty());
    assert!(rig.elapse(1).is_empty());
    rig.slave.ask(1);
    assert_eq!(rig.elapse(1), [Frame::of(0x185, 40u16.to_le_bytes())]);
    assert!(rig.elapse(1).is_empty(), "once");
}

#[test]
fn without_operational_no_pdo_is_taken_or_sent() {
    let mut rig = Rig::new();
    rig.start(1);
    rig.give(0x000, [0x80, 0]);
    rig.give(0x205, 20u16.to_le_bytes());
    assert!(rig.give(0x080, [1]).is_empty());
    rig.give(0x000, [0x01, 0]);
    assert_eq!(
        rig.give(0x080, [2]),
        [Frame::of(0x185, [0, 0])],
        "the command of before is forgotten"
    );
}

#[test]
fn a_command_that_is_too_short_is_an_emergency_and_not_taken() {
    let mut rig = Rig::new();
    rig.start(1);
    let frames = rig.give(0x205, [20]);
    assert_eq!(frames, [Frame::of(0x085, Emergency::new(code::PDO_LENGTH).encode())]);
    rig.give(0x080, [1]);
    assert_eq!(rig.device.value, 0);
}

#[test]
fn a_late_command_and_a_lost_master_are_emergencies_and_events() {
    let mut rig = Rig::new();
    rig.write(0x1400, 5, 20u16);
    rig.write(0x1016, 1, 0x7Fu32 << 16 | 60);
    rig.start(1);
    rig.device.events.clear();
    assert!(rig.elapse(1_000_000).is_empty(), "neither was heard yet");
    rig.give(0x205, [0, 0]);
    rig.give(0x77F, [0x05]);
    assert!(rig.elapse(19_999).is_empty());
    assert_eq!(
        rig.elapse(1),
        [Frame::of(0x085, Emergency::new(code::RPDO_TIMEOUT).encode())]
    );
    assert_eq!(
        rig.elapse(40_000),
        [Frame::of(0x085, Emergency::new(code::HEARTBEAT).encode())]
    );
    assert_eq!(rig.device.events, [Event::RpdoLate(1), Event::MasterLost]);
}

#[test]
fn heartbeats_wait_for_the_sync_while_there_is_one() {
    let mut rig = Rig::new();
    rig.write(0x1006, 0, 5000u32);
    rig.write(0x1017, 0, 100u16);
    rig.give(0x080, [1]);
    let mut with_sync = 0;
    for _ in 0..100 {
        assert!(rig.elapse(5000).is_empty());
        with_sync += rig.give(0x080, [1]).len();
    }
    assert_eq!(with_sync, 5, "in 500 ms");
    let alone: usize = (0..100).map(|_| rig.elapse(5000).len()).sum();
    assert_eq!(alone, 5, "in 500 ms without SYNC");
}

#[test]
fn refusals_have_the_codes_of_the_standard() {
    let mut rig = Rig::new();
    let download = |index, sub, number| Request::Download(at(index, sub), number);
    for (request, abort) in [
        (Request::Upload(at(0x2FFF, 0)), Abort::NO_OBJECT),
        (Request::Upload(at(0x2000, 1)), Abort::NO_SUB),
        (Request::Upload(at(0x1018, 5)), Abort::NO_SUB),
        (Request::Upload(at(0x1404, 1)), Abort::NO_OBJECT),
        (download(0x2001, 0, 1u16.into()), Abort::READ_ONLY),
        (download(0x1018, 1, 1u32.into()), Abort::READ_ONLY),
        (download(0x2000, 0, 1u32.into()), Abort::LENGTH),
        (download(0x1017, 0, 1u8.into()), Abort::LENGTH),
        (download(0x1019, 0, 100u8.into()), Abort::RANGE),
        (download(0x1400, 2, 250u8.into()), Abort::RANGE),
        (download(0x1600, 1, 1u32.into()), Abort::STATE),
        (Request::Segment { toggle: false }, Abort::COMMAND),
    ] {
        assert_eq!(rig.abort(request), abort, "{request:?}");
    }
    // A segmented download is not offered.
    let frames = rig.give(0x605, [0x21, 0x00, 0x20, 0, 9, 0, 0, 0]);
    assert_eq!(
        frames,
        [Frame::of(
            0x585,
            Response::Abort(at(0x2000, 0), Abort::COMMAND).encode()
        )]
    );
}

#[test]
fn identity_and_name_are_read_and_the_map_read_back() {
    let mut rig = Rig::new();
    rig.start(1);
    let number = |rig: &mut Rig, index, sub| match rig.ask(Request::Upload(at(index, sub))) {
        Response::Uploaded(_, number) => number.bits(),
        other => panic!("{other:?}"),
    };
    assert_eq!(number(&mut rig, 0x1000, 0), 0x0002_0192);
    assert_eq!(number(&mut rig, 0x1018, 4), 4);
    assert_eq!(number(&mut rig, 0x1A00, 1), 0x2001_0010);
    assert_eq!(number(&mut rig, 0x1800, 1), 0x185);
    assert_eq!(
        rig.ask(Request::Upload(at(0x1008, 0))),
        Response::UploadStarted(at(0x1008, 0), 20)
    );
}

#[test]
fn a_stopped_node_answers_nothing_and_a_reset_forgets_what_was_set() {
    let mut rig = Rig::new();
    rig.start(1);
    rig.give(0x000, [0x02, NODE]);
    assert!(rig.give(0x605, Request::Upload(at(0x1000, 0)).encode()).is_empty());
    assert_eq!(rig.give(0x000, [0x81, NODE]), [Frame::of(0x705, [0x00])]);
    assert!(rig.device.events.contains(&Event::Reset));
    assert_eq!(rig.slave.state(), NmtState::PreOperational);
    rig.give(0x000, [0x01, NODE]);
    assert!(rig.give(0x080, [1]).is_empty(), "its maps are empty");
    rig.give(0x000, [0x02, NODE + 1]);
    assert_eq!(rig.slave.state(), NmtState::Operational, "another node was meant");
}
