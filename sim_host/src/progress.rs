//! How far a run is, on standard error; nothing where that is no terminal, so that logs and pipes stay clean.

use indicatif::{ProgressBar, ProgressStyle};

/// A bar of `length` steps of `what` ("trials", "cycles"). Clone it into threads; it is gone once finished and cleared.
pub fn bar(length: u64, what: &'static str) -> ProgressBar {
    let bar = ProgressBar::new(length).with_message(what);
    // The template is a constant, and the test below reads it: the plain bar stands in for nothing.
    bar.set_style(style().unwrap_or_else(|_| ProgressStyle::default_bar()));
    bar
}

fn style() -> Result<ProgressStyle, indicatif::style::TemplateError> {
    let style = ProgressStyle::with_template("{bar:32} {pos}/{len} {msg}  {elapsed}, {eta} left")?;
    Ok(style.progress_chars("█▌░"))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_bar_counts_and_its_template_is_valid() {
        style().expect("a valid template");
        let bar = bar(200, "trials");
        bar.inc(3);
        assert_eq!(
            (bar.position(), bar.length(), bar.message().as_str()),
            (3, Some(200), "trials")
        );
    }
}
