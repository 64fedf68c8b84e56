//! A flight that is flown from its samples once and from its paths many times.

use std::borrow::Cow;
use std::ops::Range;
use std::path::Path;
use std::sync::Arc;
use std::sync::atomic::AtomicBool;

use cslam_core::estimator::Watch;
use cslam_core::receiver::{Config, Pilots};
use cslam_core::signal::Waveform;
use cslam_firmware::app::Estimated;
use rayon::prelude::*;

use super::again::Again;
use super::blocked::Blocked;
use super::error_free::ErrorFree;
use crate::config::EarthField;
use crate::flight_log::{FlightLog, Header};
use crate::input::InputError;
use crate::paths::{Link, LinkPath};
use crate::raw_flight::{self, BOARD_STATES, BoardReceiver, Source, Swept, board_config, with_receiver};
use crate::recording::{FileEntry, Keeper, Span, Thinned, Thinning, write_paths};
use crate::scene::Scene;
use crate::sensors::{FaultsConfig, Stamped, Truth};
use crate::smoother::{Flier, fly_smoothed};
use crate::world::{World, WorldConfig};

/// A flight whose paths are known.
#[derive(Debug)]
pub struct KeptFlight<'s> {
    scene: &'s Scene,
    config: WorldConfig,
    seed: u64,
    world: World<'s>,
    /// All but samples.
    events: Vec<Stamped>,
    /// Of sweeps 0, 1, 2 ...: what was estimated, and what is there in truth.
    estimated: Vec<Estimated>,
    links: Vec<Link>,
}

/// What is other than when the flight was flown from its samples.
#[derive(Clone, Debug, Default)]
pub struct Changes {
    /// Faults of the sensors. Those of the configuration are gone, but for wrong fixes: these are in the samples.
    pub faults: FaultsConfig,
    /// Times without the path that is the line of sight.
    pub without_sight: Vec<Span>,
    /// What is heard where the line of sight is blocked.
    pub blocked: Option<Blocked>,
    /// The part of the flight in which the receiver is on; all of it when absent.
    pub heard: Option<Span>,
    /// What of the measurements is put right by the truth.
    pub error_free: Vec<ErrorFree>,
}

impl<'s> KeptFlight<'s> {
    /// Flies from samples with our methods, and keeps the paths.
    ///
    /// # Errors
    /// [`crate::input::InputError`] naming a figure that is out of range, or saying that no flight was found.
    pub fn fly(scene: &'s Scene, config: WorldConfig, seed: u64) -> anyhow::Result<Self> {
        let world = World::new(scene, config.clone(), seed)?;
        Self::fly_through(world, scene, config, seed)
    }

    /// Flies it from its samples once more, with the line of sight blocked in a span of time: what is estimated then.
    ///
    /// # Errors
    /// [`crate::input::InputError`] naming a sweep that cannot be flown.
    pub fn blocked(&self, span: Span) -> anyhow::Result<Blocked> {
        let world = World::new(self.scene, self.config.clone(), self.seed)?;
        let world = world.blocked(span.from_s..span.to_s);
        Ok(Blocked {
            estimated: estimated(&world, self.seed)?.into(),
            span,
        })
    }

    /// The same through a world that is there already: that of this scene, configuration and seed.
    ///
    /// # Errors
    /// [`crate::input::InputError`] naming a sweep that cannot be flown.
    pub fn fly_through(
        world: World<'s>,
        scene: &'s Scene,
        config: WorldConfig,
        seed: u64,
    ) -> anyhow::Result<Self> {
        let estimated = estimated(&world, seed)?;
        let links = (0..world.sweeps()).into_par_iter();
        let links = links.map(|sweep| world.link(&world.flight().sweep_truth(sweep)));
        let links = links.collect();
        Ok(Self::of_paths(world, scene, config, seed, (estimated, links)))
    }

    /// A flight whose paths have been estimated before, in the world of this scene, configuration and seed: the estimated and the true ones of
    /// sweeps 0, 1, 2 ...
    #[must_use]
    pub fn of_paths(
        world: World<'s>,
        scene: &'s Scene,
        config: WorldConfig,
        seed: u64,
        (estimated, links): (Vec<Estimated>, Vec<Link>),
    ) -> Self {
        Self {
            scene,
            config,
            seed,
            links,
            events: world.flight().events().collect(),
            world,
            estimated,
        }
    }

    /// Writes its paths, as [`write_paths`] does.
    ///
    /// # Errors
    /// [`InputError`] naming a sweep that cannot be kept, or a file that cannot be written.
    pub fn write_paths(&self, directory: &Path) -> Result<(FileEntry, u32), InputError> {
        write_paths(directory, &self.estimated, &self.links)
    }

    /// Flies several seeds so; `flown` is called after each.
    ///
    /// # Errors
    /// As [`KeptFlight::fly`].
    pub fn fly_each(
        scene: &'s Scene,
        config: &WorldConfig,
        seeds: Range<u64>,
        mut flown: impl FnMut(),
    ) -> anyhow::Result<Vec<Self>> {
        seeds
            .map(|seed| {
                let kept = Self::fly(scene, config.clone(), seed)?;
                flown();
                Ok(kept)
            })
            .collect()
    }

    /// The world that the samples came from.
    pub fn world(&self) -> &World<'s> {
        &self.world
    }

    /// Whether there is line of sight, sweep by sweep.
    #[must_use]
    pub fn sights(&self) -> Vec<bool> {
        let sighted = |link: &Link| link.paths.iter().any(LinkPath::is_line_of_sight);
        self.links.iter().map(sighted).collect()
    }

    /// Flies its paths with these changes and a receiver that is configured so; it learns the earth's magnetic field and the height of the
    /// ground from the world. `swept` sees each sweep that has ended, beside the truth, `ended` the receiver at the end.
    ///
    /// # Errors
    /// [`crate::input::InputError`] naming a figure of the faults that is out of range.
    pub fn again(
        &self,
        changes: &Changes,
        receiver: Config<'static>,
        mut swept: impl FnMut(&Swept<'_>, &Truth),
        ended: impl FnOnce(&BoardReceiver<'_>),
    ) -> anyhow::Result<FlightLog> {
        let changed = self.changed(changes)?;
        let world = changed.as_ref().unwrap_or(&self.world);
        let paths = self.paths(changed.as_ref(), changes);
        let source = thinned(&paths, changes);
        with_receiver(at_site(receiver, world), |receiver| {
            let swept = |ended: &Swept<'_>| swept(ended, &world.flight().sweep_truth(ended.report.sweep));
            let header = header(world, self.seed);
            let (log, _) = raw_flight::fly(&source, receiver, header, &NEVER, swept, |_, _| ())?;
            ended(receiver);
            Ok(log)
        })
    }

    /// The same, smoothed: the log as it was on board, and the smoothed one. `swept` sees the flight on board.
    ///
    /// # Errors
    /// Those of [`Self::again`].
    pub fn smoothed(
        &self,
        changes: &Changes,
        receiver: Config<'static>,
        mut swept: impl FnMut(&Swept<'_>, &Truth),
    ) -> anyhow::Result<[FlightLog; 2]> {
        let changed = self.changed(changes)?;
        let world = changed.as_ref().unwrap_or(&self.world);
        let paths = self.paths(changed.as_ref(), changes);
        let receiver = at_site(receiver, world);
        let mut once = Once {
            receiver: receiver.clone(),
            header: header(world, self.seed),
            looks_on: Some(|ended: &Swept<'_>| {
                swept(ended, &world.flight().sweep_truth(ended.report.sweep));
            }),
        };
        fly_smoothed(&thinned(&paths, changes), &receiver, &mut once)
    }

    /// The world with other sensors; `None` where they are its own.
    fn changed(&self, changes: &Changes) -> Result<Option<World<'s>>, InputError> {
        let faults = FaultsConfig {
            fix: self.config.sensors.faults.fix.clone(),
            ..changes.faults.clone()
        };
        let mut config = self.config.clone();
        config.sensors = ErrorFree::sensors(&changes.error_free, &config.sensors);
        config.sensors.faults = faults;
        if config.sensors == self.config.sensors {
            return Ok(None);
        }
        World::new(self.scene, config, self.seed).map(Some)
    }

    /// Its paths, in its own world or in one with other sensors.
    fn paths<'a>(&'a self, faulty: Option<&'a World<'a>>, changes: &'a Changes) -> Again<'a> {
        let events = match faulty {
            Some(faulty) => faulty.flight().events().collect(),
            None => Cow::from(&self.events),
        };
        Again {
            sound: &self.world,
            faulty: faulty.unwrap_or(&self.world),
            events,
            estimated: &self.estimated,
            links: &self.links,
            heard: changes.heard,
            blocked: changes.blocked.as_ref(),
            error_free: &changes.error_free,
        }
    }
}

/// What our methods estimate in a world, from its samples.
fn estimated(world: &World<'_>, seed: u64) -> anyhow::Result<Vec<Estimated>> {
    let receiver = Config {
        pilots: Pilots::EverySweep,
        ..board_config()?
    };
    let keeper = Keeper::new(world);
    with_receiver(at_site(receiver, world), |receiver| {
        let swept = |swept: &Swept<'_>| keeper.swept(swept);
        raw_flight::fly(&keeper, receiver, header(world, seed), &NEVER, swept, |_, _| ())?;
        Ok(())
    })?;
    Ok(keeper.estimated()?)
}

/// Paths without those that the changes leave out.
fn thinned<'a>(paths: &'a Again<'a>, changes: &Changes) -> Thinned<'a, Again<'a>> {
    let thinning = Thinning {
        without_sight: changes.without_sight.clone(),
        ..Thinning::default()
    };
    Thinned::new(paths, thinning)
}

/// Flies for a smoother. Whoever looks on sees the first flight alone.
struct Once<W> {
    receiver: Config<'static>,
    header: Header,
    looks_on: Option<W>,
}

impl<W: FnMut(&Swept<'_>)> Flier<BOARD_STATES> for Once<W> {
    fn fly(
        &mut self,
        source: &impl Source,
        listener: Arc<dyn Watch<f32, BOARD_STATES>>,
        mut swept: impl FnMut(&Swept<'_>),
    ) -> anyhow::Result<FlightLog> {
        let mut looks_on = self.looks_on.take();
        let swept = |ended: &Swept<'_>| {
            swept(ended);
            if let Some(looks_on) = &mut looks_on {
                looks_on(ended);
            }
        };
        with_receiver(self.receiver.clone(), |receiver| {
            receiver.watch(listener);
            let (log, _) = raw_flight::fly(source, receiver, self.header.clone(), &NEVER, swept, |_, _| ())?;
            Ok(log)
        })
    }
}

/// Nobody interrupts.
static NEVER: AtomicBool = AtomicBool::new(false);

/// A receiver that knows the field and the ground of a world.
fn at_site(mut receiver: Config<'static>, world: &World<'_>) -> Config<'static> {
    let earth = EarthField::from(&world.flight().config().magnetometer);
    receiver.magnetic_field = Some(earth.config());
    if let Some(height_m) = &mut receiver.accept.point.ground_z_m {
        *height_m = world.ground_z_m() as f32;
    }
    receiver
}

fn header(world: &World<'_>, seed: u64) -> Header {
    Header {
        mode: "best".into(),
        scene: String::new(),
        world: Some(world.profile().name().to_owned()),
        seed,
        planned_sweeps: world.sweeps() as usize,
        sweep_period_s: world.flight().plan().schedule().sweep_period_s,
        delay_cycle_m: Some(Waveform::default().delay_period().length_m()),
    }
}
