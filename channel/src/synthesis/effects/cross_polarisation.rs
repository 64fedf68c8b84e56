//! Cross polarisation: what the UAV's elements take of a field along the horizontal tangent, that an ideal dipole is blind to.
//!
//! Element e takes `E_v + x_e E_h`, x_e complex normal of a power of -XPD (the cross-polar discrimination), drawn once. A horizontal
//! component comes of the UAV's tilt (its sine: -21 dB at 5 degrees), and of reflections whose plane of incidence is neither upright nor
//! level. Elements of the GMT send the vertical component alone.

use super::Draw;
use crate::synthesis::C64;

/// The elements of a device.
#[derive(Clone, Debug)]
pub(crate) struct CrossPolarisation<const ARRAYS: usize, const ELEMENTS: usize> {
    /// Of each element, x.
    pub(crate) taken: [[C64; ELEMENTS]; ARRAYS],
}

impl<const ARRAYS: usize, const ELEMENTS: usize> CrossPolarisation<ARRAYS, ELEMENTS> {
    /// Draws a device of a discrimination, dB.
    pub(crate) fn draw(discrimination_db: f64, seed: u64) -> Self {
        let mut stream = Draw::CrossPolarisation.stream(seed);
        let rms = libm::exp10(-discrimination_db / 20.0) * 0.5_f64.sqrt();
        let mut component = || stream.normal() * rms;
        let mut element = || C64::new(component(), component());
        Self {
            taken: std::array::from_fn(|_| std::array::from_fn(|_| element())),
        }
    }

    /// Adds to what the elements of array `j` hear of a wave the horizontal component, so many times the vertical one.
    pub(crate) fn apply(&self, j: usize, across: C64, steering: &mut [C64; ELEMENTS]) {
        for (s, taken) in steering.iter_mut().zip(&self.taken[j]) {
            *s += *s * taken * across;
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const ARRAYS: usize = 4;
    const ELEMENTS: usize = 8;

    #[test]
    fn elements_take_their_share_of_the_other_polarisation() {
        let (mut power, mut mean, devices) = (0.0, C64::ZERO, 60);
        let across = C64::new(0.0, 0.5);
        for seed in 0..devices {
            let cross = CrossPolarisation::<ARRAYS, ELEMENTS>::draw(18.0, seed);
            for j in 0..ARRAYS {
                let mut steering = [C64::new(0.0, 2.0); ELEMENTS];
                cross.apply(j, across, &mut steering);
                for (s, x) in steering.iter().zip(&cross.taken[j]) {
                    let taken = (s / C64::new(0.0, 2.0) - 1.0) / across;
                    assert!((taken - x).norm() < 1e-12);
                    power += taken.norm_sqr();
                    mean += taken;
                }
            }
        }
        let count = f64::from(devices as u32) * (ARRAYS * ELEMENTS) as f64;
        let found_db = 10.0 * libm::log10(power / count);
        assert!((found_db + 18.0).abs() < 0.4, "{found_db}");
        assert!((mean / count).norm() < 0.01, "{mean}");
        let mut steering = [C64::new(0.3, 2.0); ELEMENTS];
        CrossPolarisation::<ARRAYS, ELEMENTS>::draw(18.0, 1).apply(0, C64::ZERO, &mut steering);
        assert_eq!(steering, [C64::new(0.3, 2.0); ELEMENTS]);
    }
}
