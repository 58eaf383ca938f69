//! What one control cycle takes: on the board in instructions, in process in nanoseconds.

use firmware::controller::Controller;
use firmware::cycle::Params;
use firmware::job::seal::AXES;
use hal::board::counter::CycleCounter;
use hal::can::Frame;
use hal::process::{Inputs, Outputs};
use hal::stage::{Laps, STAGES, Stage};
use std::time::Instant;

/// The cost of one control cycle.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Cost {
    /// All of it.
    pub total: u64,
    /// Of each [`Stage`], in the order of [`Stage::ALL`].
    pub stages: [u64; STAGES],
}

/// This machine's clock as a counter of nanoseconds.
struct Clock(Instant);

impl CycleCounter for Clock {
    const HERTZ: u32 = 1_000_000_000;

    fn now(&self) -> u32 {
        self.0.elapsed().as_nanos() as u32 // wraps, as a counter does
    }
}

/// The controller in process, timed.
pub struct TimedController {
    /// The controller.
    pub controller: Controller,
    params: Params,
    clock: Clock,
    /// Taking in of frames since the last SYNC, ns.
    receiving: u64,
    cost: Cost,
}

impl TimedController {
    /// Times `controller`, which was set up with `params`.
    pub fn new(controller: Controller, params: Params) -> Self {
        Self {
            controller,
            params,
            clock: Clock(Instant::now()),
            receiving: 0,
            cost: Cost::default(),
        }
    }

    /// The 5 ms tick.
    pub fn sync(&mut self, transmit: &mut impl FnMut(Frame)) {
        self.receiving = 0;
        self.controller.sync(transmit);
    }

    /// The timer found so many cycles late or missed.
    pub fn overran(&mut self, cycles: u8) {
        self.controller.overran(cycles);
    }

    /// A frame came.
    pub fn receive(&mut self, frame: &Frame) {
        let start = self.clock.now();
        self.controller.receive(frame);
        self.receiving += u64::from(self.clock.now().wrapping_sub(start));
    }

    /// The cycle, and its frames.
    pub fn cycle(&mut self, transmit: &mut impl FnMut(Frame)) -> (Inputs<AXES>, Outputs<AXES>) {
        // Frames are kept until the clock has been read: what the bus does with them is not the controller's.
        let mut frames = Vec::with_capacity(16);
        let mut laps = Laps::since(&self.clock, self.clock.now());
        let (&inputs, &outputs) =
            self.controller
                .cycle_watched(&self.params, &(), &mut |frame| frames.push(frame), &mut laps);
        let mut stages = laps.counts().map(u64::from);
        stages[Stage::Decode as usize] += self.receiving;
        self.cost = Cost {
            total: stages.iter().sum(),
            stages,
        };
        frames.into_iter().for_each(transmit);
        (inputs, outputs)
    }

    /// What the newest control cycle took, ns.
    pub fn cost(&self) -> Cost {
        self.cost
    }
}
