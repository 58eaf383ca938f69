//! `cargo xtask`: builds, checks and tests everything.
fn main() {}
