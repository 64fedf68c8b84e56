//! The parts of a receiver, and how each is built where it shall lie.

use core::mem::MaybeUninit;

use cslam_core::beam_squint::BeamSquint;
use cslam_core::estimator::states;
use cslam_core::inertial::MagneticField;
use cslam_core::link_state::models;
use cslam_core::profile::{FlightConfig, FlightEstimator, Radio};
use cslam_core::receiver::{Config, LinkStates, Memory, Receiver};
use cslam_core::telemetry::{Decoder, Key};
use cslam_firmware::app::{AppConfig, Application, Downlink, Ground, Map, VOXELS};
use cslam_firmware::front_end::{FrontEnd, SoftwareCrc};
use cslam_firmware::sensor_stream::SESSION;

use crate::receiver_values::CslamReceiverConfig;
use crate::status::CslamStatus;

pub(crate) type App = Application<'static, Radio, VOXELS, { states(2) }>;

/// All of a receiver. `application` refers to the parts before it, so none of them is touched once it is there, and the whole does not
/// move: the slot knows its address.
pub(crate) struct Parts {
    estimator: FlightEstimator,
    squint: BeamSquint,
    map: Map,
    pub(crate) application: App,
}

/// Writes a receiver part by part. Each large one has a function of its own, never inlined: what it needs on the stack on the way to its
/// place is given back before the next one.
///
/// # Safety
/// `place` is memory of [`Parts`] that is the receiver's until it ends, at an address that it keeps.
pub(crate) unsafe fn build(
    place: *mut Parts,
    told: &CslamReceiverConfig,
    (ground_z_m, magnetic_field): (Option<f32>, Option<MagneticField>),
) -> Result<(), CslamStatus> {
    let classifier = models::trees().map_err(|_| CslamStatus::Damaged)?;
    let mut config = Config::best(LinkStates::Trees(classifier));
    config.accept.point.ground_z_m = ground_z_m;
    config.magnetic_field = magnetic_field;
    let key = Key::new(told.key);
    let ground = Ground {
        downlink: Downlink::new(told.uav, &key, told.first_counter),
        uplink: Decoder::new(told.uav, &key),
    };
    // SAFETY: `place` is memory of `Parts`. The references go to parts that nobody touches but through them, as long as the receiver is
    // there; they end with it.
    unsafe {
        let estimator = (&raw mut (*place).estimator).cast::<MaybeUninit<_>>();
        FlightEstimator::init(&mut *estimator, &FlightConfig::default(), ());
        place_squint(&raw mut (*place).squint, &config)?;
        place_map(&raw mut (*place).map);
        let memory = Memory {
            estimator: &mut (*place).estimator,
            squint: &mut (*place).squint,
            map: &mut (*place).map,
        };
        place_application(&raw mut (*place).application, config, ground, memory);
    }
    Ok(())
}

/// # Safety
/// `place` is memory of a [`BeamSquint`].
#[inline(never)]
unsafe fn place_squint(place: *mut BeamSquint, config: &Config<'static>) -> Result<(), CslamStatus> {
    let squint = config.beam_squint::<Radio>().map_err(|_| CslamStatus::Damaged)?;
    // SAFETY: the caller's promise.
    unsafe { place.write(squint) };
    Ok(())
}

/// # Safety
/// `place` is memory of a [`Map`].
#[inline(never)]
unsafe fn place_map(place: *mut Map) {
    // SAFETY: the caller's promise.
    unsafe { place.write(Map::new()) };
}

/// # Safety
/// `place` is memory of an [`App`].
#[inline(never)]
unsafe fn place_application(
    place: *mut App,
    config: Config<'static>,
    ground: Ground,
    memory: Memory<'static, Radio, VOXELS>,
) {
    let front_end = FrontEnd::new(SoftwareCrc, SESSION);
    // SAFETY: the caller's promise.
    unsafe {
        place.write(Application::new(
            AppConfig::default(),
            front_end,
            ground,
            Receiver::new(config, memory),
        ));
    }
}
