//! A campaign of teaching trials, and what it adds up to.

use super::scenario::TeachOptions;
use super::score::{TeachScore, TrialScore};
use super::trial::{self, Taught};
use super::words;
use crate::campaign::tally::Tally;
use crate::campaign::{self, Trials};
use crate::model::Model;
use crate::seal::recording::{Recording, Summary};
use crate::seal::scenario::name_of;
use crate::seal::score::{percentile, rms};
use crate::taught::TaughtSeam;
use std::path::{Path, PathBuf};

/// What is to be run.
pub type Campaign = campaign::Campaign<TeachOptions>;

/// What came out.
pub struct CampaignResult {
    /// The figures.
    pub score: TeachScore,
    /// What the first trial taught.
    pub taught: Option<TaughtSeam>,
    /// Files written, the report first.
    pub files: Vec<PathBuf>,
}

/// Runs a campaign; with `out`, the first trial leaves its report, log and candump there.
pub fn run(campaign: &Campaign, model: &Model, out: Option<&Path>) -> anyhow::Result<CampaignResult> {
    let mut recording = out.map(Recording::create).transpose()?;
    let mut trials = campaign.run(recording.as_mut(), |options, seed, company| {
        trial::run(options, model, seed, company)
    })?;
    let score = add_up(campaign, &trials);
    let summary = Summary {
        passed: score.tally.all_succeeded(),
        shortfalls: Vec::new(),
        tally: &score.tally,
        facts: ["path", "joint", "surface", "law"]
            .into_iter()
            .zip(score.names.clone())
            .collect(),
        figures: words::figures(&score),
    };
    let files = recording
        .map(|recording| recording.finish(summary))
        .transpose()?
        .unwrap_or_default();
    let taught = trials.each.first_mut().and_then(|first| first.seam.take());
    let taught = taught.map(|seam| seam.of_joint(name_of(&campaign.options.cell.joint)));
    Ok(CampaignResult { score, taught, files })
}

fn add_up(campaign: &Campaign, trials: &Trials<Taught>) -> TeachScore {
    let TeachOptions { cell, law } = &campaign.options;
    let scores = || trials.each.iter().map(|trial| &trial.score);
    let off = || scores().flat_map(|score| score.off.iter().copied());
    let largest = |value: fn(&TrialScore) -> f64| scores().map(value).fold(0.0, f64::max);
    TeachScore {
        tally: Tally::of(
            "teach",
            campaign,
            cell.speed,
            trials,
            |trial| &trial.score.run,
            |trial| trial.score.verdict(cell.speed),
        ),
        taught_rms_mm: rms(off()),
        taught_max_mm: percentile(off(), 1.0),
        orientation_max_deg: largest(|score| score.orientation),
        seam_lost: scores().filter(|score| score.lost).count(),
        names: [
            name_of(&cell.path),
            name_of(&cell.joint),
            name_of(&cell.surface),
            name_of(law),
        ],
        points: scores().map(|score| score.points).sum(),
        outliers: scores().map(|score| score.outliers).sum(),
        view_mm: largest(|score| score.view),
    }
}
