//! Beam squint localization (BSM): where the UAV stands in the GMT's array frame, from which subcarriers are strong.
//!
//! After its beams the GMT sends symbols whose beam looks in another direction at every subcarrier
//! ([`SquintConfig`](crate::array::SquintConfig)); what the UAV hears over frequency is the transmit pattern along the sweep, a function of its
//! direction cosines (s_x, s_z) on the face. No attitude of the UAV is in it. Three ways to read it, one listening:
//!
//! - [`BeamSquint::pick`]: the strongest subcarrier, the paper's rule;
//! - [`BeamSquint::parabola`]: a parabola through the smoothed log power around it;
//! - [`BeamSquint::fit`]: maximum likelihood, the known pattern with free gains, direction and delay together; with the
//!   ground known ([`Sighting::with_ground`]) that of the ground bounce as well.
//!
//! The result is a [`Bearing`]: direction and delay, two separate measurements with covariance. The pattern tells the
//! way the wave left, so without line of sight it points at a reflector: the caller says whether there is line of
//! sight, and without it there is a [`Refusal`].
//!
//! All faces send their symbols. Where a second one is heard it can be listened to as well ([`Sighting::on_face`]), and
//! [`Joined`] makes one direction of the bearings.
//!
//! At 30 GHz the 8 x 8 faces have a Rayleigh distance under a metre: only angles can be swept. [`near_field`] is for
//! large arrays, where range can be swept as well. Source: docs/signal-model.md, "Beam squint".
//!
//! ```text
//! towards s at the offset f from the carrier fc:  pi (s (1 + f/fc) - psi) - 2 pi f T   from element to element
//! strongest where that is zero:                   s(f) = (psi + 2 T f) / (1 + f/fc)
//! ```
//!
//! # Example
//! At each end of the band a symbol's beam looks to another side of the face; what is heard strongest between tells the direction.
//! ```
//! use cslam_core::array::{GmtFace, SquintConfig, SquintScheme, SquintSymbol};
//! use cslam_core::beam_squint::Bearing;
//! use cslam_core::geometry::Matrix3;
//!
//! let band_hz = [-99.84e6, 99.36e6];
//! let symbol: SquintSymbol<f64> = <SquintConfig>::default().symbol(SquintScheme::Sequential, 0, 3, band_hz, 30e9).expect("the first");
//! let [low, high] = band_hz.map(|offset_hz| symbol.aim(offset_hz * 1e-9, 30.0)[0]);
//! assert!(low < -0.8 && high > 0.8); // cosines along the row
//! let heard = Bearing { face: 0, cosines: [0.5, 0.0], covariance: Matrix3::identity().fixed_resize(0.0), delay: None };
//! let direction = heard.direction(&GmtFace::of(0, 3)).expect("in front");
//! assert!((direction.azimuth_rad().to_degrees() - 30.0).abs() < 1e-3);
//! ```

mod bearing;
mod bounce;
mod fit;
mod joined;
pub mod near_field;
mod pattern;
mod peak;
mod reception;
mod refusal;
mod robust;
mod search;
mod sighting;
#[cfg(test)]
mod tests;

use heapless::Vec;
use nalgebra::Matrix2;

pub use bearing::{Bearing, Delay, FACE_BIAS_SIGMA};
pub use joined::Joined;
pub use reception::NULLS;
pub use refusal::Refusal;
pub use sighting::{Expected, Ground, Sighting};

use crate::array::{SquintSymbol, UavArrays};
use crate::field::{FieldError, Range, all_in, wide};
use crate::numeric::gather;
use crate::radio::RadioConfig;
use crate::signal::{BeamBlock, Correlator, Workspace};
use bounce::Mirror;
use fit::{Place, ReceivedSymbols};
use pattern::Band;
use reception::{Reception, Spectrum};

/// Energy beyond what noise gives that a fit must explain, in noise variances.
/// Derived: a false one in 1e12.
const LEAST_ENERGY: f32 = 40.0;
/// Log-likelihood by which the best place must beat every other one.
/// Tuned: `cslam campaign` with tuning seeds (docs/flights.md).
const LEAST_LEAD: f32 = 12.0;
/// Places closer than this in both cosines are the same.
/// Tuned: `cslam campaign` with tuning seeds (docs/flights.md).
const SAME: f32 = 0.02;

/// Errors of delay beyond this are none of arrays, m.
/// Given: arrays are centimetres wide.
const MOST_DELAY_M: f64 = 10.0;

/// What the receiver knows and assumes.
/// Derived: what the error budget leaves beside the constant part (docs/signal-model.md).
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct BeamSquintConfig {
    /// Standard deviation of what calibration errors of a face leave in (s_x, s_z) beside their constant part.
    pub residual_sigma: [f32; 2],
    /// Standard deviation of the delay by the arrays' delay errors, m.
    pub delay_sigma_m: f32,
}

impl Default for BeamSquintConfig {
    /// What the GMT's errors of docs/signal-model.md, "Error budget" leave beside their constant part: 0.33 and 0.19 mrad; 50 ps of each of about
    /// two arrays that share the signal, 1 cm.
    fn default() -> Self {
        Self {
            residual_sigma: [0.33e-3, 0.19e-3],
            delay_sigma_m: 0.01,
        }
    }
}

impl BeamSquintConfig {
    /// Whether every number can be.
    ///
    /// # Errors
    /// [`FieldError`] naming the first one that cannot.
    pub fn check(&self) -> Result<(), FieldError> {
        let residuals = self.residual_sigma.map(|sigma| wide(("residual_sigma", sigma)));
        all_in(Range::Within(0.0, 1.0), &residuals)?;
        all_in(
            Range::Within(0.0, MOST_DELAY_M),
            &[wide(("delay_sigma_m", self.delay_sigma_m))],
        )
    }

    /// Perfect arrays: covariances are those of noise.
    #[must_use]
    pub fn ideal() -> Self {
        Self {
            residual_sigma: [0.0; 2],
            delay_sigma_m: 0.0,
        }
    }
}

/// The UAV's side of beam squint localization: `SYMBOLS` a face, `A` arrays of `E` elements (`C` channels), faces of
/// `X` x `Z` elements, `ACTIVE` subcarriers. 60 KiB by default.
#[derive(Clone, Debug)]
pub struct BeamSquint<
    const SYMBOLS: usize = 11,
    const A: usize = 4,
    const E: usize = 8,
    const C: usize = 32,
    const X: usize = 8,
    const Z: usize = 8,
    const ACTIVE: usize = 416,
> {
    config: BeamSquintConfig,
    arrays: UavArrays<f32, A, E>,
    /// Faces of the GMT.
    faces: usize,
    /// Symbols of one face; all faces send the same.
    schedule: [SquintSymbol; SYMBOLS],
    band: Band,
    reception: Reception<A, E, C, ACTIVE>,
    spectra: [Option<Spectrum<ACTIVE>>; SYMBOLS],
    /// Face and reference delay.
    begun: Option<(usize, f32)>,
    expected: Option<Expected>,
    mirror: Option<Mirror>,
}

impl<
    const SYMBOLS: usize,
    const A: usize,
    const E: usize,
    const C: usize,
    const X: usize,
    const Z: usize,
    const ACTIVE: usize,
> BeamSquint<SYMBOLS, A, E, C, X, Z, ACTIVE>
{
    /// A receiver for the squint symbols of a radio whose GMT has so many faces. None when a face has not `SYMBOLS` symbols or the waveform
    /// not `ACTIVE` subcarriers.
    #[must_use]
    pub fn new<const ELEVATIONS: usize, const AZIMUTH_SWEEPS: usize, const ELEVATION_SWEEPS: usize>(
        config: BeamSquintConfig,
        radio: &RadioConfig<ELEVATIONS, AZIMUTH_SWEEPS, ELEVATION_SWEEPS>,
        faces: usize,
    ) -> Option<Self> {
        let (waveform, scheme) = (&radio.waveform, radio.squint_scheme);
        if radio.squint.per_face(scheme) != SYMBOLS || waveform.active != ACTIVE {
            return None;
        }
        let spacing_wavelengths = radio.gmt_arrays.spacing_wavelengths;
        let offset_hz = |index| f64::from(waveform.offset(index)) * waveform.spacing_hz();
        let band_hz = [offset_hz(0), offset_hz(ACTIVE.saturating_sub(1))];
        let nothing = SquintSymbol {
            face: 0,
            psi: [0.0; 2],
            delay_ns: [0.0; 2],
            half_wavelengths: 1.0,
        };
        Some(Self {
            config,
            arrays: radio.uav_arrays(),
            faces,
            schedule: core::array::from_fn(|index| {
                let carrier_hz = waveform.carrier_hz;
                radio
                    .squint
                    .spaced_symbol(scheme, index, 1, band_hz, carrier_hz, spacing_wavelengths)
                    .unwrap_or(nothing)
            }),
            band: Band {
                first_ghz: (band_hz[0] * 1e-9) as f32,
                step_ghz: (waveform.spacing_hz() * 1e-9) as f32,
                carrier_ghz: (waveform.carrier_hz * 1e-9) as f32,
            },
            reception: Reception::new(waveform),
            spectra: [None; SYMBOLS],
            begun: None,
            expected: None,
            mirror: None,
        })
    }

    /// Forgets what was heard and prepares for the symbols of one face.
    ///
    /// # Errors
    /// [`Refusal::NotLineOfSight`], [`Refusal::NotFinite`], [`Refusal::Masked`].
    pub fn begin(&mut self, sighting: &Sighting) -> Result<(), Refusal> {
        self.spectra = [None; SYMBOLS];
        self.begun = None;
        if !sighting.line_of_sight {
            return Err(Refusal::NotLineOfSight);
        }
        if !sighting.c_tau_m.is_finite() {
            return Err(Refusal::NotFinite);
        }
        let (aoa, nulls) = (&sighting.aoa, &sighting.interferers);
        let bounce = sighting.ground.as_ref().map(|ground| &ground.arrival);
        if !self
            .reception
            .aim(&self.arrays, aoa, sighting.c_tau_m, nulls, bounce)
        {
            return Err(Refusal::Masked);
        }
        self.begun = Some((sighting.face, sighting.c_tau_m));
        self.expected = sighting.expected;
        self.mirror = sighting.mirror(self.faces);
        Ok(())
    }

    /// Whether a symbol of the whole schedule is one of the face that is listened to: others need not be pushed.
    #[must_use]
    pub fn wants(&self, symbol: usize) -> bool {
        self.begun.is_some_and(|(face, _)| symbol / SYMBOLS == face)
    }

    /// Hears a symbol; `block.beam` is its place in the whole schedule (face after face). Symbols of other faces are
    /// passed over. The block is worked on in place and is not needed afterwards.
    pub fn push(&mut self, block: BeamBlock<'_, C>, correlator: &Correlator, work: &mut Workspace) {
        let symbol = usize::from(block.beam);
        if !self.wants(symbol) {
            return;
        }
        if let Some(spectrum) = self.spectra.get_mut(symbol % SYMBOLS) {
            *spectrum = self.reception.hear(block, correlator, work);
        }
    }

    /// The paper's rule: the strongest subcarrier.
    ///
    /// # Errors
    /// [`Refusal::NotBegun`], [`Refusal::SymbolsMissing`], [`Refusal::TooWeak`].
    pub fn pick(&self) -> Result<Bearing, Refusal> {
        let (face, _, received) = self.received()?;
        let readings = [
            peak::pick::<X, SYMBOLS, ACTIVE>(&received, 0)?,
            peak::pick::<Z, SYMBOLS, ACTIVE>(&received, 1)?,
        ];
        Ok(self.read(face, readings))
    }

    /// A parabola through the smoothed log power around the strongest subcarrier.
    ///
    /// # Errors
    /// Those of [`Self::pick`], and [`Refusal::NoPeak`].
    pub fn parabola(&self) -> Result<Bearing, Refusal> {
        let (face, _, received) = self.received()?;
        let readings = [
            peak::parabola::<X, SYMBOLS, ACTIVE>(&received, 0)?,
            peak::parabola::<Z, SYMBOLS, ACTIVE>(&received, 1)?,
        ];
        Ok(self.read(face, readings))
    }

    /// Maximum likelihood: the known pattern, fitted from the best places of a coarse grid, near where the sighting expects
    /// the path if it does.
    ///
    /// # Errors
    /// Those of [`Self::pick`], [`Refusal::Ambiguous`] and [`Refusal::Unsettled`].
    pub fn fit(&self) -> Result<Bearing, Refusal> {
        let (face, reference_m, received) = self.received()?;
        let starts = search::candidates::<X, Z, SYMBOLS, ACTIVE>(&received, self.expected.as_ref());
        let fits: Vec<fit::Fit<SYMBOLS>, { search::CANDIDATES }> = gather(starts.iter().map(|cosines| {
            received.fit::<X, Z, { fit::PAIR }>(Place {
                cosines: *cosines,
                delay_m: 0.0,
            })
        }));
        let first = fits
            .iter()
            .max_by(|a, b| a.energy.total_cmp(&b.energy))
            .ok_or(Refusal::TooWeak)?;
        // With the ground the fit of both paths goes on from here.
        let best = &match &self.mirror {
            Some(_) => *first,
            None => received.fit::<X, Z, 1>(first.place),
        };
        let count = received.symbols().count() as f32;
        // Noise alone explains one variance a symbol, with a spread of its root.
        if best.energy.is_nan() || best.energy < count + LEAST_ENERGY {
            return Err(Refusal::TooWeak);
        }
        let [x, z] = best.place.cosines;
        let astray = self
            .expected
            .is_some_and(|expected| !expected.holds(&best.place.cosines));
        if !best.settled || x * x + z * z >= 1.0 || astray {
            return Err(Refusal::Unsettled);
        }
        let elsewhere = |f: &&fit::Fit<SYMBOLS>| {
            let [fx, fz] = f.place.cosines;
            (fx - x).abs() > SAME || (fz - z).abs() > SAME
        };
        if fits
            .iter()
            .filter(elsewhere)
            .any(|f| best.energy - f.energy < LEAST_LEAD)
        {
            return Err(Refusal::Ambiguous);
        }
        let shown = received.shown::<X, Z>(best).ok_or(Refusal::SymbolsMissing)?;
        let (mut place, mut covariance, mut delay_m2) = (best.place, shown.cosines, shown.delay_m2);
        if let Some(mirror) = &self.mirror {
            let joint = received.fit_both::<X, Z>(best, mirror);
            let joint = joint.filter(|joint| joint.settled).ok_or(Refusal::Unsettled)?;
            (place, covariance, delay_m2) = (joint.place, joint.covariance, joint.delay_m2);
        }
        let [rx, rz] = self.config.residual_sigma;
        covariance.m11 += rx * rx;
        covariance.m22 += rz * rz;
        let sigma_m = self.config.delay_sigma_m;
        Ok(Bearing {
            face,
            cosines: place.cosines,
            covariance,
            delay: Some(Delay {
                c_tau_m: reference_m + place.delay_m,
                variance_m2: delay_m2 + sigma_m * sigma_m,
            }),
        })
    }

    /// What was heard, if it can tell a direction: face, reference delay, spectra.
    fn received(&self) -> Result<(usize, f32, ReceivedSymbols<'_, SYMBOLS, ACTIVE>), Refusal> {
        let (face, reference_m) = self.begun.ok_or(Refusal::NotBegun)?;
        let received = ReceivedSymbols {
            schedule: &self.schedule,
            spectra: &self.spectra,
            band: self.band,
            per_m_rad: self.reception.per_m_rad(),
        };
        let sweeps = |axis: usize| {
            let mut symbols = received.symbols();
            symbols.any(|(symbol, _)| symbol.delay_ns.get(axis).is_some_and(|delay| *delay != 0.0))
        };
        if sweeps(0) && sweeps(1) {
            Ok((face, reference_m, received))
        } else {
            Err(Refusal::SymbolsMissing)
        }
    }

    /// A bearing of two readings.
    fn read(&self, face: usize, [x, z]: [peak::Reading; 2]) -> Bearing {
        let [rx, rz] = self.config.residual_sigma;
        Bearing {
            face,
            cosines: [x.cosine, z.cosine],
            covariance: Matrix2::new(x.variance + rx * rx, 0.0, 0.0, z.variance + rz * rz),
            delay: None,
        }
    }
}
