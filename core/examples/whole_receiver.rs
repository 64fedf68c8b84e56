//! The whole receiver of a radio in static memory, fed event by event. For another radio: another module of `profile`, or one like it.

use std::{error::Error, sync::Mutex};

use cslam_core::geometry::{Rotation, Vector3};
use cslam_core::inertial::ImuSample;
use cslam_core::link_state::models;
use cslam_core::map::PointCloud;
use cslam_core::profile::quad_4x16_gmt_48 as own;
use cslam_core::receiver::{Beacon, Config, LinkStates, Radio};

static SAMPLES: Mutex<own::Samples> = Mutex::new([[cslam_core::signal::Iq::ZERO; 512]; own::CHANNELS]);
static ESTIMATOR: Mutex<Option<own::FlightEstimator>> = Mutex::new(None);
static SQUINT: Mutex<Option<<own::Radio as Radio>::Squint>> = Mutex::new(None);
static MAP: Mutex<Option<PointCloud<4096>>> = Mutex::new(None);

fn main() -> Result<(), Box<dyn Error>> {
    let radio = own::radio();
    let config = Config::of(radio, LinkStates::Trees(models::trees()?));
    let (mut estimator, mut squint, mut map) = (ESTIMATOR.lock()?, SQUINT.lock()?, MAP.lock()?);
    let memory = own::ReceiverMemory {
        estimator: estimator.insert(own::FlightEstimator::checked(&own::Config::of(&radio))?),
        squint: squint.insert(config.beam_squint::<own::Radio>()?),
        map: map.insert(PointCloud::new()),
    };
    let mut receiver = own::Receiver::new(config, memory);
    let samples = &mut *SAMPLES.lock()?;
    for sweep in 0..4_u32 {
        let time_ns = 500_000_000 * u64::from(sweep + 1);
        // One of a thousand a second.
        receiver.imu(&ImuSample {
            time_ns,
            rate_rad_per_s: Vector3::zeros(),
            specific_force_m_per_s2: Vector3::z() * 9.81,
        });
        receiver.timing(time_ns, 0.0);
        receiver.sweep(time_ns, sweep);
        for beam in 0..own::BEAMS as u16 {
            // A front end would fill `samples` here, and say with which exponent: that of this beam.
            let exponent = -38;
            receiver.beam(own::Block {
                samples,
                beam,
                exponent,
            });
        }
        let beacon = Beacon {
            sweep,
            position_m: Vector3::new(0.0, 0.0, 1.5),
            sigma_m: 0.02,
            attitude: Rotation::identity(),
            sweeps_per_stop: 16,
        };
        receiver.beacon(time_ns, &beacon);
        let report = receiver.end_sweep().ok_or("a sweep is in hand")?;
        println!("sweep {sweep}: {} paths in silence", report.paths.len());
    }
    Ok(())
}
