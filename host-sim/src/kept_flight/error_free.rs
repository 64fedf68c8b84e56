//! Measurements put right by the truth: what a flight would be if they had no errors, and so what limits it.
//!
//! A measured path takes over what the true path behind it has, as evaluation matches them; what it claims of its errors stays, and so do
//! paths that are missing. Times of sensors and their noise stay as well.

use cslam_core::beam_squint::Refusal;
use cslam_core::constants::SPEED_OF_LIGHT_M_PER_S;
use cslam_core::geometry::{Direction, Frame};
use cslam_core::path::RangeRate;
use cslam_core::paths::EstimatedPath;
use cslam_core::signal::Waveform;
use cslam_firmware::app::Estimated;
use nalgebra::{UnitVector3, Vector3};

use super::straight::is_straight;
use crate::evaluation::matching::{MatchGates, matches, unit};
use crate::flight_log::{MeasuredPath, PoseTruth};
use crate::paths::{Link, LinkPath};
use crate::recording::keep;
use crate::sensors::{BeaconConfig, ImuConfig, SensorsConfig, TimingConfig, Truth};

/// What is without errors.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum ErrorFree {
    /// Angles of arrival.
    Arrivals,
    /// Angles of departure, by the sweep's beams alone: bearings of beam squint are left out.
    Departures,
    /// Lengths.
    Lengths,
    /// Range rates, but for the common offset of the carriers.
    RangeRates,
    /// Paths that are none: images that the arrays make of others are left out.
    Artefacts,
    /// What came along the straight way where there is no line of sight: it was not bent, nor held up.
    Bends,
    /// Two-way timing, which is always there and never errs.
    Timing,
    /// The GMT's knowledge of its position, and of how its mast stands; its beacons are always heard.
    Beacon,
    /// The inertial sensor, but for its noise.
    Inertial,
}

impl ErrorFree {
    /// All of them.
    pub const ALL: [Self; 9] = [
        Self::Arrivals,
        Self::Departures,
        Self::Lengths,
        Self::RangeRates,
        Self::Artefacts,
        Self::Bends,
        Self::Timing,
        Self::Beacon,
        Self::Inertial,
    ];

    /// All that is told of a path.
    pub const OF_PATHS: [Self; 6] = [
        Self::Arrivals,
        Self::Departures,
        Self::Lengths,
        Self::RangeRates,
        Self::Artefacts,
        Self::Bends,
    ];

    /// Sensors of which these have no errors.
    pub(super) fn sensors(free: &[Self], sensors: &SensorsConfig) -> SensorsConfig {
        let mut ideal = sensors.clone();
        for what in free {
            match what {
                Self::Timing => ideal.timing = TimingConfig::ideal(),
                Self::Beacon => ideal.beacon = BeaconConfig::ideal(),
                Self::Inertial => {
                    ideal.imu = ImuConfig {
                        gyro_noise_mdps_per_sqrt_hz: sensors.imu.gyro_noise_mdps_per_sqrt_hz,
                        accel_noise_ug_per_sqrt_hz: sensors.imu.accel_noise_ug_per_sqrt_hz,
                        ..ImuConfig::ideal()
                    };
                }
                _ => {}
            }
        }
        ideal
    }

    /// The paths of a sweep of which these have no errors, by the truth at its time.
    pub(super) fn paths(free: &[Self], mut estimated: Estimated, truth: &Truth, link: &Link) -> Estimated {
        let is_free = |what: Self| free.contains(&what);
        if !Self::OF_PATHS.into_iter().any(is_free) {
            return estimated;
        }
        let measured: Vec<MeasuredPath> = estimated.paths.iter().map(MeasuredPath::from).collect();
        let period = Waveform::default().delay_period();
        let (pose, cycle_m) = (PoseTruth::from(truth), Some(period.length_m()));
        let matched = matches(&measured, link, &pose, &MatchGates::default(), cycle_m);
        let behind: Vec<_> = (matched.into_iter())
            .map(|index| index.and_then(|index| link.paths.get(index)))
            .collect();
        let straight: Vec<_> = estimated
            .paths
            .iter()
            .map(|path| is_straight(path, truth))
            .collect();
        let in_sight = link.paths.iter().any(LinkPath::is_line_of_sight);
        let offset_m_per_s = carriers_m_per_s(&estimated.paths, &behind, truth);
        let of_paths = estimated.paths.iter_mut().zip(&behind).zip(&straight);
        for ((path, behind), straight) in of_paths {
            if let Some(behind) = behind {
                let true_path = TruePath::of(behind, truth);
                if is_free(Self::Arrivals) {
                    true_path.put_arrival(path);
                }
                if is_free(Self::Departures) {
                    true_path.put_departure(path);
                }
                if is_free(Self::Lengths) {
                    true_path.put_length(path);
                }
                if let Some(rate) = &mut path.range_rate
                    && is_free(Self::RangeRates)
                {
                    rate.m_per_s =
                        within_period(true_path.rate_m_per_s + offset_m_per_s.unwrap_or(0.0), rate);
                }
            }
            if *straight && !in_sight && is_free(Self::Bends) {
                let way = TruePath::straight(truth);
                way.put_arrival(path);
                way.put_departure(path);
                way.put_length(path);
            }
        }
        if is_free(Self::Departures)
            && let Some((_, bearing)) = &mut estimated.sighted
        {
            *bearing = Err(Refusal::NotBegun);
        }
        if is_free(Self::Artefacts) {
            let keeps: Vec<_> = (behind.iter().zip(&straight))
                .map(|(behind, straight)| behind.is_some() || *straight)
                .collect();
            keep(&mut estimated, &keeps);
        }
        estimated
    }
}

/// A path as the antennas see it that have no errors.
struct TruePath {
    /// Clock offset included, m.
    c_tau_m: f64,
    /// Body axes.
    arrival: Vector3<f64>,
    /// Axes of the GMT's arrays.
    departure: Option<Vector3<f64>>,
    rate_m_per_s: f64,
}

impl TruePath {
    fn of(path: &LinkPath, truth: &Truth) -> Self {
        let arrival = unit(path.aoa_zenith_rad, path.aoa_azimuth_rad);
        let departure = path.aod_zenith_rad.zip(path.aod_azimuth_rad);
        let length_m = path.delay_s * SPEED_OF_LIGHT_M_PER_S;
        let departure = departure.map(|(zenith_rad, azimuth_rad)| unit(zenith_rad, azimuth_rad));
        let rate_m_per_s =
            -truth.uav.velocity_m_per_s.dot(&arrival) - path.closing_m_per_s.unwrap_or_default();
        Self::seen(truth, length_m, arrival, departure, rate_m_per_s)
    }

    /// The straight way between GMT and UAV.
    fn straight(truth: &Truth) -> Self {
        let way_m = truth.gmt_position_m - truth.uav.position_m;
        let towards = UnitVector3::new_normalize(way_m).into_inner();
        let rate_m_per_s = -truth.uav.velocity_m_per_s.dot(&towards);
        Self::seen(truth, way_m.norm(), towards, Some(-towards), rate_m_per_s)
    }

    /// Of a length, and of directions in world axes.
    fn seen(
        truth: &Truth,
        length_m: f64,
        arrival: Vector3<f64>,
        departure: Option<Vector3<f64>>,
        rate_m_per_s: f64,
    ) -> Self {
        Self {
            c_tau_m: length_m + truth.clock_offset_s * SPEED_OF_LIGHT_M_PER_S,
            arrival: truth.uav.attitude.inverse() * arrival,
            departure: departure.map(|left| truth.gmt_attitude.inverse() * left),
            rate_m_per_s,
        }
    }

    fn put_arrival(&self, path: &mut EstimatedPath) {
        put(&mut path.path.aoa, &self.arrival);
    }

    /// A path that had no departure gets none.
    fn put_departure(&self, path: &mut EstimatedPath) {
        if let (Some(departure), Some(left)) = (&mut path.path.aod, &self.departure) {
            put(&mut departure.direction, left);
        }
    }

    /// In the delay period in which the path was measured.
    fn put_length(&self, path: &mut EstimatedPath) {
        let measured_m = f64::from(path.path.c_tau_m);
        let off_m = Waveform::default()
            .delay_period()
            .wrap_m(measured_m - self.c_tau_m);
        path.path.c_tau_m = (measured_m - off_m) as f32;
    }
}

fn put<F: Frame>(direction: &mut Direction<F>, right: &Vector3<f64>) {
    if let Ok(right) = Direction::from_vector(right.map(|value| value as f32)) {
        *direction = right;
    }
}

/// What the carriers' offset adds to the rates: what the strongest path that is one tells, m/s.
fn carriers_m_per_s(paths: &[EstimatedPath], behind: &[Option<&LinkPath>], truth: &Truth) -> Option<f64> {
    paths.iter().zip(behind).find_map(|(path, behind)| {
        let rate = path.range_rate?;
        Some(f64::from(rate.m_per_s) - TruePath::of((*behind)?, truth).rate_m_per_s)
    })
}

/// A rate as the looks tell it: within half a period of nothing, m/s.
fn within_period(m_per_s: f64, rate: &RangeRate) -> f32 {
    let period = f64::from(rate.period_m_per_s);
    (m_per_s - period * (m_per_s / period).round()) as f32
}

#[cfg(test)]
mod tests;
