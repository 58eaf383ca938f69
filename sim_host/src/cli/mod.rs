//! The command line: verbs, and what they all share.
//!
//! Exit status: 0 when the job met its own criterion, 1 when it did not, 2 for bad arguments and bad files, with one line that says
//! what is wrong. With `--json` one JSON value goes to stdout and nothing else; progress and logs go to stderr.

mod arm;
mod bench;
mod calibrate;
mod cell;
mod jitter;
mod latency;
mod look;
mod replay;
mod seal;
mod teach;
mod train;

use clap::error::ErrorKind;
use clap::{Parser, Subcommand};
use std::io::Write;
use std::path::PathBuf;
use std::process::ExitCode;

/// Controller firmware for robot arms guided by a camera on the hand, and the emulated cell that it is tested in.
#[derive(Parser)]
#[command(
    name = "tesaki",
    version,
    about,
    after_help = "Without a verb: seals one panel and says what it did."
)]
struct CommandLine {
    #[command(subcommand)]
    verb: Option<Verb>,
}

#[derive(Subcommand)]
enum Verb {
    /// Run a sealing job in the emulated cell
    Seal(seal::SealArgs),
    /// Drive along a seam that nobody has shown, and write the taught seam
    Teach(teach::TeachArgs),
    /// Re-run a log's inputs through the core and compare the outputs bit for bit
    Replay(replay::ReplayArgs),
    /// Kinematics of a model: forward, inverse, Jacobian
    Arm(arm::ArmArgs),
    /// Run one vision routine on image files
    Look(look::LookArgs),
    /// Measure how evenly the control cycle comes and what it takes
    Jitter(jitter::JitterArgs),
    /// Measure how late the camera exposes and how old sightings are, by the control loop itself
    Latency(latency::LatencyArgs),
    /// Count what the control cycle costs, stage by stage, on the emulated Cortex-M
    Bench(bench::BenchArgs),
    /// Train the neural seam finder
    Train(train::TrainArgs),
    /// Find the camera, its slit and its place on the arm
    Calibrate(calibrate::CalibrateArgs),
}

/// What a verb ends with: it met its criterion, or it did not; an error is bad input.
type Outcome = anyhow::Result<bool>;

/// Runs the command line and gives the exit status.
pub fn main() -> ExitCode {
    let line = match CommandLine::try_parse() {
        Ok(line) => line,
        Err(error) if error.kind() == ErrorKind::DisplayHelpOnMissingArgumentOrSubcommand => {
            return refuse("what to do is missing: give one of the commands that --help lists");
        }
        Err(error) if error.use_stderr() => return refuse(&one_line(&error)),
        Err(help) => {
            print_text(&help.to_string());
            return ExitCode::SUCCESS;
        }
    };
    let outcome = match line.verb {
        None => seal::panel(),
        Some(Verb::Seal(args)) => seal::run(&args),
        Some(Verb::Teach(args)) => teach::run(&args),
        Some(Verb::Replay(args)) => replay::run(&args),
        Some(Verb::Arm(args)) => arm::run(&args),
        Some(Verb::Look(args)) => look::run(&args),
        Some(Verb::Jitter(args)) => jitter::run(&args),
        Some(Verb::Latency(args)) => latency::run(&args),
        Some(Verb::Bench(args)) => bench::run(&args),
        Some(Verb::Train(args)) => train::run(&args),
        Some(Verb::Calibrate(args)) => calibrate::run(&args),
    };
    match outcome {
        Ok(true) => ExitCode::SUCCESS,
        Ok(false) => ExitCode::from(1),
        Err(error) => refuse(&format!("{error:#}")),
    }
}

fn refuse(reason: &str) -> ExitCode {
    eprintln!("error: {}", reason.lines().collect::<Vec<_>>().join(" "));
    ExitCode::from(2)
}

/// clap's message without its usage and hints, on one line: it names the option, the value and what is allowed.
fn one_line(error: &clap::Error) -> String {
    let text = error.to_string();
    let words: Vec<&str> = text
        .lines()
        .take_while(|line| !line.starts_with("Usage:") && !line.starts_with("For more information"))
        .map(str::trim)
        .filter(|line| !line.is_empty())
        .collect();
    words.join(" ").trim_start_matches("error: ").to_string()
}

/// A clap parser for a number in a closed range, with the range in its message.
fn number_in(min: f64, max: f64) -> impl Fn(&str) -> Result<f64, String> + Clone + Send + Sync + 'static {
    move |text| match text.parse::<f64>() {
        Ok(value) if (min..=max).contains(&value) => Ok(value),
        _ => Err(format!("must be a number from {min} to {max}")),
    }
}

/// The same for a whole number.
fn whole_in(min: u64, max: u64) -> impl Fn(&str) -> Result<u64, String> + Clone + Send + Sync + 'static {
    move |text| match text.parse() {
        Ok(value) if (min..=max).contains(&value) => Ok(value),
        _ => Err(format!("must be a whole number from {min} to {max}")),
    }
}

/// The same for a time in ms that must be a whole number of 5 ms cycles; gives the cycles.
fn cycles_in(min_ms: u32, max_ms: u32) -> impl Fn(&str) -> Result<u8, String> + Clone + Send + Sync + 'static {
    move |text| match text.parse::<u32>() {
        Ok(ms) if (min_ms..=max_ms).contains(&ms) && ms.is_multiple_of(5) => {
            u8::try_from(ms / 5).map_err(|error| error.to_string())
        }
        _ => Err(format!("must be a multiple of 5 from {min_ms} to {max_ms}")),
    }
}

/// Prints a value as the one JSON value on stdout.
fn print_json(value: &impl serde::Serialize) -> anyhow::Result<()> {
    print_text(&format!("{}\n", serde_json::to_string(value)?));
    Ok(())
}

/// Prints a score: as JSON, or as `text` and the names of the `files` that were written.
fn print_score(score: &impl serde::Serialize, text: &str, files: &[PathBuf], json: bool) -> anyhow::Result<()> {
    if json {
        return print_json(score);
    }
    print_text(text);
    files
        .iter()
        .for_each(|file| print_text(&format!("{}\n", file.display())));
    Ok(())
}

/// Prints to stdout; a reader that has gone away (`| head`) is no error of ours.
fn print_text(text: &str) {
    let _ = std::io::stdout().write_all(text.as_bytes());
}
