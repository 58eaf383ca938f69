//! The core library of the Cortex-M target, found in one of three ways.
//!
//! Rust's installers leave it out, so a fresh machine has none. In order: the active toolchain has it; on Debian it is
//! built from the library source that goes with Debian's compiler ([`crate::debian`]); rustup fetches it.

use std::path::{Path, PathBuf};
use std::process::Command;

use anyhow::{Context, Result};

use crate::debian;
use crate::step::{cargo, output, root, run};

/// Cortex-M4F: hard-float f32.
pub const TARGET: &str = "thumbv7em-none-eabihf";

/// A compiler that can build for [`TARGET`].
pub struct Toolchain {
    /// Compiler to use in place of cargo's own choice.
    rustc: Option<PathBuf>,
}

impl Toolchain {
    /// A cargo that builds for the target, into a folder of its own: the compiler may be another than the host's, and
    /// one folder for both would make each build throw away what the other one cached.
    pub fn cargo(&self) -> Command {
        let mut command = cargo();
        if let Some(rustc) = &self.rustc {
            command.env("RUSTC", rustc);
        }
        command
            .env("CARGO_BUILD_TARGET", TARGET)
            .env("CARGO_TARGET_DIR", build_folder());
        command
    }

    /// `cargo clippy` for the target, of the compiler's own release: another could not read the target's core.
    pub fn clippy(&self) -> Result<Command> {
        let Some(rustc) = &self.rustc else {
            let mut command = self.cargo();
            command.arg("clippy");
            return Ok(command);
        };
        let mut command = debian::clippy(rustc)?;
        command
            .arg("clippy")
            .env("CARGO_BUILD_TARGET", TARGET)
            .env("CARGO_TARGET_DIR", build_folder())
            .current_dir(root());
        Ok(command)
    }
}

/// Where target builds go.
pub fn build_folder() -> PathBuf {
    root().join("target/thumb")
}

/// Finds a toolchain, and installs one where there is none.
pub fn find() -> Result<Toolchain> {
    if active_has_target()? {
        return Ok(Toolchain { rustc: None });
    }
    let reason = match debian::rustc_with_core() {
        Ok(rustc) => return Ok(Toolchain { rustc: Some(rustc) }),
        Err(reason) => reason,
    };
    println!("   not by way of Debian's packages: {reason:#}");
    println!("   installing the core library of {TARGET}: rustup target add {TARGET}");
    run(Command::new("rustup")
        .args(["target", "add", TARGET])
        .current_dir(root()))
    .with_context(|| format!("no core library for {TARGET}: `rustup target add {TARGET}` must work first"))?;
    Ok(Toolchain { rustc: None })
}

fn active_has_target() -> Result<bool> {
    let sysroot = output(Command::new("rustc").args(["--print", "sysroot"]).current_dir(root()))?;
    Ok(Path::new(&sysroot)
        .join("lib/rustlib")
        .join(TARGET)
        .join("lib")
        .is_dir())
}
