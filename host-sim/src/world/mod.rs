//! The world around a receiver: a scene with a flight through it, heard through channel and front end.
//!
//! This is where the parts meet: the flight says where the two ends are, the tracer which paths there are between them,
//! the channel what the front end makes of these. Each sweep depends on the world and its number only, so sweeps may be
//! made in any order, on any thread.

mod config;
mod effects;
mod given;
mod medium;
mod propagation;
mod scene;
mod surroundings;
mod words;

use std::ops::Range;

use cslam_core::array::half_wave_dipole;
use cslam_core::constants::SPEED_OF_LIGHT_M_PER_S;
use cslam_core::geometry::{GeometryError, Rotation};
use nalgebra::Vector3;

use crate::channel::{Instant, Radio, Simulator, Sweep};
use crate::flight::FlightPlan;
use crate::input::InputError;
use crate::paths::{Link, LinkPath};
use crate::scene::Scene;
use crate::sensors::{SensedFlight, Site, Truth, WallIron};
use crate::tracer::{Propagation, Tracer};

pub use config::{Profile, WorldConfig};
pub use effects::{EFFECTS, Effect};
pub use given::GivenLinks;
use medium::Medium;
pub use propagation::{Materials, PropagationConfig};
pub use scene::SceneConfig;
use surroundings::Surroundings;

/// Beams whose pilots the front end keeps, the strongest of a sweep (docs/front-end.md section 5).
const PILOT_BEAMS: usize = 12;

/// A scene, or the links that somebody traced in one, with a flight through it. The UAV hears it with `ARRAYS` arrays of `ELEMENTS`
/// elements.
#[derive(Debug)]
pub struct World<'s, const ARRAYS: usize = 4, const ELEMENTS: usize = 8, const CHANNELS: usize = 32> {
    profile: Profile,
    medium: Medium<'s>,
    ground_z_m: f64,
    flight: SensedFlight,
    simulator: Simulator<ARRAYS, ELEMENTS, CHANNELS>,
    /// When nothing comes straight, s.
    blocked_s: Range<f64>,
}

/// What one sweep of the transmit beams left at the receiver, and the truth behind it.
#[derive(Clone, Debug)]
pub struct HeardSweep<const CHANNELS: usize = 32> {
    /// Number of the sweep.
    pub number: u32,
    /// Blocks of the transmit beams.
    pub beams: Sweep<CHANNELS>,
    /// Blocks of the beam squint symbols that follow them.
    pub squint: Sweep<CHANNELS>,
    /// Blocks of the pilots: the strongest beams, each sent twice again.
    pub pilots: Sweep<CHANNELS>,
    /// The world at the first beam: not for the receiver.
    pub truth: Truth,
    /// The true paths: not for the receiver.
    pub link: Link,
}

impl<'s> World<'s> {
    /// Plans a flight through a scene, which [`WorldConfig::scene`] loads, and sets up its sensors and its channel; `seed` decides all of it.
    ///
    /// # Errors
    /// [`InputError`] naming a figure of the configuration that is out of range, or saying that no flight was found.
    pub fn new(scene: &'s Scene, config: WorldConfig, seed: u64) -> Result<Self, InputError> {
        Self::planned(scene, Radio::default(), config, seed)
    }

    /// Flies along links that somebody else traced, with the channel and the sensors of this world; what it says of propagation and of
    /// planning, but for the rest at the beginning and the period of sweeps, has no meaning. `seed` decides all that is drawn.
    ///
    /// # Errors
    /// [`InputError`] naming a figure of the configuration that is out of range, or a place that cannot be flown to.
    pub fn along(links: GivenLinks, config: WorldConfig, seed: u64) -> Result<World<'static>, InputError> {
        World::along_with_radio(links, Radio::default(), config, seed)
    }
}

impl<'s, const ARRAYS: usize, const ELEMENTS: usize, const CHANNELS: usize>
    World<'s, ARRAYS, ELEMENTS, CHANNELS>
{
    /// [`World::new`] with any radio, in a scene at its carrier ([`Scene::at_frequency`]).
    ///
    /// # Errors
    /// As there, or [`InputError`] saying that the scene is at another frequency.
    pub fn with_radio(
        scene: &'s Scene,
        radio: Radio,
        config: WorldConfig,
        seed: u64,
    ) -> Result<Self, InputError> {
        let [of_scene_hz, of_radio_hz] = [scene.frequency_hz(), radio.waveform().carrier_hz];
        if of_scene_hz != of_radio_hz {
            let [of_scene_ghz, of_radio_ghz] = [of_scene_hz, of_radio_hz].map(|hz| hz / 1e9);
            let name = scene.name();
            let message = format!("scene {name} is at {of_scene_ghz} GHz, the radio at {of_radio_ghz}");
            return Err(InputError::new(message));
        }
        Self::planned(scene, radio, config, seed)
    }

    fn planned(scene: &'s Scene, radio: Radio, config: WorldConfig, seed: u64) -> Result<Self, InputError> {
        config.check_with(CHANNELS, radio.beams())?;
        let tracer = Tracer::with(
            scene,
            config.propagation.max_order(),
            config.propagation.of_tracer(seed),
        )
        .ok_or_else(|| InputError::new("more reflections are asked for than the tracer can follow"))?;
        // All that is drawn is drawn in the scene's own frame, and goes with the scene.
        let plan = FlightPlan::plan(scene.own(), &config.flight, seed)?;
        let surroundings = Surroundings::place(&tracer, &config.propagation, &plan, seed)?;
        let iron_ut = config.sensors.magnetometer.wall_dipole_ut;
        let iron = WallIron::draw(scene.own(), &plan, iron_ut, seed);
        let site = Site {
            ground_z_m: ground_z_m(scene),
            iron: iron.placed(&scene.placement()),
        };
        let plan = plan.placed(&scene.placement());
        let mut flight = SensedFlight::new(plan, config.sensors, seed)?.at_site(site);
        let simulator = Simulator::with_radio(radio, config.channel, seed);
        if sends_words(&flight) {
            // Words are understood over single paths.
            let single = Propagation {
                diffuse: None,
                ..*tracer.propagation()
            };
            let single = Tracer::with(scene, tracer.max_order(), single).ok_or_else(|| {
                InputError::new("more reflections are asked for than the tracer can follow")
            })?;
            let medium = Medium::Traced(Box::new(single), surroundings.clone());
            let words = words::over_air(&medium, &simulator, &flight)?;
            flight = flight.with_words(words);
        }
        let medium = Medium::Traced(Box::new(tracer), surroundings);
        Ok(Self {
            profile: config.profile,
            medium,
            ground_z_m: ground_z_m(scene),
            flight,
            simulator,
            blocked_s: 0.0..0.0,
        })
    }

    /// [`World::along`] with any radio. The links are taken as they are: traced at its carrier.
    ///
    /// # Errors
    /// As there.
    pub fn along_with_radio(
        links: GivenLinks,
        radio: Radio,
        config: WorldConfig,
        seed: u64,
    ) -> Result<World<'static, ARRAYS, ELEMENTS, CHANNELS>, InputError> {
        config.check_with(CHANNELS, radio.beams())?;
        let (plan, between) = links.flown(&config.flight)?;
        let mut flight = SensedFlight::new(plan, config.sensors, seed)?;
        let medium = Medium::Given(between);
        let simulator = Simulator::with_radio(radio, config.channel, seed);
        if sends_words(&flight) {
            let words = words::over_air(&medium, &simulator, &flight)?;
            flight = flight.with_words(words);
        }
        Ok(World {
            profile: config.profile,
            medium,
            ground_z_m: 0.0,
            flight,
            simulator,
            blocked_s: 0.0..0.0,
        })
    }

    /// The radio.
    pub fn radio(&self) -> &Radio {
        self.simulator.radio()
    }

    /// The name of this world.
    pub fn profile(&self) -> Profile {
        self.profile
    }

    /// The flight with its sensors.
    pub fn flight(&self) -> &SensedFlight {
        &self.flight
    }

    /// Number of sweeps.
    pub fn sweeps(&self) -> u32 {
        self.flight.plan().sweeps()
    }

    /// Height of the ground, m, world frame: scenes have it at 0 of their own frame; its relief lies about it.
    pub fn ground_z_m(&self) -> f64 {
        self.ground_z_m
    }

    /// The same world with the line of sight blocked for a while, s: whatever else arrives does so as before.
    #[must_use]
    pub fn blocked(self, during_s: Range<f64>) -> Self {
        Self {
            blocked_s: during_s,
            ..self
        }
    }

    /// The paths between the two ends.
    pub fn link(&self, truth: &Truth) -> Link {
        let mut link = self.medium.link(truth);
        if self.blocked_s.contains(&truth.time_s) {
            link.paths.retain(|path| !path.is_line_of_sight());
        }
        link
    }

    /// Traces, synthesises and digitises a sweep.
    ///
    /// # Errors
    /// [`InputError`] naming the sweep when a path cannot be synthesised.
    pub fn sweep(&self, sweep: u32) -> Result<HeardSweep<CHANNELS>, InputError> {
        let truth = self.flight.sweep_truth(sweep);
        let failed = |reason: String| InputError::new(format!("sweep {sweep}: {reason}"));
        let link = self.link(&truth);
        let instant = instant(&truth).map_err(|e| failed(e.to_string()))?;
        let shift_m = self.flight.wrong_fix_m(sweep);
        let wavelength_m = self.radio().waveform().wavelength_m();
        let elsewhere = (shift_m != Vector3::zeros()).then(|| seen_from(&link, shift_m, wavelength_m));
        let heard = elsewhere.as_ref().unwrap_or(&link);
        let beams = self
            .simulator
            .sweep(heard, &instant, sweep)
            .map_err(|e| failed(e.to_string()))?;
        let squint = self
            .simulator
            .squint(heard, &instant, sweep, self.radio().squint_scheme())
            .map_err(|e| failed(e.to_string()))?;
        let strongest = beams.strongest(PILOT_BEAMS);
        let pilots = self
            .simulator
            .pilots(heard, &instant, sweep, strongest)
            .map_err(|e| failed(e.to_string()))?;
        Ok(HeardSweep {
            number: sweep,
            beams,
            squint,
            pilots,
            truth,
            link,
        })
    }
}

/// Whether beacon or timing go over the air.
fn sends_words(flight: &SensedFlight) -> bool {
    flight.config().beacon.over_air || flight.config().timing.over_air
}

fn ground_z_m(scene: &Scene) -> f64 {
    let [.., raised_m] = scene.placement().moved_m;
    raised_m
}

/// A link whose line of sight, there or not, is that of a UAV `shift_m` away, through free space.
fn seen_from(link: &Link, shift_m: Vector3<f64>, wavelength_m: f64) -> Link {
    let way = Vector3::from(link.rx) + shift_m - Vector3::from(link.tx);
    let length_m = way.norm().max(f64::MIN_POSITIVE);
    let left = way / length_m;
    let zenith_rad = |u: &Vector3<f64>| libm::acos(u.z.clamp(-1.0, 1.0));
    let azimuth_rad = |u: &Vector3<f64>| libm::atan2(u.y, u.x);
    let dipoles = half_wave_dipole(&left) * half_wave_dipole(&-left);
    let gain = wavelength_m / (4.0 * core::f64::consts::PI * length_m) * dipoles;
    let path = LinkPath {
        order: Some(0),
        kind: None,
        delay_s: length_m / SPEED_OF_LIGHT_M_PER_S,
        aoa_zenith_rad: zenith_rad(&-left),
        aoa_azimuth_rad: azimuth_rad(&-left),
        aod_zenith_rad: Some(zenith_rad(&left)),
        aod_azimuth_rad: Some(azimuth_rad(&left)),
        aod_sigma_rad: None,
        gain: Some([gain, 0.0]),
        cross_gain: None,
        first_vertex: None,
        last_vertex: None,
        edge_point: None,
        snr_db: None,
        covariance: None,
        confirmed: None,
        closing_m_per_s: None,
    };
    let others = link.paths.iter().filter(|path| path.order != Some(0)).cloned();
    Link {
        paths: core::iter::once(path).chain(others).collect(),
        ..link.clone()
    }
}

/// The truth as the channel takes it.
///
/// # Errors
/// [`GeometryError`] for an attitude that is no rotation: none that a flight gives.
pub fn instant(truth: &Truth) -> Result<Instant, GeometryError> {
    let gmt = nalgebra::UnitQuaternion::from_rotation_matrix(&truth.gmt_attitude);
    Ok(Instant {
        time_s: truth.time_s,
        attitude: Rotation::from_quaternion(truth.uav.quaternion_wb())?,
        velocity_m_per_s: truth.uav.velocity_m_per_s,
        turn_rad_per_s: truth.uav.rate_rad_per_s,
        gmt_attitude: Rotation::from_quaternion([gmt.w, gmt.i, gmt.j, gmt.k])?,
        gmt_velocity_m_per_s: truth.gmt_velocity_m_per_s,
        clock_offset_s: truth.clock_offset_s,
        clock_drift: truth.clock_drift,
    })
}

#[cfg(test)]
mod tests;
