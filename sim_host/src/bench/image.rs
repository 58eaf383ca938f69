//! What `cargo xtask build` and its other steps found out about an image and left beside it.

use crate::target::image;
use anyhow::Context;
use serde::{Deserialize, Serialize};
use std::fs;

/// What an image takes, bytes, and which panics it can reach.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct ImageFigures {
    /// Code, constants, and initial values of variables.
    pub flash_bytes: u64,
    /// Variables; the stack comes on top.
    pub ram_bytes: u64,
    /// Functions of core's panic machinery that were linked into it.
    pub reachable_panics: u64,
    /// Deepest stack by the call graph; `None` while nobody has computed it.
    #[serde(default)]
    pub stack_bound_bytes: Option<u64>,
}

impl ImageFigures {
    /// Reads what stands beside the image `name`.
    pub fn read(name: &str) -> anyhow::Result<Self> {
        let path = image::find(name)?.with_extension("json");
        let again = "`cargo xtask build` makes it";
        let text = fs::read_to_string(&path).with_context(|| format!("cannot read {}: {again}", path.display()))?;
        serde_json::from_str(&text).with_context(|| format!("{}: {again}", path.display()))
    }
}
