//! Running steps: a heading, what the step prints, the time it took; the first failure ends the run.

use std::io::{BufRead, BufReader};
use std::path::{Path, PathBuf};
use std::process::{Command, Stdio};
use std::time::Instant;

use anyhow::{Context, Result, bail};

/// One check of the workspace.
pub struct Step {
    /// What `cargo xtask NAME` calls it.
    pub name: &'static str,
    /// What it shows, for the heading.
    pub shows: &'static str,
    /// Runs it; the text is a result worth a place in the closing line ("212 tests passed"), or empty.
    pub run: fn() -> Result<String>,
}

/// Runs `steps` in order.
pub fn run_all(steps: &[Step]) -> Result<()> {
    let start = Instant::now();
    let mut results = Vec::new();
    for (at, step) in steps.iter().enumerate() {
        println!("── {}/{} {}: {}", at + 1, steps.len(), step.name, step.shows);
        let start = Instant::now();
        let result = (step.run)().with_context(|| {
            let Step { name, shows, .. } = step;
            format!("step `{name}` ({shows}) failed; again with `cargo xtask {name}`")
        })?;
        println!("   {} ok, {:.1} s", step.name, start.elapsed().as_secs_f64());
        if !result.is_empty() {
            results.push(result);
        }
    }
    results.push(format!("{:.1} s", start.elapsed().as_secs_f64()));
    println!(
        "── all ok: {} of {} steps, {}",
        steps.len(),
        steps.len(),
        results.join(", ")
    );
    Ok(())
}

/// Top of the workspace.
pub fn root() -> PathBuf {
    let package = Path::new(env!("CARGO_MANIFEST_DIR"));
    package.parent().unwrap_or(package).to_path_buf()
}

/// The cargo that runs us, at the top of the workspace.
pub fn cargo() -> Command {
    let mut command = Command::new(std::env::var_os("CARGO").unwrap_or_else(|| "cargo".into()));
    command.current_dir(root());
    command
}

/// `tesaki`, whose arguments follow.
pub fn tesaki() -> Command {
    let mut command = cargo();
    command.args(["run", "--release", "--quiet", "--package", "sim_host", "--"]);
    command
}

/// Runs `command` to its end, output shown; an error names the command.
pub fn run(command: &mut Command) -> Result<()> {
    let line = text(command);
    let status = command.status().with_context(|| format!("cannot start `{line}`"))?;
    if !status.success() {
        bail!("`{line}` ended with {status}");
    }
    Ok(())
}

/// What `command` printed on stdout; an error names the command.
pub fn output(command: &mut Command) -> Result<String> {
    let line = text(command);
    let output = command.stderr(Stdio::inherit()).output();
    let output = output.with_context(|| format!("cannot start `{line}`"))?;
    if !output.status.success() {
        bail!("`{line}` ended with {}", output.status);
    }
    Ok(String::from_utf8_lossy(&output.stdout).trim().to_string())
}

/// As [`run`], with every line of stdout also given to `see`.
pub fn run_watched(command: &mut Command, mut see: impl FnMut(&str)) -> Result<()> {
    let line = text(command);
    let mut child = command
        .stdout(Stdio::piped())
        .spawn()
        .with_context(|| format!("cannot start `{line}`"))?;
    let stdout = child.stdout.take().context("no pipe from the child")?;
    for printed in BufReader::new(stdout).lines() {
        let printed = printed?;
        println!("{printed}");
        see(&printed);
    }
    let status = child.wait()?;
    if !status.success() {
        bail!("`{line}` ended with {status}");
    }
    Ok(())
}

fn text(command: &Command) -> String {
    let program = Path::new(command.get_program()).file_name().unwrap_or_default();
    let words = std::iter::once(program).chain(command.get_args());
    words.map(|word| word.to_string_lossy()).collect::<Vec<_>>().join(" ")
}

/// Tests counted by one closing line of the test harness ("test result: ok. 12 passed; …"); zero for any other line.
pub fn tests_passed(line: &str) -> u32 {
    let Some(counts) = line.strip_prefix("test result: ok. ") else {
        return 0;
    };
    counts
        .split(' ')
        .next()
        .and_then(|count| count.parse().ok())
        .unwrap_or(0)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_closing_line_counts_its_passed_tests_and_no_other_line_counts() {
        assert_eq!(
            tests_passed("test result: ok. 12 passed; 0 failed; 1 ignored; 0 measured"),
            12
        );
        assert_eq!(tests_passed("test arm::ik ... ok"), 0);
        assert_eq!(tests_passed("test result: FAILED. 3 passed; 1 failed"), 0);
    }
}
