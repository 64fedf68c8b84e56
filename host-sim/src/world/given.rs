//! Links that somebody else traced, one for each sweep, and the flight along them.

use std::path::{Path, PathBuf};

use nalgebra::{Quaternion, UnitQuaternion, Vector3};

use crate::flight::{FlightConfig, FlightPlan, GivenFlight, GivenPlace};
use crate::input::InputError;
use crate::paths::{self, Link};
use crate::sensors::Truth;

/// Lines may be so far off an even spacing, s: times are written with three digits after the point or more.
const UNEVEN_S: f64 = 2e-3;
/// Least and greatest time from line to line, s.
const SPACING_S: [f64; 2] = [0.1, 5.0];

/// Links between both ends in the sweeps of a flight.
#[derive(Clone, Debug)]
pub struct GivenLinks {
    file: PathBuf,
    links: Vec<Link>,
    /// Time from line to line, where the lines tell it, s.
    spacing_s: Option<f64>,
}

impl GivenLinks {
    /// Reads a path list of traced links, line by line those of consecutive sweeps.
    ///
    /// # Errors
    /// [`InputError`] naming file and line, and what was expected.
    pub fn read(file: &Path) -> Result<Self, InputError> {
        let links = paths::read(file)?;
        if links.len() < 2 {
            return Err(InputError::in_file(
                file,
                format!("{} links, expected two or more: one for each sweep", links.len()),
            ));
        }
        for (number, link) in links.iter().enumerate() {
            complete(link).map_err(|message| {
                InputError::in_file(file, format!("link {} (from 1): {message}", number + 1))
            })?;
        }
        let spacing_s = spacing_s(&links).map_err(|message| InputError::in_file(file, message))?;
        Ok(Self {
            file: file.to_owned(),
            links,
            spacing_s,
        })
    }

    /// The flight along them, and the medium that they are.
    ///
    /// # Errors
    /// [`InputError`] naming the place that cannot be flown to.
    pub(super) fn flown(self, config: &FlightConfig) -> Result<(FlightPlan, Between), InputError> {
        let period_s = self.spacing_s.unwrap_or(config.schedule.sweep_period_s);
        let mut heading_rad = 0.0;
        let places: Vec<GivenPlace> = self
            .links
            .iter()
            .map(|link| {
                heading_rad = link.uav_quaternion_wb.map_or(heading_rad, heading_of);
                place(link, heading_rad)
            })
            .collect();
        let flight = GivenFlight::through(&places, period_s, config.rest_s, config.drag_per_s)
            .map_err(|error| error.within(&self.file))?;
        let between = Between {
            links: self.links,
            waited_sweeps: flight.waited_sweeps,
            period_s,
        };
        Ok((flight.plan, between))
    }
}

/// The links of a flight, by time.
#[derive(Clone, Debug)]
pub(super) struct Between {
    links: Vec<Link>,
    waited_sweeps: usize,
    period_s: f64,
}

impl Between {
    /// The link of the sweep that is nearest in time: words are sent beside sweeps, and both ends stand still for the few milliseconds.
    pub(super) fn link(&self, truth: &Truth) -> Link {
        // The first sweep is a period after the beginning.
        let sweep = (truth.time_s / self.period_s + 0.5).max(1.0) as usize - 1;
        let place = sweep.saturating_sub(self.waited_sweeps).min(self.links.len() - 1);
        self.links[place].clone()
    }
}

/// What a link has to tell so that it can be heard.
fn complete(link: &Link) -> Result<(), String> {
    if link.measured {
        return Err("it was measured, expected a traced one: measured paths are flown with --paths".into());
    }
    for (number, path) in link.paths.iter().enumerate() {
        path.gain_and_departure()
            .map_err(|missing| format!("path {} (from 1): {missing}", number + 1))?;
    }
    Ok(())
}

/// The time from link to link; none where they tell no times.
fn spacing_s(links: &[Link]) -> Result<Option<f64>, String> {
    let times_s: Vec<f64> = links.iter().filter_map(|link| link.time_s).collect();
    if times_s.is_empty() {
        return Ok(None);
    }
    if times_s.len() < links.len() {
        return Err("some links have a `time_s`, expected all of them or none".into());
    }
    let steps_s: Vec<f64> = times_s.windows(2).map(|pair| pair[1] - pair[0]).collect();
    let mut sorted_s = steps_s.clone();
    sorted_s.sort_by(f64::total_cmp);
    let usual_s = sorted_s[sorted_s.len() / 2];
    if let Some(number) = steps_s
        .iter()
        .position(|step_s| (step_s - usual_s).abs() > UNEVEN_S)
    {
        return Err(format!(
            "link {} (from 1): `time_s` is {}, expected {:.3}: links must be evenly spaced, one for each sweep",
            number + 2,
            times_s[number + 1],
            times_s[number] + usual_s
        ));
    }
    // The mean: steps are rounded.
    let spacing_s = steps_s.iter().sum::<f64>() / steps_s.len() as f64;
    if !(SPACING_S[0]..=SPACING_S[1]).contains(&spacing_s) {
        return Err(format!(
            "links are {spacing_s} s apart, expected {} to {} s",
            SPACING_S[0], SPACING_S[1]
        ));
    }
    Ok(Some(spacing_s))
}

/// Heading of body x, from east, rad.
fn heading_of([w, x, y, z]: [f64; 4]) -> f64 {
    let forward = UnitQuaternion::from_quaternion(Quaternion::new(w, x, y, z)) * Vector3::x();
    libm::atan2(forward.y, forward.x)
}

fn place(link: &Link, heading_rad: f64) -> GivenPlace {
    let met = |order| link.paths.iter().any(|path| path.order == Some(order));
    GivenPlace {
        uav_m: link.rx.into(),
        heading_rad,
        gmt_m: link.tx.into(),
        visible: met(0),
        reflected: met(1),
    }
}
