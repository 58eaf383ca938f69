//! A campaign of sealing trials, and what it adds up to.

use super::recording::{Recording, Summary};
use super::scenario::{Options, name_of};
use super::score::{SealScore, TrialScore, percentile, rms};
use super::{trial, words};
use crate::campaign::tally::{BUS_LOAD_MAX, BUS_LOAD_MAX_OF_TWO, Tally};
use crate::campaign::{self, Trials};
use crate::model::Model;
use crate::target::vision::VisionFigures;
use std::path::{Path, PathBuf};

/// Most instructions that vision may take for one image of the seam, and for one by two slits.
const VISION_MAX: u64 = 600_000;
const VISION_MAX_OF_TWO: u64 = 1_000_000;

/// What is to be run.
pub type Campaign = campaign::Campaign<Options>;

/// What came out.
pub struct CampaignResult {
    /// The figures.
    pub score: SealScore,
    /// Files written, the report first.
    pub files: Vec<PathBuf>,
}

/// Runs a campaign; with `out`, the first trial leaves its report, log and candump there.
pub fn run(campaign: &Campaign, model: &Model, out: Option<&Path>) -> anyhow::Result<CampaignResult> {
    let mut recording = out.map(Recording::create).transpose()?;
    let trials = campaign.run(recording.as_mut(), |options, seed, company| {
        trial::run(options, model, seed, company)
    })?;
    let score = add_up(campaign, &trials);
    let summary = Summary {
        passed: score.passed(),
        shortfalls: score.shortfalls(),
        tally: &score.tally,
        facts: vec![
            ("path", score.path.clone()),
            ("joint", score.joint.clone()),
            ("surface", score.surface.clone()),
            ("hold", score.hold.clone()),
        ],
        figures: words::figures(&score),
    };
    let files = recording
        .map(|recording| recording.finish(summary))
        .transpose()?
        .unwrap_or_default();
    Ok(CampaignResult { score, files })
}

fn add_up(campaign: &Campaign, trials: &Trials<TrialScore>) -> SealScore {
    let options = &campaign.options;
    let scores = || trials.each.iter();
    let lateral = || scores().flat_map(|score| score.lateral.iter().copied());
    let largest = |value: fn(&TrialScore) -> f64| scores().map(value).fold(0.0, f64::max);
    SealScore {
        tally: Tally::of(
            "seal",
            campaign,
            options.speed,
            trials,
            |score| &score.run,
            |score| score.verdict(options.speed),
        ),
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
        time_lost_max_s: largest(|score| score.time_lost),
        second_arm_max_mm: scores().filter_map(|score| score.second_max).reduce(f64::max),
        bus_load_bar: match options {
            Options { error_frames: 1.., .. } => None,
            Options { second_arm: true, .. } => Some(BUS_LOAD_MAX_OF_TWO),
            _ => Some(BUS_LOAD_MAX),
        },
        vision_bar: if options.slits == 1 {
            VISION_MAX
        } else {
            VISION_MAX_OF_TWO
        },
        camera: VisionFigures::new(scores().filter_map(|score| score.camera.as_ref())),
    }
}
