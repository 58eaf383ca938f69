//! The deepest that an image's stack can go: a bound from its code, and the depth that painting shows.
//!
//! The bound is the sum over the levels that can stand on each other: what runs without interrupt, and for each priority the
//! deepest of its handlers with the frame that the core pushes. Before interrupts are enabled there is only the way through
//! `init`. The compiler says each function's frame ([`program`]); what it did not compile is read from its code ([`thumb`]).
//! Recursion, and calls through registers, would leave no bound: they are refused.

mod program;
mod thumb;

use std::fs;

use anyhow::{Context, Result, bail, ensure};

use crate::board::{Board, REFERENCE};
use crate::image::{self, Size};
use crate::step::{cargo, output};
use program::Program;

/// Bytes that the core pushes for an exception: 8 words, 18 more of the FPU (reserved even if they are stored lazily), one to align
/// (Armv7-M Architecture Reference Manual, B1.5.7).
const EXCEPTION: u32 = 4 * (8 + 18 + 1);

/// Tasks by rising priority, as firmware/src/bin/ binds them, and in the highest what the board adds.
const LEVELS: [(u8, &[&str]); 3] = [(1, &["BACKGROUND"]), (2, &["CANRX"]), (3, &["TICK", "DUALTIMER"])];

/// Name, in part, of what RTIC runs with interrupts off before `idle`.
const INIT: &str = "__rtic_init_resources";

/// Entries of the vector table that are the core's own exceptions, the reset among them.
const EXCEPTIONS: usize = 15;

/// Share of the stack's room that must stay free, percent.
const MARGIN_MIN: u32 = 30;

/// Cycles run to see how deep the stack goes: a panel sealed.
const PAINTED_CYCLES: u32 = 2500;

/// The bound of an image, bytes.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Bound {
    /// Up to the first timer event.
    boot: u32,
    /// From then on.
    run: u32,
}

impl Bound {
    /// Of an ELF file of the image.
    pub fn of(elf: &[u8]) -> Result<Self> {
        Ok(levels(&Program::read(elf)?)?.0)
    }

    /// The deeper of both.
    pub fn deepest(&self) -> u32 {
        self.boot.max(self.run)
    }
}

/// Whether the levels of this image's tasks on that board are known here.
pub fn knows(board: &Board, binary: &str) -> bool {
    board.name == REFERENCE.name && binary == IMAGE
}

/// The binary whose stack is bounded, and its image that is painted.
const IMAGE: &str = "controller";
/// Its image for two arms; `bench` paints that one.
const SECOND: &str = "second-arm";

/// Checks the controller's image for the reference machine, building it first.
pub fn check() -> Result<String> {
    image::find_qemu()?;
    image::build_one(&REFERENCE, IMAGE)?;
    let file = image::path(&REFERENCE, IMAGE);
    let elf = fs::read(&file).with_context(|| format!("cannot read {}", file.display()))?;
    let (bound, ways) = levels(&Program::read(&elf)?)?;
    ways.iter().for_each(|way| println!("   {way}"));
    let ram = Size::of(&elf).context("no image")?.ram;
    let room = (image::known(IMAGE)?.ram_max - ram) as u32;
    enough(IMAGE, bound.deepest(), room)?;
    second()?;
    let [boot, run] = painted()?;
    ensure!(
        boot <= bound.boot && run <= bound.run,
        "painted {boot} and {run} bytes, over the bound of {} and {}: the bound is wrong",
        bound.boot,
        bound.run
    );
    let deepest = bound.deepest();
    let margin = margin(deepest, room);
    println!("   painted: {boot} bytes in boot, {run} in {PAINTED_CYCLES} cycles of a sealing job under full load");
    let json = format!(
        "{{\"stack_bound_bytes\":{deepest},\"stack_painted_bytes\":{},\"stack_room_bytes\":{room},\"stack_margin_percent\":{margin},\
         \"boot_bound_bytes\":{},\"boot_painted_bytes\":{boot},\"run_bound_bytes\":{},\"run_painted_bytes\":{run}}}\n",
        boot.max(run),
        bound.boot,
        bound.run
    );
    fs::write(file.with_file_name("stack.json"), json)?;
    Ok(format!("stack {deepest} of {room} B"))
}

/// The image for two arms.
fn second() -> Result<()> {
    image::build_one(&REFERENCE, SECOND)?;
    let file = image::path(&REFERENCE, SECOND);
    let elf = fs::read(&file).with_context(|| format!("cannot read {}", file.display()))?;
    let ram = Size::of(&elf).context("no image")?.ram;
    let room = (image::known(SECOND)?.ram_max - ram) as u32;
    enough(SECOND, Bound::of(&elf)?.deepest(), room)
}

/// Share of the room for the stack that stays free, per cent.
fn margin(deepest: u32, room: u32) -> u32 {
    100 * room.saturating_sub(deepest) / room
}

fn enough(name: &str, deepest: u32, room: u32) -> Result<()> {
    let margin = margin(deepest, room);
    println!("   {name}: {deepest} of {room} bytes: {margin} % free, at least {MARGIN_MIN} must be");
    ensure!(margin >= MARGIN_MIN, "the stack's margin in image {name} is {margin} %");
    Ok(())
}

/// Adds the levels up; with them the way to the deepest place of each.
fn levels(program: &Program) -> Result<(Bound, Vec<String>)> {
    let init = program
        .functions
        .iter()
        .find(|(_, function)| function.names.iter().any(|name| name.contains(INIT)))
        .map(|(address, _)| *address)
        .with_context(|| format!("no function {INIT}: it was inlined, and boot can no longer be told from the run"))?;
    let reset = program.find("Reset")?;
    let (faults, way) = faults(program)?;
    let mut ways = vec![format!("faults and unused exceptions: {faults} bytes, {way}")];
    let (boot, way) = program.depth(reset, &[])?;
    ways.push(format!("boot: {boot} bytes, {}", shown(&way)));
    let (mut run, way) = program.depth(reset, &[init])?;
    ways.push(format!("idle: {run} bytes, {}", shown(&way)));
    for (priority, names) in LEVELS {
        let (depth, way) = deepest(program, names.iter().map(|name| program.find(name)))?;
        ways.push(format!("priority {priority}: {EXCEPTION} + {depth} bytes, {way}"));
        run += EXCEPTION + depth;
    }
    if !program.read_from_code.is_empty() {
        let names: Vec<String> = program.read_from_code.iter().map(|name| words(name)).collect();
        ways.push(format!("frames read from the code of: {}", names.join(", ")));
    }
    let bound = Bound {
        boot: boot + faults,
        run: run + faults,
    };
    Ok((bound, ways))
}

/// The deepest of what stands in the vector table and is no task; a handler that is neither a task nor the one that halts is refused.
fn faults(program: &Program) -> Result<(u32, String)> {
    let halts = program.find("DefaultHandler_")?;
    for vector in program.vectors.iter().skip(EXCEPTIONS).filter(|vector| **vector != 0) {
        let at = vector & !1;
        let function = program
            .functions
            .get(&at)
            .with_context(|| format!("vector {vector:#x} is no function"))?;
        let tasks = || LEVELS.iter().flat_map(|(_, names)| names.iter());
        if at != halts && !tasks().any(|task| function.names.iter().any(|name| name == task)) {
            bail!("interrupt {}: of no known priority", function.names.join(", "));
        }
    }
    let exceptions = program
        .vectors
        .iter()
        .take(EXCEPTIONS)
        .skip(1)
        .filter(|vector| **vector != 0);
    let (depth, way) = deepest(program, exceptions.map(|vector| Ok(vector & !1)))?;
    Ok((EXCEPTION + depth, way))
}

fn deepest(program: &Program, starts: impl Iterator<Item = Result<u32>>) -> Result<(u32, String)> {
    let mut deepest = (0, String::new());
    for start in starts {
        let (depth, way) = program.depth(start?, &[])?;
        if depth >= deepest.0 {
            deepest = (depth, shown(&way));
        }
    }
    Ok(deepest)
}

/// A way through functions, each by the words of its mangled name that a person reads.
fn shown(way: &[&str]) -> String {
    way.iter().map(|name| words(name)).collect::<Vec<_>>().join(" > ")
}

/// The identifiers in a mangled name: what stands behind its decimal lengths; names of crates have a hash before them.
fn words(name: &str) -> String {
    let Some(mut rest) = name.strip_prefix("_R") else {
        return name.to_string();
    };
    let mut words = Vec::new();
    while let Some(at) = rest.find(|c: char| c.is_ascii_digit()) {
        rest = &rest[at..];
        let digits = rest.len() - rest.trim_start_matches(|c: char| c.is_ascii_digit()).len();
        let (length, tail) = rest.split_at(digits);
        match length
            .parse()
            .ok()
            .and_then(|length: usize| tail.trim_start_matches('_').get(..length))
        {
            Some(word) if word.starts_with(|c: char| c.is_ascii_alphabetic()) && length != "0" => {
                words.push(word);
                rest = &tail[word.len()..];
            }
            _ => rest = tail,
        }
    }
    match words.as_slice() {
        [.., before, last] => format!("{before}::{last}"),
        _ => words.join("::"),
    }
}

/// Runs a job under QEMU, everything below the tick busy, and asks how deep the stack went: in boot, and since.
fn painted() -> Result<[u32; 2]> {
    let mut jitter = cargo();
    jitter.args(["run", "--quiet", "--release", "--package", "sim_host", "--"]);
    jitter.args(["jitter", "--on", "qemu", "--load", "full", "--cycles"]);
    let said = output(jitter.arg(PAINTED_CYCLES.to_string()))?;
    numbers(&said).with_context(|| format!("no line on the painted stack in:\n{said}"))
}

/// The two numbers of "stack, painted: 4752 bytes up to the first tick, 2768 since".
fn numbers(said: &str) -> Option<[u32; 2]> {
    let line = said.lines().find(|line| line.starts_with("stack, painted:"))?;
    let mut numbers = line.split(' ').filter_map(|word| word.parse().ok());
    Some([numbers.next()?, numbers.next()?])
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_painted_depths_are_read_from_the_report() {
        let said = "2500 cycles\nstack, painted: 4752 bytes up to the first tick, 2768 since\n";
        assert_eq!(numbers(said), Some([4752, 2768]));
        assert_eq!(numbers("no board"), None);
    }
}
