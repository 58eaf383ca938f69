//! Names the linker script of the chosen board.

use std::env;
use std::path::Path;

fn main() -> Result<(), Box<dyn std::error::Error>> {
    println!("cargo::rerun-if-changed=build.rs");
    if env::var("CARGO_CFG_TARGET_OS").is_ok_and(|os| os != "none") {
        return Ok(());
    }
    // cortex-m-rt's script, which includes memory.x from the top of the workspace.
    if env::var_os("CARGO_FEATURE_MPS2").is_some() {
        println!("cargo::rustc-link-arg-bins=-Tlink.x");
    }
    if env::var_os("CARGO_FEATURE_NUCLEO_H743").is_some() {
        let folder = env::var("CARGO_MANIFEST_DIR")?;
        let script = Path::new(&folder).join("../hal/src/board/nucleo_h743/link.x");
        println!("cargo::rerun-if-changed={}", script.display());
        println!("cargo::rustc-link-arg-bins=-T{}", script.display());
    }
    Ok(())
}
