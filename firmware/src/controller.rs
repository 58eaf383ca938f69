//! The controller as a node on the bus: the CANopen master and the cycle, wired together, without a board.
//!
//! Whoever owns the timer and the CAN peripheral calls three things: [`Controller::sync`] at each 5 ms tick, [`Controller::receive`] for each
//! frame, and [`Controller::cycle`] half a period after the tick, when the drives' answers are in. The same calls come from the board's
//! interrupts, from the emulated board, and from the simulator in process.
//!
//! It does not hold its parameters but is lent them: they are forty kilobytes that come from somewhere else, and beside initial values
//! of its own they would lie in an image's flash as that many zeros.

use crate::cycle::{Params, Second, State, step_with};
use crate::job::seal::AXES;
use hal::can::Frame;
use hal::master::{ConfigError, Master, MasterConfig};
use hal::process::{Inputs, Outputs};
use hal::stage::{Stage, Stopwatch};
use hal::wire::Wire;

/// The controller node of `N` axes: the sealing arm's, and those of what moves beside it.
pub struct Controller<S: Second = (), const N: usize = AXES> {
    master: Master<N>,
    state: State,
    beside: S::State,
    outputs: Outputs<N>,
    /// Late or missed cycles that no inputs have told yet.
    overruns: u8,
}

impl<S: Second, const N: usize> Controller<S, N> {
    /// To be set up.
    pub const EMPTY: Self = Self {
        master: Master::EMPTY,
        state: State::EMPTY,
        beside: S::EMPTY_STATE,
        outputs: Outputs::EMPTY,
        overruns: 0,
    };

    /// At power-up.
    pub fn new(config: &MasterConfig<N>, params: &Params) -> Result<Self, ConfigError> {
        let mut controller = Self::EMPTY;
        controller.set_up(config, params)?;
        Ok(controller)
    }

    /// Sets an [`Self::EMPTY`] one up where it stands: it is too large to be moved on a microcontroller's stack.
    pub fn set_up(&mut self, config: &MasterConfig<N>, params: &Params) -> Result<(), ConfigError> {
        self.state.set_up(params);
        self.master.set_up(config)
    }

    /// The 5 ms tick: the SYNC frame, first of all.
    pub fn sync(&mut self, transmit: &mut impl FnMut(Frame)) {
        self.master.sync(transmit);
    }

    /// The timer found so many cycles late or missed.
    pub fn overran(&mut self, cycles: u8) {
        self.overruns = self.overruns.saturating_add(cycles);
    }

    /// A frame came.
    pub fn receive(&mut self, frame: &Frame) {
        self.master.receive(frame);
    }

    /// The cycle, and its frames; `params` are those that it was set up with, `second` those of what moves beside. Inputs and outputs are
    /// there for whoever records them, until the next.
    pub fn cycle(
        &mut self,
        params: &Params,
        second: &S,
        transmit: &mut impl FnMut(Frame),
    ) -> (&Inputs<N>, &Outputs<N>) {
        self.cycle_watched(params, second, transmit, &mut ())
    }

    /// The same, and `watch` tells its stages apart.
    pub fn cycle_watched(
        &mut self,
        params: &Params,
        second: &S,
        transmit: &mut impl FnMut(Frame),
        watch: &mut impl Stopwatch,
    ) -> (&Inputs<N>, &Outputs<N>) {
        let inputs = self.master.inputs(core::mem::take(&mut self.overruns));
        watch.lap(Stage::Decode);
        let (state, beside) = (&mut self.state, &mut self.beside);
        step_with(params, second, state, beside, inputs, &mut self.outputs, watch);
        self.master.outputs(&self.outputs, transmit);
        watch.lap(Stage::Encode);
        (self.master.image(), &self.outputs)
    }

    /// What the cycle hands on, to look at.
    pub fn state(&self) -> &State {
        &self.state
    }

    /// And that of what moves beside the sealing arm.
    pub fn beside(&self) -> &S::State {
        &self.beside
    }
}
