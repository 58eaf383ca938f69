//! A progress bar on stderr for work that takes longer than a breath.

use indicatif::{ProgressBar, ProgressStyle};

/// Steps of a whole bar: fine enough to move during a single trial.
pub const STEPS: u64 = 1_000_000;

/// A bar over `trials` trials; hidden by itself where stderr is no terminal.
pub fn bar(trials: usize) -> ProgressBar {
    let bar = ProgressBar::new(STEPS);
    let what = if trials == 1 { "sealing".to_string() } else { format!("{trials} trials") };
    let style = ProgressStyle::with_template("{msg} [{bar:40}] {percent:>3} % · {elapsed} · {eta} left");
    bar.set_style(style.unwrap_or_else(|_| ProgressStyle::default_bar()).progress_chars("=> "));
    bar.set_message(what);
    bar
}

/// Shows how far a single trial has come, 0 to 1; among several, whole trials count.
pub fn within(bar: &ProgressBar, trials: usize, done: f64) {
    if trials == 1 {
        bar.set_position((done * STEPS as f64) as u64);
    }
}
