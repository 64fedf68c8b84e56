//! Beam squint symbols through the same channel and front end.
//!
//! Here the transmit field varies over the band by design, so each ray has its own waveform in each symbol, shaped by
//! what the elements of a face send towards it (`squint_field`).

use super::air::SweepState;
use super::antenna::squint::SquintSymbol;
use super::mix::STRONG_POWER;
use super::radio::Radio;
use super::rays::{Instant, Ray, RayError};
use super::transmit::BeamField;
use super::waves::Shape;
use super::{C64, Simulator, SquintScheme, Sweep};
use crate::paths::Link;

/// Beam squint symbols hear what edges and rough faces send down to so much under the strongest ray, dB.
const RANGE_DB: f64 = 30.0;

/// The rays of a link that beam squint symbols hear: all specular ones, and what is strong of the others; `specular` says which are which.
fn heard_in_squint(rays: &[Ray], specular: impl Fn(usize) -> bool) -> Vec<Ray> {
    let power = |ray: &Ray| ray.amplitude.norm_sqr();
    let strongest = rays.iter().map(power).fold(0.0, f64::max);
    let least = strongest * libm::exp10(-RANGE_DB / 10.0);
    let heard = |(path, ray): &(usize, &Ray)| specular(*path) || power(ray) >= least;
    rays.iter()
        .enumerate()
        .filter(heard)
        .map(|(_, ray)| *ray)
        .collect()
}

impl<const ARRAYS: usize, const ELEMENTS: usize, const CHANNELS: usize>
    Simulator<ARRAYS, ELEMENTS, CHANNELS>
{
    /// The symbols of a scheme, in the order they are sent: 33 or 3 by default.
    pub fn squint_symbols(&self, scheme: SquintScheme) -> Vec<SquintSymbol> {
        let waveform = self.maker.waveform();
        let edge_hz = |index| f64::from(waveform.offset(index)) * waveform.spacing_hz();
        let band_hz = [edge_hz(0), edge_hz(waveform.active - 1)];
        let Radio { squint, gmt, .. } = &self.radio;
        squint.symbols(scheme, gmt.faces, band_hz, waveform.carrier_hz)
    }

    /// Blocks of the squint symbols over a link. They follow the sweep of the same `index`: their slots are those after
    /// its beams, so clock and Doppler run on. A block's `beam` is the symbol's place in the schedule.
    ///
    /// # Errors
    /// [`RayError`] when a path of the link cannot be synthesised.
    pub fn squint(
        &self,
        link: &Link,
        instant: &Instant,
        index: u32,
        scheme: SquintScheme,
    ) -> Result<Sweep<CHANNELS>, RayError> {
        let rays = self.rays(link, instant)?;
        let heard = heard_in_squint(&rays, |path| link.paths[path].is_specular());
        Ok(self.squint_rays(&heard, instant, index, scheme, |_| true))
    }

    /// The same for rays that are already in the frames of the arrays. Only symbols that `wanted` accepts are made,
    /// with the same samples as among all.
    pub fn squint_rays(
        &self,
        rays: &[Ray],
        instant: &Instant,
        index: u32,
        scheme: SquintScheme,
        wanted: impl Fn(&SquintSymbol) -> bool,
    ) -> Sweep<CHANNELS> {
        let symbols = self.squint_symbols(scheme);
        let places = (0..symbols.len()).filter(|place| wanted(&symbols[*place]));
        self.shaped_rays(rays, instant, index, places, |place, rays| {
            self.squint_fields(&symbols[place], rays)
        })
    }

    /// Blocks of symbols with any transmit pattern: `responses` gives the field of symbol `place` towards each ray, one
    /// value an active subcarrier, in units of a transmitter of gain one.
    pub fn shaped_rays(
        &self,
        rays: &[Ray],
        instant: &Instant,
        index: u32,
        places: impl Iterator<Item = usize>,
        responses: impl Fn(usize, &[Ray]) -> Vec<Vec<C64>>,
    ) -> Sweep<CHANNELS> {
        let mut state = SweepState::new(self, rays, instant, index);
        let mut sweep = Sweep::default();
        for place in places {
            let slot = self.beams() + place;
            state.make_shaped_waves(slot, |rays| responses(place, rays));
            let whole = |_: &SweepState<'_, ARRAYS, ELEMENTS, CHANNELS>, _| BeamField {
                field: C64::new(1.0, 0.0),
                slope_s: C64::new(0.0, 0.0),
            };
            if state.air(slot, false, whole) {
                sweep.blocks.push(state.digitise(slot, place as u16));
            }
        }
        sweep
    }
}

impl<const ARRAYS: usize, const ELEMENTS: usize, const CHANNELS: usize>
    SweepState<'_, ARRAYS, ELEMENTS, CHANNELS>
{
    /// Replaces the waves by those of a symbol with a pattern of its own, at the clock of its slot.
    fn make_shaped_waves(&mut self, slot: usize, responses: impl Fn(&[Ray]) -> Vec<Vec<C64>>) {
        let clock_s = self.clock_s(slot);
        let simulator = self.simulator;
        let cfo_hz = self.cfo_hz;
        let of_link = &self.rays[..self.fields.len()];
        let responses = responses(of_link);
        // The slope is what elements with delays of their own take, and only of what is strong.
        let power = |ray: &Ray| ray.amplitude.norm_sqr();
        let most = of_link.iter().map(power).fold(0.0, f64::max);
        for (l, ray) in self.rays.iter().enumerate() {
            let response = &responses[self.origin[l]];
            let with_slope =
                simulator.arrays.squints() && l < responses.len() && power(ray) > STRONG_POWER * most;
            let turns = simulator.maker.turns(ray.doppler_hz + cfo_hz);
            let delays_s = self.receptions[l].delay_s.map(|delay_s| delay_s + clock_s);
            let shape = Shape {
                response: Some(response),
                with_slope,
            };
            let out = self.waves.each_mut().map(|waves| &mut waves[l]);
            simulator.maker.make(delays_s, &turns, &shape, out);
        }
        self.made_at_s = clock_s;
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use cslam_core::geometry::Direction;

    use crate::synthesis::Impairments;
    use crate::synthesis::antenna::phasor;
    use crate::synthesis::probe::{block, noiseless, one_path, response};

    const DEPARTURE: [f64; 2] = [1.35, 0.25];

    fn simulator(impairments: Impairments) -> Simulator {
        Simulator::new(noiseless(impairments), 6)
    }

    fn heard(simulator: &Simulator, scheme: SquintScheme) -> Sweep {
        let link = one_path(50.0, [1.4, 0.3], DEPARTURE);
        simulator
            .squint(&link, &Instant::at_rest(), 0, scheme)
            .expect("complete path")
    }

    /// The symbol as the receiver knows it.
    fn known(scheme: SquintScheme, place: usize) -> cslam_core::array::SquintSymbol<f64> {
        use cslam_core::array::SquintConfig;
        let band_hz = [-208.0 * 480e3, 207.0 * 480e3];
        let symbol = SquintConfig::default().symbol(scheme, place, 3, band_hz, 30e9);
        symbol.expect("a symbol")
    }

    fn cosines() -> [f64; 2] {
        [DEPARTURE[0].sin() * DEPARTURE[1].sin(), DEPARTURE[0].cos()]
    }

    #[test]
    fn a_clean_path_shows_the_known_pattern_and_its_delay() {
        let simulator = simulator(Impairments::none());
        for (scheme, count) in [(SquintScheme::Sequential, 33), (SquintScheme::Raster, 3)] {
            let sweep = heard(&simulator, scheme);
            assert_eq!(sweep.blocks.len(), count);
            let symbols = simulator.squint_symbols(scheme);
            // Symbols of face 0, which looks at the receiver.
            for (place, _) in symbols.iter().enumerate().filter(|(_, s)| s.face == 0) {
                let known = known(scheme, place);
                let h = response(block(&sweep, place as u16), 3);
                let lead_s = simulator
                    .arrays
                    .lead_m(&Direction::from_zenith_azimuth(1.4, 0.3).expect("angles"))[0]
                    / 299_792_458.0;
                let delay_s = 50.0 / 299_792_458.0 - lead_s;
                let model: Vec<C64> = (-208..208)
                    .map(|k| {
                        let f_hz = f64::from(k) * 480e3;
                        known.response::<8, 8>(cosines(), f_hz * 1e-9, 30.0)
                            * phasor(-std::f64::consts::TAU * f_hz * delay_s)
                    })
                    .collect();
                let inner: C64 = h.iter().zip(&model).map(|(h, m)| h * m.conj()).sum();
                let energy = |x: &[C64]| x.iter().map(|x| x.norm_sqr()).sum::<f64>();
                let match_ = inner.norm_sqr() / (energy(&h) * energy(&model));
                assert!(match_ > 1.0 - 1e-6, "symbol {place}: {match_}");
            }
        }
    }

    #[test]
    fn symbols_hear_mirrors_and_what_is_strong_of_all_else() {
        let simulator = simulator(Impairments::none());
        let ray = simulator.rays(&one_path(50.0, [1.4, 0.3], DEPARTURE), &Instant::at_rest());
        let ray = ray.expect("complete path")[0];
        let rays = [1.0, 0.03, 0.03, 0.04].map(|share| Ray {
            amplitude: ray.amplitude * share,
            ..ray
        });
        assert_eq!(
            heard_in_squint(&rays, |path| path == 1),
            [rays[0], rays[1], rays[3]]
        );
    }

    #[test]
    fn symbols_share_the_link_budget_of_the_beams() {
        let simulator = simulator(Impairments::none());
        let link = one_path(50.0, [1.4, 0.3], DEPARTURE);
        let beams = simulator.sweep(&link, &Instant::at_rest(), 0).expect("path");
        let codebook = cslam_core::array::Codebook::<f64>::default();
        let u = Direction::from_zenith_azimuth(DEPARTURE[0], DEPARTURE[1]).expect("angles");
        let arrays = codebook.arrays();
        let element = arrays.amplitude(&arrays.faces()[0], &u);
        let per_field = response(block(&beams, 16), 3)[208].norm() / codebook.field(16, &u).norm();
        let symbol = known(SquintScheme::Sequential, 1);
        let sweep = heard(&simulator, SquintScheme::Sequential);
        let h = response(block(&sweep, 1), 3)[208].norm();
        let expected = per_field * symbol.response::<8, 8>(cosines(), 0.0, 30.0).norm() * element;
        assert!((h / expected - 1.0).abs() < 2e-3, "{h} {expected}");
    }

    #[test]
    fn element_errors_enter_the_pattern() {
        let simulator = simulator(Impairments {
            gmt_arrays: crate::synthesis::GmtArrayErrors {
                gain_rms_db: 0.5,
                centre_rms_mm: 2.0,
                ..Default::default()
            },
            ..Impairments::budget()
        });
        let u = Direction::from_zenith_azimuth(DEPARTURE[0], DEPARTURE[1]).expect("angles");
        let amplitude = simulator.transmitter.faces()[0].amplitude(&u);
        let symbol = &simulator.squint_symbols(SquintScheme::Raster)[0];
        let link = one_path(50.0, [1.4, 0.3], DEPARTURE);
        let ray = simulator.rays(&link, &Instant::at_rest()).expect("complete path")[0];
        // Among others, as alone.
        let response = &simulator.squint_fields(symbol, &[ray; 6])[5];
        assert_eq!(simulator.squint_fields(symbol, &[ray])[0], *response);
        let lead_s = simulator.device.gmt_centre_m[0].dot(u.vector()) / 299_792_458.0;
        for k in [-208, 0, 3, 207] {
            let f_hz = f64::from(k) * 480e3;
            let sum: C64 = (0..64)
                .map(|e| {
                    let n = [f64::from(e / 8) - 3.5, f64::from(e % 8) - 3.5];
                    let along = |v: [f64; 2]| n[0] * v[0] + n[1] * v[1];
                    let e = e as usize;
                    let delay_s = along(symbol.delay_ns) * 1e-9 + simulator.device.gmt_delay_s[0][e];
                    let phase = std::f64::consts::PI * along(cosines()) * (1.0 + f_hz / 30e9)
                        - std::f64::consts::PI * along(symbol.psi)
                        - std::f64::consts::TAU * f_hz * delay_s
                        + std::f64::consts::TAU * (30e9 + f_hz) * lead_s;
                    phasor(phase) * simulator.device.gmt_element[0][e] * amplitude / 8.0
                })
                .sum();
            assert!(
                (response[(k + 208) as usize] - sum).norm() < 1e-9,
                "subcarrier {k}"
            );
        }
    }

    #[test]
    fn calibration_errors_move_the_peak_by_milliradians() {
        // Amplitude-weighted centre of the main lobe, as a stand-in for a fit: 5 deg and 20 ps shift it a little.
        let centre = |impairments| {
            let sweep = heard(&simulator(impairments), SquintScheme::Sequential);
            let h = response(block(&sweep, 1), 3);
            let power: Vec<f64> = h.iter().map(|h| h.norm_sqr().powi(2)).collect();
            let sum: f64 = power.iter().sum();
            power.iter().enumerate().map(|(k, p)| k as f64 * p).sum::<f64>() / sum
        };
        let clean = centre(Impairments::none());
        let gmt = Impairments {
            gmt_element_phase_rms_deg: 5.0,
            gmt_element_delay_rms_ps: 20.0,
            ..Impairments::none()
        };
        let moved = (centre(gmt) - clean).abs() * 1.74 / 415.0;
        assert!((1e-5..6e-3).contains(&moved), "{moved}");
    }
}
