//! Promises 1 and 2 that can be read off the text of the core: no truth, one arithmetic.
//!
//! Nothing under `firmware/` or `hal/` names the simulator, `f64`, `std`, `unsafe` or `mul_add` (a fused multiply-add
//! rounds otherwise than the two steps it replaces). Boards (`board/`) and images (`bin/`) may be unsafe; unit tests may
//! use `std` and compare with `f64`; build scripts run elsewhere. A search for words, not a proof: the proof of `no_std` is the build for the target.

use std::fs;
use std::path::{Path, PathBuf};

use anyhow::{Context, Result, bail};

use crate::step::root;

/// Words that the core must not use, and why.
const FORBIDDEN: [(&str, &str); 5] = [
    ("f64", "results must be the same bits on a machine without it"),
    ("std", "the core has no operating system"),
    ("unsafe", "only boards may be unsafe"),
    ("mul_add", "its rounding differs between machines"),
    ("sim_host", "the controller sees only the bus, the image and its inputs"),
];

/// Reads every source file and manifest of the core.
pub fn check() -> Result<String> {
    let mut files = Vec::new();
    for room in ["firmware", "hal"] {
        collect(&root().join(room), &mut files)?;
    }
    let mut found = Vec::new();
    for path in &files {
        let text = fs::read_to_string(path).with_context(|| format!("cannot read {}", path.display()))?;
        let shown = path.strip_prefix(root()).unwrap_or(path).display();
        if path.extension().is_some_and(|extension| extension == "toml") {
            if text.contains("sim_host") {
                found.push(format!("{shown} depends on sim_host"));
            }
            continue;
        }
        for (line, word, why) in violations(&text, is_wiring(path)) {
            found.push(format!("{shown}:{line} names `{word}`: {why}"));
        }
    }
    if !found.is_empty() {
        bail!("{}", found.join("\n"));
    }
    Ok(String::new())
}

/// Boards and images: the only places that touch registers.
fn is_wiring(path: &Path) -> bool {
    path.components()
        .any(|part| matches!(part.as_os_str().to_str(), Some("board" | "bin")))
}

fn collect(folder: &Path, files: &mut Vec<PathBuf>) -> Result<()> {
    for entry in fs::read_dir(folder).with_context(|| format!("cannot read {}", folder.display()))? {
        let path = entry?.path();
        let name = path.file_name().unwrap_or_default().to_string_lossy().into_owned();
        if path.is_dir() && name != "target" {
            collect(&path, files)?;
        } else if name == "Cargo.toml" || (name.ends_with(".rs") && name != "tests.rs" && name != "build.rs") {
            files.push(path);
        }
    }
    Ok(())
}

/// Line number, word and reason of each forbidden word in code that is neither comment nor test.
fn violations(text: &str, wiring: bool) -> Vec<(usize, &'static str, &'static str)> {
    let mut found = Vec::new();
    let mut test_item: Option<usize> = None; // indentation of the item under #[cfg(test)] that is being passed over
    for (at, line) in text.lines().enumerate() {
        let code = line.split("//").next().unwrap_or("").trim_end();
        let indent = code.len() - code.trim_start().len();
        if code.trim_start().starts_with("#[cfg(test)]") {
            test_item = Some(indent);
            continue;
        }
        let in_test = test_item.is_some();
        // rustfmt puts the end of an item at the indentation of its beginning.
        if test_item == Some(indent) && (code.ends_with(';') || code.ends_with('}')) {
            test_item = None;
        }
        for (word, why) in FORBIDDEN {
            let allowed = word != "sim_host" && (in_test || (wiring && word == "unsafe"));
            if !allowed && names(code, word) {
                found.push((at + 1, word, why));
            }
        }
    }
    found
}

/// Whether `code` uses `word` as a whole word, or `f64` as the type of a literal (`2.0_f64`). `std` counts as a path or a
/// crate only, since it also abbreviates a standard deviation.
fn names(code: &str, word: &str) -> bool {
    let part_of_word = |c: char| c.is_ascii_alphanumeric() || c == '_';
    let mut words = code.split(|c| !part_of_word(c)).filter(|found| !found.is_empty());
    match word {
        "f64" => words.any(|found| found.ends_with("f64") && !found.starts_with("0x")),
        "std" => code.match_indices("std").any(|(at, _)| {
            let (before, after) = (&code[..at], &code[at + 3..]);
            before.ends_with("crate ") || (after.starts_with("::") && !before.ends_with(part_of_word))
        }),
        _ => words.any(|found| found == word),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn words(text: &str, wiring: bool) -> Vec<(usize, &'static str)> {
        violations(text, wiring)
            .into_iter()
            .map(|(line, word, _)| (line, word))
            .collect()
    }

    #[test]
    fn each_forbidden_word_is_found_with_its_line() {
        let text =
            "fn a() -> f64 {\n    unsafe { std::mem::zeroed() }\n}\nlet y = x.mul_add(a, b);\nuse sim_host::x;\n";
        let expected = [(1, "f64"), (2, "std"), (2, "unsafe"), (4, "mul_add"), (5, "sim_host")];
        assert_eq!(words(text, false), expected);
    }

    #[test]
    fn comments_and_longer_words_are_no_offence() {
        assert!(
            words(
                "/// unsafe in f64\nlet unsafely = noise.std * 2.0; // std::\nuse embedded_std::x;\nlet h = 0xf64;\n",
                false
            )
            .is_empty()
        );
    }

    #[test]
    fn a_test_module_may_use_std_but_never_the_simulator() {
        let text = "#[cfg(test)]\nextern crate std;\n#[cfg(test)]\nmod tests {\n    use sim_host::x;\n    let y = 1f64 as f64;\n}\nfn c(x: f64) {}\n";
        assert_eq!(words(text, false), [(5, "sim_host"), (8, "f64")]);
    }

    #[test]
    fn a_board_may_be_unsafe_and_nothing_more() {
        assert_eq!(words("unsafe { f(1.0_f64) }\n", true), [(1, "f64")]);
    }
}
