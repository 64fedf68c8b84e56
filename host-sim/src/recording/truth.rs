//! The truth beside a recording: written for evaluation, never given to a receiver.

use std::path::Path;

use nalgebra::{Quaternion, UnitQuaternion, Vector3};

use crate::flight_log::PoseTruth;
use crate::input::limits::FLIGHT_EVENTS;
use crate::input::{InputError, lines, read_text};
use crate::paths::{self, Link};
use crate::sensors::SensedFlight;

/// Poses and clocks.
pub(super) const TRUTH: &str = "truth.csv";
/// Paths of every sweep.
pub(super) const TRUTH_PATHS: &str = "truth_paths.jsonl";
/// Columns of `truth.csv`. Quaternion Hamilton, body to world; clock: UAV less GMT.
const TRUTH_HEADER: &str = "time_s,sweep,x_m,y_m,z_m,vx_m_per_s,vy_m_per_s,vz_m_per_s,qw,qx,qy,qz,\
                            rate_x_rad_per_s,rate_y_rad_per_s,rate_z_rad_per_s,gmt_x_m,gmt_y_m,gmt_z_m,\
                            clock_offset_s,clock_drift";
/// Places of columns among the numbers of a line, without `sweep`.
const POSITION: usize = 1;
const VELOCITY: usize = 4;
const QUATERNION: usize = 7;
const CLOCK_OFFSET: usize = 17;
/// Truth lines a second, besides those at sweeps.
const TRUTH_RATE_HZ: u32 = 100;

/// Checks the truth beside a recording, as far as it is there: that every line of it is what it should be.
///
/// # Errors
/// [`InputError`] naming file, line and column, and what was expected.
pub fn check_truth(directory: &Path) -> Result<(), InputError> {
    TruthTrack::read(directory)?;
    let file = directory.join(TRUTH_PATHS);
    if file.exists() {
        paths::read(&file)?;
    }
    Ok(())
}

/// Writes the true paths of sweeps 0, 1, 2 ... beside a recording.
///
/// # Errors
/// [`InputError`] naming the file that cannot be written.
pub fn write_links(directory: &Path, links: &[Link]) -> Result<(), InputError> {
    let file = directory.join(TRUTH_PATHS);
    let mut text = String::new();
    for link in links {
        text += &serde_json::to_string(link).map_err(|e| InputError::in_file(&file, e.to_string()))?;
        text.push('\n');
    }
    std::fs::write(&file, text).map_err(|e| InputError::unwritable(&file, "cannot be written", &e))
}

/// `truth.csv` in memory.
#[derive(Clone, Debug)]
pub(super) struct TruthTrack {
    /// GMT time, s, and the world then; in order of time, at least one.
    lines: Vec<(f64, PoseTruth)>,
}

impl TruthTrack {
    /// Reads the truth in `directory`; `None` when there is none.
    ///
    /// # Errors
    /// [`InputError`] naming file, line and column, and what was expected.
    pub(super) fn read(directory: &Path) -> Result<Option<Self>, InputError> {
        let file = directory.join(TRUTH);
        if !file.exists() {
            return Ok(None);
        }
        let text = read_text(&file, &FLIGHT_EVENTS)?;
        let mut numbered = lines(&file, &text, &FLIGHT_EVENTS);
        if numbered.next().transpose()?.map(|(_, line)| line) != Some(TRUTH_HEADER) {
            let message = format!("expected the columns {TRUTH_HEADER}");
            return Err(InputError::at_line(&file, 1, message));
        }
        let mut known: Vec<(f64, PoseTruth)> = Vec::new();
        for line in numbered {
            let (number, line) = line?;
            let (time_s, pose) =
                read_line(line).map_err(|message| InputError::at_line(&file, number, message))?;
            if known.last().is_some_and(|(before_s, _)| time_s < *before_s) {
                let message = format!("time_s is {time_s}, earlier than the line before it");
                return Err(InputError::at_line(&file, number, message));
            }
            known.push((time_s, pose));
        }
        Ok((!known.is_empty()).then_some(Self { lines: known }))
    }

    /// The world when the UAV's clock shows `uav_time_s`, between two lines from both; before the first and after the last line, theirs.
    pub(super) fn at(&self, uav_time_s: f64) -> PoseTruth {
        // The clock is off by microseconds, so one correction does.
        let time_s = uav_time_s - self.at_gmt_time(uav_time_s).clock_offset_s;
        self.at_gmt_time(time_s)
    }

    fn at_gmt_time(&self, time_s: f64) -> PoseTruth {
        let after = self.lines.partition_point(|(line_s, _)| *line_s <= time_s);
        let (Some(before), Some((end_s, end))) = (after.checked_sub(1), self.lines.get(after)) else {
            return self.lines[after.min(self.lines.len() - 1)].1;
        };
        let (start_s, start) = &self.lines[before];
        let span_s = end_s - start_s;
        let share = (time_s - start_s) / span_s;
        let between = |a: f64, b: f64| a + share * (b - a);
        let vector = Vector3::from;
        // Cubic, so that it goes through both places with both velocities.
        let (s2, s3) = (share * share, share * share * share);
        let position = vector(start.position_m) * (2.0 * s3 - 3.0 * s2 + 1.0)
            + vector(start.velocity_m_per_s) * (span_s * (s3 - 2.0 * s2 + share))
            + vector(end.position_m) * (3.0 * s2 - 2.0 * s3)
            + vector(end.velocity_m_per_s) * (span_s * (s3 - s2));
        let quaternion = |[w, x, y, z]: [f64; 4]| Quaternion::new(w, x, y, z);
        let (from, to) = (quaternion(start.quaternion_wb), quaternion(end.quaternion_wb));
        let to = if from.dot(&to) < 0.0 { -to } else { to };
        let attitude = UnitQuaternion::from_quaternion(from * (1.0 - share) + to * share);
        PoseTruth {
            position_m: position.into(),
            quaternion_wb: [attitude.w, attitude.i, attitude.j, attitude.k],
            velocity_m_per_s: std::array::from_fn(|k| {
                between(start.velocity_m_per_s[k], end.velocity_m_per_s[k])
            }),
            clock_offset_s: between(start.clock_offset_s, end.clock_offset_s),
        }
    }
}

/// Time and world of a line that has a number in every column but `sweep`, which may be empty.
fn read_line(line: &str) -> Result<(f64, PoseTruth), String> {
    let columns = TRUTH_HEADER.split(',').count();
    let found = line.split(',').count();
    if found != columns {
        return Err(format!("has {found} columns, expected {columns}"));
    }
    let mut numbers = Vec::with_capacity(columns);
    for (column, text) in TRUTH_HEADER.split(',').zip(line.split(',')) {
        if column == "sweep" {
            if !text.is_empty() && text.parse::<u32>().is_err() {
                return Err(format!(
                    "{column}: expected the number of a sweep, found \"{text}\""
                ));
            }
        } else {
            let value = text.parse().ok().filter(|value: &f64| value.is_finite());
            numbers.push(value.ok_or_else(|| format!("{column}: expected a number, found \"{text}\""))?);
        }
    }
    let three = |from: usize| std::array::from_fn(|k| numbers[from + k]);
    let pose = PoseTruth {
        position_m: three(POSITION),
        velocity_m_per_s: three(VELOCITY),
        quaternion_wb: std::array::from_fn(|k| numbers[QUATERNION + k]),
        clock_offset_s: numbers[CLOCK_OFFSET],
    };
    Ok((numbers[0], pose))
}

/// The text of `truth.csv` up to `end_s`: a line every 10 ms and one at each of the first `sweeps` sweeps, in order of time. `sweep`
/// is empty between.
pub(super) fn truth(flight: &SensedFlight, sweeps: u32, end_s: f64) -> String {
    let schedule = flight.plan().schedule();
    let ticks = (end_s * f64::from(TRUTH_RATE_HZ)) as u32;
    let mut instants: Vec<(f64, Option<u32>)> = (0..=ticks)
        .map(|tick| (f64::from(tick) / f64::from(TRUTH_RATE_HZ), None))
        .chain((0..sweeps).map(|sweep| (schedule.sweep_time_s(sweep), Some(sweep))))
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
