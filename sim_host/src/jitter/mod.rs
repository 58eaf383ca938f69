//! How evenly the control cycle comes, how long it takes, and how old is what it works with.
//!
//! On the board under QEMU ([`lockstep`]): sealing jobs one after the other, the image's own instruments read at the end, if asked
//! for with everything below the tick busy, or with a seeded mix of [`faults`]. On this machine ([`host`]): a recorded job
//! ([`tape`]) played to the same core in real time, cyclictest beside it. What a figure is worth is said with it
//! ([`caveats`], [`verdict`]); [`ages`] come from the bus of the emulated cell in both cases.

pub mod ages;
pub mod busy;
pub mod caveats;
pub mod cyclictest;
pub mod faults;
pub mod figures;
pub mod files;
pub mod host;
pub mod lockstep;
pub mod tape;
pub mod verdict;
pub mod words;

use crate::model::Model;
use crate::progress;
use crate::seal::scenario::Options;
use crate::target::node::On;
use ages::Ages;
use anyhow::Context;
use clap::ValueEnum;
use faults::{Account, Faults};
use figures::{Distributions, JitterFigures, Scale};
use hal::board::report::Instruments;
use lockstep::Lockstep;
use serde::Serialize;
use std::path::Path;
use tape::Tape;

/// What else runs, below the cycle.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, ValueEnum)]
#[serde(rename_all = "lowercase")]
pub enum Load {
    /// Nothing.
    #[default]
    None,
    /// All that there is time for, at every priority below the cycle's.
    Full,
}

/// What is to be measured.
#[derive(Clone, Copy, Debug)]
pub struct Measurement {
    /// Where the cycle runs.
    pub on: On,
    /// Cycles to measure.
    pub cycles: u64,
    /// What else runs.
    pub load: Load,
    /// Seed of the cell.
    pub seed: u64,
    /// Seed of the mix of faults, if there is to be one.
    pub faults: Option<u64>,
}

/// Measures.
pub fn run(measurement: &Measurement, model: &Model) -> anyhow::Result<JitterFigures> {
    match measurement.on {
        On::Host => on_host(measurement, model),
        On::Qemu => on_board(measurement, model),
    }
}

fn on_board(measurement: &Measurement, model: &Model) -> anyhow::Result<JitterFigures> {
    let Soak {
        instruments,
        ages,
        late,
        jobs,
        overruns,
        account,
    } = soak(measurement, model)?;
    let instruments = instruments.context("the board kept no instruments")?;
    let mut caveats = caveats::of_emulator();
    caveats.extend(caveats::of_length(measurement.cycles));
    if jobs == 0 {
        caveats.push(format!(
            "{} cycles are too few for a whole sealing job: the costly part of the path may not be in them",
            measurement.cycles
        ));
    }
    if let Some(late_ticks) = account.as_ref().and_then(|account| account.injected.get("late ticks")) {
        caveats.push(format!(
            "the tick was held up on purpose, 1 ms each time, in {late_ticks} bursts: they are in all figures of time"
        ));
    }
    Ok(JitterFigures::new(
        measurement,
        Distributions {
            instruments: *instruments,
            scale: Scale::Instructions,
            vision: ages.vision,
            bus: Some((ages.feedback, ages.command)),
        },
        u64::from(overruns) + late,
        caveats,
        account,
        None,
    ))
}

fn on_host(measurement: &Measurement, model: &Model) -> anyhow::Result<JitterFigures> {
    let tape = Tape::record(&Options::told(), model, measurement.seed)?;
    let measured = host::run(&tape, measurement.cycles, measurement.load == Load::Full)?;
    let mut caveats = caveats::of_machine(Path::new("/"));
    caveats.extend(measured.refused);
    caveats.extend(caveats::of_length(measurement.cycles));
    Ok(JitterFigures::new(
        measurement,
        Distributions {
            instruments: measured.instruments,
            scale: Scale::Nanoseconds,
            vision: tape.vision,
            bus: None,
        },
        measured.deadline_misses,
        caveats,
        None,
        measured.cyclictest,
    ))
}

/// What came of a long run in lock step.
pub struct Soak {
    /// The board's own distributions.
    pub instruments: Option<Box<Instruments>>,
    /// Ages, from the bus.
    pub ages: Ages,
    /// Cycles whose targets came too late for their SYNC.
    pub late: u64,
    /// Sealing jobs done.
    pub jobs: u64,
    /// Late or missed cycles that the controller was told.
    pub overruns: u32,
    /// What the faults did.
    pub account: Option<Account>,
}

/// Runs cell and controller for the measurement's cycles, in process or on the board.
pub fn soak(measurement: &Measurement, model: &Model) -> anyhow::Result<Soak> {
    let options = Options {
        on: measurement.on,
        ..Options::told()
    };
    let mut run = Lockstep::new(&options, model, measurement.seed)?;
    run.node.load(measurement.load == Load::Full);
    let mut faults = measurement.faults.map(Faults::new);
    let mut overruns = 0;
    let bar = progress::bar(measurement.cycles, "cycles");
    for _ in 0..measurement.cycles {
        let (inputs, _) = run.cycle(faults.as_mut(), &mut |_| {})?;
        overruns += u32::from(inputs.overruns);
        bar.inc(1);
    }
    bar.finish_and_clear();
    Ok(Soak {
        ages: run.ages.clone(),
        late: run.cell.late(),
        jobs: run.jobs,
        overruns,
        account: faults.map(|faults| faults.account(run.jobs, run.hash())),
        instruments: run.finish()?,
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use firmware::fault::Fault;

    #[test]
    fn whatever_fails_every_stop_is_explained_the_arm_comes_back_and_a_second_run_is_the_same() {
        let measurement = Measurement {
            on: On::Host,
            cycles: 20_000,
            load: Load::None,
            seed: 1,
            faults: Some(1),
        };
        let run = || soak(&measurement, &Model::k3s()).unwrap().account.unwrap();
        let account = run();
        assert_eq!(account.unexplained, [""; 0]);
        assert!(account.injected.len() >= 7, "{:?}", account.injected);
        assert!(account.stops.len() >= 4, "{:?}", account.stops);
        assert!(account.stops.contains_key(&(Fault::EStop as u8)));
        assert!(account.jobs_done >= 1);
        assert_eq!(run().log_hash, account.log_hash);
    }
}
