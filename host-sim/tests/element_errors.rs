//! Arrays that are not as the receiver believes them: what their errors leave of a strong path is no path, and the claim on its place holds them.

use cslam_core::geometry::{Body, Direction, Frame};
use cslam_core::paths::{ElementErrors, EstimatedPath, EstimatorConfig, PathEstimator};
use cslam_host_sim::accuracy::{Mode, Range, Truth};
use cslam_host_sim::channel::{ChannelConfig, Impairments};
use cslam_host_sim::estimate;

fn direction<F: Frame>(azimuth_deg: f64, elevation_deg: f64) -> Direction<F, f64> {
    Direction::from_zenith_azimuth((90.0 - elevation_deg).to_radians(), azimuth_deg.to_radians())
        .expect("finite")
}

/// The errors of the elements that the world `real` has, and no others.
fn range(seed: u64) -> Range {
    let real = ChannelConfig::real();
    let config = ChannelConfig {
        impairments: Impairments {
            free_array_phase: true,
            uav_element_phase_rms_deg: real.impairments.uav_element_phase_rms_deg,
            uav_arrays: real.impairments.uav_arrays,
            ..Impairments::none()
        },
        ..ChannelConfig::default()
    };
    Range::over(config, seed)
}

/// One path at 30 dB from a direction that turns from sweep to sweep, over 60 sweeps: what is found of each.
fn flown(errors: ElementErrors, seed: u64) -> Vec<(Truth, Vec<EstimatedPath>)> {
    let range = range(seed);
    let config = EstimatorConfig {
        element_errors: errors,
        ..EstimatorConfig::single_sweeps()
    };
    let mut estimator: Box<dyn PathEstimator<32, 9>> = estimate::estimator(Mode::Best, &config);
    (0..60_u32)
        .map(|index| {
            let azimuth_deg = 6.1 * f64::from(index);
            let truth = Truth {
                c_tau_m: 40.0,
                aoa: direction::<Body>(azimuth_deg, -8.0),
                aod: direction(10.0, 0.0),
                snr_db: 30.0,
                phase_rad: 0.0,
            };
            let found = range.sweep(std::slice::from_ref(&truth), index, estimator.as_mut());
            (truth, found)
        })
        .collect()
}

fn further(flight: &[(Truth, Vec<EstimatedPath>)]) -> usize {
    flight
        .iter()
        .map(|(_, found)| found.len().saturating_sub(1))
        .sum()
}

#[test]
fn what_errors_of_the_arrays_leave_is_no_path() {
    let told = flown(ElementErrors::Known(0.035), 3);
    let learned = flown(ElementErrors::Learned(0.17), 3);
    let (told, learned) = (further(&told), further(&learned));
    println!(
        "further paths in 60 sweeps of one path: {told} with errors of 2 degrees, {learned} with learned ones"
    );
    assert!(told > 60, "the errors make no images: {told}");
    assert!(learned * 10 < told, "{learned} of {told}");
}

/// Arrival errors over their claimed standard deviation: as many beyond one and two of them as a Gaussian has, to a factor of
/// two in the standard deviation. With errors claimed to be those of noise they are fifty times too small.
#[test]
fn the_claim_on_the_arrival_holds_the_errors_of_the_elements() {
    let mut ratios = Vec::new();
    for seed in 1..=4 {
        for (truth, found) in flown(ElementErrors::Learned(0.17), seed).iter().skip(20) {
            let first = found.first().expect("the path is found");
            let off = first.path.aoa.vector().cast::<f64>() - truth.aoa.vector();
            let claimed = f64::from(first.path.covariance.m22 + first.path.covariance.m33);
            ratios.push(off.norm_squared() / claimed);
        }
    }
    let mean = ratios.iter().sum::<f64>() / ratios.len() as f64;
    println!(
        "squared arrival error over claimed variance, mean of {}: {mean:.2}",
        ratios.len()
    );
    assert!((0.25..4.0).contains(&mean), "{mean}");
}
