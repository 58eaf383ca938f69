//! Writing a log while its run goes on.

use std::io::Write;
use std::path::{Path, PathBuf};

use anyhow::{Context, Result};
use hal::process::{Inputs, Outputs};
use hal::stage::Trail;
use hal::wire::{Fnv64, Sink, Wire};
use serde_json::Value;

use super::{AXES, Buffer, END, Head, MAGIC, RunHash};
use crate::whole_file::WholeFile;

/// A log being written; it takes its name when it is [finished](LogWriter::finish), and leaves nothing if it is not.
pub struct LogWriter {
    file: WholeFile,
    path: PathBuf,
    hash: RunHash,
    cycles: u64,
}

impl LogWriter {
    /// Begins the log `path` of a run with `parameters` (the core's, in their byte form). `description` says to people
    /// and programs what was run: job, seed, options.
    pub fn create(path: &Path, parameters: &[u8], description: &Value) -> Result<Self> {
        let mut log = Self {
            file: WholeFile::create(path)?,
            path: path.into(),
            hash: RunHash::new(parameters),
            cycles: 0,
        };
        let header = header(parameters, description).with_context(|| format!("log {}", path.display()))?;
        log.put(&header)?;
        Ok(log)
    }

    /// Appends one cycle.
    pub fn cycle(&mut self, inputs: &Inputs<AXES>, outputs: &Outputs<AXES>, trail: &Trail) -> Result<()> {
        let mut cycle = Buffer::default();
        inputs.write(&mut cycle);
        self.hash.take(inputs);
        self.hash.value().write(&mut cycle);
        outputs.write(&mut cycle);
        self.hash.take(outputs);
        self.hash.value().write(&mut cycle);
        trail.write(&mut cycle);
        self.hash.of_trail(trail).write(&mut cycle);
        self.cycles += 1;
        self.put(&cycle.0)
    }

    /// Completes the log, and returns its final hash.
    pub fn finish(mut self) -> Result<u64> {
        let mut trailer = Buffer::default();
        self.cycles.write(&mut trailer);
        self.hash.value().write(&mut trailer);
        trailer.put(&END);
        self.put(&trailer.0)?;
        self.file.finish()?;
        Ok(self.hash.value())
    }

    fn put(&mut self, bytes: &[u8]) -> Result<()> {
        self.file
            .write_all(bytes)
            .with_context(|| format!("log {}: cannot be written", self.path.display()))
    }
}

fn header(parameters: &[u8], description: &Value) -> Result<Vec<u8>> {
    let description = description.to_string();
    let length = |length: usize| u32::try_from(length).context("parameters or description over 4 GiB");
    let mut header = Buffer::default();
    header.put(&MAGIC);
    Head::new(length(parameters.len())?, length(description.len())?).write(&mut header);
    header.put(parameters);
    header.put(description.as_bytes());
    let mut hash = Fnv64::default();
    hash.put(&header.0);
    hash.0.write(&mut header);
    Ok(header.0)
}
