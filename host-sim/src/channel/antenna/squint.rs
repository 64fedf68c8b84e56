//! The beam squint symbols that the GMT sends: each sweeps the beam of a face over a sector from one end of the band to
//! the other.
//!
//! Element (p, q) has a phase shifter and a true time delay: weight `exp(-j [pi (n_p psi_x + n_q psi_z) + 2 pi f (n_p T_x +
//! n_q T_z)])`, f off the carrier, so that frequency f looks at the cosine `s (1 + f/fc) = psi + 2 T f`.

use std::f64::consts::FRAC_PI_3;

use super::super::FACES;
use super::place;

/// Azimuth sweeps run over +- this cosine, at these elevations.
const HALF_WIDTH: f64 = 0.87;
const ELEVATIONS: [f64; 3] = [0.05, 0.28, 0.51];
/// Elevation sweeps stand at the eight azimuths of the codebook, and rise from the first of these to the second.
const ELEVATION_SWEEPS: usize = 8;
const RISE: [f64; 2] = [-0.10, 0.75];
/// A raster symbol passes over the azimuths this often while its elevation rises.
const PASSES: usize = 3;
const RASTER_RISE: [f64; 2] = [0.0, 0.62];

/// Which symbols are sent.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum SquintScheme {
    /// Per face three azimuth sweeps, then eight elevation sweeps: 33 symbols.
    Sequential,
    /// Per face one symbol, several azimuth passes while the elevation rises: 3 symbols.
    Raster,
}

/// Phase shifts and delays of one symbol.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SquintSymbol {
    /// Face that sends it, 0 to 2.
    pub face: usize,
    /// Phase from an element to the next, along row and column, in units of pi.
    pub psi: [f64; 2],
    /// Delay from an element to the next, along row and column, ns.
    pub delay_ns: [f64; 2],
}

impl SquintScheme {
    /// The symbols in the order they are sent, face by face. `band_hz`: first and last subcarrier off the carrier.
    pub(in crate::channel) fn symbols(self, band_hz: [f64; 2], carrier_hz: f64) -> Vec<SquintSymbol> {
        let sweep = |ends, passes| sweep(ends, passes, band_hz, carrier_hz);
        let across = [-HALF_WIDTH, HALF_WIDTH];
        let of_face: Vec<_> = match self {
            Self::Raster => vec![(sweep(across, PASSES), sweep(RASTER_RISE, 1))],
            Self::Sequential => {
                let azimuth_sweeps = ELEVATIONS.map(|elevation| (sweep(across, 1), (elevation, 0.0)));
                let elevation_sweeps = (0..ELEVATION_SWEEPS).map(|k| {
                    let azimuth = libm::sin(FRAC_PI_3) * place(k) * 2.0 / ELEVATION_SWEEPS as f64;
                    ((azimuth, 0.0), sweep(RISE, 1))
                });
                azimuth_sweeps.into_iter().chain(elevation_sweeps).collect()
            }
        };
        let symbols = |face| {
            of_face.iter().map(move |(x, z)| SquintSymbol {
                face,
                psi: [x.0, z.0],
                delay_ns: [x.1 * 1e9, z.1 * 1e9],
            })
        };
        (0..FACES).flat_map(symbols).collect()
    }
}

/// Phase shift and delay (s) that sweep the cosine from `first` at the low end of the band to `last` at the high one,
/// `passes` times: the array factor repeats every 2.
fn sweep([first, last]: [f64; 2], passes: usize, [low_hz, high_hz]: [f64; 2], carrier_hz: f64) -> (f64, f64) {
    let wraps = 2.0 * (passes - 1) as f64;
    let start = first * (1.0 + low_hz / carrier_hz);
    let delay_s = (last * (1.0 + high_hz / carrier_hz) - start + wraps) / (2.0 * (high_hz - low_hz));
    (start - 2.0 * delay_s * low_hz, delay_s)
}
