//! The bring-up of one node, and the watch over it afterwards.

use super::failure::{Failure, reason};
use super::script::Step;
use crate::can::Frame;
use crate::canopen::cob;
use crate::canopen::emcy::code;
use crate::canopen::heartbeat::Consumer;
use crate::canopen::nmt::{NmtCommand, NmtState};
use crate::canopen::sdo::{Abort, Client, Outcome};

/// Cycles between two resets of a node that does not boot: 1 s.
const RESET_EVERY: u32 = 200;
/// Cycles to wait for an SDO's answer: 100 ms, a few times what slow drives need (assumed).
const SDO_CYCLES: u32 = 20;
/// Cycles to wait for operational after an NMT start before it is sent again: a heartbeat must come in between.
const START_EVERY: u32 = 60;

/// Where a node is on its way.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Phase {
    /// Not heard since the last reset.
    Absent,
    /// At this step of its script.
    SetUp(usize),
    /// Set up; NMT start is sent, operational not yet confirmed by a heartbeat.
    Starting,
    /// In use.
    Operational,
    /// Something did not match or was refused. Only a new boot-up leads out.
    Refused,
}

/// One node.
#[derive(Clone, Debug)]
pub struct Station {
    node: u8,
    phase: Phase,
    /// The step of its script that it is at; none while it waits for that.
    step: Option<Step>,
    client: Client,
    watch: Consumer,
    /// Cycles until the phase's command is sent again.
    left: u32,
    resets: u32,
    start_slot: Option<u8>,
}

impl Station {
    /// Of no node yet.
    pub const EMPTY: Self = Self {
        node: 0,
        phase: Phase::Absent,
        step: None,
        client: Client::new(SDO_CYCLES),
        watch: Consumer::new(0),
        left: 0,
        resets: 0,
        start_slot: None,
    };

    /// Becomes that of node `node`, lost after `watch` cycles without a heartbeat, and started only in cycles of `start_slot` if there is one.
    pub fn assign(&mut self, node: u8, watch: u32, start_slot: Option<u8>) {
        self.node = node;
        self.watch = Consumer::new(watch);
        self.start_slot = start_slot;
    }

    /// Node number.
    pub fn node(&self) -> u8 {
        self.node
    }

    /// Whether the node is set up and in use.
    pub fn is_operational(&self) -> bool {
        matches!(self.phase, Phase::Operational) // and not ==, which would compare a script's step too
    }

    /// Lets one cycle pass.
    pub fn cycle(&mut self) -> Option<Failure> {
        self.left = self.left.saturating_sub(1);
        let lost = self.watch.elapse(1);
        if let Some(Outcome::Aborted(_)) = self.client.cycle() {
            let failure = self.at_step(reason::SDO_TIMEOUT, Abort::TIMEOUT.0);
            self.absent();
            return Some(failure);
        }
        if lost && self.phase != Phase::Absent {
            self.absent();
            return Some(Failure::emergency(self.node, code::HEARTBEAT));
        }
        if self.phase == Phase::Absent && self.left == 0 && self.resets == 1 {
            self.resets = 2; // said once; resets go on
            return Some(Failure::emergency(self.node, reason::NO_BOOT_UP));
        }
        None
    }

    /// A heartbeat or boot-up message of the node.
    pub fn heartbeat(&mut self, state: NmtState) -> Option<Failure> {
        let before = self.phase;
        if state == NmtState::BootUp {
            self.phase = Phase::SetUp(0);
            self.step = None;
            self.client = Client::new(SDO_CYCLES);
            return (before == Phase::Operational).then(|| Failure::emergency(self.node, reason::REBOOTED));
        }
        self.watch.heard();
        match (before, state) {
            (Phase::Starting, NmtState::Operational) => self.phase = Phase::Operational,
            (Phase::Operational, NmtState::PreOperational | NmtState::Stopped) => {
                self.absent();
                return Some(Failure::emergency(self.node, reason::NOT_OPERATIONAL));
            }
            _ => {}
        }
        None
    }

    /// An SDO answer of the node.
    pub fn sdo(&mut self, message: &[u8; 8]) -> Option<Failure> {
        let outcome = self.client.receive(message)?;
        let Phase::SetUp(k) = self.phase else { return None };
        let failure = match (outcome, self.step.as_ref()?) {
            (Outcome::Written, Step::Write(..)) => None,
            (
                Outcome::Number(number),
                &Step::Check {
                    mask, expected, reason, ..
                },
            ) => (number.bits() & mask != expected).then(|| self.at_step(reason, number.bits())),
            (Outcome::Aborted(Abort(value)), _) => Some(self.at_step(reason::SDO_ABORT, value)),
            _ => Some(self.at_step(reason::SDO_ABORT, Abort::COMMAND.0)),
        };
        if failure.is_some() {
            self.phase = Phase::Refused;
        } else {
            self.phase = Phase::SetUp(k + 1);
            self.step = None;
        }
        failure
    }

    /// The next asynchronous frame to this node, if one is due. NMT commands to all nodes share an identifier, and so a
    /// mailbox that the next one would overwrite: `nmt` says whether it is still free in this cycle. A node with a start
    /// slot is started only in cycles of that `slot`.
    pub fn transmit(&mut self, nmt: &mut bool, slot: u8) -> Option<Frame> {
        if self.is_operational() {
            return None; // its script is done, and nothing else is asked of it
        }
        if let Some(message) = self.client.transmit() {
            return Some(Frame::of(cob::sdo_request(self.node), message));
        }
        if !*nmt {
            return None;
        }
        let (command, again) = match self.phase {
            Phase::Absent if self.left == 0 => (NmtCommand::ResetCommunication, RESET_EVERY),
            Phase::Starting if self.left == 0 && self.start_slot.is_none_or(|own| own == slot) => {
                (NmtCommand::Start, START_EVERY)
            }
            _ => return None,
        };
        self.resets = self.resets.saturating_add((self.phase == Phase::Absent) as u32);
        self.left = again;
        *nmt = false;
        Some(Frame::of(cob::NMT, command.encode(self.node)))
    }

    /// The number of the step that it waits for, to [`Self::begin`] it.
    pub fn wants(&self) -> Option<usize> {
        match self.phase {
            Phase::SetUp(at) if self.step.is_none() => Some(at),
            _ => None,
        }
    }

    /// Begins a step of its script, or comes to its end.
    pub fn begin(&mut self, step: Option<Step>) {
        self.step = step;
        match step {
            Some(Step::Check { object, .. }) => self.client.read(object),
            Some(Step::Write(object, number)) => self.client.write(object, number),
            None => {
                self.phase = Phase::Starting;
                self.left = 0;
            }
        }
    }

    fn absent(&mut self) {
        self.phase = Phase::Absent;
        self.client = Client::new(SDO_CYCLES);
        self.left = 0;
        self.resets = 0;
    }

    /// A failure of the script's present step.
    fn at_step(&self, code: u16, value: u32) -> Failure {
        let object = self.step.map(|step| match step {
            Step::Check { object, .. } | Step::Write(object, _) => object,
        });
        Failure {
            node: self.node,
            code,
            object,
            value,
        }
    }
}
