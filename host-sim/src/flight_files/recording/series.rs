//! What has no place but a course over time, as JSON objects with their schemas.

use nalgebra::Vector3;
use serde::Serialize;

use crate::evaluation::attitude_error_rad;
use crate::flight_log::{Innovation, PoseEstimate, PoseTruth, SweepRecord};

/// Schema of [`Errors`].
pub(super) const ERRORS: &str = r#"{"title":"cslam.Errors","description":"Estimate less truth","type":"object","properties":{
"position_m":{"type":"number"},"position_sigma_m":{"type":"number"},
"attitude_deg":{"type":"number"},"attitude_sigma_deg":{"type":"number"},
"velocity_m_per_s":{"type":"number"},"clock_ns":{"type":["number","null"]},"clock_sigma_ns":{"type":["number","null"]}}}"#;

/// Lengths of the errors of a pose, and the receiver's own idea of them.
#[derive(Serialize)]
pub(super) struct Errors {
    position_m: f64,
    position_sigma_m: f64,
    attitude_deg: f64,
    attitude_sigma_deg: f64,
    velocity_m_per_s: f64,
    clock_ns: Option<f64>,
    clock_sigma_ns: Option<f64>,
}

pub(super) fn errors(estimate: &PoseEstimate, truth: &PoseTruth) -> Errors {
    let apart = |a: [f64; 3], b: [f64; 3]| (Vector3::from(a) - Vector3::from(b)).norm();
    let root_trace = |c: &[[f64; 3]; 3]| libm::sqrt((c[0][0] + c[1][1] + c[2][2]).max(0.0));
    Errors {
        position_m: apart(estimate.position_m, truth.position_m),
        position_sigma_m: root_trace(&estimate.position_covariance_m2),
        attitude_deg: attitude_error_rad(estimate, truth).norm().to_degrees(),
        attitude_sigma_deg: root_trace(&estimate.attitude_covariance_rad2).to_degrees(),
        velocity_m_per_s: apart(estimate.velocity_m_per_s, truth.velocity_m_per_s),
        clock_ns: estimate
            .clock_offset_s
            .map(|offset| (offset - truth.clock_offset_s) * 1e9),
        clock_sigma_ns: estimate.clock_sigma_s.map(|sigma| sigma * 1e9),
    }
}

/// Schema of [`LinkState`].
pub(super) const LINK_STATE: &str = r#"{"title":"cslam.LinkState","description":"0 outage, 1 LOS, 2 first-order, 3 higher-order","type":"object","properties":{
"state":{"type":["integer","null"]},"true_state":{"type":["integer","null"]},
"p_los":{"type":["number","null"]},"p_first_order":{"type":["number","null"]},"p_higher_order":{"type":["number","null"]},
"los_used":{"type":"boolean"},"los_visible":{"type":"boolean"},
"paths":{"type":"integer"},"true_paths":{"type":["integer","null"]},"accepted":{"type":"integer"}}}"#;

/// The link of a sweep.
#[derive(Serialize)]
pub(super) struct LinkState {
    state: Option<u8>,
    true_state: Option<u8>,
    p_los: Option<f64>,
    p_first_order: Option<f64>,
    p_higher_order: Option<f64>,
    los_used: bool,
    los_visible: bool,
    paths: usize,
    true_paths: Option<usize>,
    accepted: usize,
}

pub(super) fn link_state(sweep: &SweepRecord, accepted: usize) -> LinkState {
    let probability = |k: usize| sweep.estimate.link.and_then(|link| Some(link.probabilities?[k]));
    LinkState {
        state: sweep.estimate.link.map(|link| link.state),
        true_state: sweep.truth.link_state(),
        p_los: probability(0),
        p_first_order: probability(1),
        p_higher_order: probability(2),
        los_used: sweep.estimate.los_used,
        los_visible: sweep.truth.los_visible(),
        paths: sweep.estimate.paths.len(),
        true_paths: sweep.truth.link.as_ref().map(|link| link.paths.len()),
        accepted,
    }
}

/// Schema of [`Innovated`].
pub(super) const INNOVATION: &str = r#"{"title":"cslam.Innovation","description":"Test ratio above 1: beyond the gate","type":"object","properties":{
"nis":{"type":"number"},"dof":{"type":"integer"},"test_ratio":{"type":"number"},"accepted":{"type":"boolean"}}}"#;

/// A measurement offered to the filter.
#[derive(Serialize)]
pub(super) struct Innovated {
    nis: f64,
    dof: u32,
    test_ratio: f64,
    accepted: bool,
}

pub(super) fn innovation(innovation: &Innovation) -> Innovated {
    Innovated {
        nis: innovation.nis,
        dof: innovation.dof,
        test_ratio: innovation.test_ratio,
        accepted: innovation.accepted,
    }
}
