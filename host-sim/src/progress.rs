//! Progress bars: on a terminal only, on standard error.

use indicatif::{ProgressBar, ProgressStyle};

/// A bar over `length` steps with rate and time left. Hidden when standard error is no terminal.
pub fn bar(length: u64, what: &'static str) -> ProgressBar {
    let style = ProgressStyle::with_template("{prefix} {wide_bar} {pos}/{len} {per_sec} {eta} {msg}");
    let bar = ProgressBar::new(length).with_prefix(what);
    match style {
        Ok(style) => bar.with_style(style),
        Err(_) => bar,
    }
}
