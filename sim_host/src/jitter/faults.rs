//! A seeded mix of everything that goes wrong in a cell, one thing after the other, and the account of what each did.
//!
//! A stop must have been caused: its fault (and axis or node) must be one that what was broken at the time explains. And the
//! cell must come back: the operator acknowledges and starts again as soon as nothing is broken any more.

use crate::model::AXES;
use crate::node::Nodes;
use crate::seal::cell::Cell;
use crate::seal::scenario::{Stream, stream};
use crate::target::node::Node;
use anyhow::bail;
use firmware::fault::{Fault, Trip};
use firmware::safety::State;
use hal::canopen::emcy::code;
use rand::RngExt;
use rand_pcg::Pcg64;
use serde::Serialize;
use std::collections::BTreeMap;

/// Cycles from one cause's end to the next, at least and at most: some strike the run-in, some the bead, some the restart of the one before.
const GAP: (u64, u64) = (100, 1200);
/// Cycles after its end for which a cause may still stop the arm: a lost stretch of seam is missed only when the nozzle
/// comes to it, a set-up that a lost node must repeat takes a second.
const AFTERMATH: u64 = 500;
/// Cycles with nothing broken after which the arm must run again: 15 s, for a stop, a reset, repeated set-ups, arming.
const PATIENCE: u64 = 3000;

/// What is broken.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Cause {
    /// So many transmissions on the bus are destroyed in each cycle.
    BusErrors(u8),
    /// The slit falls on nothing.
    Sightings,
    /// A node's frames do not reach the controller for so many cycles.
    Cut(usize, u64),
    /// A drive's over-current trip.
    Drive(usize),
    /// The E-stop chain is open.
    EStop,
    /// The stop button is held down.
    StopButton,
    /// The tick is late in every third cycle, so many times.
    Stalls(u64),
}

/// A cause and when it acts.
#[derive(Clone, Copy, Debug)]
struct Injected {
    cause: Cause,
    begin: u64,
    end: u64,
}

impl Cause {
    /// What the run's account calls it.
    fn name(self) -> &'static str {
        match self {
            Self::BusErrors(_) => "frames destroyed",
            Self::Sightings => "sightings lost",
            Self::Cut(Nodes::<AXES>::CAMERA, _) => "camera cut off",
            Self::Cut(Nodes::<AXES>::IO, _) => "I/O node cut off",
            Self::Cut(..) => "drive cut off",
            Self::Drive(_) => "drive fault",
            Self::EStop => "E-stop",
            Self::StopButton => "stop button",
            Self::Stalls(_) => "late ticks",
        }
    }

    /// Whether it may stop the arm with this trip.
    fn explains(self, trip: Trip) -> bool {
        let place = usize::from(trip.place);
        match (self, trip.fault) {
            (Self::Sightings | Self::Cut(Nodes::<AXES>::CAMERA, _), Fault::Blind) => true,
            // Two heartbeats, 20 cycles apart, must be missed.
            (Self::Cut(Nodes::<AXES>::CAMERA, cycles), Fault::CameraSilent) => cycles > 20,
            (Self::Cut(Nodes::<AXES>::IO, cycles), Fault::IoSilent) => cycles > 4,
            (Self::Cut(node, cycles), Fault::DriveSilent) => node == place && cycles > 2,
            // Set up anew once it is back, it says that it has booted.
            (Self::Cut(sender, cycles), Fault::Emergency) => node_of(sender) == place && cycles > 2,
            (Self::Cut(_, cycles), Fault::ArmingTimeout) => cycles > 2,
            (Self::Drive(axis), Fault::DriveFault | Fault::DriveOff) => axis == place,
            (Self::Drive(axis), Fault::Emergency) => axis + 1 == place,
            (Self::Drive(_), Fault::ArmingTimeout) => true,
            (Self::EStop, Fault::EStop) => true,
            (Self::StopButton, Fault::StopButton) => true,
            (Self::Stalls(times), Fault::Overrun) => times >= 3,
            _ => false,
        }
    }
}

/// Number on the bus of a sender, as [`Nodes`] counts them.
fn node_of(sender: usize) -> usize {
    match sender {
        Nodes::<AXES>::CAMERA => 32, // as MasterConfig::new has it
        Nodes::<AXES>::IO => 33,
        drive => drive + 1,
    }
}

/// The account of a run with faults.
#[derive(Clone, Debug, Default, Serialize)]
pub struct Account {
    /// Seed of the mix.
    pub seed: u64,
    /// What was broken, and how often.
    pub injected: BTreeMap<&'static str, u64>,
    /// What stopped the arm, by the numbers of its faults, and how often.
    pub stops: BTreeMap<u8, u64>,
    /// Stops that nothing explains.
    pub unexplained: Vec<String>,
    /// Sealing jobs that came to their end.
    pub jobs_done: u64,
    /// Hash of every input and output of the run.
    pub log_hash: String,
}

/// The mix.
pub struct Faults {
    random: Pcg64,
    /// Newest last; those that can no longer explain anything are gone.
    injected: Vec<Injected>,
    next: u64,
    trip: Trip,
    /// When the arm last ran, or something was last broken.
    alive: u64,
    account: Account,
}

impl Faults {
    /// The mix that `seed` draws.
    pub fn new(seed: u64) -> Self {
        Self {
            random: stream(seed, Stream::Faults),
            injected: Vec::new(),
            next: GAP.1,
            trip: Trip::default(),
            alive: 0,
            account: Account {
                seed,
                ..Account::default()
            },
        }
    }

    /// What came of it.
    pub fn account(self, jobs_done: u64, log_hash: u64) -> Account {
        Account {
            jobs_done,
            log_hash: format!("{log_hash:016x}"),
            ..self.account
        }
    }

    /// Before a cycle: looks what the last one did, breaks and mends. Gives the transmissions to destroy in it. An error says that
    /// the cell hangs.
    pub fn upset(&mut self, cycle: u64, cell: &mut Cell, node: &mut Node) -> anyhow::Result<u8> {
        self.judge(cycle, node.state().trip());
        if cycle >= self.next {
            let injected = self.draw(cycle);
            *self.account.injected.entry(injected.cause.name()).or_default() += 1;
            self.next = injected.end + self.random.random_range(GAP.0..GAP.1);
            self.injected.retain(|old| cycle < old.end + AFTERMATH);
            self.injected.push(injected);
        }
        let mut errors = 0;
        if let Some(Injected { cause, begin, end }) = self.injected.last().copied()
            && (begin..=end).contains(&cycle)
        {
            self.alive = cycle;
            let broken = cycle < end;
            match cause {
                Cause::BusErrors(each) => errors = if broken { each } else { 0 },
                Cause::Sightings => cell.part_gone = broken,
                Cause::Cut(sender, _) => cell.cut = broken.then_some(sender),
                Cause::Drive(axis) if cycle == begin => cell.nodes.drives[axis].servo().fail(code::OVER_CURRENT),
                Cause::Drive(axis) if !broken => cell.nodes.drives[axis].servo().clear(),
                Cause::Drive(_) => {}
                Cause::EStop => cell.estop_open = broken,
                Cause::StopButton => cell.stop_held = broken,
                Cause::Stalls(_) if broken && (cycle - begin).is_multiple_of(3) => node.stall(),
                Cause::Stalls(_) => {}
            }
        }
        if node.state().safety() == State::Running {
            self.alive = cycle;
        }
        if cycle > self.alive + PATIENCE {
            bail!(
                "cycle {cycle}: the cell hangs in state {:?} with nothing broken for {PATIENCE} cycles; last broken: {:?}; trip: {:?}",
                node.state().safety(),
                self.injected.last(),
                self.trip
            );
        }
        Ok(errors)
    }

    /// Books a stop that is new, and whether anything explains it.
    fn judge(&mut self, cycle: u64, trip: Trip) {
        if std::mem::replace(&mut self.trip, trip) == trip || trip.fault == Fault::None {
            return;
        }
        *self.account.stops.entry(trip.fault as u8).or_default() += 1;
        let mut acting = self
            .injected
            .iter()
            .filter(|injected| cycle <= injected.end + AFTERMATH);
        if !acting.any(|injected| injected.cause.explains(trip)) {
            self.account.unexplained.push(format!(
                "cycle {cycle}, place {}: {}; broken before: {:?}",
                trip.place,
                trip.fault.line(),
                self.injected
            ));
        }
    }

    fn draw(&mut self, begin: u64) -> Injected {
        let random = &mut self.random;
        let axis = random.random_range(0..AXES);
        // Short ones must be borne, long ones must stop the arm.
        let cycles = if random.random_bool(0.5) {
            random.random_range(1..6)
        } else {
            random.random_range(6..200)
        };
        let cause = match random.random_range(0..9) {
            0 => Cause::BusErrors(random.random_range(1..=10)),
            1 => Cause::Sightings,
            2 => Cause::Cut(axis, cycles),
            3 => Cause::Cut(Nodes::<AXES>::CAMERA, cycles),
            4 => Cause::Cut(Nodes::<AXES>::IO, cycles),
            5 => Cause::Drive(axis),
            6 => Cause::EStop,
            7 => Cause::StopButton,
            _ => Cause::Stalls(cycles.min(12).div_ceil(3)),
        };
        let end = begin + cycles;
        Injected { cause, begin, end }
    }
}
