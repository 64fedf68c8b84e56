//! Points of the map, many to a packet.
//!
//! Points that were measured within seconds lie near each other, so a batch says once where its corner is and then only how
//! far each point is from it, in as many bits as the farthest needs. The same holds for the GMT's stop, the standard
//! deviation and the probability. The points are in the order of their sweeps, which are differences from point to point. The
//! surfaces of a batch are few: it lists them once, and a point has its place in the list.

use super::bits::{BitReader, BitWriter, unzigzag, width, zigzag};
use super::catalogue::Catalogue;
use super::scale::{from_log_code, log_code};

/// Most points of a batch.
pub const MAX_POINTS: usize = 24;

/// A reflection point.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct PointReport {
    /// Number of the sweep that it was measured in.
    pub sweep: u32,
    /// Number of the place that the GMT had, counted from 0.
    pub stop: u16,
    /// Position in the world, m, up to 83.8 km from the origin; sent in steps of 1 cm.
    pub position_m: [f32; 3],
    /// Root of the trace of the position's covariance, m; sent in 16 steps of half an octave from 1 cm to 1.81 m.
    pub sigma_m: f32,
    /// Probability that the path was what the point presumes, a reflection of first order or of higher; sent in 16 steps from 0 to 1.
    pub probability: f32,
    /// Number of the surface that it lies on; `None` from a receiver that has no surfaces.
    pub surface: Option<u16>,
}

impl PointReport {
    /// Greatest error of a coordinate by the step of 1 cm, m; the nearest `f32` of a far one adds to it.
    pub const POSITION_ERROR_M: f32 = 0.005;
    /// Greatest ratio between a standard deviation within its scale and what is decoded, either way: a quarter octave.
    pub const SIGMA_RATIO: f32 = 1.190;
    /// Greatest error of a probability.
    pub const PROBABILITY_ERROR: f32 = 1.0 / 30.0;
}

/// Standard deviation of code 0, m, and codes an octave.
const SIGMA: (f32, f32) = (0.01, 2.0);
/// Highest code of a standard deviation or a probability: four bits.
const LAST_CODE: u8 = 15;
/// Farthest coordinate, cm: 24 bits with sign.
const FARTHEST_CM: i32 = (1 << 23) - 1;
/// Longest gap between neighbouring sweeps of one batch.
const LONGEST_GAP: u32 = 255;

/// A point as it is sent.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
struct Point {
    sweep: u32,
    stop: u16,
    cm: [i32; 3],
    sigma: u8,
    probability: u8,
    surface: Option<u16>,
}

impl Point {
    fn new(report: &PointReport) -> Option<Self> {
        let [x, y, z] = report.position_m;
        if report.sigma_m.is_nan() || !(0.0..=1.0).contains(&report.probability) {
            return None;
        }
        Some(Self {
            sweep: report.sweep,
            stop: report.stop,
            cm: [centimetres(x)?, centimetres(y)?, centimetres(z)?],
            sigma: log_code(report.sigma_m, SIGMA.0, SIGMA.1, LAST_CODE),
            probability: (report.probability * f32::from(LAST_CODE) + 0.5) as u8,
            surface: report.surface,
        })
    }

    fn report(&self) -> PointReport {
        PointReport {
            sweep: self.sweep,
            stop: self.stop,
            position_m: self.cm.map(|cm| (f64::from(cm) / 100.0) as f32),
            sigma_m: from_log_code(self.sigma, SIGMA.0, SIGMA.1),
            probability: f32::from(self.probability) / f32::from(LAST_CODE),
            surface: self.surface,
        }
    }

    /// What differs little within a batch: each number is sent as its distance from the least one.
    fn columns(&self) -> [i64; COLUMNS] {
        let [x, y, z] = self.cm.map(i64::from);
        let [sigma, probability] = [self.sigma, self.probability].map(i64::from);
        [x, y, z, i64::from(self.stop), sigma, probability]
    }

    fn from_columns(
        sweep: u32,
        surface: Option<u16>,
        [x, y, z, stop, sigma, probability]: [i64; COLUMNS],
    ) -> Option<Self> {
        let coordinate = |cm: i64| i32::try_from(cm).ok().filter(|cm| cm.abs() <= FARTHEST_CM);
        let code = |code: i64| u8::try_from(code).ok().filter(|code| *code <= LAST_CODE);
        Some(Self {
            sweep,
            stop: u16::try_from(stop).ok()?,
            cm: [coordinate(x)?, coordinate(y)?, coordinate(z)?],
            sigma: code(sigma)?,
            probability: code(probability)?,
            surface,
        })
    }
}

const COLUMNS: usize = 6;

/// Whole centimetres, rounded half up.
fn centimetres(metres: f32) -> Option<i32> {
    let cm = libm::floor(f64::from(metres) * 100.0 + 0.5);
    (cm.abs() <= f64::from(FARTHEST_CM)).then_some(cm as i32)
}

/// Why a point is not taken.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub enum BatchError {
    /// The batch is full.
    Full,
    /// The point's sweep is more than 255 before those of the batch, or after them.
    Order,
    /// The point is too far away, or not a point.
    OutOfRange,
}

impl core::fmt::Display for BatchError {
    fn fmt(&self, f: &mut core::fmt::Formatter<'_>) -> core::fmt::Result {
        f.write_str(match self {
            Self::Full => "the batch is full",
            Self::Order => "the point's sweep is more than 255 away from those of the batch",
            Self::OutOfRange => "the point lies out of range, or is none",
        })
    }
}

impl core::error::Error for BatchError {}

/// Points that go down in one packet, in the order of their sweeps, and those of a sweep in the order in which they came. They
/// are rounded when they come in, so what the ground decodes is equal to what was sent.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct PointBatch {
    points: heapless::Vec<Point, MAX_POINTS>,
}

impl PointBatch {
    /// A batch without points, which cannot be sent.
    #[must_use]
    pub const fn new() -> Self {
        Self {
            points: heapless::Vec::new(),
        }
    }

    /// Adds a point, of whatever sweep within reach: a point may have waited for its surface.
    ///
    /// # Errors
    /// [`BatchError`]; the batch is as it was.
    pub fn push(&mut self, report: &PointReport) -> Result<(), BatchError> {
        let point = Point::new(report).ok_or(BatchError::OutOfRange)?;
        if self.is_full() {
            return Err(BatchError::Full);
        }
        if let (Some(first), Some(last)) = (self.points.first(), self.points.last()) {
            let before = first.sweep.saturating_sub(point.sweep);
            let after = point.sweep.saturating_sub(last.sweep);
            if before.max(after) > LONGEST_GAP {
                return Err(BatchError::Order);
            }
        }
        // It takes the place of the first one of a later sweep, and each from there on that of the next.
        let (mut carried, mut found) = (point, false);
        for place in &mut self.points {
            found |= point.sweep < place.sweep;
            if found {
                core::mem::swap(place, &mut carried);
            }
        }
        self.points.push(carried).map_err(|_| BatchError::Full)
    }

    /// The points, as the ground sees them.
    pub fn points(&self) -> impl ExactSizeIterator<Item = PointReport> + '_ {
        self.points.iter().map(Point::report)
    }

    /// Number of points.
    #[must_use]
    pub fn len(&self) -> usize {
        self.points.len()
    }

    /// Whether there is no point.
    #[must_use]
    pub fn is_empty(&self) -> bool {
        self.points.is_empty()
    }

    /// Whether no point has room any more.
    #[must_use]
    pub fn is_full(&self) -> bool {
        self.points.len() == MAX_POINTS
    }

    pub(super) fn write(&self, to: &mut BitWriter<'_>) {
        let Some(first) = self.points.first() else {
            return to.spoil();
        };
        let (mut least, mut most) = (first.columns(), first.columns());
        let (mut gaps, mut last) = (0, first.sweep);
        let mut surfaces = Catalogue::default();
        for point in &self.points {
            surfaces.add(point.surface);
            for ((value, least), most) in point.columns().iter().zip(&mut least).zip(&mut most) {
                *least = (*least).min(*value);
                *most = (*most).max(*value);
            }
            // Sweeps do not decrease: see `push`.
            gaps |= point.sweep.saturating_sub(last);
            last = point.sweep;
        }
        to.put(self.points.len() as u64 - 1, 5);
        to.put_sized(u64::from(first.sweep));
        let gap_bits = width(u64::from(gaps));
        to.put(u64::from(gap_bits), 4);
        let mut bits = [0; COLUMNS];
        for ((bits, least), most) in bits.iter_mut().zip(least).zip(most) {
            *bits = width((most - least) as u64);
            to.put_sized(zigzag(least));
            to.put(u64::from(*bits), 5);
        }
        surfaces.write(to);
        last = first.sweep;
        for point in &self.points {
            to.put(u64::from(point.sweep.saturating_sub(last)), gap_bits);
            last = point.sweep;
            for ((value, least), bits) in point.columns().iter().zip(least).zip(bits) {
                to.put((value - least) as u64, bits);
            }
            surfaces.write_place(point.surface, to);
        }
    }

    pub(super) fn read(from: &mut BitReader<'_>) -> Option<Self> {
        let count = from.take(5)? as usize + 1;
        let mut sweep = u32::try_from(from.take_sized()?).ok()?;
        let gap_bits = from.take(4)? as u32;
        let mut columns = [(0, 0); COLUMNS];
        for (least, bits) in &mut columns {
            *least = unzigzag(from.take_sized()?);
            *bits = from.take(5)? as u32;
        }
        let surfaces = Catalogue::read(from)?;
        let mut points = heapless::Vec::new();
        for index in 0..count {
            let gap = from.take_u32(gap_bits)?;
            if gap > LONGEST_GAP || (index == 0 && gap != 0) {
                return None;
            }
            sweep = sweep.checked_add(gap)?;
            let mut values = [0; COLUMNS];
            for (value, (least, bits)) in values.iter_mut().zip(columns) {
                *value = least.checked_add_unsigned(from.take(bits)?)?;
            }
            let surface = surfaces.read_place(from)?;
            points.push(Point::from_columns(sweep, surface, values)?).ok()?;
        }
        Some(Self { points })
    }
}
