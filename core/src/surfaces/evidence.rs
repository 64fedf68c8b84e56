//! Evidence for a surface, counted in the transmitter's motion.
//!
//! While the transmitter stands, the source of any path stands, whatever chain of surfaces it met, and with it every plane that the
//! path suggests: ten sweeps are one observation. When the transmitter moves by `delta`, the source of any chain of planes moves
//! by `delta` as well (reflections change no length), but where to is told by the chain. So there is one likelihood ratio for each
//! position of the transmitter:
//!
//! - what the network says of the path, in the mean over the position's sweeps: one observation, worth the whole of it once the
//!   transmitter, or the point of the reflection as the UAV flies on, has been [`SurfaceConfig::independent_m`] away. So a
//!   transmitter that stands for a whole flight proves a surface as far as one opinion does, formed from many places;
//! - that the source went where the surface says ([`displacement_log_ratio`]). Three parallel walls are one plane to every
//!   position, so displacements say no more than how rare such chains are ([`SurfaceConfig::indistinct_share`]).

use super::SurfaceConfig;
use crate::geometry::Vector3;

/// Logarithm of a likelihood beside which one is nothing, in single precision.
/// Numerical: rounding.
const BEYOND: f32 = 40.0;

/// Log-odds of a surface from paths, position by position of the transmitter.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Evidence {
    /// Where the transmitter was when the last position was closed, and where on the surface the path was reflected then, m. None
    /// before anything was seen.
    anchors_m: Option<[Vector3<f32>; 2]>,
    /// Furthest that either has been from there, m.
    furthest_m: f32,
    /// What was counted so far of the position in hand, and of all displacements.
    counted: f32,
    /// Log ratios of displacements, of single reflections and of chains: of the positions before, and of the one in hand.
    displaced: [f32; 2],
    displacing: [f32; 2],
    /// Mean log ratio of the network over the sweeps of this position, and how many they are.
    network: f32,
    sweeps: u16,
    /// Sweep of the last path that it explained.
    pub last_sweep: u32,
}

/// One path that a surface explained.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Sighting {
    /// Where the transmitter is, m.
    pub transmitter_m: Vector3<f32>,
    /// Whether the surface made the path alone, and not a chain that it is one of.
    pub alone: bool,
    /// Log ratio of what the network says: that the path is of this order, to that it is not.
    pub network_log_ratio: f32,
    /// Standard deviation of the source's place, m, the larger one of along and across the way.
    pub source_sigma_m: f32,
    /// Normalised innovation squared of delay and arrival.
    pub chi_square: f32,
    /// Number of the sweep.
    pub sweep: u32,
}

/// `log (1 + sqrt(2 pi) delta / sigma exp(-chi2 / 2))`: how much likelier the source's place is when the surface is there than when another
/// chain made the path, the transmitter having moved by `delta`. The other chain's source is anywhere on the circle of that
/// radius (walls are upright), a density of `1 / (2 pi delta)` along it; the surface's is where the innovation says, a Gaussian of `sigma`. The 1 is
/// what a transmitter that stands says: nothing.
#[must_use]
pub fn displacement_log_ratio(moved_m: f32, source_sigma_m: f32, chi_square: f32) -> f32 {
    /// `sqrt(2 pi)`.
    /// Given: mathematics.
    const ROOT_TWO_PI: f32 = 2.506_628_3;
    let sigma_m = source_sigma_m.max(f32::MIN_POSITIVE);
    libm::log1pf((ROOT_TWO_PI * moved_m / sigma_m).min(1e6) * libm::expf(-0.5 * chi_square))
}

impl Evidence {
    /// Of a surface that was born with the transmitter there, of a path that was reflected at this point.
    #[must_use]
    pub fn begun(transmitter_m: &Vector3<f32>, point_m: &Vector3<f32>) -> Self {
        Self {
            anchors_m: Some([*transmitter_m, *point_m]),
            ..Self::default()
        }
    }

    /// What all displacements together say. They cannot tell a surface from chains whose image moves just as its own does, however many
    /// they are: `log (L / (1 - share + share L))`.
    fn displaced_log_odds(&self, config: &SurfaceConfig) -> f32 {
        let share = config.indistinct_share;
        let of = |(closed, open): (f32, f32)| {
            let log = closed + open;
            // `L` may be beyond any number; then the limit is reached.
            if log > BEYOND {
                -libm::logf(share)
            } else {
                log - libm::logf(1.0 - share + share * libm::expf(log))
            }
        };
        self.displaced.into_iter().zip(self.displacing).map(of).sum()
    }

    /// Takes in a path that the surface explained, reflected off it at `point_m`: by how much its log-odds change.
    pub fn take(&mut self, seen: &Sighting, point_m: &Vector3<f32>, config: &SurfaceConfig) -> f32 {
        self.last_sweep = seen.sweep;
        self.sweeps = self.sweeps.saturating_add(1);
        self.network += (seen.network_log_ratio - self.network) / f32::from(self.sweeps);
        let [transmitter_m, anchor_point_m] = *self.anchors_m.get_or_insert([seen.transmitter_m, *point_m]);
        let moved_m = (seen.transmitter_m - transmitter_m).norm();
        let along_m = (point_m - anchor_point_m).norm();
        self.furthest_m = self.furthest_m.max(moved_m).max(along_m);
        let independent = (self.furthest_m / config.independent_m).min(1.0);
        let ratio = displacement_log_ratio(moved_m, seen.source_sigma_m, seen.chi_square);
        let [alone, chain] = &mut self.displacing;
        *if seen.alone { alone } else { chain } = ratio;
        let displaced = self.displaced_log_odds(config);
        let worth = independent * self.network + displaced;
        let change = worth - self.counted;
        self.counted = worth;
        if moved_m >= config.independent_m {
            let [closed, open] = [self.displaced, self.displacing];
            let mut displaced_now = [0.0; 2];
            for ((sum, closed), open) in displaced_now.iter_mut().zip(closed).zip(open) {
                *sum = closed + open;
            }
            *self = Self {
                last_sweep: seen.sweep,
                displaced: displaced_now,
                counted: displaced,
                ..Self::begun(&seen.transmitter_m, point_m)
            };
        }
        change
    }
}

#[cfg(test)]
mod tests {
    extern crate std;
    use std::vec::Vec;

    use super::*;

    fn seen(x_m: f32, network_log_ratio: f32) -> Sighting {
        Sighting {
            transmitter_m: Vector3::new(x_m, 0.0, 0.0),
            alone: true,
            network_log_ratio,
            source_sigma_m: 0.15,
            chi_square: 2.0,
            sweep: 7,
        }
    }

    fn at_origin() -> Evidence {
        Evidence::begun(&Vector3::zeros(), &Vector3::zeros())
    }

    fn all(places_m: impl Iterator<Item = f32>, network: f32) -> f32 {
        let config = SurfaceConfig::default();
        let mut evidence = at_origin();
        places_m
            .map(|x| evidence.take(&seen(x, network), &Vector3::zeros(), &config))
            .sum()
    }

    #[test]
    fn a_transmitter_that_stands_is_one_observation() {
        let config = SurfaceConfig::default();
        let mut evidence = at_origin();
        let along = |x: u16| Vector3::new(f32::from(x) * 0.5, 0.0, 0.0);
        let worth: Vec<f32> = (0..20)
            .scan(0.0, |sum, k| {
                *sum += evidence.take(&seen(0.0, 3.4), &along(k), &config);
                Some(*sum)
            })
            .collect();
        // Nothing while the wave meets the same place of the surface, and never more than one opinion.
        assert!(
            worth[0].abs() < 1e-6 && (worth[1] - 1.7).abs() < 1e-3,
            "{worth:?}"
        );
        assert!(worth[2..].iter().all(|sum| (sum - 3.4).abs() < 1e-3), "{worth:?}");
    }

    #[test]
    fn a_way_there_and_back_keeps_its_worth() {
        let config = SurfaceConfig::default();
        let at = |x: f32| Vector3::new(x, 0.0, 0.0);
        let mut evidence = Evidence::begun(&at(0.0), &at(0.0));
        let worth = [0.0, 0.5, 1.0, 0.5, 0.0].map(|x| evidence.take(&seen(0.0, 3.4), &at(x), &config));
        assert!((worth.iter().sum::<f32>() - 3.4).abs() < 1e-3, "{worth:?}");
        assert!(worth.iter().all(|change| *change > -1e-3), "{worth:?}");
    }

    #[test]
    fn where_a_surface_is_first_seen_is_where_its_evidence_begins() {
        let config = SurfaceConfig::default();
        let point_m = Vector3::new(70.0, 0.0, 0.0);
        let first = Evidence::default().take(&seen(50.0, 3.4), &point_m, &config);
        assert!(first.abs() < 1e-6, "{first}");
    }

    #[test]
    fn neither_moving_nor_seen_elsewhere_proves_nothing() {
        assert!(all((0..100).map(|_| 0.0), 3.4).abs() < 1e-5);
        let [once, often] = [1, 100].map(|sweeps| all((0..sweeps).map(|_| 0.3), 2.0));
        assert!(once > 0.5 && (once - often).abs() < 1e-3, "{once} {often}");
    }

    #[test]
    fn evidence_is_counted_by_metres_and_not_by_sweeps() {
        let [slow, fast] = [100_u16, 10].map(|sweeps| {
            let step = 2.001 / f32::from(sweeps);
            all((1..=sweeps).map(|k| f32::from(k) * step), 2.0)
        });
        assert!((slow / fast - 1.0).abs() < 0.15, "{slow} {fast}");
        let metre = all([1.001].into_iter(), 2.0);
        assert!((fast / (2.0 * metre) - 1.0).abs() < 0.15, "{fast} {metre}");
    }

    #[test]
    fn a_network_that_says_otherwise_takes_odds_away() {
        assert!(all([1.0].into_iter(), -3.4) < 0.0);
        assert!(
            all([1.0].into_iter(), 0.0) > 0.0,
            "the source went where it should"
        );
    }

    #[test]
    fn displacements_alone_tell_a_wall_from_no_three_parallel_ones() {
        let config = SurfaceConfig::default();
        let after = |alone: bool, network: f32| {
            let mut evidence = at_origin();
            let path = |k: u16| Sighting {
                alone,
                ..seen(f32::from(k) * 0.3, network)
            };
            (1..200)
                .map(|k| evidence.take(&path(k), &Vector3::zeros(), &config))
                .sum::<f32>()
        };
        let [single, chain] = [true, false].map(|alone| after(alone, 0.0));
        let most = -libm::logf(config.indistinct_share);
        assert!((single - most).abs() < 1e-3, "{single}");
        assert!((chain - most).abs() < 1e-3, "{chain}");
        // What the network says is counted metre by metre, whatever the displacements say.
        assert!(after(true, -1.0) < -40.0);
    }

    #[test]
    fn a_source_that_is_known_better_tells_more() {
        let at = |sigma_m, chi2| displacement_log_ratio(0.25, sigma_m, chi2);
        assert!(at(0.05, 1.0) > at(0.2, 1.0) && at(0.05, 1.0) > at(0.05, 9.0));
        assert!(at(0.05, 1.0) < libm::logf(1.0 + 2.51 * 5.0));
        assert_eq!(displacement_log_ratio(0.0, 0.1, 0.0), 0.0);
    }
}
