//! Images for every board: built, measured, proven free of panics, and run where the board is emulated.

use std::fs;
use std::path::{Path, PathBuf};
use std::process::Command;

use anyhow::{Context, Result, bail};

use crate::board::{BOARDS, Board, REFERENCE};
use crate::core_library::{TARGET, build_folder, find};
use crate::debian;
use crate::step::{cargo, output, root, run, run_watched, tesaki, tests_passed};
use crate::{stack, symbols};

/// Where images go, in a folder for each board; `sim_host` looks there for those of the reference machine.
const FOLDER: &str = "target/images";

/// The images.
const IMAGES: [Image; 7] = [
    Image {
        name: "controller",
        binary: "controller",
        features: "",
        boards: &BOARDS,
        flash_max: 160 * 1024,
        ram_max: 64 * 1024,
    },
    Image {
        name: "replay",
        binary: "replay",
        features: "",
        boards: &[REFERENCE],
        flash_max: 160 * 1024,
        ram_max: 64 * 1024,
    },
    Image {
        name: "net",
        binary: "net",
        features: "",
        boards: &[REFERENCE],
        flash_max: 160 * 1024,
        ram_max: 512 * 1024,
    },
    Image {
        name: "controller-stages",
        binary: "controller",
        features: "stages",
        boards: &[REFERENCE],
        flash_max: 160 * 1024,
        ram_max: 64 * 1024,
    },
    Image {
        name: "second-arm",
        binary: "controller",
        features: "second-arm",
        boards: &[REFERENCE],
        flash_max: 160 * 1024,
        ram_max: 64 * 1024,
    },
    Image {
        name: "second-arm-stages",
        binary: "controller",
        features: "second-arm,stages",
        boards: &[REFERENCE],
        flash_max: 160 * 1024,
        ram_max: 64 * 1024,
    },
    Image {
        name: "camera",
        binary: "camera",
        features: "",
        boards: &BOARDS,
        flash_max: 160 * 1024,
        ram_max: 512 * 1024,
    },
];

/// One image, and the bytes that it may take of a small microcontroller.
pub struct Image {
    name: &'static str,
    /// The binary of `firmware` that it is, with these of its features besides the board's.
    binary: &'static str,
    features: &'static str,
    /// The boards that it is for.
    boards: &'static [Board],
    flash_max: u64,
    /// Variables and stack together.
    pub ram_max: u64,
}

impl Image {
    fn is_for(&self, board: &Board) -> bool {
        self.boards.iter().any(|one| one.name == board.name)
    }
}

/// Builds the images for every board, and says what they take.
pub fn build() -> Result<String> {
    let results: Result<Vec<String>> = BOARDS.iter().map(build_for).collect();
    Ok(results?.join("; "))
}

/// Builds the images for one board, and says what they take.
pub fn build_for(board: &Board) -> Result<String> {
    let results: Result<Vec<String>> = IMAGES
        .iter()
        .filter(|image| image.is_for(board))
        .map(|image| make(board, image))
        .collect();
    Ok(format!("{}: {}", board.name, results?.join(", ")))
}

/// Builds the image called `name` for one board, and says what it takes.
pub fn build_one(board: &Board, name: &str) -> Result<String> {
    let image = known(name)?;
    if !image.is_for(board) {
        bail!("image {name}: not for board {}", board.name);
    }
    make(board, image)
}

/// The image called `name`.
pub fn known(name: &str) -> Result<&'static Image> {
    IMAGES.iter().find(|image| image.name == name).with_context(|| {
        let names = IMAGES.each_ref().map(|image| image.name).join(", ");
        format!("image {name:?}: not one of {names}")
    })
}

/// Where the image called `name` for a board is once it is built.
pub fn path(board: &Board, name: &str) -> PathBuf {
    root().join(FOLDER).join(board.name).join(name)
}

fn make(board: &Board, image: &Image) -> Result<String> {
    compile(board, image, "")?;
    let built = built(image.binary);
    let elf = fs::read(&built).with_context(|| format!("cannot read {}", built.display()))?;
    let size = Size::of(&elf).with_context(|| format!("{} is no image", built.display()))?;
    let names = symbols::names(&elf).with_context(|| format!("{} has no symbols", built.display()))?;
    let doubles = symbols::doubles(&names);
    if !doubles.is_empty() {
        bail!(
            "image {} computes in double precision, in software: {}",
            image.name,
            doubles.join(", ")
        );
    }
    let Size { flash, ram } = size;
    println!(
        "   {} for {}: flash {flash} bytes of {}, static RAM {ram} of {}",
        image.name, board.what, image.flash_max, image.ram_max
    );
    if flash > image.flash_max || ram > image.ram_max {
        bail!("image {} outgrew its bounds", image.name);
    }
    let place = path(board, image.name);
    fs::create_dir_all(place.parent().unwrap_or(&place))?;
    fs::copy(&built, &place)?;
    let mut figures = format!(
        "\"flash_bytes\": {flash}, \"ram_bytes\": {ram}, \"reachable_panics\": {}",
        symbols::panics(&names)
    );
    if stack::knows(board, image.binary) {
        figures += &format!(", \"stack_bound_bytes\": {}", stack::Bound::of(&elf)?.deepest());
    }
    fs::write(place.with_extension("json"), format!("{{{figures}}}\n"))?;
    Ok(format!("{} {flash} B flash, {ram} B RAM", image.name))
}

/// Links the images with a panic handler that calls what does not exist: that they link proves that none is reachable.
pub fn no_panic() -> Result<String> {
    for (board, image) in BOARDS
        .iter()
        .flat_map(|board| IMAGES.iter().map(move |image| (board, image)))
        .filter(|(board, image)| image.is_for(board))
    {
        compile(board, image, "panic-proof").with_context(|| {
            format!(
                "if the symbol a_panic_can_be_reached is missing, image {0} can panic: look in the disassembly of the one \
                 that `cargo xtask build {1}` makes for who calls core::panicking",
                image.name, board.name
            )
        })?;
    }
    Ok("no panic reachable".into())
}

/// Clippy on what is compiled for boards only.
pub fn lint() -> Result<()> {
    let toolchain = find()?;
    for board in &BOARDS {
        run(toolchain.clippy()?.args([
            "--package",
            "hal",
            "--package",
            "firmware",
            "--lib",
            "--bins",
            "--features",
            &format!("firmware/{}", board.name),
            "--",
            "-D",
            "warnings",
        ]))?;
    }
    Ok(())
}

/// Counts what the control cycle costs, and compares with the committed table.
pub fn bench() -> Result<String> {
    find_qemu()?;
    build_for(&REFERENCE)?;
    run(tesaki().args(["bench", "--check", "README.md"]))
        .context("if the growth is meant: `cargo run --release -- bench --update-readme README.md`")?;
    Ok("no stage grew by more than 5 %".into())
}

/// Installs QEMU where there is none.
pub fn find_qemu() -> Result<()> {
    if output(Command::new("qemu-system-arm").arg("--version")).is_err() {
        debian::install(&["qemu-system-arm"]).context("qemu-system-arm is not installed")?;
    }
    Ok(())
}

/// Runs the tests that need images and QEMU.
pub fn in_the_loop() -> Result<String> {
    find_qemu()?;
    build_for(&REFERENCE)?;
    let mut passed = 0;
    let mut test = cargo();
    test.args(["test", "--package", "sim_host", "--lib", "target::", "--", "--ignored"]);
    run_watched(&mut test, |line| passed += tests_passed(line))?;
    if passed == 0 {
        bail!("no test ran");
    }
    Ok(format!("{passed} tests in the loop passed"))
}

/// Compiles an image with one more feature, if that is not empty. Beside the code stands a table of its functions' stack frames: `stack`
/// reads it, no microcontroller sees it.
fn compile(board: &Board, image: &Image, more: &str) -> Result<()> {
    run(find()?
        .cargo()
        .args([
            "rustc",
            "--profile",
            "image",
            "--package",
            "firmware",
            "--bin",
            image.binary,
            "--features",
            &[board.name, image.features, more].join(","),
            "--",
            "-Z",
            "emit-stack-sizes",
            // Loops over six axes without a count: the arrays that a servo's axis is taken from need more pointers than there are registers.
            "-C",
            "llvm-args=-unroll-threshold=800",
        ])
        .env("RUSTC_BOOTSTRAP", binaries())) // lets a stable compiler take -Z for these crates alone
}

/// The binaries of all images: one value for all of them, for whatever reads it is compiled again when it changes.
fn binaries() -> String {
    IMAGES.each_ref().map(|image| image.binary).join(",")
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
