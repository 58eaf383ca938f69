//! Trials over all cores, and what they add up to.

use super::recording::{Recording, Summary};
use super::scenario::{Options, name_of};
use super::score::{Bars, Failure, SealScore, TrialScore, percentile, rms};
use super::trial::{self, Company};
use super::words;
use crate::model::Model;
use crate::progress;
use crate::target::figures::TargetFigures;
use crate::target::vision::VisionFigures;
use hal::board::report::Instruments;
use hal::wire::{Fnv64, Sink};
use rayon::prelude::*;
use std::path::{Path, PathBuf};
use std::time::Instant;

/// What is to be run.
#[derive(Clone, Copy, Debug)]
pub struct Campaign {
    /// The cell and the job.
    pub options: Options,
    /// First seed; trial i draws from seed + i.
    pub seed: u64,
    /// How many.
    pub trials: usize,
}

/// What came out.
pub struct CampaignResult {
    /// The figures.
    pub score: SealScore,
    /// Files written, the report first.
    pub files: Vec<PathBuf>,
}

/// Runs a campaign; with `out`, the first trial leaves its report, log and candump there.
pub fn run(campaign: &Campaign, model: &Model, out: Option<&Path>) -> anyhow::Result<CampaignResult> {
    let recording = out.map(Recording::create).transpose()?;
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
        let score = trial::run(
            &campaign.options,
            model,
            campaign.seed.wrapping_add(index as u64),
            company,
        );
        if !alone {
            bar.inc(1);
        }
        score.map(|score| (score, started.elapsed().as_secs_f64()))
    };
    let mut recording = recording;
    let first = run_trial(0, recording.as_mut())?;
    let rest: anyhow::Result<Vec<_>> = (1..campaign.trials)
        .into_par_iter()
        .map(|index| run_trial(index, None))
        .collect();
    let trials: Vec<_> = std::iter::once(first).chain(rest?).collect();
    bar.finish_and_clear();
    let score = add_up(campaign, &trials);
    let files = match recording {
        Some(recording) => recording.finish(summary(&score))?,
        None => Vec::new(),
    };
    Ok(CampaignResult { score, files })
}

fn summary(score: &SealScore) -> Summary<'_> {
    Summary {
        passed: score.passed(),
        trials: score.trials,
        succeeded: score.succeeded,
        failures: &score.failures,
        facts: vec![
            ("path", score.path.clone()),
            ("joint", score.joint.clone()),
            ("surface", score.surface.clone()),
            ("hold", score.hold.clone()),
            ("seed", score.seed.to_string()),
            ("hash", score.log_hash.clone()),
        ],
        figures: words::figures(score),
    }
}

fn add_up(campaign: &Campaign, trials: &[(TrialScore, f64)]) -> SealScore {
    let options = &campaign.options;
    let bars = Bars::at(options.speed);
    let scores = || trials.iter().map(|(score, _)| score);
    let lateral = || scores().flat_map(|score| score.lateral.iter().copied());
    let largest = |value: fn(&TrialScore) -> f64| scores().map(value).fold(0.0, f64::max);
    let failures: Vec<Failure> = scores()
        .filter_map(|score| {
            score.verdict(&bars).map(|reason| Failure {
                seed: score.seed,
                reason,
            })
        })
        .collect();
    let mut hash = Fnv64::default();
    scores().for_each(|score| hash.put(&score.hash.to_le_bytes()));
    let (simulated, elapsed) = trials
        .iter()
        .fold((0.0, 0.0), |(s, e), (score, wall)| (s + score.simulated, e + wall));
    let instruments = scores()
        .filter_map(|score| score.instruments.as_deref())
        .fold(None, |sum, one| {
            let mut sum: Instruments = sum.unwrap_or_default();
            sum.merge(one);
            Some(sum)
        });
    SealScore {
        job: "seal",
        seed: campaign.seed,
        trials: trials.len(),
        succeeded: trials.len() - failures.len(),
        failures,
        speed_m_per_s: options.speed,
        path: name_of(&options.path),
        joint: name_of(&options.joint),
        surface: name_of(&options.surface),
        hold: name_of(&options.hold),
        lateral_rms_mm: rms(lateral()),
        lateral_p999_mm: percentile(lateral(), 0.999),
        lateral_max_mm: percentile(lateral(), 1.0),
        height_max_mm: largest(|score| score.height_max),
        start_pose_max_mm: largest(|score| score.start_pose.map_or(0.0, |(mm, _)| mm)),
        start_pose_max_deg: largest(|score| score.start_pose.map_or(0.0, |(_, deg)| deg)),
        start_refused: scores().filter(|score| score.start_refused).count(),
        seam_frames: scores().map(|score| u64::from(score.seam_frames)).sum(),
        seam_refused: scores().map(|score| u64::from(score.seam_refused)).sum(),
        seam_wrong_unflagged: scores().map(|score| u64::from(score.seam_wrong)).sum(),
        joint_accel_max_rad_per_s2: largest(|score| score.joint_accel),
        cycles: scores().map(|score| score.cycles).sum(),
        deadline_misses: scores().map(|score| score.deadline_misses).sum(),
        bus_load_max_percent: largest(|score| score.bus_load),
        errors_injected: options.error_frames > 0,
        sim_speed_x: if elapsed > 0.0 { simulated / elapsed } else { 0.0 },
        target: instruments.as_ref().map(TargetFigures::new),
        camera: VisionFigures::new(scores().filter_map(|score| score.camera.as_ref())),
        log_hash: format!("{:016x}", if let [(alone, _)] = trials { alone.hash } else { hash.0 }),
    }
}
