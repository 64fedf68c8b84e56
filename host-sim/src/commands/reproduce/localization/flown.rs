//! The flights of the tables: from samples, or from the paths of such a flight where these are kept.

use crate::campaign::Flight;
use crate::commands::fly::keep;
use crate::commands::kept::{self, Kept};
use crate::config::Config;
use crate::kept_flight::KeptFlight;
use crate::raw_flight::Source;
use crate::scene::Scene;

/// Flies through a scene of this name. Paths that are not kept yet are kept then, where they are to be.
pub(super) fn fly<'s>(
    (scene, name): (&'s Scene, &str),
    config: &Config,
    seed: u64,
    kept: Option<&Kept<'_>>,
) -> anyhow::Result<KeptFlight<'s>> {
    let Some(kept) = kept else {
        return KeptFlight::fly(scene, config.world.clone(), seed);
    };
    let told = &config.receiver;
    let flight = Flight {
        world: config.world.profile.name().to_owned(),
        mode: told.mode.name().to_owned(),
        scene: name.to_owned(),
        seed,
    };
    let place = kept.place(config, told, &flight)?;
    let world = config.world_in(scene, seed)?;
    if kept::is_kept(&place) {
        let (recorded, ..) = kept::open(&place, config, told, &flight, None)?;
        let of_sweep = |sweep| {
            let given = recorded.sweep(sweep)?;
            let link = given.truth.map(|(_, link)| link);
            // Without its file of true paths they are traced again.
            let link = link.unwrap_or_else(|| world.link(&world.flight().sweep_truth(sweep)));
            Ok((given.estimated.unwrap_or_default(), link))
        };
        let sweeps = 0..recorded.sweeps();
        let paths = sweeps.map(of_sweep).collect::<anyhow::Result<_>>()?;
        let config = config.world.clone();
        return Ok(KeptFlight::of_paths(world, scene, config, seed, paths));
    }
    let directory = keep::open(&place, &world)?;
    let flown = KeptFlight::fly_through(world, scene, config.world.clone(), seed)?;
    let paths = flown.write_paths(directory.path())?;
    keep::write(directory, paths, config, name, flown.world())?;
    Ok(flown)
}
