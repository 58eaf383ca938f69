//! A core library for the target from Debian's packages: compiler and matching library source, built once.
//!
//! The source must be that of the compiler that reads it, so rustup's compiler cannot take Debian's. The result is a
//! sysroot under `target/` (the target's core, alloc and compiler_builtins beside links to the host's own libraries)
//! and a two-line wrapper that is a rustc for ordinary cargo builds, procedural macros and build scripts included.

use std::fs;
use std::os::unix::fs::{PermissionsExt, symlink};
use std::path::{Path, PathBuf};
use std::process::Command;

use anyhow::{Context, Result, bail};

use crate::core_library::{TARGET, build_folder};
use crate::step::{output, root, run};

const RUSTC: &str = "/usr/bin/rustc";
const CARGO: &str = "/usr/bin/cargo";
const CLIPPY: &str = "/usr/bin/cargo-clippy";

/// Compiler, matching library source and cargo, new enough where Debian's plain `rustc` is not; the machine that runs
/// the images; a linker.
const PACKAGES: [&str; 5] = ["rustc-web", "rust-web-src", "cargo-web", "qemu-system-arm", "lld"];

/// Goes into the stamp of a finished sysroot: raise it when the recipe below changes, so that old ones are rebuilt.
const RECIPE: u32 = 1;

/// A compiler with core for the target; installs Debian's packages if they are missing, and builds core the first time.
pub fn rustc_with_core() -> Result<PathBuf> {
    if !usable() {
        install(&PACKAGES)?;
        if !usable() {
            bail!(
                "{RUSTC} came without library source, or is older than Rust {}",
                minimum()
            );
        }
    }
    let version = output(Command::new(RUSTC).arg("-vV"))?;
    let sysroot = root().join("target/sysroot");
    // The wrapper names its folder, so a workspace that was moved or copied needs a new one.
    let stamp = format!("recipe {RECIPE}\n{}\n{version}\n", sysroot.display());
    let wrapper = sysroot.join("rustc");
    if fs::read_to_string(sysroot.join("stamp")).is_ok_and(|found| found == stamp) {
        return Ok(wrapper);
    }
    println!("   building core for {TARGET} once, into target/sysroot (about a minute)");
    // What was compiled against the old core cannot be linked with the new one.
    remove(&build_folder())?;
    remove(&sysroot)?;
    lay_out(&sysroot, &build()?, &host(&version)?)?;
    let script = format!("#!/bin/sh\nexec {RUSTC} --sysroot '{}' \"$@\"\n", sysroot.display());
    fs::write(&wrapper, script)?;
    fs::set_permissions(&wrapper, fs::Permissions::from_mode(0o755))?;
    // Last of all, so that a sysroot cut short is built again.
    fs::write(sysroot.join("stamp"), stamp)?;
    Ok(wrapper)
}

/// Debian's clippy, set up as `rustc` of [`rustc_with_core`] is; installs it if it is missing.
pub fn clippy(rustc: &Path) -> Result<Command> {
    if !Path::new(CLIPPY).exists() {
        install(&["rust-web-clippy"])?;
    }
    let mut command = Command::new(CLIPPY);
    // In place of a compiler, its driver reads the sysroot from here, not from the wrapper.
    command
        .env("CARGO", CARGO)
        .env("RUSTC", rustc)
        .env("SYSROOT", rustc.parent().unwrap_or(rustc));
    Ok(command)
}

/// Oldest compiler that the workspace builds with.
fn minimum() -> &'static str {
    env!("CARGO_PKG_RUST_VERSION")
}

fn usable() -> bool {
    let Ok(output) = Command::new(RUSTC).args(["--print", "sysroot"]).output() else {
        return false;
    };
    let sysroot = PathBuf::from(String::from_utf8_lossy(&output.stdout).trim());
    let version = Command::new(RUSTC)
        .arg("--version")
        .output()
        .map(|output| output.stdout)
        .unwrap_or_default();
    let version = String::from_utf8_lossy(&version)
        .split(' ')
        .nth(1)
        .map(str::to_owned)
        .unwrap_or_default();
    Path::new(CARGO).exists()
        && sysroot.join("lib/rustlib/src/rust/library/core").is_dir()
        && numbers(&version) >= numbers(minimum())
}

/// Major and minor of "1.96.0"; zeros for what is no version.
fn numbers(version: &str) -> (u32, u32) {
    let mut parts = version.split('.').map(|part| part.parse().unwrap_or(0));
    (parts.next().unwrap_or(0), parts.next().unwrap_or(0))
}

/// Installs `packages`, if this is Debian and we are root; says so first.
pub fn install(packages: &[&str]) -> Result<()> {
    if !Path::new("/etc/debian_version").exists() {
        bail!("this is not Debian");
    }
    if output(Command::new("id").arg("-u"))? != "0" {
        bail!(
            "{} are not installed, and installing them takes root",
            packages.join(", ")
        );
    }
    println!("   installing with apt-get: {}", packages.join(" "));
    // Another apt may be at work; and package lists as old as the machine's image name a compiler that is too old.
    let apt = || {
        let mut command = Command::new("apt-get");
        command
            .args(["-qq", "-o", "DPkg::Lock::Timeout=300"])
            .env("DEBIAN_FRONTEND", "noninteractive");
        command
    };
    run(apt().arg("update"))?;
    run(apt()
        .args(["install", "--yes", "--no-install-recommends"])
        .args(packages)
        .stdout(std::process::Stdio::null()))
}

/// Builds the target's core, alloc and compiler_builtins beneath an empty crate, and returns the folder with them.
fn build() -> Result<PathBuf> {
    let seed = root().join("target/sysroot-build");
    fs::create_dir_all(seed.join("src"))?;
    fs::write(seed.join("src/lib.rs"), "#![no_std]\n")?;
    let manifest = "[package]\nname = \"seed\"\nedition = \"2024\"\n\n[workspace]\n";
    fs::write(seed.join("Cargo.toml"), manifest)?;
    run(Command::new(CARGO)
        .args(["build", "--release", "-Z", "build-std=core,alloc", "--target", TARGET])
        .current_dir(&seed)
        .env("RUSTC", RUSTC)
        .env("CARGO_TARGET_DIR", seed.join("target"))
        // build-std is an unstable option, and this the one build that uses it.
        .env("RUSTC_BOOTSTRAP", "1")
        // Without bitcode in the libraries fat LTO of an image fails.
        .env("RUSTFLAGS", "-C embed-bitcode=yes"))?;
    Ok(seed.join("target").join(TARGET).join("release/deps"))
}

fn lay_out(sysroot: &Path, built: &Path, host: &str) -> Result<()> {
    let rustlib = sysroot.join("lib/rustlib");
    let target = rustlib.join(TARGET).join("lib");
    fs::create_dir_all(&target)?;
    for entry in fs::read_dir(built)? {
        let path = entry?.path();
        let name = path.file_name().unwrap_or_default().to_string_lossy();
        if name.ends_with(".rlib") && !name.starts_with("libseed-") {
            fs::copy(&path, target.join(&*name))?;
        }
    }
    let debian = PathBuf::from(output(Command::new(RUSTC).args(["--print", "sysroot"]))?);
    fs::create_dir_all(rustlib.join(host).join("bin"))?;
    symlink(
        debian.join("lib/rustlib").join(host).join("lib"),
        rustlib.join(host).join("lib"),
    )?;
    let lld = ["/usr/bin/rust-lld", "/usr/bin/lld"]
        .into_iter()
        .find(|path| Path::new(path).exists());
    symlink(
        lld.context("no lld in /usr/bin: apt-get install lld")?,
        rustlib.join(host).join("bin/rust-lld"),
    )?;
    Ok(())
}

fn host(version: &str) -> Result<String> {
    let line = version.lines().find_map(|line| line.strip_prefix("host: "));
    Ok(line.context("`rustc -vV` names no host")?.to_string())
}

fn remove(folder: &Path) -> Result<()> {
    match fs::remove_dir_all(folder) {
        Err(error) if error.kind() != std::io::ErrorKind::NotFound => {
            Err(error).with_context(|| format!("cannot remove {}", folder.display()))
        }
        _ => Ok(()),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn versions_compare_by_number_and_not_by_letter() {
        assert!(numbers("1.100.0") > numbers("1.96.0"));
        assert!(numbers("1.63.0") < numbers("1.89"));
        assert_eq!(numbers("nonsense"), (0, 0));
    }
}
