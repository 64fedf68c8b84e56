//! What a command says on the side, on standard error: progress bars on a terminal, and notes. Both fall silent with `--quiet`.

use std::fmt::Display;
use std::sync::atomic::{AtomicBool, Ordering};

use indicatif::{ProgressBar, ProgressStyle};

/// Set once, before the command runs.
static QUIET: AtomicBool = AtomicBool::new(false);

/// Says nothing from now on but results, warnings and errors.
pub fn be_quiet() {
    QUIET.store(true, Ordering::Relaxed);
}

/// A line that nobody has to read: what was written where, the summary beside `--json`.
pub fn note(text: impl Display) {
    if !QUIET.load(Ordering::Relaxed) {
        eprintln!("{text}");
    }
}

/// A bar over `length` steps with rate and time left. Hidden when standard error is no terminal.
pub fn bar(length: u64, what: &'static str) -> ProgressBar {
    if QUIET.load(Ordering::Relaxed) {
        return ProgressBar::hidden();
    }
    let style = ProgressStyle::with_template("{prefix} {wide_bar} {pos}/{len} {per_sec} {eta} {msg}");
    let bar = ProgressBar::new(length).with_prefix(what);
    match style {
        Ok(style) => bar.with_style(style),
        Err(_) => bar,
    }
}
