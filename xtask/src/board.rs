//! The boards that there are images for.

use anyhow::{Context, Result};

/// One board.
#[derive(Debug, PartialEq, Eq)]
pub struct Board {
    /// Its name, which is also the feature of `firmware` and the folder of its images.
    pub name: &'static str,
    /// What it is.
    pub what: &'static str,
    /// Its microcontroller as probe-rs calls it, and where its parameters lie; nothing for an emulated board.
    pub probe: Option<Probe>,
}

/// What a probe has to know of a board.
#[derive(Debug, PartialEq, Eq)]
pub struct Probe {
    /// The chip.
    pub chip: &'static str,
    /// Start of PARAMETERS in the board's linker script.
    pub parameters: u32,
    /// Its length in bytes.
    pub parameters_max: u64,
}

/// The machine that QEMU plays, which the tests run on.
pub const REFERENCE: Board = Board {
    name: "mps2",
    what: "Arm MPS2 with image AN386 (Cortex-M4F), under QEMU",
    probe: None,
};

/// The board that one can buy.
const NUCLEO: Board = Board {
    name: "nucleo-h743",
    what: "ST NUCLEO-H743ZI2 (Cortex-M7)",
    probe: Some(Probe {
        chip: "STM32H743ZITx",
        parameters: 0x0810_0000,
        parameters_max: 128 * 1024,
    }),
};

/// All of them.
pub const BOARDS: [Board; 2] = [REFERENCE, NUCLEO];

/// The board called `name`.
pub fn named(name: &str) -> Result<&'static Board> {
    BOARDS
        .iter()
        .find(|board| board.name == name)
        .with_context(|| format!("board {name:?}: not one of {}", names()))
}

/// The names of [`BOARDS`], for a message.
pub fn names() -> String {
    BOARDS.each_ref().map(|board| board.name).join(", ")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn an_unknown_board_is_told_the_known_ones() {
        let error = named("uno").err().map(|error| error.to_string());
        assert_eq!(error.as_deref(), Some("board \"uno\": not one of mps2, nucleo-h743"));
    }

    #[test]
    fn parameters_lie_where_the_linker_script_has_them() {
        let script = include_str!("../../hal/src/board/nucleo_h743/link.x");
        let probe = NUCLEO.probe.as_ref().unwrap();
        let line = format!(
            "PARAMETERS : ORIGIN = {:#010x}, LENGTH = {}K",
            probe.parameters,
            probe.parameters_max / 1024
        );
        assert!(script.contains(&line), "{line}");
    }
}
