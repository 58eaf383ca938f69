//! `seal`: a sealing job, or a campaign of them.

use super::cell::{CellArgs, TrialArgs};
use super::{Outcome, cycles_in, number_in, print_score, whole_in};
use crate::model::Model;
use crate::seal::campaign::{self, Campaign};
use crate::seal::scenario::{DriveMode, HoldName, JointName, Options, StartName, name_of};
use crate::seal::{ablation, words};
use crate::taught::TaughtSeam;
use anyhow::ensure;
use clap::{Args, ValueEnum};
use firmware::job::survey::SECTIONS;
use std::path::{Path, PathBuf};

/// Options of `seal`.
#[derive(Args)]
pub struct SealArgs {
    #[command(flatten)]
    cell: CellArgs,
    /// Speed along the seam, m/s (0.02 to 0.5)
    #[arg(long, value_name = "M_PER_S", default_value = "0.3", value_parser = number_in(0.02, 0.5))]
    speed: f64,
    /// How the nozzle is led from one correction to the next
    #[arg(long, value_enum, default_value = "smooth")]
    hold: HoldName,
    /// Where the start pose comes from: measured by the sensor first, or told with an error
    #[arg(long, value_enum, default_value = "measured")]
    start: StartName,
    /// Places along the seam that are looked at once the start is measured: 0 (none, as in the paper) or 2 to 12
    #[arg(long, value_name = "N", default_value = "12", value_parser = survey)]
    survey: u8,
    /// Times that the camera takes a lost image again by itself, 10 ms later (0 to 3)
    #[arg(long, value_name = "N", default_value = "0", value_parser = whole_in(0_u8, 3))]
    retakes: u8,
    /// Drive mode: velocity with the drive's own speed loop, or torque as in the paper
    #[arg(long, value_enum, default_value = "csv")]
    mode: DriveMode,
    /// Servo without feed-forward
    #[arg(long)]
    no_feed_forward: bool,
    /// Play the taught path without the sensor's corrections
    #[arg(long)]
    no_preview: bool,
    /// Time from one burst of exposures to the next, ms (20 to 200, a multiple of 5)
    #[arg(long, value_name = "MS", default_value = "100", value_parser = cycles_in(20, 200))]
    vision_ms: u8,
    /// Play the seam in this file, as `teach --save` writes it, on a part that lies elsewhere and is bent otherwise; --joint must be that of the
    /// file, where that says its own
    #[arg(long, value_name = "FILE")]
    taught: Option<PathBuf>,
    #[command(flatten)]
    trials: TrialArgs,
    /// A second arm, of five axes, moves beside it under the same controller; its share is not recorded, so without --out
    #[arg(long, conflicts_with = "out")]
    second_arm: bool,
    /// Run holds × feed-forward × drive modes and print the table
    #[arg(long, conflicts_with_all = ["hold", "no_feed_forward", "mode", "out"])]
    ablate: bool,
}

impl SealArgs {
    fn options(&self) -> anyhow::Result<Options> {
        let taught = self.taught.as_deref().map(|file| self.taught(file)).transpose()?;
        self.cell.options(Options {
            second_arm: self.second_arm,
            speed: self.speed,
            hold: self.hold,
            start: self.start,
            survey: self.survey,
            retakes: self.retakes,
            mode: self.mode,
            feed_forward: !self.no_feed_forward,
            preview: !self.no_preview,
            vision_period: self.vision_ms,
            taught,
            ..Options::default()
        })
    }

    /// The seam in `file`, of a joint that the sensor is told; read once, and played until the process ends.
    fn taught(&self, file: &Path) -> anyhow::Result<&'static TaughtSeam> {
        let seam = TaughtSeam::read(file)?;
        let told = name_of(&self.cell.joint);
        if let Some(joint) = seam.joint() {
            let all: Vec<String> = JointName::value_variants().iter().map(name_of).collect();
            ensure!(
                all.iter().any(|name| name == joint),
                "taught seam {}: joint: {joint:?}, must be one of {}",
                file.display(),
                all.join(", ")
            );
            ensure!(
                joint == told,
                "--joint: {told}, must be {joint}, on which the seam in {} was taught",
                file.display()
            );
        }
        Ok(Box::leak(Box::new(seam)))
    }
}

fn survey(text: &str) -> Result<u8, String> {
    match text.parse() {
        Ok(number) if number == 0 || (2..=SECTIONS).contains(&usize::from(number)) => Ok(number),
        _ => Err(format!("must be 0 or from 2 to {SECTIONS}")),
    }
}

/// `cargo run --release` alone: one panel, with its report.
pub fn panel() -> Outcome {
    let campaign = Campaign {
        options: Options::default(),
        seed: 1,
        trials: 1,
    };
    report(&campaign, &Model::k3s(), Some(Path::new("target/tesaki/panel")), false)
}

/// `seal …`.
pub fn run(args: &SealArgs) -> Outcome {
    let SealArgs { trials, .. } = args;
    let model = trials.model()?;
    let campaign = trials.campaign(args.options()?);
    if args.ablate {
        let table = ablation::run(&campaign, &model)?;
        print_score(&table, &ablation::table(&table), &[], trials.json)?;
        return Ok(true);
    }
    report(&campaign, &model, trials.out.as_deref(), trials.json)
}

fn report(campaign: &Campaign, model: &Model, out: Option<&Path>, json: bool) -> Outcome {
    let result = campaign::run(campaign, model, out)?;
    print_score(&result.score, &words::score_table(&result.score), &result.files, json)?;
    Ok(result.score.passed())
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::taught::TaughtRow;
    use crate::whole_file::tests::folder;
    use clap::Parser;
    use nalgebra::Vector3;

    #[derive(Parser)]
    struct Line {
        #[command(flatten)]
        seal: SealArgs,
    }

    #[test]
    fn a_seam_taught_on_one_joint_is_not_played_on_another() {
        let rows = (0..=100).map(|k| TaughtRow {
            s: 0.002 * f64::from(k),
            point: Vector3::new(0.4 + 0.002 * f64::from(k), 0.0, 0.2),
            normal: Vector3::z(),
        });
        let unknown = TaughtSeam::new(rows.collect(), 0.2).unwrap();
        let folder = folder("seal-taught");
        let play = |seam: &TaughtSeam, joint: &[&str]| {
            let file = seam
                .write(&folder.join("seam.toml"), "a test's")
                .unwrap()
                .display()
                .to_string();
            let line = [&["line", "--taught", &file], joint].concat();
            let options = Line::try_parse_from(line).unwrap().seal.options();
            options
                .map(|options| options.taught.unwrap().length())
                .map_err(|error| error.to_string())
        };
        let vee = unknown.clone().of_joint("vee".into());
        assert_eq!(play(&vee, &["--joint", "vee"]), Ok(0.2));
        let file = folder.join("seam.toml");
        assert_eq!(
            play(&vee, &[]),
            Err(format!(
                "--joint: crank, must be vee, on which the seam in {} was taught",
                file.display()
            ))
        );
        let damaged = unknown.clone().of_joint("Vee".into());
        assert_eq!(
            play(&damaged, &["--joint", "vee"]),
            Err(format!(
                "taught seam {}: joint: \"Vee\", must be one of crank, crank-right, vee, lip, lip-right",
                file.display()
            ))
        );
        assert_eq!(
            play(&unknown, &["--joint", "lip"]),
            Ok(0.2),
            "an old file's is not known"
        );
    }
}
