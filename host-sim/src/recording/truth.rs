//! The truth beside a recording: written for evaluation, never given to a receiver.

use std::path::Path;

use crate::input::limits::FLIGHT_EVENTS;
use crate::input::{InputError, lines, read_text};
use crate::paths;
use crate::sensors::SensedFlight;

/// Poses and clocks.
pub(super) const TRUTH: &str = "truth.csv";
/// Paths of every sweep.
pub const TRUTH_PATHS: &str = "truth_paths.jsonl";
/// Columns of `truth.csv`. Quaternion Hamilton, body to world; clock: UAV less GMT.
const TRUTH_HEADER: &str = "time_s,sweep,x_m,y_m,z_m,vx_m_per_s,vy_m_per_s,vz_m_per_s,qw,qx,qy,qz,\
                            rate_x_rad_per_s,rate_y_rad_per_s,rate_z_rad_per_s,gmt_x_m,gmt_y_m,gmt_z_m,\
                            clock_offset_s,clock_drift";
/// Truth lines a second, besides those at sweeps.
const TRUTH_RATE_HZ: u32 = 100;

/// Checks the truth beside a recording, as far as it is there: that every line of it is what it should be.
///
/// # Errors
/// [`InputError`] naming file, line and column, and what was expected.
pub fn check_truth(directory: &Path) -> Result<(), InputError> {
    let file = directory.join(TRUTH);
    if file.exists() {
        check_text(&file, &read_text(&file, &FLIGHT_EVENTS)?)?;
    }
    let file = directory.join(TRUTH_PATHS);
    if file.exists() {
        paths::read(&file)?;
    }
    Ok(())
}

fn check_text(file: &Path, text: &str) -> Result<(), InputError> {
    let mut lines = lines(file, text, &FLIGHT_EVENTS);
    if lines.next().transpose()?.map(|(_, line)| line) != Some(TRUTH_HEADER) {
        return Err(InputError::at_line(
            file,
            1,
            format!("expected the columns {TRUTH_HEADER}"),
        ));
    }
    let mut before_s = f64::NEG_INFINITY;
    for line in lines {
        let (number, line) = line?;
        let time_s = check_line(line).map_err(|message| InputError::at_line(file, number, message))?;
        if time_s < before_s {
            let message = format!("time_s is {time_s}, earlier than the line before it");
            return Err(InputError::at_line(file, number, message));
        }
        before_s = time_s;
    }
    Ok(())
}

/// The time of a line that has a number in every column but `sweep`, which may be empty.
fn check_line(line: &str) -> Result<f64, String> {
    let columns = TRUTH_HEADER.split(',').count();
    let found = line.split(',').count();
    if found != columns {
        return Err(format!("has {found} columns, expected {columns}"));
    }
    let mut time_s = None;
    for (column, text) in TRUTH_HEADER.split(',').zip(line.split(',')) {
        if column == "sweep" {
            if !text.is_empty() && text.parse::<u32>().is_err() {
                return Err(format!(
                    "{column}: expected the number of a sweep, found \"{text}\""
                ));
            }
        } else {
            let value = text.parse().ok().filter(|value: &f64| value.is_finite());
            let value = value.ok_or_else(|| format!("{column}: expected a number, found \"{text}\""))?;
            time_s = time_s.or(Some(value));
        }
    }
    time_s.ok_or_else(|| "expected a time".into())
}

/// The text of `truth.csv`: a line every 10 ms and one at each sweep, in order of time. `sweep` is empty between.
pub(super) fn truth(flight: &SensedFlight) -> String {
    let schedule = flight.plan().schedule();
    let ticks = (flight.plan().duration_s() * f64::from(TRUTH_RATE_HZ)) as u32;
    let mut instants: Vec<(f64, Option<u32>)> = (0..=ticks)
        .map(|tick| (f64::from(tick) / f64::from(TRUTH_RATE_HZ), None))
        .chain((0..flight.plan().sweeps()).map(|sweep| (schedule.sweep_time_s(sweep), Some(sweep))))
        .collect();
    instants.sort_by(|a, b| a.0.total_cmp(&b.0).then(a.1.cmp(&b.1)));
    let mut text = format!("{TRUTH_HEADER}\n");
    for (time_s, sweep) in instants {
        let truth = flight.truth(time_s);
        let uav = &truth.uav;
        text += &format!("{time_s},{}", sweep.map_or(String::new(), |s| s.to_string()));
        let numbers = uav
            .position_m
            .iter()
            .chain(&uav.velocity_m_per_s)
            .copied()
            .chain(uav.quaternion_wb())
            .chain(uav.rate_rad_per_s.iter().copied())
            .chain(truth.gmt_position_m.iter().copied())
            .chain([truth.clock_offset_s, truth.clock_drift]);
        for number in numbers {
            text += &format!(",{number:e}");
        }
        text.push('\n');
    }
    text
}
