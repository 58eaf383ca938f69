//! Our master and our slave against an independent CANopen stack, `canopen-rs`: that both ends of ours agree proves
//! little about the standard.

use canopen_rs::node::Node;
use canopen_rs::sdo::client::{SdoClient, SdoEvent};
use canopen_rs::{Address, DataType, Entry, NmtState, NodeId, ObjectDictionary, Value};
use hal::can::Frame;
use hal::canopen::cob;
use hal::canopen::slave::Slave;
use hal::cia402::{Mode, PowerState};
use hal::io::{CellIo, FlowControl, IDENTITY};
use hal::master::{DriveConfig, Master, MasterConfig};
use hal::process::{Outputs, PowerRequest};

const DRIVE: DriveConfig = DriveConfig {
    vendor_product: [0x1234, 7],
    rated_torque_mnm: 955,
    encoder_counts: 131_072,
    gear: [1, 1],
    max_torque: 3000,
    max_speed_rpm: 4500,
    position_limits: [-1000, 1000],
    quick_stop: 1_000_000,
    following_window: 500,
    following_time_ms: 20,
};

/// A drive's dictionary in the peer's terms: what the master's script reads and writes, and what it maps.
fn dictionary() -> ObjectDictionary<128> {
    use Value::*;
    let mut od = ObjectDictionary::new();
    for (index, sub, value) in [
        (0x1000, 0, Unsigned32(0x0002_0192)),
        (0x1018, 1, Unsigned32(0x1234)),
        (0x1018, 2, Unsigned32(7)),
        (0x6502, 0, Unsigned32(1 << 8 | 1 << 9)),
        (0x6076, 0, Unsigned32(955)),
        (0x608F, 1, Unsigned32(131_072)),
        (0x608F, 2, Unsigned32(1)),
        (0x6091, 1, Unsigned32(1)),
        (0x6091, 2, Unsigned32(1)),
        (0x6061, 0, Integer8(9)),
        (0x6041, 0, Unsigned16(0x0221)),
        (0x6064, 0, Integer32(-123_456)),
        (0x6077, 0, Integer16(-42)),
        (0x606C, 0, Integer32(777)),
        (0x603F, 0, Unsigned16(0)),
    ] {
        od.insert(Address::new(index, sub), Entry::ro(value)).unwrap();
    }
    for (index, sub, value) in [
        (0x1005, 0, Unsigned32(0)),
        (0x1006, 0, Unsigned32(0)),
        (0x1016, 1, Unsigned32(0)),
        (0x1017, 0, Unsigned16(0)),
        (0x1400, 5, Unsigned16(0)),
        (0x6007, 0, Integer16(1)),
        (0x605A, 0, Integer16(2)),
        (0x605B, 0, Integer16(1)),
        (0x605C, 0, Integer16(1)),
        (0x605D, 0, Integer16(1)),
        (0x605E, 0, Integer16(1)),
        (0x6085, 0, Unsigned32(1)),
        (0x6065, 0, Unsigned32(1)),
        (0x6066, 0, Unsigned16(1)),
        (0x6072, 0, Unsigned16(1)),
        (0x607D, 1, Integer32(0)),
        (0x607D, 2, Integer32(0)),
        (0x6080, 0, Unsigned32(1)),
        (0x6060, 0, Integer8(0)),
        (0x6040, 0, Unsigned16(0xFFFF)),
        (0x60FF, 0, Integer32(-1)),
        (0x60B2, 0, Integer16(-1)),
    ] {
        od.insert(Address::new(index, sub), Entry::rw(value)).unwrap();
    }
    for index in [0x1400u16, 0x1800, 0x1801] {
        od.insert(Address::new(index, 1), Entry::rw(Unsigned32(0))).unwrap();
        od.insert(Address::new(index, 2), Entry::rw(Unsigned8(255))).unwrap();
        for sub in 0..=3 {
            let value = if sub == 0 { Unsigned8(0) } else { Unsigned32(0) };
            od.insert(Address::new(index + 0x200, sub), Entry::rw(value)).unwrap();
        }
    }
    od
}

#[test]
fn our_master_sets_up_a_drive_of_another_stack_and_exchanges_its_process_data() {
    let mut master = Master::new(&MasterConfig::new(Mode::Velocity, [DRIVE])).unwrap();
    let mut peer = Node::new(NodeId::new(1).unwrap(), dictionary());
    let mut wish = Outputs::<1>::default();
    wish.axes[0].request = PowerRequest::Enable;
    for _ in 0..120 {
        let mut sent = Vec::new();
        master.sync(&mut |frame| sent.push(frame));
        master.outputs(&wish, &mut |frame| sent.push(frame));
        for frame in sent {
            let answers = if frame.cob() == cob::SYNC {
                peer.sync_tpdos().to_vec()
            } else {
                peer.on_frame(frame.cob(), frame.bytes()).into_iter().collect()
            };
            for answer in answers {
                master.receive(&Frame::data(answer.cob_id, answer.data()).unwrap());
            }
            if peer
                .take_written_object()
                .is_some_and(|object| (0x1400..0x1C00).contains(&object.index))
            {
                peer.configure_pdos_from_od();
            }
            if frame.cob() == cob::NMT && peer.state() == NmtState::Initialising {
                let boot = peer.boot();
                master.receive(&Frame::data(boot.cob_id, boot.data()).unwrap());
            }
        }
        if peer.state() != NmtState::Initialising {
            let heartbeat = peer.heartbeat();
            master.receive(&Frame::data(heartbeat.cob_id, heartbeat.data()).unwrap());
        }
    }
    assert_eq!(master.last_failure().filter(|failure| failure.node == 1), None);
    assert_eq!(peer.state(), NmtState::Operational);
    let object = |index, sub| peer.od().read(Address::new(index, sub)).unwrap();
    assert_eq!(object(0x6060, 0), Value::Integer8(9));
    assert_eq!(object(0x607D, 1), Value::Integer32(-1000));
    assert_eq!(object(0x1016, 1), Value::Unsigned32(127 << 16 | 60));
    // Its TPDOs, by the maps that the master wrote.
    let inputs = master.inputs(0);
    let axis = inputs.axes[0];
    assert_eq!(
        (axis.position, axis.torque, axis.velocity, axis.mode),
        (-123_456, -42, 777, 9)
    );
    assert_eq!(PowerState::of(axis.statusword), Some(PowerState::ReadyToSwitchOn));
    // And our RPDO: switch on, nothing to follow yet.
    assert_eq!(object(0x6040, 0), Value::Unsigned16(0x0007));
    assert_eq!(
        (object(0x60FF, 0), object(0x60B2, 0)),
        (Value::Integer32(0), Value::Integer16(0))
    );
}

struct Pump;

impl FlowControl for Pump {
    fn set_flow(&mut self, _per_mille: i16) {}
}

struct Pin;

impl embedded_hal::digital::ErrorType for Pin {
    type Error = core::convert::Infallible;
}

impl embedded_hal::digital::InputPin for Pin {
    fn is_high(&mut self) -> Result<bool, Self::Error> {
        Ok(true)
    }
    fn is_low(&mut self) -> Result<bool, Self::Error> {
        Ok(false)
    }
}

impl embedded_hal::digital::OutputPin for Pin {
    fn set_high(&mut self) -> Result<(), Self::Error> {
        Ok(())
    }
    fn set_low(&mut self) -> Result<(), Self::Error> {
        Ok(())
    }
}

#[test]
fn a_client_of_another_stack_reads_and_writes_our_node() {
    let mut device = CellIo::new([Pin, Pin, Pin, Pin], [Pin, Pin, Pin, Pin], Pump);
    let mut slave = Slave::new(33, IDENTITY);
    slave.boot(&mut device, &mut |_| {});
    let mut client = SdoClient::new(NodeId::new(33).unwrap());
    let mut transfer = |client: &mut SdoClient, first: [u8; 8]| {
        let mut request = first;
        loop {
            let mut answer = None;
            slave.receive(&Frame::of(cob::sdo_request(33), request), &mut device, &mut |frame| {
                answer = Some(frame)
            });
            let answer = answer.expect("an answer to each request");
            match client.on_response(answer.bytes().try_into().unwrap()) {
                SdoEvent::Send(next) => request = next,
                SdoEvent::Complete(value) => return Ok(value),
                SdoEvent::Aborted(code) => return Err(code),
            }
        }
    };
    let name = client.read(Address::new(0x1008, 0), DataType::VisibleString);
    match transfer(&mut client, name) {
        Ok(Some(Value::VisibleString(text))) => assert_eq!(text.as_str(), Some(IDENTITY.name)),
        other => panic!("{other:?}"),
    }
    let write = client.write(Address::new(0x1017, 0), Value::Unsigned16(100));
    assert_eq!(transfer(&mut client, write), Ok(None));
    let read = client.read(Address::new(0x1017, 0), DataType::Unsigned16);
    assert_eq!(transfer(&mut client, read), Ok(Some(Value::Unsigned16(100))));
    let refused = client.write(Address::new(0x1000, 0), Value::Unsigned32(1));
    assert_eq!(transfer(&mut client, refused), Err(0x0601_0002));
    let unknown = client.read(Address::new(0x5000, 0), DataType::Unsigned8);
    assert_eq!(transfer(&mut client, unknown), Err(0x0602_0000));
}
