//! A CANopen node but for its application: NMT state, boot-up, heartbeat both ways, SDO server, SYNC and PDOs.
//!
//! Drives, camera and I/O node are each a [`Slave`] and a [`Device`]. It owns no bus and no clock: frames are handed to
//! [`Slave::receive`], time to [`Slave::elapse`], and what it sends goes to the `tx` it is given.
//!
//! At a SYNC while operational, in this order: synchronous RPDOs that came since the last SYNC are written, the device
//! latches, and TPDOs that are due are read and sent. A frame for which there was no SYNC yet is replaced by a newer one:
//! one mailbox per PDO. Heartbeats wait for the burst after a SYNC, where they lose every arbitration, so that none is
//! under way when the next SYNC is due; without SYNC they go at once.
//!
//! Communication objects held here: 0x1000, 0x1001, 0x1005, 0x1006, 0x1008, 0x1016, 0x1017, 0x1018, 0x1019, and per PDO
//! 0x1400.., 0x1600.., 0x1800.., 0x1A00... Maps are empty after a reset of communication: the master writes them.

mod objects;

use super::cob;
use super::emcy::{Emergency, code};
use super::heartbeat::{Consumer, Producer};
use super::nmt::{NmtCommand, NmtState};
use super::object::{Device, Event, Number, Value};
use super::pdo::{Direction, Pdo};
use super::sdo::Server;
use super::sync;
use crate::can::Frame;
use objects::read_object;

/// PDOs of each direction that a node has: those of the pre-defined connection set.
pub const PDOS: usize = 4;
/// Nodes that boot at one command spread their heartbeats over this many parts of the period, by node number.
const HEARTBEAT_PHASES: u32 = 16;

/// Who a node is.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Identity {
    /// Device type, object 0x1000: profile number in the low half.
    pub device_type: u32,
    /// Name, object 0x1008.
    pub name: &'static str,
    /// Vendor, product code, revision, serial number: object 0x1018, sub-indices 1..=4.
    pub numbers: [u32; 4],
}

/// What a frame meant to the node.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Received {
    /// Nothing that the owner need act on.
    Nothing,
    /// A SYNC with this count, while operational.
    Sync(u8),
}

/// An RPDO and its newest frame.
#[derive(Clone, Copy, Debug)]
struct Receiver {
    pdo: Pdo,
    frame: Option<Frame>,
    watch: Consumer,
}

/// A TPDO and whether an event asks for it.
#[derive(Clone, Copy, Debug)]
struct Transmitter {
    pdo: Pdo,
    asked: bool,
}

/// A CANopen node.
#[derive(Clone, Debug)]
pub struct Slave {
    node: u8,
    identity: Identity,
    state: NmtState,
    error_register: u8,
    sync_period_us: u32,
    since_sync_us: u32,
    count: u8,
    producer_ms: u16,
    producer: Producer,
    /// Entry of 0x1016: node in bits 16..=22, time in ms below.
    consumer_entry: u32,
    consumer: Consumer,
    server: Server,
    receivers: [Receiver; PDOS],
    transmitters: [Transmitter; PDOS],
}

impl Slave {
    /// Node `node`, 1..=127, silent until [`Self::boot`].
    pub fn new(node: u8, identity: Identity) -> Self {
        let receiver = |k| Receiver {
            pdo: Pdo::new(Direction::Receive, cob::rpdo(k, node)),
            frame: None,
            watch: Consumer::default(),
        };
        let transmitter = |k| Transmitter {
            pdo: Pdo::new(Direction::Transmit, cob::tpdo(k, node)),
            asked: false,
        };
        Self {
            node,
            identity,
            state: NmtState::BootUp,
            error_register: 0,
            sync_period_us: 0,
            since_sync_us: u32::MAX,
            count: 0,
            producer_ms: 0,
            producer: Producer::default(),
            consumer_entry: 0,
            consumer: Consumer::default(),
            server: Server::default(),
            receivers: [receiver(1), receiver(2), receiver(3), receiver(4)],
            transmitters: [transmitter(1), transmitter(2), transmitter(3), transmitter(4)],
        }
    }

    /// Node number.
    pub fn node(&self) -> u8 {
        self.node
    }

    /// NMT state.
    pub fn state(&self) -> NmtState {
        self.state
    }

    /// Count of the last SYNC; zero if none came.
    pub fn count(&self) -> u8 {
        self.count
    }

    /// Power-on, or reset of communication: parameters at their defaults, boot-up message, pre-operational.
    pub fn boot(&mut self, device: &mut impl Device, tx: &mut impl FnMut(Frame)) {
        *self = Self::new(self.node, self.identity);
        self.send_state(tx);
        self.enter(NmtState::PreOperational, device);
    }

    /// Reports an emergency, or with [`code::NONE`] that all is well again.
    pub fn emergency(&mut self, code: u16, tx: &mut impl FnMut(Frame)) {
        let emergency = Emergency::new(code);
        self.error_register = emergency.register;
        if matches!(self.state, NmtState::PreOperational | NmtState::Operational) {
            tx(Frame::of(cob::emcy(self.node), emergency.encode()));
        }
    }

    /// Asks for an event-driven TPDO `k` (from 1): with the next SYNC or, if it is asynchronous, at the next
    /// [`Self::elapse`].
    pub fn ask(&mut self, k: u8) {
        if let Some(transmitter) = self.transmitters.get_mut((k as usize).wrapping_sub(1)) {
            transmitter.asked = true;
        }
    }

    /// Lets `us` microseconds pass: heartbeats go out, and silence of others is noticed.
    pub fn elapse(&mut self, us: u32, device: &mut impl Device, tx: &mut impl FnMut(Frame)) {
        self.since_sync_us = self.since_sync_us.saturating_add(us);
        self.producer.elapse(us);
        let synchronised = self.since_sync_us < self.sync_period_us.saturating_add(self.sync_period_us / 2);
        if !synchronised && self.producer.take_due() {
            self.send_state(tx);
        }
        if self.consumer.elapse(us) {
            self.emergency(code::HEARTBEAT, tx);
            device.event(Event::MasterLost);
        }
        if self.state != NmtState::Operational {
            return;
        }
        for k in 1..=PDOS as u8 {
            let late = self
                .receivers
                .get_mut(k as usize - 1)
                .is_some_and(|r| r.watch.elapse(us));
            if late {
                self.emergency(code::RPDO_TIMEOUT, tx);
                device.event(Event::RpdoLate(k));
            }
        }
        for transmitter in &mut self.transmitters {
            if transmitter.asked && !transmitter.pdo.is_synchronous() {
                transmitter.asked = false;
                transmit(&transmitter.pdo, &self.identity, device, tx);
            }
        }
    }

    /// Whether frames with this identifier mean anything to the node: what its controller's filter must let through.
    pub fn hears(&self, id: u16) -> bool {
        [cob::NMT, cob::SYNC, cob::sdo_request(self.node)].contains(&id)
            || id == cob::heartbeat((self.consumer_entry >> 16) as u8)
            || self.receivers.iter().any(|receiver| receiver.pdo.cob() == Some(id))
    }

    /// Takes a frame from the bus.
    pub fn receive(&mut self, frame: &Frame, device: &mut impl Device, tx: &mut impl FnMut(Frame)) -> Received {
        if frame.is_remote() || self.state == NmtState::BootUp {
            return Received::Nothing;
        }
        let bytes = frame.bytes();
        match frame.cob() {
            cob::NMT => self.command(bytes, device, tx),
            cob::SYNC => return self.synchronise(bytes, device, tx),
            id if id == cob::sdo_request(self.node) => {
                if let (Ok(message), true) = (bytes.try_into(), self.state != NmtState::Stopped)
                    && let Some(response) = self.serve(message, device)
                {
                    tx(Frame::of(cob::sdo_response(self.node), response.encode()));
                }
            }
            id if id == cob::heartbeat((self.consumer_entry >> 16) as u8) => self.consumer.heard(),
            id => self.take_pdo(id, frame, device, tx),
        }
        Received::Nothing
    }

    fn command(&mut self, bytes: &[u8], device: &mut impl Device, tx: &mut impl FnMut(Frame)) {
        let Some((command, node)) = NmtCommand::decode(bytes) else {
            return;
        };
        if node != 0 && node != self.node {
            return;
        }
        match command {
            NmtCommand::Start => self.enter(NmtState::Operational, device),
            NmtCommand::Stop => self.enter(NmtState::Stopped, device),
            NmtCommand::PreOperational => self.enter(NmtState::PreOperational, device),
            NmtCommand::ResetNode => {
                device.event(Event::Reset);
                self.boot(device, tx);
            }
            NmtCommand::ResetCommunication => self.boot(device, tx),
        }
    }

    fn enter(&mut self, state: NmtState, device: &mut impl Device) {
        if state == self.state {
            return;
        }
        self.state = state;
        for receiver in &mut self.receivers {
            receiver.frame = None;
            receiver.watch = Consumer::new(receiver.pdo.event_us());
        }
        for transmitter in &mut self.transmitters {
            transmitter.pdo.restart();
            transmitter.asked = false;
        }
        device.event(Event::State(state));
    }

    fn synchronise(&mut self, bytes: &[u8], device: &mut impl Device, tx: &mut impl FnMut(Frame)) -> Received {
        // A SYNC without counter (older masters) is counted here, so that starts and stamps still mean something.
        self.count = match bytes {
            [count] => *count,
            _ => sync::next(self.count),
        };
        self.since_sync_us = 0;
        let operational = self.state == NmtState::Operational;
        if operational {
            for receiver in &mut self.receivers {
                if let Some(frame) = receiver.frame.take() {
                    write_mapped(&receiver.pdo, &frame, device);
                }
            }
            device.sync(self.count);
            for transmitter in &mut self.transmitters {
                let asked = transmitter.asked && transmitter.pdo.is_event_driven() && transmitter.pdo.is_synchronous();
                if transmitter.pdo.due() || asked {
                    transmitter.asked = false;
                    transmit(&transmitter.pdo, &self.identity, device, tx);
                }
            }
        }
        if self.producer.take_due() {
            self.send_state(tx);
        }
        if operational {
            Received::Sync(self.count)
        } else {
            Received::Nothing
        }
    }

    fn take_pdo(&mut self, id: u16, frame: &Frame, device: &mut impl Device, tx: &mut impl FnMut(Frame)) {
        if self.state != NmtState::Operational {
            return;
        }
        let Some(receiver) = self
            .receivers
            .iter_mut()
            .find(|receiver| receiver.pdo.cob() == Some(id))
        else {
            return;
        };
        let bits: u32 = receiver.pdo.map().iter().map(|entry| entry.bits as u32).sum();
        if (frame.bytes().len() as u32) * 8 < bits {
            return self.emergency(code::PDO_LENGTH, tx);
        }
        receiver.watch.heard();
        if receiver.pdo.is_synchronous() {
            receiver.frame = Some(*frame);
        } else {
            write_mapped(&receiver.pdo, frame, device);
        }
    }

    fn send_state(&self, tx: &mut impl FnMut(Frame)) {
        tx(Frame::of(cob::heartbeat(self.node), [self.state.code()]));
    }
}

/// Writes an RPDO's objects. What an object refuses it refuses in silence: a PDO has no answer.
fn write_mapped(pdo: &Pdo, frame: &Frame, device: &mut impl Device) {
    let mut rest = frame.bytes();
    for entry in pdo.map() {
        let Some((bytes, tail)) = rest.split_at_checked(entry.bits as usize / 8) else {
            return;
        };
        rest = tail;
        if let Some(number) = Number::from_bytes(bytes) {
            let _ = device.write(entry.object, number);
        }
    }
}

/// Reads a TPDO's objects and sends them.
fn transmit(pdo: &Pdo, identity: &Identity, device: &impl Device, tx: &mut impl FnMut(Frame)) {
    let Some(cob) = pdo.cob() else { return };
    let mut bytes = heapless::Vec::<u8, 8>::new();
    for &entry in pdo.map() {
        if let Ok(Value::Number(number)) = read_object(identity, entry.object, device) {
            let all = number.to_bytes();
            // The map's length was checked against eight bytes when it was written.
            let _ = bytes.extend_from_slice(all.get(..entry.bits as usize / 8).unwrap_or(&[]));
        }
    }
    if let Some(frame) = Frame::data(cob, &bytes) {
        tx(frame);
    }
}

#[cfg(test)]
mod tests;
