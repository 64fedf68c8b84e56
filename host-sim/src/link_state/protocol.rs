//! The paper's data set protocol: a grid of receivers around transmitters on the ground, every link traced.
//!
//! Receivers stand at the centres of a horizontal grid and at every step of height, outside buildings: 120 x 120 x 20 of
//! them at 1 m over the outdoor scene. Each with each transmitter is a link with a number of its own, and a seed says which
//! of them are taken and of which material the world is for it. So a link comes out the same in whatever piece of the set
//! it is made, and on however many threads.

use rayon::prelude::*;
use serde::{Deserialize, Serialize};

use super::links::Links;
use crate::random::Stream;
use crate::scene::{Material, Scene};
use crate::tracer::{DEFAULT_MAX_ORDER, TracedPath, Tracer};

/// Which set: each has transmitters of its own.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize, clap::ValueEnum)]
#[serde(rename_all = "lowercase")]
pub enum SetName {
    /// 100 transmitters in the paper
    Train,
    /// 50 other transmitters in the same scene
    Validation,
    /// Transmitters for figures that nothing was fitted to
    Test,
}

impl SetName {
    /// Transmitters of the paper's protocol.
    pub fn transmitters(self) -> usize {
        match self {
            Self::Train => 100,
            Self::Validation | Self::Test => 50,
        }
    }
}

/// How a data set is made. Written beside its shards.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Protocol {
    /// Scene as after `--scene`.
    pub scene: String,
    /// Which set.
    pub set: SetName,
    /// Number of transmitters.
    pub transmitters: usize,
    /// Grid step, m.
    pub step_m: f64,
    /// Share of all links that are taken, above 0 and up to 1.
    pub rate: f64,
    /// Least and greatest relative permittivity, drawn anew for every link; the scene's own when absent.
    pub permittivity: Option<[f64; 2]>,
    /// Seed of transmitters, sampling and materials.
    pub seed: u64,
}

/// Heights of transmitters above the lowest point of the scene, m.
const TX_HEIGHT_M: [f64; 2] = [1.0, 2.0];
/// Free space that a transmitter and a receiver need around them, m: to the sides, and up and down.
const TX_CLEARANCE_M: f64 = 0.5;
const RX_CLEARANCE_M: f64 = 0.1;
/// Tries for a free place before the scene counts as full.
const TRIES: usize = 100_000;
/// Streams: links have their number with the set above it; transmitters have this bit more.
const SET_SHIFT: u32 = 48;
const TRANSMITTERS_STREAM: u64 = 1 << 63;
/// Links traced before the count of progress goes on.
const BATCH: usize = 4096;

/// A protocol with its scene, ready to make links.
#[derive(Debug)]
pub struct Source<'s> {
    protocol: &'s Protocol,
    tracer: Tracer<'s>,
    transmitters_m: Vec<[f64; 3]>,
    grid: Grid,
    free: Vec<bool>,
}

/// Receivers of a box, x running fastest, then y, then height.
#[derive(Clone, Copy, Debug)]
struct Grid {
    origin_m: [f64; 3],
    step_m: f64,
    counts: [usize; 3],
}

impl Grid {
    fn over(scene: &Scene, step_m: f64) -> Self {
        let bounds = scene.bounds();
        let count = |k: usize| ((bounds.max_m[k] - bounds.min_m[k]) / step_m + 1e-9).floor() as usize;
        Self {
            origin_m: bounds.min_m,
            step_m,
            counts: [count(0), count(1), count(2)],
        }
    }

    fn len(&self) -> usize {
        self.counts.iter().product()
    }

    fn point_m(&self, index: usize) -> [f64; 3] {
        let [nx, ny, _] = self.counts;
        let cell = [index % nx, index / nx % ny, index / (nx * ny)];
        let offset = [0.5, 0.5, 1.0];
        [0, 1, 2].map(|k| self.origin_m[k] + self.step_m * (cell[k] as f64 + offset[k]))
    }
}

impl<'s> Source<'s> {
    /// Places transmitters and receivers.
    ///
    /// # Errors
    /// What is wrong with the protocol, in words.
    pub fn new(protocol: &'s Protocol, scene: &'s Scene) -> Result<Self, String> {
        let Protocol {
            transmitters,
            step_m,
            rate,
            permittivity,
            ..
        } = protocol;
        if !(*rate > 0.0 && *rate <= 1.0) {
            return Err(format!("rate must be above 0 and up to 1, not {rate}"));
        }
        if !(0.05..=100.0).contains(step_m) {
            return Err(format!("grid step must be 0.05 to 100 m, not {step_m}"));
        }
        if !(1..=10_000).contains(transmitters) {
            return Err(format!("expected 1 to 10000 transmitters, not {transmitters}"));
        }
        if let Some([least, most]) = permittivity
            && !(*least >= 1.0 && least <= most && most.is_finite())
        {
            return Err(format!(
                "permittivity must be a range from 1 up, not {least} to {most}"
            ));
        }
        let grid = Grid::over(scene, *step_m);
        let free: Vec<bool> = (0..grid.len())
            .into_par_iter()
            .map(|i| is_clear(scene, grid.point_m(i)))
            .collect();
        if !free.contains(&true) {
            return Err(format!("the scene has no free place on a grid of {step_m} m"));
        }
        Ok(Self {
            protocol,
            tracer: Tracer::new(scene, DEFAULT_MAX_ORDER).ok_or("order out of range")?,
            transmitters_m: place(scene, protocol).ok_or("the scene has no room for transmitters")?,
            grid,
            free,
        })
    }

    /// Number of links at a rate of 1, those from inside buildings included: the numbers of links lie below.
    pub fn all_links(&self) -> u64 {
        (self.transmitters_m.len() * self.grid.len()) as u64
    }

    /// Transmitter positions, m.
    pub fn transmitters_m(&self) -> &[[f64; 3]] {
        &self.transmitters_m
    }

    /// Traces those links of a range of numbers that are free and taken, in order. `progress` hears how far the range has
    /// been gone through.
    pub fn links(&self, range: std::ops::Range<u64>, progress: impl Fn(u64)) -> Links {
        let mut links = Links::default();
        let receivers = self.grid.len() as u64;
        let mut at = range.start;
        while at < range.end.min(self.all_links()) {
            let tx = at / receivers;
            let Some(&tx_m) = self.transmitters_m.get(tx as usize) else {
                break;
            };
            let end = range.end.min((tx + 1) * receivers);
            let tree = self.tracer.transmitter(tx_m);
            while at < end {
                let next = end.min(at + (BATCH as f64 / self.protocol.rate) as u64);
                let traced: Vec<(u64, [f64; 3], f64, Vec<TracedPath>)> = (at..next)
                    .into_par_iter()
                    .filter_map(|index| {
                        let receiver = (index % receivers) as usize;
                        if !self.free[receiver] {
                            return None;
                        }
                        let material = self.drawn(index)?;
                        let rx_m = self.grid.point_m(receiver);
                        let paths = tree.trace_with(rx_m, &material);
                        Some((index, rx_m, material.relative_permittivity(), paths))
                    })
                    .collect();
                for (index, rx_m, permittivity, paths) in &traced {
                    links.push(*index, tx_m, *rx_m, *permittivity, paths);
                }
                progress(next - at);
                at = next;
            }
        }
        links
    }

    /// The material of a link, or `None` when it is not taken.
    fn drawn(&self, index: u64) -> Option<Material> {
        let scene = self.tracer.scene().material();
        if self.protocol.rate >= 1.0 && self.protocol.permittivity.is_none() {
            return Some(*scene);
        }
        let mut stream = Stream::new(
            self.protocol.seed,
            (self.protocol.set as u64) << SET_SHIFT | index,
        );
        // The same links are taken at a lower rate as at a higher one, and fewer.
        if stream.uniform() >= self.protocol.rate {
            return None;
        }
        match self.protocol.permittivity {
            Some([least, most]) => {
                let permittivity = least + (most - least) * stream.uniform();
                Material::new(permittivity, scene.conductivity_s_per_m())
            }
            None => Some(*scene),
        }
    }
}

fn is_clear(scene: &Scene, at: [f64; 3]) -> bool {
    let [x, y, z] = at;
    let (below, above) = ([x, y, z - RX_CLEARANCE_M], [x, y, z + RX_CLEARANCE_M]);
    scene.is_free(at) && !scene.blocked(below, above)
}

/// Draws transmitters where they have room.
fn place(scene: &Scene, protocol: &Protocol) -> Option<Vec<[f64; 3]>> {
    let mut stream = Stream::new(
        protocol.seed,
        TRANSMITTERS_STREAM | (protocol.set as u64) << SET_SHIFT,
    );
    let bounds = scene.bounds();
    let mut between = |low: f64, high: f64| low + (high - low) * stream.uniform();
    let mut places = Vec::with_capacity(protocol.transmitters);
    for _ in 0..TRIES {
        let at @ [x, y, z] = [
            between(bounds.min_m[0], bounds.max_m[0]),
            between(bounds.min_m[1], bounds.max_m[1]),
            bounds.min_m[2] + between(TX_HEIGHT_M[0], TX_HEIGHT_M[1]),
        ];
        let beside = |dx: f64, dy: f64| scene.blocked(at, [x + dx, y + dy, z]);
        let c = TX_CLEARANCE_M;
        let crowded = beside(c, 0.0) || beside(-c, 0.0) || beside(0.0, c) || beside(0.0, -c);
        if scene.is_free(at) && !crowded {
            places.push(at);
        }
        if places.len() == protocol.transmitters {
            return Some(places);
        }
    }
    None
}

#[cfg(test)]
mod tests;
