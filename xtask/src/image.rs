//! Images for the emulated board: built, measured, proven free of panics, and run.

use std::fs;
use std::path::{Path, PathBuf};
use std::process::Command;

use anyhow::{Context, Result, bail};

use crate::core_library::{TARGET, build_folder, find};
use crate::debian;
use crate::step::{cargo, output, root, run, run_watched, tests_passed};

/// Where `sim_host` looks for images, under `target/`.
pub const FOLDER: &str = "target/images/mps2";

/// The images, names of binaries of `firmware`.
pub const IMAGES: [Image; 1] = [Image {
    name: "controller",
    flash_max: 160 * 1024,
    ram_max: 64 * 1024,
}];

/// One image, and the bytes that it may take of a small microcontroller.
pub struct Image {
    /// Of the binary.
    pub name: &'static str,
    flash_max: u64,
    /// Variables and stack together.
    pub ram_max: u64,
}

/// Builds the images, and says what they take.
pub fn build() -> Result<String> {
    let mut results = Vec::new();
    for image in &IMAGES {
        compile(image.name, "mps2")?;
        let built = built(image.name);
        let size = Size::of(&fs::read(&built).with_context(|| format!("cannot read {}", built.display()))?)
            .with_context(|| format!("{} is no image", built.display()))?;
        let Size { flash, ram } = size;
        println!(
            "   {}: flash {flash} bytes of {}, static RAM {ram} of {}",
            image.name, image.flash_max, image.ram_max
        );
        if flash > image.flash_max || ram > image.ram_max {
            bail!("image {} outgrew its bounds", image.name);
        }
        let folder = root().join(FOLDER);
        fs::create_dir_all(&folder)?;
        fs::copy(&built, folder.join(image.name))?;
        results.push(format!("{} {flash} B flash, {ram} B RAM", image.name));
    }
    Ok(results.join(", "))
}

/// Links the images with a panic handler that calls what does not exist: that they link proves that none is reachable.
pub fn no_panic() -> Result<String> {
    for image in &IMAGES {
        compile(image.name, "mps2,panic-proof").with_context(|| {
            format!("if the symbol a_panic_can_be_reached is missing, image {} can panic: look in the disassembly of the one \
                     that `cargo xtask build` makes for who calls core::panicking", image.name)
        })?;
    }
    Ok("no panic reachable".into())
}

/// Runs the tests that need images and QEMU.
pub fn in_the_loop() -> Result<String> {
    find_qemu()?;
    build()?;
    let mut passed = 0;
    let mut test = cargo();
    test.args(["test", "--package", "sim_host", "--lib", "target::", "--", "--ignored"]);
    run_watched(&mut test, |line| passed += tests_passed(line))?;
    if passed == 0 {
        bail!("no test ran");
    }
    Ok(format!("{passed} tests in the loop passed"))
}

/// Installs QEMU where it is missing.
pub fn find_qemu() -> Result<()> {
    if output(Command::new("qemu-system-arm").arg("--version")).is_err() {
        debian::install(&["qemu-system-arm"]).context("qemu-system-arm is not installed")?;
    }
    Ok(())
}

/// Compiles an image, with a table of its functions' stack frames beside the code: `stack` reads it, no microcontroller sees it.
fn compile(name: &str, features: &str) -> Result<()> {
    let mut cargo = find()?.cargo();
    cargo.args([
        "rustc",
        "--profile",
        "image",
        "--package",
        "firmware",
        "--bin",
        name,
        "--features",
        features,
        "--",
        "-Z",
        "emit-stack-sizes",
    ]);
    run(cargo.env("RUSTC_BOOTSTRAP", "1")) // lets a stable compiler take -Z
}

fn built(name: &str) -> PathBuf {
    build_folder().join(Path::new(TARGET)).join("image").join(name)
}

/// What an image takes of the microcontroller, bytes.
#[derive(Debug, PartialEq, Eq)]
pub struct Size {
    /// Code, constants, and the initial values of variables.
    flash: u64,
    /// Variables; the stack comes on top.
    pub ram: u64,
}

impl Size {
    /// Sums the sections of a 32-bit little-endian ELF file.
    pub fn of(elf: &[u8]) -> Option<Self> {
        const NOBITS: u32 = 8;
        const WRITE: u32 = 1;
        const ALLOC: u32 = 2;
        let half = |at: usize| {
            elf.get(at..at + 2)
                .map(|b| usize::from(u16::from_le_bytes([b[0], b[1]])))
        };
        let word = |at: usize| {
            elf.get(at..at + 4)
                .map(|b| u32::from_le_bytes([b[0], b[1], b[2], b[3]]))
        };
        if elf.get(..6)? != b"\x7fELF\x01\x01" {
            return None;
        }
        let (table, entry, count) = (word(0x20)? as usize, half(0x2E)?, half(0x30)?);
        let mut size = Self { flash: 0, ram: 0 };
        for header in (0..count).map(|k| table + k * entry) {
            let (kind, flags, bytes) = (word(header + 4)?, word(header + 8)?, u64::from(word(header + 20)?));
            if flags & ALLOC != 0 {
                size.flash += if kind == NOBITS { 0 } else { bytes };
                size.ram += if flags & WRITE == 0 { 0 } else { bytes };
            }
        }
        Some(size)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn flash_is_what_has_contents_and_ram_what_is_written() {
        let mut elf = vec![0; 0x34 + 4 * 40];
        elf[..6].copy_from_slice(b"\x7fELF\x01\x01");
        elf[0x20] = 0x34;
        elf[0x2E] = 40;
        elf[0x30] = 4;
        // .text, .data, .bss and a comment that is not loaded: kind, flags, size.
        for (k, [kind, flags, size]) in [[1, 6, 100], [1, 3, 10], [8, 3, 7], [1, 0, 50]].into_iter().enumerate() {
            let header = 0x34 + k * 40;
            elf[header + 4] = kind;
            elf[header + 8] = flags;
            elf[header + 20] = size;
        }
        assert_eq!(Size::of(&elf), Some(Size { flash: 110, ram: 17 }));
        assert_eq!(Size::of(&elf[..0x60]), None);
        assert_eq!(Size::of(b"no ELF file"), None);
    }
}
