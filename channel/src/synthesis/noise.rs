//! Fast white Gaussian noise: ChaCha8 words through a ziggurat.
//!
//! A sweep takes 2.4 million deviates, more than all else in it costs with Box-Muller. The ziggurat (Marsaglia and Tsang,
//! 2000) covers the half density by 256 layers of equal area: 99 % of deviates need one word, one product and one
//! comparison. From a 32-bit word, 8 bits choose the layer, one the sign and the other 23 the place in it, so the three are
//! independent (the flaw of the original, Doornik 2005). Tables are made here with libm; the bits are the same everywhere.

use rand::Rng;
use rand_chacha::ChaCha8Rng;
use rand_chacha::rand_core::SeedableRng;

/// Layers of the ziggurat.
const LAYERS: usize = 256;
/// Places in a layer.
const PLACES: f64 = 8_388_608.0;

/// Edges of the layers of a half normal density.
#[derive(Clone, Debug)]
struct Ziggurat {
    /// Right edges x_0 > x_1 = r > ... > x_256 = 0; x_0 is the width of the base as if the tail were part of it.
    edge: [f64; LAYERS + 1],
    /// `exp(-x^2/2)` at the edges.
    density: [f64; LAYERS + 1],
    /// Width of a place in each layer.
    width: [f32; LAYERS],
    /// Places below this one lie under the density whatever the height.
    inside: [u32; LAYERS],
}

impl Ziggurat {
    /// Solves for the base edge whose layers close at zero, by bisection, and fills the tables.
    fn new() -> Self {
        let density = |x: f64| libm::exp(-0.5 * x * x);
        // Area of a layer with base edge r: rectangle and tail.
        let area = |r: f64| {
            r * density(r) + (std::f64::consts::PI / 2.0).sqrt() * libm::erfc(r / std::f64::consts::SQRT_2)
        };
        // Density left to cover above the last layer: negative when r is too small (areas too large).
        let left = |r: f64| {
            let (v, mut x) = (area(r), r);
            for _ in 1..LAYERS - 1 {
                let y = v / x + density(x);
                if y >= 1.0 {
                    return -1.0;
                }
                x = libm::sqrt(-2.0 * libm::log(y));
            }
            1.0 - (v / x + density(x))
        };
        let (mut low, mut high) = (3.0, 4.0);
        for _ in 0..100 {
            let middle = 0.5 * (low + high);
            if left(middle) < 0.0 {
                low = middle;
            } else {
                high = middle;
            }
        }
        let (r, v) = (high, area(high));
        let mut edge = [0.0; LAYERS + 1];
        edge[0] = v / density(r);
        edge[1] = r;
        for i in 2..LAYERS {
            edge[i] = libm::sqrt(-2.0 * libm::log(v / edge[i - 1] + density(edge[i - 1])));
        }
        Self {
            edge,
            density: edge.map(density),
            width: std::array::from_fn(|i| (edge[i] / PLACES) as f32),
            inside: std::array::from_fn(|i| (edge[i + 1] / edge[i] * PLACES) as u32),
        }
    }
}

/// A stream of standard normal deviates.
#[derive(Clone, Debug)]
pub struct Gaussian {
    ziggurat: std::sync::Arc<Ziggurat>,
    rng: ChaCha8Rng,
}

impl Gaussian {
    /// Stream 0 of seed 0; see [`Self::restart`].
    pub fn new() -> Self {
        Self {
            ziggurat: std::sync::Arc::new(Ziggurat::new()),
            rng: ChaCha8Rng::seed_from_u64(0),
        }
    }

    /// Begins stream `stream` of a seed.
    pub fn restart(&mut self, seed: u64, stream: u64) {
        self.rng = ChaCha8Rng::seed_from_u64(seed);
        self.rng.set_stream(stream);
    }

    /// Adds deviates of standard deviation `sigma` to `out`.
    pub fn add_to(&mut self, out: &mut [f32], sigma: f32) {
        let Self { ziggurat, rng } = self;
        for x in out {
            *x += sigma * ziggurat.deviate(rng);
        }
    }
}

impl Default for Gaussian {
    fn default() -> Self {
        Self::new()
    }
}

impl Ziggurat {
    /// One standard normal deviate.
    #[inline]
    fn deviate(&self, rng: &mut ChaCha8Rng) -> f32 {
        let word = rng.next_u32();
        let layer = (word & 255) as usize;
        let place = word >> 9;
        // Bit 8 goes to the sign bit of the float.
        let sign = (word & 256) << 23;
        let size = if place < self.inside[layer] {
            place as f32 * self.width[layer]
        } else {
            self.edge_case(layer, place, rng)
        };
        f32::from_bits(size.to_bits() | sign)
    }

    /// The rest of a draw whose place is not under the density for sure: tail, wedge, or a new draw of the size (the sign
    /// stays, it is independent).
    #[cold]
    fn edge_case(&self, layer: usize, place: u32, rng: &mut ChaCha8Rng) -> f32 {
        let (mut layer, mut place) = (layer, place);
        loop {
            if place < self.inside[layer] {
                return place as f32 * self.width[layer];
            }
            if layer == 0 {
                return self.tail(rng);
            }
            let x = f64::from(place) / PLACES * self.edge[layer];
            let (low, high) = (self.density[layer], self.density[layer + 1]);
            if low + (high - low) * unit(rng) < libm::exp(-0.5 * x * x) {
                return x as f32;
            }
            let word = rng.next_u32();
            (layer, place) = ((word & 255) as usize, word >> 9);
        }
    }

    /// Beyond the base edge (Marsaglia 1964).
    fn tail(&self, rng: &mut ChaCha8Rng) -> f32 {
        let r = self.edge[1];
        loop {
            let x = -libm::log(unit(rng)) / r;
            let y = -libm::log(unit(rng));
            if 2.0 * y > x * x {
                return (r + x) as f32;
            }
        }
    }
}

/// Uniform in (0, 1).
fn unit(rng: &mut ChaCha8Rng) -> f64 {
    (f64::from(rng.next_u32()) + 0.5) / 4_294_967_296.0
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn layers_have_equal_area_and_close_at_the_top() {
        let z = Ziggurat::new();
        let area = z.edge[0] * z.density[1];
        for i in 1..LAYERS {
            let layer = z.edge[i] * (z.density[i + 1] - z.density[i]);
            assert!((layer / area - 1.0).abs() < 1e-9, "layer {i}: {layer} of {area}");
        }
        // The known base edge of 256 layers.
        assert!((z.edge[1] - 3.654_152_885_361_009).abs() < 1e-9, "{}", z.edge[1]);
    }

    #[test]
    fn deviates_follow_the_normal_distribution() {
        let mut gaussian = Gaussian::new();
        gaussian.restart(11, 3);
        let n = 4_000_000;
        let mut x = vec![0.0_f32; n];
        gaussian.add_to(&mut x, 1.0);
        // Counts below a grid of points, tail included, against the distribution: within five standard errors.
        for point in [
            -4.0, -3.7, -3.0, -2.0, -1.0, -0.3, -0.01, 0.0, 0.1, 0.7, 1.5, 2.5, 3.6, 3.8, 4.2,
        ] {
            let p = 0.5 * libm::erfc(-point / std::f64::consts::SQRT_2);
            let below = x.iter().filter(|x| f64::from(**x) < point).count() as f64;
            let error = (below - n as f64 * p) / (n as f64 * p * (1.0 - p)).sqrt();
            assert!(
                error.abs() < 5.0,
                "below {point}: {below}, {error} standard errors"
            );
        }
        // Between the edges of its neighbours a layer is a wedge: of all sizes there, the share in the inner halves.
        let edge = &gaussian.ziggurat.edge;
        let middle = |i: usize| 0.5 * (edge[i] + edge[i + 1]);
        let inside = |x: f64| libm::erf(x / std::f64::consts::SQRT_2);
        let p: f64 = (1..LAYERS).map(|i| inside(middle(i)) - inside(edge[i + 1])).sum();
        let inner = |x: &&f32| {
            let x = f64::from(x.abs());
            // The last edge at or over x.
            let i = edge.partition_point(|e| *e >= x).saturating_sub(1);
            i > 0 && i < LAYERS && x < middle(i)
        };
        let count = x.iter().filter(inner).count() as f64;
        let error = (count - n as f64 * p) / (n as f64 * p * (1.0 - p)).sqrt();
        assert!(
            error.abs() < 5.0,
            "inner halves: {count}, {error} standard errors"
        );
        let fourth: f64 = x.iter().map(|x| f64::from(*x).powi(4)).sum::<f64>() / n as f64;
        assert!((fourth - 3.0).abs() < 5.0 * (96.0 / n as f64).sqrt(), "{fourth}");
        // Neighbours, and the even and odd ones, do not know of each other.
        for lag in [1, 2, 512, 1024] {
            let sum: f64 = x.iter().zip(&x[lag..]).map(|(a, b)| f64::from(a * b)).sum();
            assert!(sum.abs() < 5.0 * (n as f64).sqrt(), "lag {lag}: {sum}");
        }
    }

    #[test]
    fn streams_are_reproducible_and_differ() {
        let mut gaussian = Gaussian::new();
        let mut take = |seed, stream| {
            let mut x = [0.0; 16];
            gaussian.restart(seed, stream);
            gaussian.add_to(&mut x, 1.0);
            x
        };
        let first = take(1, 2);
        assert_eq!(first, take(1, 2));
        assert_ne!(first, take(1, 3));
        assert_ne!(first, take(2, 2));
    }
}
