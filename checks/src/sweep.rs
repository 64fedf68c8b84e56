//! The whole path estimator: recorded sweeps in, one line of text for everything it makes of them. Equal lines on
//! two machines mean equal bits.
//!
//! A recording is a stream of blocks: an 8-byte header (u16 [`BLOCK`] or [`END_OF_SWEEP`], u16 transmit beam, i32 exponent)
//! and, after [`BLOCK`], the samples as 32-bit words, channel after channel. Little-endian throughout.

use core::fmt;

use cslam_core::paths::{BeamReport, EstimatedPath, PathEstimator};
use cslam_core::profile::Samples;
use cslam_core::profile::quad_4x8_gmt_72::{CHANNELS, PATHS};
use cslam_core::signal::{BeamBlock, Iq, SAMPLES};
use embedded_io::{Read, ReadExactError};

/// Tag of a header that samples follow.
pub const BLOCK: u16 = 1;
/// Tag of a header that ends a sweep.
pub const END_OF_SWEEP: u16 = 2;
/// Length of a header, bytes.
pub const HEADER: usize = 8;

/// Why a check ended early.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum SweepError<E> {
    /// The stream ended inside a block, or could not be read.
    Read(ReadExactError<E>),
    /// A header has neither tag.
    Tag(u16),
    /// A line could not be written.
    Write,
}

impl<E> From<ReadExactError<E>> for SweepError<E> {
    fn from(error: ReadExactError<E>) -> Self {
        Self::Read(error)
    }
}

impl<E> From<fmt::Error> for SweepError<E> {
    fn from(_: fmt::Error) -> Self {
        Self::Write
    }
}

/// Header of a block or of the end of a sweep.
#[must_use]
pub fn header(tag: u16, beam: u16, exponent: i32) -> [u8; HEADER] {
    let mut bytes = [0; HEADER];
    bytes[..2].copy_from_slice(&tag.to_le_bytes());
    bytes[2..4].copy_from_slice(&beam.to_le_bytes());
    bytes[4..].copy_from_slice(&exponent.to_le_bytes());
    bytes
}

/// What a run sees of the estimator's work, to count it.
pub trait Observer {
    /// Wraps the work on one beam.
    fn push(&mut self, work: impl FnOnce() -> BeamReport) -> BeamReport {
        work()
    }
    /// Wraps the end of a sweep.
    fn finish<R>(&mut self, work: impl FnOnce() -> R) -> R {
        work()
    }
}

/// Sees nothing.
impl Observer for () {}

/// Reads the sweeps of a recording one after another through an estimator, and writes what came of each. Gives the number of
/// sweeps.
///
/// # Errors
/// The stream is not one, or cannot be read or written.
pub fn run<R: Read>(
    recording: &mut R,
    estimator: &mut dyn PathEstimator<CHANNELS, PATHS>,
    block: &mut Samples,
    observer: &mut impl Observer,
    out: &mut dyn fmt::Write,
) -> Result<u32, SweepError<R::Error>> {
    let (mut sweeps, mut blocks) = (0, 0);
    loop {
        let mut bytes = [0; HEADER];
        // A stream may end between blocks, nowhere else.
        let first = recording.read(&mut bytes).map_err(ReadExactError::Other)?;
        let Some(rest) = bytes.get_mut(first..).filter(|_| first > 0) else {
            return Ok(sweeps);
        };
        recording.read_exact(rest)?;
        let [t0, t1, b0, b1, exponent @ ..] = bytes;
        match u16::from_le_bytes([t0, t1]) {
            BLOCK => {
                load(recording, block)?;
                let beam = BeamBlock {
                    samples: block,
                    beam: u16::from_le_bytes([b0, b1]),
                    exponent: i32::from_le_bytes(exponent),
                };
                let report = observer.push(|| estimator.push_beam(beam));
                writeln!(out, "sweep {sweeps} block {blocks}: {}", Beam(report))?;
                blocks += 1;
            }
            END_OF_SWEEP => {
                let paths = observer.finish(|| estimator.finish());
                for (index, path) in paths.iter().enumerate() {
                    writeln!(out, "sweep {sweeps} path {index}: {}", Bits(path))?;
                }
                (sweeps, blocks) = (sweeps + 1, 0);
            }
            tag => return Err(SweepError::Tag(tag)),
        }
    }
}

/// Fills a block with the samples that come next.
fn load<R: Read>(recording: &mut R, block: &mut Samples) -> Result<(), ReadExactError<R::Error>> {
    let mut bytes = [0; 4 * SAMPLES];
    for channel in block {
        recording.read_exact(&mut bytes)?;
        for (x, word) in channel.iter_mut().zip(bytes.as_chunks::<4>().0) {
            *x = Iq::from_word(u32::from_le_bytes(*word));
        }
    }
    Ok(())
}

/// A report, in words.
struct Beam(BeamReport);

impl fmt::Display for Beam {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{:?}", self.0)
    }
}

/// A path with every float as its bits.
struct Bits<'a>(&'a EstimatedPath);

impl fmt::Display for Bits<'_> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let EstimatedPath {
            path,
            beam,
            snr_db,
            energy,
            range_rate: _,
        } = self.0;
        write!(
            f,
            "beam {beam} snr {:08x} energy {:08x} c_tau {:08x} aoa",
            snr_db.to_bits(),
            energy.to_bits(),
            path.c_tau_m.to_bits()
        )?;
        let aoa = path.aoa.vector();
        for part in aoa.iter() {
            write!(f, " {:08x}", part.to_bits())?;
        }
        write!(f, " covariance")?;
        for part in path.covariance.iter() {
            write!(f, " {:08x}", part.to_bits())?;
        }
        match &path.aod {
            None => write!(f, " no aod"),
            Some(aod) => {
                write!(f, " aod")?;
                let aod_vector = aod.direction.vector();
                for part in aod_vector.iter().chain([&aod.sigma_rad]) {
                    write!(f, " {:08x}", part.to_bits())?;
                }
                Ok(())
            }
        }
    }
}
