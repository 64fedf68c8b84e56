//! Options that leave out some of the estimated paths of a recording.

use crate::input::InputError;
use crate::recording::{Span, Thinning};

/// Heading of the options below in the help text.
const HEADING: &str = "Leaving out paths (recordings of --keep-paths)";

/// What to leave out.
#[derive(clap::Args, Clone, Debug, Default)]
pub(super) struct LeftOut {
    /// Leave out every path within 1 m and 3 degrees of the true line of sight, in sweeps that begin from FROM to before TO, s of the UAV's clock: an
    /// outage. May be given several times; wants the truth beside the paths
    #[arg(long, value_name = "FROM..TO", requires = "recording", help_heading = HEADING)]
    without_sight: Vec<Span>,
    /// Keep each path with this probability, 0 to 1
    #[arg(long, value_name = "P", requires = "recording", help_heading = HEADING)]
    path_share: Option<f64>,
    /// Seed of which paths are kept [default: 1]
    #[arg(long, value_name = "N", requires = "path_share", help_heading = HEADING)]
    path_seed: Option<u64>,
}

impl LeftOut {
    /// The same, checked for a recording that is of estimated paths or is not.
    ///
    /// # Errors
    /// [`InputError`] naming the option, when its value is out of range or there are samples instead of paths.
    pub(super) fn of(&self, is_of_paths: bool) -> Result<Thinning, InputError> {
        let share = self.path_share.unwrap_or(1.0);
        if !(0.0..=1.0).contains(&share) {
            return Err(InputError::new(format!(
                "--path-share is {share}, expected 0 to 1"
            )));
        }
        if !is_of_paths && (self.path_share.is_some() || !self.without_sight.is_empty()) {
            return Err(InputError::new(
                "--without-sight and --path-share: expected a recording of --keep-paths, found samples",
            ));
        }
        Ok(Thinning {
            without_sight: self.without_sight.clone(),
            share,
            seed: self.path_seed.unwrap_or(1),
        })
    }
}
