//! Hands the linker the list of interrupts of a board that is linked by cortex-m-rt's script, which includes it as `device.x`.

use std::path::{Path, PathBuf};
use std::{env, fs};

fn main() -> Result<(), Box<dyn std::error::Error>> {
    println!("cargo::rerun-if-changed=build.rs");
    let bare = env::var_os("CARGO_CFG_TARGET_OS").is_some_and(|os| os == "none");
    if bare && env::var_os("CARGO_FEATURE_MPS2").is_some() {
        let list = Path::new("src/board/mps2/device.x");
        println!("cargo::rerun-if-changed={}", list.display());
        let out = PathBuf::from(env::var_os("OUT_DIR").ok_or("cargo sets OUT_DIR")?);
        fs::copy(list, out.join("device.x"))?;
        println!("cargo::rustc-link-search={}", out.display());
    }
    Ok(())
}
