//! Check of localization: a recorded flight in, one line of text with every bit of the state after every sweep. Equal
//! lines on two machines mean equal bits.
//!
//! A recording is a stream of [`Event`]s: inertial samples, two-way timing, magnetometer, sweeps as measured paths, and the
//! planes of the map.

mod event;
mod lines;

use core::fmt;

use cslam_core::geometry::Real;
use cslam_core::localization::filter::{MappedPlane, SweepMeasurement, SweepVerdict, TimingVerdict};
use cslam_core::localization::imu::{HeadingRefusal, ImuStep, MagneticField};
use cslam_core::localization::{Localizer, LocalizerConfig};
use embedded_io::{Read, ReadExactError};

pub use event::{Event, MAX_EVENT, PATHS, Reflected, Sweep};
use lines::{Digest, Line};

/// Planes of the map that a recording may hold.
pub const MAP_PLANES: usize = 64;

/// Why a check ended early.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum FlightCheckError<E> {
    /// The stream ended inside an event, or could not be read.
    Read(ReadExactError<E>),
    /// An event is not one.
    Event,
    /// There are more planes than [`MAP_PLANES`].
    Planes,
    /// A line could not be written.
    Write,
}

impl<E> From<ReadExactError<E>> for FlightCheckError<E> {
    fn from(error: ReadExactError<E>) -> Self {
        Self::Read(error)
    }
}

impl<E> From<fmt::Error> for FlightCheckError<E> {
    fn from(_: fmt::Error) -> Self {
        Self::Write
    }
}

/// What a run sees of the work, to count it.
pub trait Observer {
    /// Wraps the work on an inertial sample: whether it completed a step.
    fn sample(&mut self, work: impl FnOnce() -> Option<ImuStep>) -> Option<ImuStep> {
        work()
    }
    /// Wraps the way of the filter to a sweep, in so many covariance steps.
    fn advance(&mut self, _steps: u32, work: impl FnOnce()) {
        work();
    }
    /// Wraps the updates of a sweep.
    fn sweep(&mut self, work: impl FnOnce() -> SweepVerdict) -> SweepVerdict {
        work()
    }
    /// Wraps a two-way exchange.
    fn two_way(&mut self, work: impl FnOnce() -> TimingVerdict) -> TimingVerdict {
        work()
    }
    /// Wraps a sample of the magnetometer.
    fn magnetic(&mut self, work: impl FnOnce() -> Result<(), HeadingRefusal>) -> Result<(), HeadingRefusal> {
        work()
    }
}

/// Sees nothing.
impl Observer for () {}

/// Localization as it flies here: the default figures, and a magnetometer.
#[must_use]
pub fn config() -> LocalizerConfig {
    const DEG: f32 = core::f32::consts::PI / 180.0;
    LocalizerConfig {
        magnetic: Some(MagneticField::new(48.0, 65.0 * DEG, 3.0 * DEG)),
        ..LocalizerConfig::default()
    }
}

/// Flies a recording and writes a line after every sweep. Gives the number of sweeps.
///
/// # Errors
/// The stream is not a recording, or cannot be read or written.
pub fn run<R: Read, T: Real, const N: usize>(
    recording: &mut R,
    localizer: &mut Localizer<T, N>,
    observer: &mut impl Observer,
    out: &mut dyn fmt::Write,
) -> Result<u32, FlightCheckError<R::Error>> {
    let mut planes = heapless::Vec::<MappedPlane, MAP_PLANES>::new();
    let (mut sweeps, mut steps, mut inertial) = (0, 0, Digest::new());
    while let Some(event) = event::read(recording)? {
        match event {
            Event::Imu(sample) => {
                if let Some(step) = observer.sample(|| localizer.sample(&sample)) {
                    inertial.step(&step);
                    steps += 1;
                }
            }
            Event::TwoWay { time_ns, offset_m } => {
                observer.two_way(|| localizer.two_way(time_ns, offset_m));
            }
            Event::Magnetic { time_ns, field_ut } => {
                // A refusal is an answer like another; it shows in the counters of the filter.
                let _ = observer.magnetic(|| localizer.magnetic(time_ns, &field_ut));
            }
            Event::Plane(plane) => planes.push(plane).map_err(|_| FlightCheckError::Planes)?,
            Event::Begin { time_ns } => {
                observer.advance(steps, || localizer.announce_sweep(time_ns));
                steps = 0;
            }
            Event::Sweep(sweep) => {
                let reflections = sweep.reflected(&planes);
                let measurement = SweepMeasurement {
                    time_ns: sweep.time_ns,
                    gmt: sweep.gmt,
                    stop: sweep.stop,
                    line_of_sight: sweep.line_of_sight,
                    proven: false,
                    level_yaw: None,
                    contrary: None,
                    reflections: &reflections,
                    heard: &[],
                };
                let verdict = observer.sweep(|| localizer.sweep(&measurement));
                localizer.filter().update_map(&mut planes);
                let line = Line {
                    sweep: sweeps,
                    verdict,
                    inertial: inertial.value(),
                    localizer,
                    time_ns: sweep.time_ns,
                };
                writeln!(out, "{line}")?;
                sweeps += 1;
            }
        }
    }
    Ok(sweeps)
}
