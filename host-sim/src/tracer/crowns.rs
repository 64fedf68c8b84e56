//! Trees between the ends of a link: trunks block, crowns weaken after Weissberger, fade and scatter.
//!
//! Over d metres of crowns a wave loses `0.45 f^0.284 d` dB to 14 m and `1.33 f^0.284 d^0.588` dB beyond, f in GHz, in leaf
//! (Weissberger's modified exponential decay). What passes fades as Rice with K = 3 dB through a whole crown, slowly; what it has lost
//! a crown scatters alike to all sides. Twigs that move in the wind are waves of drawn frequencies: a function of time and place.

use core::f64::consts::{PI, TAU};

use nalgebra::Complex;

use super::LEAST_DISTANCE_M;
use super::field::dipole;
use super::path::{Place, TracedPath};
use super::tree::ImageTree;
use crate::paths::{Interaction, Kind};
use crate::random::Stream;
use crate::scene::Vec3;
use crate::vegetation::Tree;
use cslam_core::constants::SPEED_OF_LIGHT_M_PER_S;

/// Share of the power that scatters behind a deep crown: K = 3 dB.
const SCATTERED: f64 = 1.0 / 3.0;
/// Standard deviation of the frequencies of twigs, Hz.
const TWIGS_HZ: f64 = 5.0;
/// Over so many metres of a crown the fading changes.
const GRAIN_M: f64 = 0.5;
/// Waves that a crown's twigs are made of.
const WAVES: usize = 12;
/// S of a crown.
const COEFFICIENT: f64 = 0.6;
/// Crowns that scatter less are not heard, gain between vertical half-wave dipoles, dB.
const LEAST_GAIN_DB: f64 = -165.0;
/// Streams of the seed from here on belong to trees.
const STREAMS: u64 = 3 << 62;

/// Loss over so many metres of crowns, dB.
pub(super) fn loss_db(depth_m: f64, frequency_hz: f64) -> f64 {
    let of_frequency = libm::pow(1e-9 * frequency_hz, 0.284);
    if depth_m < 14.0 {
        0.45 * of_frequency * depth_m
    } else {
        1.33 * of_frequency * libm::pow(depth_m, 0.588)
    }
}

/// The twigs of a crown: a complex Gaussian of unit power in time and place.
#[derive(Debug)]
struct Twigs {
    /// Frequency, Hz, wave vector, rad/m, and phase, rad.
    waves: [(f64, Vec3, f64); WAVES],
}

impl Twigs {
    fn of(seed: u64, number: usize) -> Self {
        let mut stream = Stream::new(seed, STREAMS | number as u64);
        let wave = |_| {
            let frequency_hz = TWIGS_HZ * stream.normal();
            let mut component = || stream.normal() / GRAIN_M;
            let vector = Vec3::new(component(), component(), component());
            (frequency_hz, vector, TAU * stream.uniform())
        };
        Self {
            waves: core::array::from_fn(wave),
        }
    }

    fn at(&self, time_s: f64, place: &Vec3) -> Complex<f64> {
        let wave = |(frequency_hz, vector, phase): &(f64, Vec3, f64)| {
            let turns = frequency_hz * time_s;
            let (sin, cos) = libm::sincos(TAU * (turns - turns.floor()) + vector.dot(place) + phase);
            Complex::new(cos, sin)
        };
        let sum: Complex<f64> = self.waves.iter().map(wave).sum();
        sum / (WAVES as f64).sqrt()
    }
}

/// Trees between the ends of a link, at one instant.
#[derive(Debug)]
pub struct Crowns<'t> {
    trees: &'t [Tree],
    twigs: Vec<Twigs>,
    frequency_hz: f64,
    time_s: f64,
}

impl<'t> Crowns<'t> {
    /// Trees at a carrier frequency and a time; the seed moves their twigs.
    pub fn new(trees: &'t [Tree], frequency_hz: f64, time_s: f64, seed: u64) -> Self {
        Self {
            trees,
            twigs: (0..trees.len()).map(|number| Twigs::of(seed, number)).collect(),
            frequency_hz,
            time_s,
        }
    }

    /// Appends what crowns scatter to a receiver, single bounce: kind S.
    pub fn scatter(&self, tree: &ImageTree<'_>, rx_m: [f64; 3], paths: &mut Vec<TracedPath>) {
        let (tx, rx) = (Vec3::from(tree.transmitter_m()), Vec3::from(rx_m));
        let Some(kind) = Kind::of(&[Interaction::Scattering]) else {
            return;
        };
        for (number, crown) in self.trees.iter().enumerate() {
            let middle = crown.crown_m();
            let ways = [middle - tx, rx - middle];
            let lengths_m = ways.map(|way| way.norm());
            if lengths_m.iter().any(|length_m| *length_m < LEAST_DISTANCE_M)
                || tree.scene().blocked(tx.into(), middle.into())
                || tree.scene().blocked(middle.into(), rx_m)
            {
                continue;
            }
            let lost = 1.0 - libm::exp10(-0.1 * loss_db(crown.width_m, self.frequency_hz));
            let silhouette_m2 = 0.25 * PI * crown.width_m * crown.width_m;
            let [out, back] = [ways[0] / lengths_m[0], ways[1] / lengths_m[1]];
            let amplitude = SPEED_OF_LIGHT_M_PER_S / self.frequency_hz / (4.0 * PI)
                * (dipole(&out) * dipole(&back))
                * COEFFICIENT
                * (lost * silhouette_m2 / (4.0 * PI)).sqrt()
                / (lengths_m[0] * lengths_m[1]);
            if amplitude < libm::exp10(LEAST_GAIN_DB / 20.0) {
                continue;
            }
            let gain = self.twigs[number].at(self.time_s, &middle) * amplitude;
            let place = Place {
                point: middle,
                face: None,
            };
            paths.push(TracedPath::through(kind, &tx, core::iter::once(place), &rx, gain));
        }
        paths.sort_by(TracedPath::by_strength);
    }

    /// Takes from paths what trees take: all behind trunks, a part behind crowns.
    pub fn weaken(&self, tree: &ImageTree<'_>, rx_m: [f64; 3], paths: &mut Vec<TracedPath>) {
        let (tx, rx) = (Vec3::from(tree.transmitter_m()), Vec3::from(rx_m));
        paths.retain_mut(|path| match self.factor(path, &tx, &rx) {
            None => false,
            Some(factor) => {
                if factor != Complex::new(1.0, 0.0) {
                    path.weaken(factor);
                }
                true
            }
        });
        paths.sort_by(TracedPath::by_strength);
    }

    /// What is left of a path's amplitude; `None` behind a trunk.
    fn factor(&self, path: &TracedPath, tx: &Vec3, rx: &Vec3) -> Option<Complex<f64>> {
        let (mut from, mut depth_m) = (*tx, 0.0);
        let mut twigs = Complex::new(0.0, 0.0);
        let stops = path.vertices().iter().map(|vertex| Vec3::from(*vertex));
        for to in stops.chain([*rx]) {
            for (number, tree) in self.trees.iter().enumerate() {
                // What a crown scatters comes out of it.
                let own = tree.crown_m();
                if from == own || to == own {
                    continue;
                }
                if tree.blocks(&from, &to) {
                    return None;
                }
                let here_m = tree.depth_m(&from, &to);
                if here_m > 0.0 {
                    let way = to - from;
                    let along = way * ((own - from).dot(&way) / way.norm_squared());
                    twigs += self.twigs[number].at(self.time_s, &(from + along)) * here_m;
                    depth_m += here_m;
                }
            }
            from = to;
        }
        if depth_m <= 0.0 {
            return Some(Complex::new(1.0, 0.0));
        }
        let left = libm::exp10(-0.1 * loss_db(depth_m, self.frequency_hz));
        let scattered = SCATTERED * (1.0 - left);
        let fading = Complex::new((1.0 - scattered).sqrt(), 0.0) + twigs * (scattered.sqrt() / depth_m);
        Some(fading * left.sqrt())
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::scene::Scene;
    use crate::tracer::Tracer;

    const TREE: Tree = Tree {
        foot_m: Vec3::new(60.0, 60.0, 0.0),
        width_m: 6.0,
    };

    #[test]
    fn the_loss_is_weissbergers() {
        // By hand at 30 GHz, where f^0.284 is 2.6275.
        for (depth_m, expected_db) in [
            (0.0, 0.0),
            (1.0, 1.182),
            (5.0, 5.912),
            (10.0, 11.824),
            (14.0, 16.49),
            (40.0, 30.58),
        ] {
            let loss_db = loss_db(depth_m, 30e9);
            assert!((loss_db - expected_db).abs() < 0.01, "{depth_m} m: {loss_db}");
        }
    }

    /// A link through the crown, so far off its middle, at a time: gain over that without trees.
    fn passed(aside_m: f64, time_s: f64, seed: u64, trees: &[Tree]) -> Complex<f64> {
        // Over the roofs of nothing: the ground alone.
        let scene = Scene::load("street").unwrap();
        let tracer = Tracer::new(&scene, 0).unwrap();
        let tree = tracer.transmitter([40.0, 20.0, 5.5]);
        let rx_m = [80.0, 20.0, 5.5];
        let trees: Vec<Tree> = trees
            .iter()
            .map(|tree| Tree {
                foot_m: Vec3::new(60.0, 20.0 + aside_m, 0.0),
                ..*tree
            })
            .collect();
        let bare = tree.trace(rx_m);
        let mut paths = bare.clone();
        Crowns::new(&trees, 30e9, time_s, seed).weaken(&tree, rx_m, &mut paths);
        assert_eq!((paths.len(), bare.len()), (1, 1));
        paths[0].gain / bare[0].gain
    }

    #[test]
    fn behind_a_crown_the_mean_is_the_loss_and_it_fades_slowly_beside_it_nothing() {
        let powers: Vec<f64> = (0..3000)
            .map(|seed| passed(0.0, 3.7, seed, &[TREE]).norm_sqr())
            .collect();
        let mean = powers.iter().sum::<f64>() / powers.len() as f64;
        let loss_db = loss_db(6.0, 30e9);
        assert!(
            (-10.0 * libm::log10(mean) - loss_db).abs() < 0.15,
            "{mean} {loss_db}"
        );
        // Of Rice's power the variance is (1 + 2 K)/(1 + K)^2 of the square of the mean.
        let spread = powers.iter().map(|p| (p / mean - 1.0).powi(2)).sum::<f64>() / powers.len() as f64;
        let share = SCATTERED * (1.0 - libm::exp10(-0.1 * loss_db));
        let rice = share * (2.0 - share);
        assert!((spread / rice - 1.0).abs() < 0.1, "{spread} {rice}");
        let at = |time_s: f64| passed(0.0, time_s, 4, &[TREE]);
        let [now, soon, later] = [1.0, 1.0005, 1.5].map(at);
        assert!((soon - now).norm() < 0.05 * now.norm() && (later - now).norm() > 0.1 * now.norm());
        assert_eq!(at(1.0), now);
        assert_eq!(passed(3.01, 1.0, 4, &[TREE]), Complex::new(1.0, 0.0));
        assert_eq!(passed(0.0, 1.0, 4, &[]), Complex::new(1.0, 0.0));
    }

    #[test]
    fn a_crown_scatters_what_it_took_of_the_wave() {
        let scene = Scene::load("street").unwrap();
        let tracer = Tracer::new(&scene, 0).unwrap();
        let tree = tracer.transmitter([40.0, 20.0, 5.5]);
        let rx_m = [80.0, 20.0, 5.5];
        let planted = [Tree {
            foot_m: Vec3::new(60.0, 20.0, 0.0),
            ..TREE
        }];
        let power = |seed: u64| {
            let mut paths = Vec::new();
            Crowns::new(&planted, 30e9, 2.0, seed).scatter(&tree, rx_m, &mut paths);
            assert_eq!((paths.len(), paths[0].kind().to_string()), (1, "S".to_owned()));
            assert!((paths[0].length_m() - 40.0).abs() < 1e-9);
            // Its own crown takes nothing more of it.
            let before = paths[0].gain;
            Crowns::new(&planted, 30e9, 2.0, seed).weaken(&tree, rx_m, &mut paths);
            assert_eq!(paths[0].gain, before);
            before.norm_sqr()
        };
        let mean = (0..2000).map(power).sum::<f64>() / 2000.0;
        // By hand: 30 dB of a square metre is the flux at 20 m over the sphere; 28.27 m^2, 80.5 % of it lost, 0.36 scattered.
        let wavelength_m = SPEED_OF_LIGHT_M_PER_S / 30e9;
        let flux_w = 1.643 * 28.274 / (4.0 * PI * 400.0);
        let expected =
            flux_w * 0.8047 * 0.36 / (4.0 * PI * 400.0) * wavelength_m * wavelength_m * 1.643 / (4.0 * PI);
        assert!((mean / expected - 1.0).abs() < 0.1, "{mean} {expected}");
    }
}
