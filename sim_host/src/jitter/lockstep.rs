//! The cell and the controller in lock step for as long as one likes: one sealing job after the other.

use super::ages::Ages;
use super::faults::Faults;
use crate::bus::Delivery;
use crate::log::{RunHash, bytes_of};
use crate::model::Model;
use crate::seal::cell::{Cell, TICKS};
use crate::seal::lockstep::STEP_PHASE;
use crate::seal::scenario::Options;
use crate::seal::setup::Setup;
use crate::target::node::Node;
use firmware::job::phase::Phase;
use firmware::job::seal::AXES;
use hal::board::report::{HALF_US, Instruments};
use hal::process::{Inputs, Outputs};

/// Images that may still be asked for: those that the camera has in hand.
const IMAGES_KEPT: usize = 2;

/// A controller and its cell, with an operator who starts again and again.
pub struct Lockstep {
    /// The controller.
    pub node: Node,
    /// What it is wired to.
    pub cell: Cell,
    /// Ages measured so far.
    pub ages: Ages,
    /// Jobs that came to their end.
    pub jobs: u64,
    hash: RunHash,
    cycles: u64,
    phase: Phase,
}

impl Lockstep {
    /// At power-up.
    pub fn new(options: &Options, model: &Model, seed: u64) -> anyhow::Result<Self> {
        let setup = Setup::new(options, model, seed)?;
        let mut cell = Cell::new(options, model, &setup, seed);
        cell.restarts = true;
        let hash = RunHash::new(&bytes_of(&setup.params));
        Ok(Self {
            node: Node::new(options.on, &setup.master, setup.params)?,
            cell,
            ages: Ages::default(),
            jobs: 0,
            hash,
            cycles: 0,
            phase: Phase::Idle,
        })
    }

    /// One cycle of 5 ms, in which `faults` break what they like and `listen` hears the bus.
    pub fn cycle(
        &mut self,
        faults: Option<&mut Faults>,
        listen: &mut dyn FnMut(&Delivery),
    ) -> anyhow::Result<(Inputs<AXES>, Outputs<AXES>)> {
        let Self {
            node, cell, ages, hash, ..
        } = self;
        let errors = match faults {
            Some(faults) => faults.upset(self.cycles, cell, node)?,
            None => 0,
        };
        let t_ns = self.cycles * u64::from(2 * HALF_US) * 1000;
        cell.press(node.state().safety());
        cell.start_cycle(errors);
        node.sync(&mut |frame| cell.send(frame))?;
        let mut exchanged = None;
        for tick in 1..=TICKS {
            cell.run_tick(node, &mut |delivery| {
                ages.hear(delivery);
                listen(delivery);
            });
            if tick == STEP_PHASE {
                let (inputs, outputs) = node.cycle(&mut |frame| {
                    ages.sent(&frame, t_ns + u64::from(HALF_US) * 1000);
                    cell.send(frame);
                })?;
                hash.take(&inputs);
                hash.take(&outputs);
                ages.cycle(&inputs, &outputs);
                exchanged = Some((inputs, outputs));
            }
        }
        // A long run would drown in its images.
        for shot in cell.shots.iter_mut().rev().skip(IMAGES_KEPT).take(1) {
            shot.image.pixels = Vec::new();
        }
        self.cycles += 1;
        let phase = node.state().phase();
        self.jobs += u64::from(phase == Phase::Done && self.phase != Phase::Done);
        self.phase = phase;
        exchanged.ok_or_else(|| anyhow::anyhow!("the step phase is not in the cycle"))
    }

    /// Hash over the parameters and every input and output so far.
    pub fn hash(&self) -> u64 {
        self.hash.value()
    }

    /// Ends it; a board hands over what it measured of itself.
    pub fn finish(self) -> anyhow::Result<Option<Box<Instruments>>> {
        self.node.finish()
    }
}
