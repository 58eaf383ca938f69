//! `cargo xtask`: builds, checks and tests everything, and finds by itself what that takes.
//!
//! Each check is a step with a name; `cargo xtask test` runs them all, cheapest first, and a step that fails says how to
//! run it alone. What a step installs it announces first. Depends on nothing that takes long to compile.

mod board;
mod checks;
mod core_library;
mod debian;
mod flash;
mod image;
mod rooms;
mod stack;
mod step;
mod symbols;

use std::process::ExitCode;

use anyhow::{Context, Result, bail};

const HELP: &str = "\
Usage: cargo xtask COMMAND

  test    every step below, in this order; what .ci/run calls
  fmt     the sources are formatted (rustfmt)
  rooms   firmware/ and hal/ name nothing that they must not: sim_host, f64, std, unsafe, mul_add
  core    hal and firmware build for thumbv7em-none-eabihf: proof of no_std
  lint    clippy on the host and on every board, warnings denied
  doc     documentation, warnings denied
  host    every test on this machine (cargo test --workspace)
  panics  the images link with a panic handler that does not exist: proof that no panic can be reached
  build   images for every board (target/images), what they take of flash and RAM, and that no f64 is in them; `build BOARD` for one
  stack   the deepest that the stack can go, from the image's code; held against what was painted
  target  the images under QEMU, in lock step with the cell
  bench   no stage of the control cycle grew by more than 5 % over README's table

  flash [BOARD] [IMAGE] [--params FILE]
          builds an image (controller) and writes it to a board (nucleo-h743) by probe-rs; with --params also what
          it is to be: `cargo run --release -- seal --out DIR` writes DIR/controller.params and DIR/camera.params

Boards: mps2 (Arm MPS2 image AN386, under QEMU), nucleo-h743 (ST NUCLEO-H743ZI2).

`core`, `lint`, `panics`, `build`, `stack`, `target`, `bench` and `flash` need the core library of thumbv7em-none-eabihf. They take the first of: the active
toolchain's; one built once under target/ from the sources of Debian's rustc-web (installed by apt-get if this is Debian
and you are root); `rustup target add`. `stack`, `target` and `bench` need qemu-system-arm, and install it likewise. They say what they
install before they do.";

/// Something that is there to be done.
type Job<'a> = Box<dyn FnOnce() -> Result<()> + 'a>;

fn main() -> ExitCode {
    let arguments: Vec<String> = std::env::args().skip(1).collect();
    let names: Vec<&str> = arguments.iter().map(String::as_str).collect();
    if let [] | ["--help" | "-h" | "help"] = names.as_slice() {
        println!("{HELP}");
        return ExitCode::SUCCESS;
    }
    let (outcome, bad) = match job(&names) {
        Ok(job) => (job(), ExitCode::FAILURE),
        Err(error) => (Err(error), ExitCode::from(2)),
    };
    match outcome {
        Ok(()) => ExitCode::SUCCESS,
        Err(error) => {
            eprintln!("error: {error:#}");
            bad
        }
    }
}

/// What these words ask for; an error if there is no such thing.
fn job<'a>(words: &[&'a str]) -> Result<Job<'a>> {
    Ok(match words {
        ["test"] => Box::new(|| step::run_all(&checks::STEPS)),
        ["build", name] => {
            let board = board::named(name)?;
            Box::new(|| image::build_for(board).map(drop))
        }
        ["flash", words @ ..] => {
            let order = flash::Order::of(words)?;
            Box::new(move || flash::run_order(&order))
        }
        [name] => {
            let known = checks::STEPS.iter().find(|step| step.name == *name);
            let step = known.with_context(|| format!("command {name:?}: not one of test, {}", checks::names()))?;
            Box::new(|| step::run_all(std::slice::from_ref(step)))
        }
        _ => bail!("one command is taken, not {}: see cargo xtask --help", words.len()),
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_there_is_not_is_refused_before_anything_is_done() {
        let refused = |words: &[&str]| job(words).err().map(|error| error.to_string()).unwrap_or_default();
        assert_eq!(
            refused(&["build", "foo"]),
            "board \"foo\": not one of mps2, nucleo-h743"
        );
        assert_eq!(refused(&["flash", "foo"]), refused(&["build", "foo"]));
        assert!(refused(&["flash", "nucleo-h743", "foo"]).starts_with("image \"foo\": not one of controller, "));
        assert!(refused(&["flash", "--params", "no.params"]).starts_with("--params no.params: cannot be read"));
        assert!(refused(&["foo"]).starts_with("command \"foo\": not one of test, fmt, "));
        assert_eq!(
            refused(&["fmt", "foo"]),
            "one command is taken, not 2: see cargo xtask --help"
        );
    }
}
