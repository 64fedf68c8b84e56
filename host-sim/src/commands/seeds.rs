//! Flights to tune on and flights to report, kept apart by every command that flies several.

use crate::campaign::Lists;
use crate::input::InputError;

/// Whether both may be flown together.
#[derive(clap::Args, Clone, Copy, Debug)]
pub(crate) struct AnySeed {
    /// Fly flights that are there to report only (tests/seeds.toml) together with others
    #[arg(long)]
    any_seed: bool,
}

impl AnySeed {
    /// Refuses flights (scene and seed) to report beside others, unless that is asked for.
    pub(crate) fn check(self, flights: &[(String, u64)]) -> Result<(), InputError> {
        if self.any_seed {
            return Ok(());
        }
        Lists::of_the_repository()?.refuse_mixture(flights)
    }

    /// The same for a scene and seeds one after the other.
    pub(crate) fn check_seeds(self, scene: &str, first: u64, count: u64) -> Result<(), InputError> {
        let seeds = first..first.saturating_add(count);
        self.check(&seeds.map(|seed| (scene.to_owned(), seed)).collect::<Vec<_>>())
    }
}
