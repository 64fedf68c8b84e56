//! The whole application: everything that flies, from the drivers' samples to what the ground hears.

use core::hint::black_box;

use cortex_m::singleton;
use cslam_core::cslam::{Beacon, Config, Cslam, LinkStates, Memory};
use cslam_core::geometry::{Gmt, Rotation, Vector3, World};
use cslam_core::localization::ImuSample;
use cslam_core::localization::filter::states;
use cslam_core::lscn::{Classifier, models};
use cslam_core::ltd::EstimatorConfig;
use cslam_firmware::app::{AppConfig, Application, Best, Map, VOXELS};
use cslam_firmware::front_end::{FrontEnd, HEADER_LENGTH, SoftwareCrc};
use cslam_firmware::front_end_check::Block;

/// Flies on inputs of which the compiler knows nothing.
pub(crate) fn fly(block: &mut Block) -> Option<()> {
    let geometric = Classifier::new(
        models::geometric().ok()?,
        models::geometric_without_departure().ok()?,
    );
    let config = black_box(Config::best(LinkStates::Geometric(geometric.ok()?)));
    let estimator = singleton!(: Best = Best::new(&black_box(EstimatorConfig::default())))?;
    let squint = config.beam_squint().ok()?;
    let squint = singleton!(: cslam_core::localization::bsm::BeamSquint = squint)?;
    let map = singleton!(: Map = Map::new())?;
    let memory = Memory {
        estimator,
        squint,
        map,
    };
    let cslam: Cslam<'_, Best, VOXELS, { states(2) }> = Cslam::new(config, memory);
    let mut app = Application::new(
        black_box(AppConfig::default()),
        FrontEnd::new(SoftwareCrc, black_box(1)),
        cslam,
    );
    loop {
        let observer = &mut ();
        app.imu(
            &black_box(ImuSample {
                time_ns: 0,
                rate_rad_per_s: Vector3::zeros(),
                specific_force_m_per_s2: Vector3::zeros(),
            }),
            observer,
        );
        app.magnetometer(black_box(0), &black_box(Vector3::zeros()), observer);
        app.timing(black_box(0), black_box(0.0), observer);
        let attitude = Rotation::<Gmt, World>::from_quaternion(black_box([1.0, 0.0, 0.0, 0.0])).ok()?;
        let beacon = black_box(Beacon {
            sweep: 0,
            position_m: Vector3::zeros(),
            sigma_m: 0.02,
            attitude,
            sweeps_per_stop: 1,
        });
        app.beacon(black_box(0), &beacon, observer);
        black_box(app.frame(black_box(&[0; HEADER_LENGTH]), block, observer).is_ok());
        let _ended = app.end(observer);
        black_box((app.counters(), app.cslam().pose()));
    }
}
