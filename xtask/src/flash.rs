//! `cargo xtask flash`: an image, and what it is to be, onto a board.
//!
//! By probe-rs, which drives the ST-LINK that is on the board. Image and parameters are written apart from each other:
//! they lie in different banks of the flash, so either can be renewed alone.

use std::ffi::OsString;
use std::fs;
use std::path::Path;
use std::process::Command;

use anyhow::{Context, Result, bail};

use crate::board::{BOARDS, Board, Probe, named};
use crate::image;
use crate::step::{output, run};

/// The program.
const PROBE: &str = "probe-rs";

/// The image that is meant if none is named.
const CONTROLLER: &str = "controller";

/// What is to be written where.
#[derive(Debug, PartialEq, Eq)]
pub struct Order<'a> {
    board: &'a str,
    image: &'a str,
    parameters: Option<&'a str>,
}

impl<'a> Order<'a> {
    /// Reads `[BOARD] [IMAGE] [--params FILE]`.
    pub fn of(words: &[&'a str]) -> Result<Self> {
        let (mut places, mut parameters) = (Vec::new(), None);
        let mut words = words.iter();
        while let Some(word) = words.next() {
            match *word {
                "--params" => parameters = Some(*words.next().context("--params: a file must follow")?),
                word if word.starts_with('-') => bail!("option {word:?}: there is only --params FILE"),
                word => places.push(word),
            }
        }
        let (board, image) = match places[..] {
            [] => (default_board(), CONTROLLER),
            [board] => (board, CONTROLLER),
            [board, image] => (board, image),
            [_, _, word, ..] => bail!("{word:?}: board and image are there already"),
        };
        Ok(Order {
            board,
            image,
            parameters,
        })
    }
}

/// The first board that a probe can reach.
fn default_board() -> &'static str {
    BOARDS
        .iter()
        .find(|board| board.probe.is_some())
        .map_or("", |board| board.name)
}

/// Builds and writes.
pub fn run_order(order: &Order) -> Result<()> {
    let board = named(order.board)?;
    let Some(probe) = &board.probe else {
        bail!(
            "board {}: is emulated, there is nothing to flash; `cargo run --release -- seal --on qemu` runs its images",
            board.name
        );
    };
    let parameters = order.parameters.map(|file| checked(file, probe)).transpose()?;
    image::known(order.image)?;
    if output(Command::new(PROBE).arg("--version")).is_err() {
        bail!("{PROBE} is not installed: `cargo install probe-rs-tools --locked`, or a binary from its releases");
    }
    image::build_one(board, order.image)?;
    for words in commands(board, probe, order.image, parameters) {
        run(Command::new(PROBE).args(words))?;
    }
    Ok(())
}

/// What probe-rs is told, call by call.
fn commands(board: &Board, probe: &Probe, name: &str, parameters: Option<&Path>) -> Vec<Vec<OsString>> {
    let words = |words: &[&str]| words.iter().map(OsString::from).collect::<Vec<_>>();
    let mut calls = vec![words(&[
        "download",
        "--chip",
        probe.chip,
        "--verify",
        "--binary-format",
        "elf",
    ])];
    calls[0].push(image::path(board, name).into());
    if let Some(file) = parameters {
        let base = format!("{:#x}", probe.parameters);
        let mut call = words(&[
            "download",
            "--chip",
            probe.chip,
            "--verify",
            "--binary-format",
            "bin",
            "--base-address",
            &base,
        ]);
        call.push(file.into());
        calls.push(call);
    }
    calls.push(words(&["reset", "--chip", probe.chip]));
    calls
}

/// `file`, if it holds parameters that have room on the board.
fn checked<'a>(file: &'a str, probe: &Probe) -> Result<&'a Path> {
    let bytes = fs::read(file).with_context(|| format!("--params {file}: cannot be read"))?;
    // The mark at the beginning of every parameter region, hal::board::parameters; what follows is the image's to judge.
    if !bytes.starts_with(b"TSK1") {
        bail!(
            "--params {file}: holds no parameters; `cargo run --release -- seal --out DIR` writes DIR/controller.params and DIR/camera.params"
        );
    }
    if bytes.len() as u64 > probe.parameters_max {
        bail!(
            "--params {file}: {} bytes, must be at most {}",
            bytes.len(),
            probe.parameters_max
        );
    }
    Ok(Path::new(file))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_board_that_one_can_buy_and_its_controller_are_meant_if_nothing_is_said() {
        let order = Order::of(&["--params", "x.bin"]).unwrap();
        let expected = Order {
            board: "nucleo-h743",
            image: "controller",
            parameters: Some("x.bin"),
        };
        assert_eq!(order, expected);
        assert_eq!(Order::of(&["mps2"]).unwrap().board, "mps2");
    }

    #[test]
    fn wrong_words_are_named() {
        let said = |words: &[&str]| Order::of(words).unwrap_err().to_string();
        assert_eq!(said(&["--params"]), "--params: a file must follow");
        assert_eq!(said(&["--chip"]), "option \"--chip\": there is only --params FILE");
        assert_eq!(said(&["a", "b", "c"]), "\"c\": board and image are there already");
    }

    #[test]
    fn an_emulated_board_is_not_flashed() {
        let error = run_order(&Order::of(&["mps2"]).unwrap()).unwrap_err().to_string();
        assert!(error.starts_with("board mps2: is emulated"), "{error}");
    }

    #[test]
    fn image_and_parameters_go_to_their_places_and_then_the_board_starts() {
        let board = named("nucleo-h743").unwrap();
        let calls = commands(
            board,
            board.probe.as_ref().unwrap(),
            "controller",
            Some(Path::new("p.bin")),
        );
        let text: Vec<String> = calls
            .iter()
            .map(|call| call.join(" ".as_ref()).to_string_lossy().into_owned())
            .collect();
        assert!(
            text[0].starts_with("download --chip STM32H743ZITx --verify --binary-format elf /")
                && text[0].ends_with("images/nucleo-h743/controller")
        );
        assert!(text[1].ends_with("--binary-format bin --base-address 0x8100000 p.bin"));
        assert_eq!(text[2], "reset --chip STM32H743ZITx");
    }
}
