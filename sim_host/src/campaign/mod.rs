//! Campaigns: many trials of one job, over all cores, and what the results of every job have in common.
//!
//! A job says how one trial of it runs; [`Campaign::run`] runs as many as were asked for, shows how far it is, and lets the first leave its recording.
//! [`tally`] adds up what every job's trials show, [`words`] puts it into tables. What is the job's own, each adds for itself.

pub mod tally;
pub mod words;

use crate::progress;
use crate::seal::cell::Cell;
use crate::seal::recording::Recording;
use rayon::prelude::*;
use std::time::Instant;

/// What is to be run.
#[derive(Clone, Copy, Debug)]
pub struct Campaign<Options> {
    /// The cell and the job.
    pub options: Options,
    /// First seed; trial i draws from seed + i.
    pub seed: u64,
    /// How many.
    pub trials: usize,
}

/// Who looks on, and who interferes.
pub struct Company<'a> {
    /// Keeps everything for people and other tools.
    pub recording: Option<&'a mut Recording>,
    /// Is told how far along the seam the nozzle is, 0 to 1.
    pub progress: &'a dyn Fn(f64),
    /// Is called at the beginning of each cycle, with its number and the nozzle's station (m): breaks what it likes.
    pub upset: &'a mut dyn FnMut(u64, f64, &mut Cell),
}

/// Trials that were run.
pub struct Trials<Trial> {
    /// In the order of their seeds.
    pub each: Vec<Trial>,
    /// Time that they took, s, as if on one core.
    pub elapsed: f64,
}

impl<Options: Sync> Campaign<Options> {
    /// Runs every trial by `trial`; the first of them is recorded, if there is a recording.
    pub fn run<Trial: Send>(
        &self,
        recording: Option<&mut Recording>,
        trial: impl Fn(&Options, u64, Company) -> anyhow::Result<Trial> + Sync,
    ) -> anyhow::Result<Trials<Trial>> {
        // A single trial shows how far along the seam it is; several, how many are done.
        let alone = self.trials == 1;
        let bar = if alone {
            progress::bar(1000, "‰ of the seam")
        } else {
            progress::bar(self.trials as u64, "trials")
        };
        let run_trial = |index: usize, recording: Option<&mut Recording>| {
            let started = Instant::now();
            let share = |done: f64| {
                if alone {
                    bar.set_position((1000.0 * done) as u64)
                }
            };
            let company = Company {
                recording,
                progress: &share,
                upset: &mut |_, _, _| {},
            };
            let result = trial(&self.options, self.seed.wrapping_add(index as u64), company)?;
            if !alone {
                bar.inc(1);
            }
            Ok((result, started.elapsed().as_secs_f64()))
        };
        let first = run_trial(0, recording)?;
        let rest: anyhow::Result<Vec<_>> = (1..self.trials)
            .into_par_iter()
            .map(|index| run_trial(index, None))
            .collect();
        bar.finish_and_clear();
        let (each, times): (Vec<_>, Vec<f64>) = std::iter::once(first).chain(rest?).unzip();
        Ok(Trials {
            each,
            elapsed: times.iter().sum(),
        })
    }
}
