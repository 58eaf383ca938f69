//! The steps, cheapest first, so that a slip of the pen is told in seconds and not after the last test.

use anyhow::{Context, Result, bail};

use crate::step::{Step, cargo, output, run, run_watched, tesaki, tests_passed};
use crate::{core_library, image, rooms, stack};

/// Every step of `cargo xtask test`, in the order they run.
pub const STEPS: [Step; 12] = [
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
        shows: "clippy on the host and on every board, warnings denied",
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
    Step {
        name: "train",
        shows: "the net of rows learns its committed weights again, bit for bit",
        run: train,
    },
    Step {
        name: "panics",
        shows: "the images link only if no panic can be reached",
        run: image::no_panic,
    },
    Step {
        name: "build",
        shows: "images for every board, what they take, and that they compute nothing in double precision",
        run: image::build,
    },
    Step {
        name: "stack",
        shows: "the stack cannot grow into the variables",
        run: stack::check,
    },
    Step {
        name: "target",
        shows: "the images under QEMU, in lock step with the cell",
        run: image::in_the_loop,
    },
    Step {
        name: "bench",
        shows: "no stage of the cycle grew by more than 5 % over README's table",
        run: image::bench,
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
    image::lint()?;
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
    run_watched(cargo().args(["test", "--workspace"]), |line| {
        passed += tests_passed(line)
    })?;
    if passed == 0 {
        bail!("no test ran");
    }
    Ok(format!("{passed} tests passed"))
}

fn train() -> Result<String> {
    run(tesaki().args(["train", "--net", "rows", "--check"]))
        .context("if it is meant: `cargo run --release -- train --net rows --out DIR`")?;
    Ok(String::new())
}

/// rustfmt and clippy come with rustup's default profile but not with its minimal one.
fn component(subcommand: &str, name: &str) -> Result<()> {
    output(cargo().args([subcommand, "--version"]))
        .with_context(|| format!("{name} is not installed: `rustup component add {name}`, or your system's package"))?;
    Ok(())
}
