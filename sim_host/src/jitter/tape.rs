//! A sealing job as the controller saw it: every frame that came to it, and what it answered.

use super::lockstep::Lockstep;
use crate::log::bytes_of;
use crate::model::Model;
use crate::node::Nodes;
use crate::seal::scenario::Options;
use crate::seal::setup::Setup;
use firmware::controller::Controller;
use firmware::cycle::Params;
use firmware::job::seal::AXES;
use hal::board::histogram::Histogram;
use hal::board::report::HALF_US;
use hal::can::Frame;
use hal::master::MasterConfig;
use hal::wire::{Fnv64, Sink};

/// A recorded job, from power-up to its end.
pub struct Tape {
    master: MasterConfig<AXES>,
    params: Params,
    /// Frames in the order they came.
    frames: Vec<Frame>,
    /// For each timer event, SYNC and cycle in turn, how many of them had come.
    come: Vec<usize>,
    /// Hash of each cycle's outputs.
    outputs: Vec<u64>,
    /// Ages of sightings, µs, as [`super::ages::Ages`] has them.
    pub vision: Histogram,
}

impl Tape {
    /// Records the job that `seed` draws.
    pub fn record(options: &Options, model: &Model, seed: u64) -> anyhow::Result<Self> {
        let setup = Setup::new(options, model, seed)?;
        let mut run = Lockstep::new(options, model, seed)?;
        let (mut arrived, mut outputs) = (Vec::new(), Vec::new());
        while run.jobs == 0 {
            let (_, written) = run.cycle(None, &mut |delivery| {
                if delivery.sender != Nodes::<AXES>::CONTROLLER {
                    arrived.push((delivery.t_ns.div_ceil(u64::from(HALF_US) * 1000), delivery.frame));
                }
            })?;
            outputs.push(hash(&written));
        }
        let come = (0..2 * outputs.len() as u64).map(|event| arrived.partition_point(|(due, _)| *due <= event));
        Ok(Self {
            come: come.collect(),
            master: setup.master,
            params: setup.params,
            frames: arrived.into_iter().map(|(_, frame)| frame).collect(),
            outputs,
            vision: run.ages.vision,
        })
    }

    /// A controller at the tape's beginning.
    pub fn controller(&self) -> anyhow::Result<Controller> {
        Controller::new(&self.master, &self.params)
            .map_err(|error| anyhow::anyhow!("{}: {} is out of range", error.field, error.value))
    }

    /// The parameters that go with it.
    pub fn params(&self) -> &Params {
        &self.params
    }

    /// Timer events on it.
    pub fn events(&self) -> usize {
        self.come.len()
    }

    /// What came to the controller before timer event `event` and after the one before it.
    pub fn frames(&self, event: usize) -> &[Frame] {
        let before = if event == 0 { 0 } else { self.come[event - 1] };
        &self.frames[before..self.come[event]]
    }

    /// Whether these are the outputs of cycle `cycle`.
    pub fn agrees(&self, cycle: usize, outputs: &hal::process::Outputs<AXES>) -> bool {
        self.outputs[cycle] == hash(outputs)
    }
}

fn hash(outputs: &hal::process::Outputs<AXES>) -> u64 {
    let mut hash = Fnv64::default();
    hash.put(&bytes_of(outputs));
    hash.0
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::seal::scenario::PathName;

    #[test]
    fn a_controller_that_is_played_the_tape_answers_as_it_did() {
        let options = Options {
            path: PathName::Straight,
            ..Options::told()
        };
        let tape = Tape::record(&options, &Model::k3s(), 1).unwrap();
        assert!(tape.events() > 2000, "{} events", tape.events());
        let mut controller = tape.controller().unwrap();
        for event in 0..tape.events() {
            tape.frames(event).iter().for_each(|frame| controller.receive(frame));
            if event % 2 == 0 {
                controller.sync(&mut |_| {});
            } else {
                let (_, outputs) = controller.cycle(&tape.params, &(), &mut |_| {});
                assert!(tape.agrees(event / 2, outputs), "cycle {}", event / 2);
            }
        }
    }
}
