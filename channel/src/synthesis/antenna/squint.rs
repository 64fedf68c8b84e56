//! The beam squint symbols that the GMT sends: each sweeps the beam of a face over a sector from one end of the band to
//! the other.
//!
//! Element (p, q) has a phase shifter and a true time delay: weight `exp(-j [pi (n_p psi_x + n_q psi_z) + 2 pi f (n_p T_x +
//! n_q T_z)])`, f off the carrier, so that frequency f looks at the cosine `s (1 + f/fc) = psi + 2 T f`.

use cslam_core::array::SquintScheme;

use super::super::radio::SquintSweeps;
use super::place;

/// Phase shifts and delays of one symbol.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SquintSymbol {
    /// Face that sends it, from 0.
    pub face: usize,
    /// Phase from an element to the next, along row and column, in units of pi.
    pub psi: [f64; 2],
    /// Delay from an element to the next, along row and column, ns.
    pub delay_ns: [f64; 2],
}

impl SquintSweeps {
    /// The symbols in the order they are sent, face by face. `band_hz`: first and last subcarrier off the carrier.
    pub(crate) fn symbols(
        &self,
        scheme: SquintScheme,
        faces: usize,
        band_hz: [f64; 2],
        carrier_hz: f64,
    ) -> Vec<SquintSymbol> {
        let sweep = |ends, passes| sweep(ends, passes, band_hz, carrier_hz);
        let across = [-self.half_width, self.half_width];
        let of_face: Vec<_> = match scheme {
            SquintScheme::Raster => vec![(sweep(across, self.passes), sweep(self.raster_rise, 1))],
            SquintScheme::Sequential => {
                let azimuth_sweep = |elevation: &f64| (sweep(across, 1), (*elevation, 0.0));
                let count = self.elevation_sweeps;
                let elevation_sweep = |k| {
                    let azimuth = self.sector * place(k, count) * 2.0 / count as f64;
                    ((azimuth, 0.0), sweep(self.rise, 1))
                };
                let azimuth_sweeps = self.elevations.iter().map(azimuth_sweep);
                azimuth_sweeps.chain((0..count).map(elevation_sweep)).collect()
            }
        };
        let symbols = |face| {
            of_face.iter().map(move |(x, z)| SquintSymbol {
                face,
                psi: [x.0, z.0],
                delay_ns: [x.1 * 1e9, z.1 * 1e9],
            })
        };
        (0..faces).flat_map(symbols).collect()
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
