//! Cancellation: takes a fitted path out of the taps, or puts it back.
//!
//! The band is rectangular, so a path's kernel decays with 1/|x| only: it is cancelled, not windowed away
//! (docs/signal-model.md, "Path estimation"). How far depends on its strength: up to where its sidelobes fall [`MARGIN`] in amplitude under the noise.
//! Taps are int16 and stay so; each subtraction rounds once, half up, which adds 0.3 LSB of noise to taps that already
//! carry 1.1 LSB from the transform (docs/signal-model.md, "Fixed point"). The power-delay profile is updated with exactly the integers
//! that changed, so it stays the sum of the taps' powers.

use nalgebra::{Complex, Vector3};

use super::model::{ArrayModel, place, steering};
use super::template::{SPAN, Template};
use crate::kernels::stage::Stages;
use crate::kernels::stages::{Channel, FRACTION_BITS};
use crate::kernels::{Iq, Native};
use crate::signal::{SAMPLES, phasor};

/// Sidelobes are cancelled down to a third of the noise amplitude.
/// Derived: what is left of them then holds 3.6 noise variances in all channels, a tenth of what a path must.
const MARGIN: f32 = 3.0;
/// Taps on both sides that are always cancelled.
/// Capacity: work of a cancellation.
const LEAST: usize = 8;

/// A path as it is cancelled.
#[derive(Clone, Copy, Debug)]
pub(super) struct Source<const A: usize> {
    /// Tap to which delay and phase refer.
    pub(super) origin: usize,
    /// Delay at the body origin, taps from the origin.
    pub(super) delay_taps: f32,
    pub(super) u: Vector3<f32>,
    /// Gains at the arrays, LSB.
    pub(super) gains: [Complex<f32>; A],
}

impl<const A: usize> Source<A> {
    /// Mean power over the arrays, squared LSB of a tap.
    pub(super) fn power(&self) -> f32 {
        self.gains.iter().map(|g| g.norm_sqr()).sum::<f32>() / A as f32
    }

    /// Delay in taps from another origin, the shorter way round the period.
    pub(super) fn delay_from(&self, origin: usize) -> f32 {
        self.delay_taps + taps_between(origin, self.origin)
    }

    /// Delay from another origin, and the gains with their phase referred to it.
    pub(super) fn seen_from(&self, origin: usize, centre_turns: f32) -> (f32, [Complex<f32>; A]) {
        let delay = self.delay_from(origin);
        let turn = phasor(-centre_turns * (delay - self.delay_taps));
        (delay, self.gains.map(|g| g * turn))
    }

    /// Largest amplitude at any array, LSB of a tap.
    pub(super) fn amplitude(&self) -> f32 {
        libm::sqrtf(self.gains.iter().map(|g| g.norm_sqr()).fold(0.0, f32::max))
    }

    /// Amplitude of a source whose sidelobes are nowhere weaker than those of the difference to `other`: gains that differ, kernels that are
    /// shifted, and outermost elements whose phase turns.
    pub(super) fn difference<const E: usize>(
        &self,
        other: &Self,
        model: &ArrayModel<A, E>,
        template: &Template,
    ) -> f32 {
        use core::f32::consts::{PI, TAU};
        let (delay, gains) = other.seen_from(self.origin, template.centre_turns());
        let turned = (self.u - other.u).norm();
        let mut most = 0.0_f32;
        for ((step, lead), (new, old)) in model.arrays().zip(self.gains.iter().zip(&gains)) {
            let shifted = (self.delay_taps - delay).abs() + lead.norm() * turned;
            let phase = TAU * step.norm() * place::<E>(E - 1) * turned;
            let relative = PI * template.occupancy() * shifted + phase;
            most = most.max(libm::sqrtf((new - old).norm_sqr()) + relative * libm::sqrtf(old.norm_sqr()));
        }
        most
    }
}

/// Taps on both sides over which a path of this amplitude stands out of the noise.
pub(super) fn reach(amplitude: f32, noise: f32, occupancy: f32) -> usize {
    let ratio = amplitude / libm::sqrtf(noise.max(f32::MIN_POSITIVE));
    reach_of::<SAMPLES>(MARGIN * ratio, occupancy)
}

/// Taps of a period of `N`, on both sides, at which sidelobes are over `1 / ratio` of the peak.
pub(super) fn reach_of<const N: usize>(ratio: f32, occupancy: f32) -> usize {
    // |D(x)| <= 1 / (pi occupancy x) up to a quarter of the period, and less than twice that beyond.
    let reach = ratio / (core::f32::consts::PI * occupancy);
    (reach.min(N as f32) as usize).clamp(LEAST, N / 2)
}

/// Taps from one origin to another, the shorter way round the period.
pub(super) fn taps_between(from: usize, to: usize) -> f32 {
    let half = SAMPLES / 2;
    let between = to.wrapping_sub(from).wrapping_add(half) & (SAMPLES - 1);
    between as f32 - half as f32
}

/// Subtract or add back.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Change {
    Subtract,
    Add,
}

/// Changes the taps by the sum of the sources' models and keeps `profile` in step. Close sources of opposite phase are
/// larger than their sum, which is what fits int16: they must go together. `reach`: taps on both sides of the first source's origin
/// ([`reach`]). Returns over how many taps.
pub(super) fn change<const L: usize, const A: usize, const E: usize, const C: usize>(
    model: &ArrayModel<A, E>,
    template: &Template,
    taps: &mut [Channel; C],
    profile: &mut [u64; SAMPLES],
    sources: &[Source<A>; L],
    reach: usize,
    change: Change,
) -> usize {
    const { assert!(C == A * E && L > 0) };
    let origin = sources[0].origin;
    // The whole period once: from -256 to 255.
    let count = (2 * reach + 1).min(SAMPLES);
    let first = -(reach as i32);
    // In two stretches where it runs over the period's end.
    let start = origin.wrapping_sub(reach) & (SAMPLES - 1);
    let ahead = count.min(SAMPLES - start);
    let mut columns = [[[0_i32; 2]; L]; SAMPLES];
    for (j, ((step, lead), rows)) in model.arrays().zip(taps.as_chunks_mut::<E>().0).enumerate() {
        for (l, source) in sources.iter().enumerate() {
            let (away, gain) = source.seen_from(origin, template.centre_turns());
            let delay = away - lead.dot(&source.u);
            let scaled = gain.get(j).copied().unwrap_or_default() * (1 << FRACTION_BITS) as f32;
            let column = columns.as_flattened_mut().get_mut(l..).unwrap_or_default();
            fill(template, first, count, delay, scaled, (column, L));
        }
        let phases: [[Iq; E]; L] = sources
            .each_ref()
            .map(|source| steering::<E>(step.dot(&source.u)).map(q15));
        let columns = columns.as_flattened();
        let (before, behind) = columns.split_at_checked(L * ahead).unwrap_or((columns, &[]));
        let behind = behind.get(..L * (count - ahead)).unwrap_or(&[]);
        for (e, row) in rows.iter_mut().enumerate() {
            let phases = phases.each_ref().map(|elements| elements[e]);
            for (at, part) in [(start, before), (0, behind)] {
                if let (Some(taps), Some(powers)) = (row.get_mut(at..), profile.get_mut(at..)) {
                    Native::cancel(taps, powers, part, &phases, change == Change::Add);
                }
            }
        }
    }
    count
}

/// Q15 of a phase factor, parts within +-32 767; the cast cuts towards zero.
pub(super) fn q15(s: Complex<f32>) -> Iq {
    let part = |x: f32| (x * 32_768.0).clamp(-32_767.0, 32_767.0) as i16;
    Iq::new(part(s.re), part(s.im))
}

/// Fills a column with the kernel times `gain`, cut to integers, at coordinates `first`, `first + 1`, ..., `count` of them: from the table near
/// the peak, by the closed form beyond, band centre put back. Phases advance by products, anew on each side of the peak and around
/// it: their rounding stays under 3e-5 of values that are a fortieth of the peak at most. The column is every so-manyth value, from the
/// first one on. Of one kind for all numbers of sources: flash is short.
#[inline(never)]
pub(super) fn fill(
    template: &Template,
    first: i32,
    count: usize,
    delay: f32,
    gain: Complex<f32>,
    (column, stride): (&mut [[i32; 2]], usize),
) {
    let mut column = column
        .chunks_mut(stride.max(1))
        .filter_map(|row| row.first_mut())
        .take(count);
    let place = |tap: usize| (first + tap as i32) as f32 - delay;
    // As many taps as lie further ahead of the peak than the table reaches, and as many as do not lie as far behind it: the casts
    // cut towards zero and give 0 below it.
    let ahead = (((1 - NEAR - first) as f32 + delay) as usize).min(count);
    let mut near = [[0.0; 2]; 2 * NEAR as usize];
    let behind = (((1 + NEAR - first) as f32 + delay) as usize)
        .min(ahead + near.len())
        .min(count)
        .max(ahead);
    let centre = template.centre_turns();
    let turned = |tap: usize| gain * phasor(centre * (first + tap as i32) as f32);
    far(template, place(0), ahead, turned(0), &mut column);
    template.row(place(ahead), &mut near);
    let (mut here, step) = (turned(ahead), phasor(centre));
    for ([d, _], value) in near.iter().take(behind - ahead).zip(&mut column) {
        *value = [(here.re * d) as i32, (here.im * d) as i32];
        here *= step;
    }
    far(
        template,
        place(behind),
        count - behind,
        turned(behind),
        &mut column,
    );
}

/// Taps to either side of the peak that come from the table.
const NEAR: i32 = SPAN as i32 - 1;

/// The kernel by its closed form, `D(x) = sin(pi Na x / N) / (Na sin(pi x / N))`, at `x`, `x + 1`, ..., `count` of them, times a gain
/// that the band's centre turns from tap to tap.
#[inline(always)]
fn far<'a>(
    template: &Template,
    x: f32,
    count: usize,
    gain: Complex<f32>,
    column: &mut impl Iterator<Item = &'a mut [i32; 2]>,
) {
    if count == 0 {
        return;
    }
    // Half turns per tap of the two sines.
    let (band_step, period_step) = (0.5 * template.occupancy(), 0.5 / template.period());
    let (band, band_turn) = (phasor(band_step * x), phasor(band_step));
    let (mut band, mut before, twice) = (band.im, (band * band_turn.conj()).im, 2.0 * band_turn.re);
    let (mut period, period_turn) = (phasor(period_step * x), phasor(period_step));
    let (mut here, step) = (gain / template.active(), phasor(template.centre_turns()));
    for value in column.take(count) {
        let d = band / period.im;
        *value = [(here.re * d) as i32, (here.im * d) as i32];
        here *= step;
        period *= period_turn;
        // sin(a + b) + sin(a - b) = 2 cos(b) sin(a).
        (before, band) = (band, twice * band - before);
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::array::UavArrays;
    use crate::signal::Waveform;

    fn source() -> Source<4> {
        Source {
            origin: 100,
            delay_taps: 0.37,
            u: Vector3::new(0.36, -0.48, 0.8),
            gains: core::array::from_fn(|j| phasor(0.21 * j as f32) * (6000.0 - 1500.0 * j as f32)),
        }
    }

    /// The taps of the source by the definition of the signal, in double precision, rounded.
    fn exact(model: &ArrayModel<4, 8>, waveform: &Waveform, source: &Source<4>) -> [Channel; 32] {
        let mut taps = [[Iq::ZERO; SAMPLES]; 32];
        let mut kernel = [[Complex::new(0.0_f64, 0.0); SAMPLES]; 4];
        for (row, (_, lead)) in kernel.iter_mut().zip(model.arrays()) {
            let delay = f64::from(source.delay_taps - lead.dot(&source.u));
            for (n, value) in row.iter_mut().enumerate() {
                let x = n as f64 - source.origin as f64;
                for i in 0..waveform.active {
                    let k = f64::from(waveform.offset(i));
                    // The gain's phase refers to the band centre at the delay, to the origin tap elsewhere.
                    let turns = (k * (x - delay) - 0.5 * delay) / SAMPLES as f64;
                    let (sine, cosine) = (
                        libm::sin(core::f64::consts::TAU * turns),
                        libm::cos(core::f64::consts::TAU * turns),
                    );
                    *value += Complex::new(cosine, sine) / waveform.active as f64;
                }
            }
        }
        for (c, row) in taps.iter_mut().enumerate() {
            let (j, i) = (c / 8, c % 8);
            let (step, _) = model.arrays().nth(j).expect("array");
            let angle = core::f64::consts::TAU * f64::from(step.dot(&source.u)) * (i as f64 - 3.5);
            let g = source.gains[j];
            let gain = Complex::new(f64::from(g.re), f64::from(g.im))
                * Complex::new(libm::cos(angle), libm::sin(angle));
            for (sample, d) in row.iter_mut().zip(&kernel[j]) {
                let value = gain * d;
                *sample = Iq::new(libm::round(value.re) as i16, libm::round(value.im) as i16);
            }
        }
        taps
    }

    fn profile_of(taps: &[Channel; 32]) -> [u64; SAMPLES] {
        core::array::from_fn(|n| taps.iter().map(|row| u64::from(row[n].power())).sum())
    }

    #[test]
    fn path_leaves_only_rounding_and_the_profile_keeps_step() {
        let waveform = Waveform::default();
        let model = ArrayModel::<4, 8>::new(&UavArrays::default(), &waveform);
        let template = Template::new(&waveform);
        let source = source();
        let mut taps = exact(&model, &waveform, &source);
        let before = taps;
        let mut profile = profile_of(&taps);
        // Noise so weak that the whole period is cancelled.
        change(
            &model,
            &template,
            &mut taps,
            &mut profile,
            &[source],
            SAMPLES / 2,
            Change::Subtract,
        );
        let left: u64 = profile.iter().sum();
        assert_eq!(profile, profile_of(&taps));
        let rms = libm::sqrt(left as f64 / (2.0 * 32.0 * SAMPLES as f64));
        assert!(rms < 0.45, "{rms} LSB per component");
        let largest = taps.iter().flatten().map(|x| x.power()).max().expect("taps");
        assert!(largest <= 8, "{largest}");
        change(
            &model,
            &template,
            &mut taps,
            &mut profile,
            &[source],
            SAMPLES / 2,
            Change::Add,
        );
        assert_eq!(profile, profile_of(&taps));
        let back = taps.iter().flatten().zip(before.iter().flatten());
        assert!(
            back.clone().all(|(a, b)| a == b),
            "{:?}",
            back.clone().find(|(a, b)| a != b)
        );
    }

    #[test]
    fn a_column_is_the_kernel_wherever_it_begins() {
        let template = Template::new(&Waveform::default());
        let gain = phasor(0.1) * 1e6;
        for (first, count) in [
            (-256, 512),
            (-60, 30),
            (-20, 3),
            (-5, 8),
            (-14, 200),
            (15, 4),
            (40, 100),
        ] {
            for delay in [-0.5, -0.25, 0.0, 0.3] {
                let mut column = [[0; 2]; SAMPLES];
                fill(&template, first, count, delay, gain, (&mut column, 1));
                for (n, value) in (first..).zip(column).take(count) {
                    let exact = gain
                        * phasor(template.centre_turns() * n as f32)
                        * template.anywhere(n as f32 - delay);
                    let away = (exact.re - value[0] as f32)
                        .abs()
                        .max((exact.im - value[1] as f32).abs());
                    assert!(
                        away < 3.0,
                        "tap {n} of {first}, {count} at {delay}: {value:?} {exact}"
                    );
                }
            }
        }
    }

    #[test]
    fn reach_follows_the_strength() {
        let waveform = Waveform::default();
        let model = ArrayModel::<4, 8>::new(&UavArrays::default(), &waveform);
        let template = Template::new(&waveform);
        let weak = Source {
            gains: [Complex::new(40.0, 0.0); 4],
            ..source()
        };
        let mut taps = [[Iq::ZERO; SAMPLES]; 32];
        let mut profile = [0; SAMPLES];
        change(
            &model,
            &template,
            &mut taps,
            &mut profile,
            &[weak],
            reach(weak.amplitude(), 16.0, template.occupancy()),
            Change::Add,
        );
        let touched = |n: usize| profile.get(n).is_some_and(|&e| e > 0);
        // Amplitude ten times the noise: 3 x 10 / 2.55 = 11 taps.
        assert!(touched(100 - 10) && touched(100 + 10));
        assert!((112..600).all(|n| !touched(n % SAMPLES)) && !touched(88));
    }

    /// What the bound on a difference leaves out is under a third of the noise's amplitude, wherever and however a path is moved.
    #[test]
    fn beyond_its_reach_a_difference_is_under_the_noise() {
        let waveform = Waveform::default();
        let model = ArrayModel::<4, 8>::new(&UavArrays::default(), &waveform);
        let template = Template::new(&waveform);
        let noise = 16.0_f32;
        for (by_taps, by_rad, by_gain) in [
            (0.02, 0.0, 1.0),
            (0.0, 0.002, 1.0),
            (0.0, 0.0, 0.98),
            (-0.02, 0.002, 1.02),
        ] {
            let old = source();
            let u = old.u + Vector3::new(0.0, by_rad, 0.0);
            let new = Source {
                delay_taps: old.delay_taps + by_taps,
                u: u / u.norm(),
                gains: old.gains.map(|g| g * by_gain),
                ..old
            };
            let taps = [&new, &old].map(|source| exact(&model, &waveform, source));
            let amplitude = new.difference(&old, &model, &template);
            let far = reach(amplitude, noise, template.occupancy()) as i32;
            assert!(far < 200, "{far}: a small change must not reach everywhere");
            let left = (far + 1..256)
                .flat_map(|n| [n, -n])
                .map(|n| (100 + n) as usize & (SAMPLES - 1));
            let most = left
                .flat_map(|n| (0..32).map(move |c| (c, n)))
                .map(|(c, n)| {
                    let [a, b] = taps.each_ref().map(|taps| taps[c][n]);
                    let part = |x: i16, y: i16| f32::from(x) - f32::from(y);
                    libm::hypotf(part(a.re(), b.re()), part(a.im(), b.im()))
                })
                .fold(0.0, f32::max);
            // Both are rounded: up to 1.4 LSB, and beyond a quarter of the period the kernel is up to twice the bound.
            assert!(
                most < 2.0 * libm::sqrtf(noise) / 3.0 + 1.5,
                "{by_taps} {by_rad}: {most} beyond {far}"
            );
        }
    }
}
