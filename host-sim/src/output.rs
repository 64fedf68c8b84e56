//! What a command prints: this crate's own `print!`, `println!` and `eprintln!`.
//!
//! Those of the standard library panic when nobody reads any more, as after `cslam trace ... | head -1`, and when the disk under a
//! redirected output is full. These unwind without a word to [`catching`], which makes an error of it, so all commands end alike;
//! files and stations that are open are closed on the way.

use std::fmt;
use std::io::{self, Write};
use std::panic::{AssertUnwindSafe, catch_unwind, resume_unwind};

/// Standard output does not take any more.
struct Unprintable(io::Error);

/// Prints to standard output, all of it before it returns.
///
/// # Panics
/// Unwinds to [`catching`] when it cannot be written.
pub(crate) fn print(text: fmt::Arguments<'_>) {
    let mut out = io::stdout().lock();
    if let Err(error) = out.write_fmt(text).and_then(|()| out.flush()) {
        drop(out);
        resume_unwind(Box::new(Unprintable(error)));
    }
}

/// Prints to standard error. There is nobody to tell when that fails.
pub(crate) fn print_error(text: fmt::Arguments<'_>) {
    let _unheard = io::stderr().lock().write_fmt(text);
}

/// Runs a command; an output that does not take any more is an error of it.
///
/// # Errors
/// Those of the command, and of its standard output.
pub(crate) fn catching(command: impl FnOnce() -> anyhow::Result<()>) -> anyhow::Result<()> {
    // What the command leaves half done is not looked at again.
    catch_unwind(AssertUnwindSafe(command)).unwrap_or_else(|panic| match panic.downcast::<Unprintable>() {
        Ok(unprintable) => {
            Err(anyhow::Error::new(unprintable.0).context("standard output cannot be written"))
        }
        Err(panic) => resume_unwind(panic),
    })
}

macro_rules! print {
    ($($text:tt)*) => { $crate::output::print(format_args!($($text)*)) };
}

macro_rules! println {
    () => { $crate::output::print(format_args!("\n")) };
    ($($text:tt)*) => { $crate::output::print(format_args!("{}\n", format_args!($($text)*))) };
}

macro_rules! eprintln {
    () => { $crate::output::print_error(format_args!("\n")) };
    ($($text:tt)*) => { $crate::output::print_error(format_args!("{}\n", format_args!($($text)*))) };
}
