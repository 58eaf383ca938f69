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

/// What is to be written where, all of which there is.
#[derive(Debug, PartialEq, Eq)]
pub struct Order<'a> {
    board: &'static Board,
    probe: &'static Probe,
    image: &'a str,
    parameters: Option<&'a Path>,
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
        let board = named(board)?;
        let Some(probe) = &board.probe else {
            bail!(
                "board {}: is emulated, there is nothing to flash; `cargo run --release -- seal --on qemu` runs its images",
                board.name
            );
        };
        image::known(image)?;
        Ok(Order {
            board,
            probe,
            image,
            parameters: parameters.map(|file| checked(file, probe)).transpose()?,
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
    if output(Command::new(PROBE).arg("--version")).is_err() {
        bail!("{PROBE} is not installed: `cargo install probe-rs-tools --locked`, or a binary from its releases");
    }
    image::build_one(order.board, order.image)?;
    for words in commands(order) {
        run(Command::new(PROBE).args(words))?;
    }
    Ok(())
}

/// What probe-rs is told, call by call.
fn commands(order: &Order) -> Vec<Vec<OsString>> {
    let probe = order.probe;
    let words = |words: &[&str]| words.iter().map(OsString::from).collect::<Vec<_>>();
    let mut calls = vec![words(&[
        "download",
        "--chip",
        probe.chip,
        "--verify",
        "--binary-format",
        "elf",
    ])];
    calls[0].push(image::path(order.board, order.image).into());
    if let Some(file) = order.parameters {
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
        let order = Order::of(&[]).unwrap();
        assert_eq!(
            (order.board.name, order.image, order.parameters),
            ("nucleo-h743", "controller", None)
        );
    }

    #[test]
    fn wrong_words_are_named() {
        let said = |words: &[&str]| Order::of(words).unwrap_err().to_string();
        assert_eq!(said(&["--params"]), "--params: a file must follow");
        assert_eq!(said(&["--chip"]), "option \"--chip\": there is only --params FILE");
        assert_eq!(said(&["a", "b", "c"]), "\"c\": board and image are there already");
        assert!(said(&["mps2"]).starts_with("board mps2: is emulated, there is nothing to flash"));
    }

    #[test]
    fn image_and_parameters_go_to_their_places_and_then_the_board_starts() {
        let mut order = Order::of(&["nucleo-h743"]).unwrap();
        order.parameters = Some(Path::new("p.bin"));
        let calls = commands(&order);
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
