//! Field of a beam squint symbol towards rays: the elements' phase shifters, true time delays and errors, with the squint of the
//! elements' places at every subcarrier.

use std::array::from_fn;

use super::antenna::phasor;
use super::antenna::squint::SquintSymbol;
use super::lanes::in_widest_lanes;
use super::rays::Ray;
use super::{C64, Simulator};

/// Rays handled at a time. Each has its own sums in the same order, so the result does not depend on it.
const LANES: usize = 4;

/// Complex numbers of several rays.
#[derive(Clone, Copy)]
struct Lanes {
    re: [f64; LANES],
    im: [f64; LANES],
}

impl Lanes {
    const ZERO: Self = Self {
        re: [0.0; LANES],
        im: [0.0; LANES],
    };

    fn set(&mut self, lane: usize, value: C64) {
        (self.re[lane], self.im[lane]) = (value.re, value.im);
    }
}

impl<const ARRAYS: usize, const ELEMENTS: usize, const CHANNELS: usize>
    Simulator<ARRAYS, ELEMENTS, CHANNELS>
{
    /// Field of a symbol towards the departure of each ray on every active subcarrier, element errors included.
    pub(super) fn squint_fields(&self, symbol: &SquintSymbol, rays: &[Ray]) -> Vec<Vec<C64>> {
        let of_lanes = |rays| self.fields_of_lanes(symbol, rays);
        rays.chunks(LANES).flat_map(of_lanes).collect()
    }

    /// The same for at most [`LANES`] rays.
    fn fields_of_lanes(&self, symbol: &SquintSymbol, rays: &[Ray]) -> Vec<Vec<C64>> {
        let waveform = self.maker.waveform();
        // What each element sends, and what turns it. Side by side, and sums in arrays of their own: the compiler keeps these in registers.
        let mut all = vec![[Lanes::ZERO; 2]; self.radio.gmt.elements()];
        for (lane, ray) in rays.iter().enumerate() {
            for ([now, step], (first, per_subcarrier)) in all.iter_mut().zip(self.elements(symbol, ray)) {
                now.set(lane, first);
                step.set(lane, per_subcarrier);
            }
        }
        let mut fields = vec![vec![C64::new(0.0, 0.0); waveform.active]; rays.len()];
        in_widest_lanes(
            #[inline(always)]
            || sum_up(&mut all, &mut fields, waveform.active),
        );
        fields
    }

    /// What each element sends towards a ray at the first subcarrier, and what turns it from one to the next: its phase is linear in
    /// frequency.
    fn elements(&self, symbol: &SquintSymbol, ray: &Ray) -> Vec<(C64, C64)> {
        let (face, departure) = (&self.transmitter.faces()[symbol.face], &ray.departure);
        let cosines = face.cosines(departure);
        let amplitude = face.amplitude(departure) / (self.radio.gmt.elements() as f64).sqrt();
        let (carrier, lead_s) = (self.transmitter.carrier(face, departure), face.lead_s(departure));
        let waveform = self.maker.waveform();
        let spacing_hz = waveform.spacing_hz();
        let element = |e| {
            let [p, q] = face.place(e);
            let along = |v: [f64; 2]| p * v[0] + q * v[1];
            let path = face.phase_per_element_rad() * along(cosines);
            let shift = std::f64::consts::PI * along(symbol.psi);
            let own_s = self.device.gmt_delay_s[symbol.face][e] - lead_s;
            let delay_s = along(symbol.delay_ns) * 1e-9 + own_s;
            let per_subcarrier = spacing_hz * (path / waveform.carrier_hz - std::f64::consts::TAU * delay_s);
            let first = f64::from(waveform.offset(0));
            let now = phasor(path - shift + first * per_subcarrier)
                * self.device.gmt_element[symbol.face][e]
                * amplitude
                * carrier;
            (now, phasor(per_subcarrier))
        };
        (0..self.radio.gmt.elements()).map(element).collect()
    }
}

/// Adds up what the elements send on each subcarrier, one turn further each.
#[inline(always)]
fn sum_up(elements: &mut [[Lanes; 2]], fields: &mut [Vec<C64>], subcarriers: usize) {
    for subcarrier in 0..subcarriers {
        let (mut sum_re, mut sum_im) = ([0.0; LANES], [0.0; LANES]);
        for [now, step] in elements.iter_mut() {
            let (re, im) = (now.re, now.im);
            for k in 0..LANES {
                sum_re[k] += re[k];
                sum_im[k] += im[k];
            }
            now.re = from_fn(|k| re[k] * step.re[k] - im[k] * step.im[k]);
            now.im = from_fn(|k| im[k] * step.re[k] + re[k] * step.im[k]);
        }
        for (k, field) in fields.iter_mut().enumerate() {
            field[subcarrier] = C64::new(sum_re[k], sum_im[k]);
        }
    }
}
