//! Trials over all cores, and what they add up to.

use super::scenario::TeachOptions;
use super::score::{Bars, Particulars, TeachScore, TrialScore};
use super::{trial, words};
use crate::model::Model;
use crate::progress;
use crate::seal::recording::{Recording, Summary};
use crate::seal::scenario::name_of;
use crate::seal::score::{Failure, percentile, rms};
use crate::seal::trial::Company;
use crate::target::figures::TargetFigures;
use crate::taught::TaughtSeam;
use hal::wire::{Fnv64, Sink};
use rayon::prelude::*;
use std::path::{Path, PathBuf};
use std::time::Instant;

/// What is to be run.
#[derive(Clone, Copy, Debug)]
pub struct Campaign {
    /// The cell and the job.
    pub options: TeachOptions,
    /// First seed; trial i draws from seed + i.
    pub seed: u64,
    /// How many.
    pub trials: usize,
}

/// What came out.
pub struct CampaignResult {
    /// The figures.
    pub score: TeachScore,
    /// What the first trial taught.
    pub taught: Option<TaughtSeam>,
    /// Files written, the report first.
    pub files: Vec<PathBuf>,
}

/// A trial that was run.
struct Done {
    score: TrialScore,
    taught: Option<TaughtSeam>,
    elapsed: f64,
}

/// Runs a campaign; with `out`, the first trial leaves its report, log and candump there.
pub fn run(campaign: &Campaign, model: &Model, out: Option<&Path>) -> anyhow::Result<CampaignResult> {
    let mut recording = out.map(Recording::create).transpose()?;
    // A single trial shows how far along the seam it is; several, how many are done.
    let alone = campaign.trials == 1;
    let bar = if alone {
        progress::bar(1000, "‰ of the seam")
    } else {
        progress::bar(campaign.trials as u64, "trials")
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
        let seed = campaign.seed.wrapping_add(index as u64);
        let (score, taught) = trial::run(&campaign.options, model, seed, company)?;
        if !alone {
            bar.inc(1);
        }
        Ok(Done {
            score,
            taught,
            elapsed: started.elapsed().as_secs_f64(),
        })
    };
    let first = run_trial(0, recording.as_mut())?;
    let rest: anyhow::Result<Vec<_>> = (1..campaign.trials)
        .into_par_iter()
        .map(|index| run_trial(index, None))
        .collect();
    let mut trials: Vec<_> = std::iter::once(first).chain(rest?).collect();
    bar.finish_and_clear();
    let score = add_up(campaign, &trials);
    let files = match recording {
        Some(recording) => recording.finish(summary(&score))?,
        None => Vec::new(),
    };
    let taught = trials.first_mut().and_then(|first| first.taught.take());
    Ok(CampaignResult { score, taught, files })
}

fn summary(score: &TeachScore) -> Summary<'_> {
    let [path, joint, surface, law] = score.particulars.names.clone();
    Summary {
        passed: score.passed(),
        trials: score.trials,
        succeeded: score.succeeded,
        failures: &score.failures,
        facts: vec![
            ("path", path),
            ("joint", joint),
            ("surface", surface),
            ("law", law),
            ("seed", score.seed.to_string()),
            ("hash", score.particulars.log_hash.clone()),
        ],
        figures: words::figures(score),
    }
}

fn add_up(campaign: &Campaign, trials: &[Done]) -> TeachScore {
    let TeachOptions { cell, law } = &campaign.options;
    let bars = Bars::at(cell.speed);
    let scores = || trials.iter().map(|done| &done.score);
    let off = || scores().flat_map(|score| score.off.iter().copied());
    let largest = |value: fn(&TrialScore) -> f64| scores().map(value).fold(0.0, f64::max);
    let failures: Vec<Failure> = scores()
        .filter_map(|score| {
            let reason = score.verdict(&bars)?;
            Some(Failure {
                seed: score.seed,
                reason,
            })
        })
        .collect();
    let mut hash = Fnv64::default();
    scores().for_each(|score| hash.put(&score.hash.to_le_bytes()));
    let simulated: f64 = scores().map(|score| score.simulated).sum();
    let elapsed: f64 = trials.iter().map(|done| done.elapsed).sum();
    let cycle_max_instructions = scores()
        .filter_map(|score| score.instruments.as_deref())
        .map(|instruments| TargetFigures::new(instruments).cycle_max_instructions)
        .max();
    TeachScore {
        job: "teach",
        seed: campaign.seed,
        trials: trials.len(),
        succeeded: trials.len() - failures.len(),
        failures,
        speed_m_per_s: cell.speed,
        taught_rms_mm: rms(off()),
        taught_max_mm: percentile(off(), 1.0),
        orientation_max_deg: largest(|score| score.orientation),
        seam_lost: scores().filter(|score| score.lost).count(),
        particulars: Particulars {
            names: [
                name_of(&cell.path),
                name_of(&cell.joint),
                name_of(&cell.surface),
                name_of(law),
            ],
            points: scores().map(|score| score.points).sum(),
            outliers: scores().map(|score| score.outliers).sum(),
            view_mm: largest(|score| score.view),
            bus_load_percent: largest(|score| score.bus_load),
            sim_speed: if elapsed > 0.0 { simulated / elapsed } else { 0.0 },
            log_hash: match trials {
                [alone] => format!("{:016x}", alone.score.hash),
                _ => format!("{:016x}", hash.0),
            },
            cycle_max_instructions,
        },
    }
}
