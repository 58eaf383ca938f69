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

use crate::whole_file;
use anyhow::Context;
use clap::error::ErrorKind;
use clap::{Command, CommandFactory, FromArgMatches, Parser, Subcommand};
use std::fmt::Display;
use std::io::Write;
use std::path::{Path, PathBuf};
use std::process::ExitCode;
use std::str::FromStr;

/// Controller firmware for robot arms guided by a camera on the hand, and the emulated cell that it is tested in.
#[derive(Parser)]
#[command(
    name = "tesaki",
    version,
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
    /// Train a net: the neural seam finder, or the one that finds a lap joint's edge
    Train(train::TrainArgs),
    /// Find the camera, its slit and its place on the arm
    Calibrate(calibrate::CalibrateArgs),
}

/// What a verb ends with: it met its criterion, or it did not; an error is bad input.
type Outcome = anyhow::Result<bool>;

/// The command line's grammar. A negative number is a value for every verb, so that its range refuses it where it is none.
fn grammar() -> Command {
    fn with_negative_numbers(verb: Command) -> Command {
        verb.allow_negative_numbers(true).mut_subcommands(with_negative_numbers)
    }
    with_negative_numbers(CommandLine::command())
}

/// Runs the command line and gives the exit status.
pub fn main() -> ExitCode {
    let line = grammar()
        .try_get_matches()
        .and_then(|matches| CommandLine::from_arg_matches(&matches));
    let line = match line {
        Ok(line) => line,
        Err(error) if error.kind() == ErrorKind::DisplayHelpOnMissingArgumentOrSubcommand => {
            return refuse("what to do is missing: give one of the commands that --help lists");
        }
        Err(error) if error.use_stderr() => return refuse(&one_line(&error)),
        Err(help) => {
            return match print_text(&help.to_string()) {
                Ok(()) => ExitCode::SUCCESS,
                Err(error) => refuse(&format!("{error:#}")),
            };
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
    let lines: Vec<String> = reason.lines().map(with_short_numbers).collect();
    eprintln!("error: {}", lines.join(" "));
    ExitCode::from(2)
}

/// `line` with numbers of hundreds of digits, as a damaged file or a slip of the hand makes them, as powers of ten: 1e308.
fn with_short_numbers(line: &str) -> String {
    const LONG: usize = 24; // an f64 of ordinary size takes at most 20
    let short = |word: &str| {
        let number = word.trim_matches(['[', ']', '(', ')', '±', ',', ';', ':', '\'']);
        let value = number.parse::<f64>().ok().filter(|_| number.len() > LONG);
        value.map_or(word.into(), |value| word.replacen(number, &format!("{value:e}"), 1))
    };
    line.split(' ').map(short).collect::<Vec<_>>().join(" ")
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
    words.join(" ").trim_start_matches("error: ").replace(" tip: ", "; ")
}

/// A clap parser for numbers in a closed range, with the range in its message.
pub fn number_in<T: Bound>(min: T, max: T) -> impl Fn(&str) -> Result<T, String> + Clone + Send + Sync + 'static {
    move |text| within(text, min, max).ok_or_else(|| format!("must be a number from {min} to {max}"))
}

/// The same for whole numbers.
fn whole_in<T: Bound>(min: T, max: T) -> impl Fn(&str) -> Result<T, String> + Clone + Send + Sync + 'static {
    move |text| within(text, min, max).ok_or_else(|| format!("must be a whole number from {min} to {max}"))
}

/// What a range of numbers can be of.
pub trait Bound: FromStr + PartialOrd + Display + Copy + Send + Sync + 'static {}

impl<T: FromStr + PartialOrd + Display + Copy + Send + Sync + 'static> Bound for T {}

fn within<T: Bound>(text: &str, min: T, max: T) -> Option<T> {
    text.parse().ok().filter(|value| (min..=max).contains(value))
}

/// The same for a seed.
fn seed(text: &str) -> Result<u64, String> {
    text.parse()
        .map_err(|_| "must be a whole number from 0 to 2^64 - 1".to_string())
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

/// Whether what comes of a run can be saved where --save says: known before the run.
fn check_save(path: Option<&Path>) -> anyhow::Result<()> {
    path.map_or(Ok(()), whole_file::check).context("--save")
}

/// The same of `file` in the folder that --out names.
fn check_out(folder: Option<&Path>, file: &str) -> anyhow::Result<()> {
    folder
        .map_or(Ok(()), |folder| whole_file::check(&folder.join(file)))
        .context("--out")
}

/// Prints a value as the one JSON value on stdout.
fn print_json(value: &impl serde::Serialize) -> anyhow::Result<()> {
    print_text(&format!("{}\n", serde_json::to_string(value)?))
}

/// Prints a score: as JSON, or as `text` and the names of the `files` that were written.
fn print_score(score: &impl serde::Serialize, text: &str, files: &[PathBuf], json: bool) -> anyhow::Result<()> {
    if json {
        return print_json(score);
    }
    print_text(text)?;
    print_files(files)
}

/// Prints the names of the files that were written.
fn print_files(files: &[PathBuf]) -> anyhow::Result<()> {
    files
        .iter()
        .try_for_each(|file| print_text(&format!("{}\n", file.display())))
}

/// Prints to stdout; a reader that has gone away (`| head`) is no error of ours.
fn print_text(text: &str) -> anyhow::Result<()> {
    let mut stdout = std::io::stdout();
    match stdout.write_all(text.as_bytes()).and_then(|()| stdout.flush()) {
        Err(error) if error.kind() != std::io::ErrorKind::BrokenPipe => Err(error).context("stdout: cannot be written"),
        _ => Ok(()),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::calibration::board::Grid;
    use std::any::TypeId;

    /// Every option of `verb` and of the verbs under it that takes numbers, with the words that lead to it.
    fn numeric(verb: &Command, words: &[&str]) -> Vec<(Vec<String>, String)> {
        let kinds = [
            TypeId::of::<u8>(),
            TypeId::of::<u32>(),
            TypeId::of::<u64>(),
            TypeId::of::<usize>(),
            TypeId::of::<f32>(),
            TypeId::of::<f64>(),
            TypeId::of::<Grid>(),
        ];
        let here = verb.get_arguments().filter(|option| {
            let kind = option.get_value_parser().type_id();
            option.get_action().takes_values() && kinds.iter().any(|number| kind == *number)
        });
        let words_to = |name: &str| words.iter().chain([&name]).map(|word| word.to_string()).collect();
        let here = here.map(|option| {
            let name = format!("--{}", option.get_long().expect("a long name"));
            (words_to(&name), option.get_help().expect("help").to_string())
        });
        let below = verb
            .get_subcommands()
            .flat_map(|verb| numeric(verb, &[words, &[verb.get_name()]].concat()));
        here.chain(below).collect()
    }

    #[test]
    fn a_refused_number_of_hundreds_of_digits_is_told_as_a_power_of_ten() {
        let (huge, tiny) = (1e308, -2.5e-300);
        assert_eq!(
            with_short_numbers(&format!(
                "gear = {huge}; [{huge:.3}, {tiny}]: must be 0.1 to {}",
                0.1 + 0.2
            )),
            "gear = 1e308; [1e308, -2.5e-300]: must be 0.1 to 0.30000000000000004"
        );
        let name = "1".repeat(30);
        assert_eq!(
            with_short_numbers(&format!("file {name}.yml: within ±{huge}")),
            format!("file {name}.yml: within ±1e308")
        );
    }

    #[test]
    fn every_number_is_refused_with_its_name_and_range_which_the_help_states() {
        let options = numeric(&grammar(), &["tesaki"]);
        assert!(options.len() > 40, "{} options", options.len());
        for (words, help) in options {
            for value in ["x", "1.5.", "-1000000000", "100000000000000000000"] {
                let line = words.iter().map(String::as_str).chain([value]);
                let error = one_line(&grammar().try_get_matches_from(line).expect_err("refused"));
                let name = words.last().expect("a name");
                assert!(error.contains(&format!("'{value}' for '{name} ")), "{words:?}: {error}");
                let (_, range) = error.rsplit_once("from ").expect(&error);
                let range = range.split(", as").next().expect("a range");
                assert!(
                    error.contains("must be") && help.contains(range),
                    "{words:?}: {error}; {help}"
                );
            }
        }
    }
}
