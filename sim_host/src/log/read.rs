//! Reading a log: its structure is checked at once, each cycle's hash as the cycle is taken.

use std::fmt;
use std::fs;
use std::path::Path;

use anyhow::{Context, Result, bail, ensure};
use hal::process::Inputs;
use hal::stage::Trail;
use hal::wire::{Fnv64, Sink, Wire};
use serde_json::Value;

use super::{AXES, Answer, CYCLE_BYTES, END, HEAD_BYTES, Head, MAGIC, RunHash, TRAILER_BYTES};

/// A complete log.
#[derive(Clone, Debug, PartialEq)]
pub struct Log {
    /// What was run.
    pub description: Value,
    /// The core's parameters in their byte form.
    pub parameters: Vec<u8>,
    /// Final running hash as the trailer gives it.
    pub hash: u64,
    /// The cycles in the file's byte form, [`CYCLE_BYTES`] each.
    cycles: Vec<u8>,
}

/// The first place where a log is not what was recorded; cycles count from zero.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Damage {
    /// The inputs of this cycle, or their hash.
    Inputs(u64),
    /// The outputs of this cycle, or their hash.
    Outputs(u64),
    /// The trail of this cycle, or its hash.
    Trail(u64),
    /// The hash in the trailer.
    Trailer,
}

impl fmt::Display for Damage {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Inputs(cycle) => write!(f, "cycle {cycle}: recorded inputs do not match their hash"),
            Self::Outputs(cycle) => write!(f, "cycle {cycle}: recorded outputs do not match their hash"),
            Self::Trail(cycle) => write!(f, "cycle {cycle}: the recorded trail does not match its hash"),
            Self::Trailer => write!(f, "the final hash does not match the cycles"),
        }
    }
}

impl Log {
    /// Reads the log `path`. The error is one line that names the file, and for a log cut short the cycle it ends in.
    pub fn read(path: &Path) -> Result<Self> {
        let bytes = fs::read(path).with_context(|| format!("log {}: cannot be read", path.display()))?;
        Self::from_bytes(&bytes).with_context(|| format!("log {}", path.display()))
    }

    /// Reads a log from memory.
    pub fn from_bytes(bytes: &[u8]) -> Result<Self> {
        let magic = bytes.len().min(MAGIC.len());
        ensure!(
            magic > 0 && bytes[..magic] == MAGIC[..magic],
            "not a run log: it does not begin as a .tlog does"
        );
        let cut = || format!("truncated in its header, after {} bytes", bytes.len());
        ensure!(bytes.len() >= HEAD_BYTES, cut());
        let head = Head::read(&mut &bytes[MAGIC.len()..]).with_context(cut)?;
        let ours = Head::new(head.parameters, head.description);
        ensure!(
            head.version == ours.version,
            "version {}: this program reads version {}",
            head.version,
            ours.version
        );
        let variable = head.parameters as usize + head.description as usize;
        let header_end = HEAD_BYTES + variable;
        ensure!(bytes.len() >= header_end + 8, cut());
        let (header, rest) = bytes.split_at(header_end);
        let (mut recorded, body) = rest.split_at(8);
        let mut hash = Fnv64::default();
        hash.put(header);
        ensure!(
            u64::read(&mut recorded) == Some(hash.0),
            "the header does not match its hash"
        );
        ensure!(head == ours, "sizes {head:?}: this program's are {ours:?}");
        let (parameters, description) = header[HEAD_BYTES..].split_at(head.parameters as usize);
        let (cycles, hash) = split_body(body)?;
        Ok(Self {
            description: serde_json::from_slice(description).context("the description is no JSON")?,
            parameters: parameters.to_vec(),
            hash,
            cycles: cycles.to_vec(),
        })
    }

    /// Number of cycles.
    pub fn len(&self) -> usize {
        self.cycles.len() / CYCLE_BYTES
    }

    /// Whether no cycle was recorded.
    pub fn is_empty(&self) -> bool {
        self.cycles.is_empty()
    }

    /// The cycles in order, each as recorded; ends with the first damage, if there is any.
    pub fn cycles(&self) -> impl Iterator<Item = Result<(Inputs<AXES>, Answer), Damage>> {
        let mut hash = RunHash::new(&self.parameters);
        let mut damaged = false;
        let mut cycles = self.cycles.chunks_exact(CYCLE_BYTES).zip(0_u64..);
        std::iter::from_fn(move || {
            if damaged {
                return None;
            }
            let item = match cycles.next() {
                Some((bytes, at)) => take_cycle(bytes, at, &mut hash),
                None if hash.value() != self.hash => Err(Damage::Trailer),
                None => return None,
            };
            damaged = item.is_err();
            Some(item)
        })
    }
}

/// Takes cycle `at` apart.
fn take_cycle(mut bytes: &[u8], at: u64, hash: &mut RunHash) -> Result<(Inputs<AXES>, Answer), Damage> {
    let inputs = take(&mut bytes, hash).ok_or(Damage::Inputs(at))?;
    let outputs = take(&mut bytes, hash).ok_or(Damage::Outputs(at))?;
    let trail = Trail::read(&mut bytes)
        .filter(|trail| u64::read(&mut bytes) == Some(hash.of_trail(trail)))
        .ok_or(Damage::Trail(at))?;
    Ok((inputs, Answer { outputs, trail }))
}

/// Takes a value and its running hash off the front; `None` if they do not match.
fn take<T: Wire>(bytes: &mut &[u8], hash: &mut RunHash) -> Option<T> {
    let value_bytes = bytes.get(..T::BYTES)?;
    hash.0.put(value_bytes);
    let value = T::read(bytes);
    (u64::read(bytes)? == hash.value()).then_some(value?)
}

/// The cycles' bytes and the final hash.
fn split_body(body: &[u8]) -> Result<(&[u8], u64)> {
    let Some(cycles) = body.len().checked_sub(TRAILER_BYTES).filter(|_| body.ends_with(&END)) else {
        // Whole cycles may precede the cut; the end mark is only in a complete log.
        bail!("truncated in cycle {}: no end mark", body.len() / CYCLE_BYTES);
    };
    let (cycles, mut trailer) = body.split_at(cycles);
    let count = u64::read(&mut trailer).context("no number of cycles")?;
    let hash = u64::read(&mut trailer).context("no final hash")?;
    let found = cycles.len() as u64 / CYCLE_BYTES as u64;
    let whole = cycles.len() % CYCLE_BYTES == 0;
    ensure!(
        whole && count == found,
        "its trailer counts {count} cycles of {CYCLE_BYTES} bytes, not {} bytes",
        cycles.len()
    );
    Ok((cycles, hash))
}
