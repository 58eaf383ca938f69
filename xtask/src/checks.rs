//! The steps, cheapest first, so that a slip of the pen is told in seconds and not after the last test.

use anyhow::{Context, Result, bail};

use crate::step::{Step, cargo, output, run, run_watched};
use crate::{core_library, rooms};

/// Every step of `cargo xtask test`, in the order they run.
pub const STEPS: [Step; 6] = [
    Step {
        name: "fmt",
        shows: "the sources are formatted",
        run: fmt,
    },
    Step {
        name: "rooms",
        shows: "the core names nothing that it must not",
        run: rooms::check,
    },
    Step {
        name: "core",
        shows: "hal and firmware are no_std: they build for the target",
        run: core,
    },
    Step {
        name: "lint",
        shows: "clippy on all targets, warnings denied",
        run: lint,
    },
    Step {
        name: "doc",
        shows: "documentation, warnings denied",
        run: doc,
    },
    Step {
        name: "host",
        shows: "every test on this machine",
        run: host,
    },
];

/// The names of [`STEPS`], for a message.
pub fn names() -> String {
    STEPS.map(|step| step.name).join(", ")
}

fn fmt() -> Result<String> {
    component("fmt", "rustfmt")?;
    run(cargo().args(["fmt", "--all", "--check"])).context("`cargo fmt --all` puts it right")?;
    Ok(String::new())
}

fn core() -> Result<String> {
    let toolchain = core_library::find()?;
    for package in ["hal", "firmware"] {
        run(toolchain
            .cargo()
            .args(["build", "--release", "--lib", "--package", package]))?;
    }
    Ok(String::new())
}

fn lint() -> Result<String> {
    component("clippy", "clippy")?;
    run(cargo().args(["clippy", "--workspace", "--all-targets", "--", "-D", "warnings"]))?;
    Ok(String::new())
}

fn doc() -> Result<String> {
    run(cargo()
        .args(["doc", "--workspace", "--no-deps"])
        .env("RUSTDOCFLAGS", "-D warnings"))?;
    Ok(String::new())
}

fn host() -> Result<String> {
    let mut passed = 0;
    run_watched(cargo().args(["test", "--workspace"]), |line| passed += passed_in(line))?;
    if passed == 0 {
        bail!("no test ran");
    }
    Ok(format!("{passed} tests passed"))
}

/// Tests counted by one closing line of the test harness ("test result: ok. 12 passed; …"); zero for any other line.
fn passed_in(line: &str) -> u32 {
    let Some(counts) = line.strip_prefix("test result: ok. ") else {
        return 0;
    };
    counts
        .split(' ')
        .next()
        .and_then(|count| count.parse().ok())
        .unwrap_or(0)
}

/// rustfmt and clippy come with rustup's default profile but not with its minimal one.
fn component(subcommand: &str, name: &str) -> Result<()> {
    output(cargo().args([subcommand, "--version"]))
        .with_context(|| format!("{name} is not installed: `rustup component add {name}`, or your system's package"))?;
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_closing_line_counts_its_passed_tests_and_no_other_line_counts() {
        assert_eq!(
            passed_in("test result: ok. 12 passed; 0 failed; 1 ignored; 0 measured"),
            12
        );
        assert_eq!(passed_in("test arm::ik ... ok"), 0);
        assert_eq!(passed_in("test result: FAILED. 3 passed; 1 failed"), 0);
    }
}
