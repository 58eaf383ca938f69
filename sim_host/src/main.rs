//! The command line, `tesaki`.
fn main() {}
