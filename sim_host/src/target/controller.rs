//! The controller node on the emulated board, with the calls of the one in process, and held against it.
//!
//! The board's frames are the ones that go out to the bus. Beside it the core runs in process on the same frames: it is where
//! [`TargetController::state`] looks, and every frame, input and output of the board is compared with it, bit for bit.

use super::cost::Cost;
use super::emulator::{Emulator, Message, SHIFT};
use super::figures::instructions;
use super::node::host;
use super::region;
use crate::log::bytes_of;
use anyhow::{Context, bail};
use firmware::controller::Controller;
use firmware::cycle::{Params, Second, State};
use firmware::job::seal::AXES;
use hal::board::frames::{GUARD_US, Stamped, ask};
use hal::board::report::{CycleReport, Event, HALF_US, Instruments, Timing};
use hal::can::Frame;
use hal::master::MasterConfig;
use hal::process::{Inputs, Outputs};
use hal::stage::{STAGES, Trail};
use hal::wire::{Fnv64, Sink, Wire};
use std::fmt::Debug;
use std::path::Path;

/// The controller node on the emulated board.
pub struct TargetController<S: Second = (), const N: usize = AXES> {
    emulator: Emulator,
    mirror: Controller<S, N>,
    params: Params,
    second: S,
    /// Frames that came since the last timer event.
    arrived: Vec<Stamped>,
    /// Timer events so far.
    events: u64,
    outputs_hash: Fnv64,
    /// Of the next answer alone.
    ask: u8,
    /// Everything below the board's tick is to be busy.
    load: bool,
    instruments: Option<Box<Instruments>>,
    timing: Timing,
    stages: [u32; STAGES],
    /// What came out of the stages of the newest cycle in process.
    trail: Trail,
}

impl<S: Second, const N: usize> TargetController<S, N> {
    /// Starts `image` with these parameters: the bus's, the core's, and those of what moves beside the sealing arm.
    pub fn new(image: &Path, config: &MasterConfig<N>, params: Params, second: S) -> anyhow::Result<Self> {
        let parameters = region::of_controller(config, &params, &second);
        let mirror = host(config, &params)?;
        Ok(Self {
            emulator: Emulator::start(image, &parameters, SHIFT)?,
            mirror,
            params,
            second,
            arrived: Vec::new(),
            events: 0,
            outputs_hash: Fnv64::default(),
            ask: 0,
            load: false,
            instruments: None,
            timing: Timing::default(),
            stages: [0; STAGES],
            trail: Trail::default(),
        })
    }

    /// The 5 ms tick: the SYNC frame, first of all. Time is zero at the first.
    pub fn sync(&mut self, transmit: &mut impl FnMut(Frame)) -> anyhow::Result<()> {
        let message = self.next(Event::Sync)?;
        let mut expected = Vec::new();
        self.mirror.sync(&mut |frame| expected.push(frame));
        self.hand_on(&message, &expected, transmit)
    }

    /// A frame came, `t_ns` after the first SYNC.
    pub fn receive(&mut self, frame: &Frame, t_ns: u64) {
        self.mirror.receive(frame);
        let event_ns = self.events.saturating_sub(1) * u64::from(HALF_US) * 1000;
        let since_us = t_ns.saturating_sub(event_ns) / 1000;
        let at_us = since_us.min(u64::from(HALF_US - GUARD_US)) as u16;
        self.arrived.push(Stamped { at_us, frame: *frame });
    }

    /// The cycle, and its frames. Inputs and outputs are returned for whoever records them.
    pub fn cycle(&mut self, transmit: &mut impl FnMut(Frame)) -> anyhow::Result<(Inputs<N>, Outputs<N>)> {
        let mut message = self.next(Event::Cycle)?;
        let mut expected = Vec::new();
        self.trail = Trail::default();
        let mut expect = |frame| expected.push(frame);
        let (&inputs, &outputs) = self
            .mirror
            .cycle_watched(&self.params, &self.second, &mut expect, &mut self.trail);
        let mut rest = message.trace.as_slice();
        let report = CycleReport::<N>::read(&mut rest).context("report of a cycle")?;
        message.trace = rest.to_vec();
        self.stages = report.stages;
        self.outputs_hash.put(&bytes_of(&report.outputs));
        if self.outputs_hash.0 != report.hash {
            bail!(
                "{}: the board's hash of its outputs is not that of the outputs it sent",
                self.place()
            );
        }
        self.same("inputs", &report.inputs, &inputs)?;
        self.same("outputs", &report.outputs, &outputs)?;
        self.hand_on(&message, &expected, transmit)?;
        Ok((report.inputs, report.outputs))
    }

    /// What the cycle hands on, as the core beside the board has it.
    pub fn state(&self) -> &State {
        self.mirror.state()
    }

    /// And that of what moves beside the sealing arm.
    pub fn beside(&self) -> &S::State {
        self.mirror.beside()
    }

    /// What came out of the stages of the newest cycle of the core in process.
    pub fn trail(&self) -> Trail {
        self.trail
    }

    /// What the newest control cycle took on the board; stages are zero from an image that does not tell them apart.
    pub fn cost(&self) -> Cost {
        Cost {
            total: instructions(self.timing.busy),
            stages: self.stages.map(instructions),
        }
    }

    /// Something on the board is to hold its next timer event up for this long, in steps of [`ask::STALL_US`]. By less than half a cycle it is
    /// late; by more it would be missed, and the board no longer in step.
    pub fn stall(&mut self, us: u32) {
        self.ask |= ((us / ask::STALL_US) as u8) << ask::STALL_SHIFT;
    }

    /// From the next answer on everything below the board's tick is busy, or idle again.
    pub fn load(&mut self, busy: bool) {
        self.load = busy;
    }

    /// Runs one more SYNC event, and returns the distributions that the board kept of itself.
    pub fn finish(mut self) -> anyhow::Result<Box<Instruments>> {
        self.ask = ask::INSTRUMENTS;
        self.sync(&mut |_| {})?;
        self.instruments
            .context("the board was asked for its instruments and sent none")
    }

    /// Lets the board go on to its next timer event, which must be `event`.
    fn next(&mut self, event: Event) -> anyhow::Result<Message> {
        if self.events > 0 {
            let load = if self.load { ask::LOAD } else { 0 };
            self.emulator
                .answer(&self.arrived, std::mem::take(&mut self.ask) | load)
                .with_context(|| self.place())?;
            self.arrived.clear();
        }
        self.events += 1;
        let mut message = self.emulator.message().with_context(|| self.place())?;
        if message.dropped > 0 {
            bail!("{}: the board had no room for {} frames", self.place(), message.dropped);
        }
        let mut rest = message.trace.as_slice();
        let timing = Timing::read(&mut rest).context("timing of a timer event")?;
        if timing.event != event {
            bail!(
                "{}: the board is at its {:?} event, the cell at {event:?}",
                self.place(),
                timing.event
            );
        }
        self.mirror.overran(timing.overruns);
        self.timing = timing;
        message.trace = rest.to_vec();
        Ok(message)
    }

    /// Passes the board's frames on, if they are those that the core in process sends.
    fn hand_on(
        &mut self,
        message: &Message,
        expected: &[Frame],
        transmit: &mut impl FnMut(Frame),
    ) -> anyhow::Result<()> {
        let frames: Vec<Frame> = message.frames.iter().map(|stamped| stamped.frame).collect();
        self.same("frames", &frames.as_slice(), &expected)?;
        frames.into_iter().for_each(transmit);
        let mut rest = message.trace.as_slice();
        if !rest.is_empty() {
            self.instruments = Some(Box::new(Instruments::read(&mut rest).context("instruments")?));
        }
        Ok(())
    }

    fn same<T: PartialEq + Debug>(&self, what: &str, target: &T, host: &T) -> anyhow::Result<()> {
        if target != host {
            bail!(
                "{}: {what} differ between the board and the core in process:\nboard   {target:?}\nprocess {host:?}",
                self.place()
            );
        }
        Ok(())
    }

    fn place(&self) -> String {
        format!("cycle {}", self.events.div_ceil(2))
    }
}

#[cfg(test)]
mod tests;
