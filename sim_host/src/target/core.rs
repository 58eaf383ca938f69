//! The core alone, in process or on the emulated target: what a log is replayed through.

use super::emulator::{Emulator, SHIFT};
use super::image;
use super::node::On;
use crate::log::{Answer, bytes_of};
use crate::model::AXES;
use firmware::cycle::{Params, State, step_watched};
use hal::process::{Inputs, Outputs};
use hal::stage::{Stage, Trail, Witness};

/// A core, from power-up on.
pub enum Core {
    /// In this process.
    Host(Box<(Params, State)>),
    /// In an image of its own under QEMU.
    Target(Emulator),
}

impl Core {
    /// With these parameters.
    pub fn new(on: On, params: Params) -> anyhow::Result<Self> {
        Ok(match on {
            On::Host => {
                let state = State::new(&params);
                Self::Host(Box::new((params, state)))
            }
            On::Qemu => Self::Target(Emulator::start(&image::find("replay")?, &bytes_of(&params), SHIFT)?),
        })
    }

    /// One cycle. With `flip` the last bit of the first number that comes out of that stage is flipped, so that one can see it found.
    pub fn step(&mut self, inputs: &Inputs<AXES>, flip: Option<Stage>) -> anyhow::Result<Answer> {
        match self {
            Self::Host(core) => {
                let (params, state) = &mut **core;
                let mut witness = Witness {
                    trail: Trail::default(),
                    flip,
                };
                let mut outputs = Outputs::default();
                step_watched(params, state, inputs, &mut outputs, &mut witness);
                Ok(Answer {
                    outputs,
                    trail: witness.trail,
                })
            }
            Self::Target(emulator) => {
                emulator.put(&(*inputs, flip))?;
                let (outputs, trail): (Outputs<AXES>, Trail) = emulator.get()?;
                Ok(Answer { outputs, trail })
            }
        }
    }
}
