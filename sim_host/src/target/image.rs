//! Where the images are.

use anyhow::{Context, bail};
use std::path::PathBuf;

/// Folder of the images beside the build folders, as `cargo xtask build` makes it.
const FOLDER: &str = "images/mps2";

/// The image called `name` for the emulated board; an error says how to make it.
pub fn find(name: &str) -> anyhow::Result<PathBuf> {
    let program = std::env::current_exe().context("cannot tell where this program stands")?;
    // target/release/tesaki and target/debug/deps/tests-…: target/images is beside one of the folders above.
    let candidates = program
        .ancestors()
        .skip(1)
        .take(4)
        .map(|folder| folder.join(FOLDER).join(name));
    for path in candidates {
        if path.is_file() {
            return Ok(path);
        }
    }
    bail!(
        "no image {FOLDER}/{name} in the folders above {}: `cargo xtask build` makes it",
        program.display()
    )
}
