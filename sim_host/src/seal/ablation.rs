//! What each part of the controller is worth: hold × feed-forward × drive mode on the same seeds.

use super::campaign::{self, Campaign};
use super::scenario::{DriveMode, HoldName, name_of};
use crate::model::Model;
use crate::table::Table;
use clap::ValueEnum;
use serde::Serialize;

/// One combination.
#[derive(Clone, Debug, Serialize)]
pub struct AblationRow {
    /// Hold between corrections.
    pub hold: String,
    /// Velocity, inertia, gravity and friction feed-forward.
    pub feed_forward: bool,
    /// Drive mode.
    pub mode: String,
    /// Trials without a fault that kept every bar.
    pub succeeded: usize,
    /// Trials run.
    pub trials: usize,
    /// Over all cycles with the bead on.
    pub lateral_rms_mm: f64,
    /// Over all cycles with the bead on.
    pub lateral_max_mm: f64,
    /// Peak joint acceleration with the bead on.
    pub joint_accel_max_rad_per_s2: f64,
}

/// Runs every combination on the campaign's seeds.
pub fn run(campaign: &Campaign, model: &Model) -> anyhow::Result<Vec<AblationRow>> {
    let mut rows = Vec::new();
    for mode in DriveMode::value_variants() {
        for feed_forward in [true, false] {
            for hold in HoldName::value_variants() {
                let mut one = *campaign;
                one.options.mode = *mode;
                one.options.feed_forward = feed_forward;
                one.options.hold = *hold;
                let score = campaign::run(&one, model, None)?.score;
                rows.push(AblationRow {
                    hold: name_of(hold),
                    feed_forward,
                    mode: name_of(mode),
                    succeeded: score.tally.succeeded,
                    trials: score.tally.trials,
                    lateral_rms_mm: score.lateral_rms_mm,
                    lateral_max_mm: score.lateral_max_mm,
                    joint_accel_max_rad_per_s2: score.joint_accel_max_rad_per_s2,
                });
            }
        }
    }
    Ok(rows)
}

/// The rows as a table for the terminal and for the README.
pub fn table(rows: &[AblationRow]) -> String {
    let mut table = Table::new([
        "mode",
        "feed-forward",
        "hold",
        "kept its bars",
        "lateral rms mm",
        "lateral max mm",
        "joint acceleration max rad/s²",
    ]);
    for row in rows {
        table.row([
            row.mode.clone(),
            if row.feed_forward { "on" } else { "off" }.into(),
            row.hold.clone(),
            format!("{} of {}", row.succeeded, row.trials),
            format!("{:.3}", row.lateral_rms_mm),
            format!("{:.3}", row.lateral_max_mm),
            format!("{:.1}", row.joint_accel_max_rad_per_s2),
        ]);
    }
    table.to_string()
}
