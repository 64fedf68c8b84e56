//! Diffuse scattering off faces, single bounce (kind S): effective roughness with a directive lobe (Degli-Esposti et al. 2007).
//!
//! What a tile takes of the transmitter's wave depends on the transmitter alone and is found once ([`LitTiles`]). A tile is a path
//! of its own with a fixed phase drawn from seed, face and tile, so that fading over motion follows from the lengths. Weak
//! tiles are gathered, one path a face.

mod lit;

use core::cell::Cell;
use core::f64::consts::TAU;
use std::collections::{BTreeMap, HashMap};

use nalgebra::Complex;

use self::lit::{Lit, hear, light};
use super::Diffuse;
use super::beam::SLACK_M;
use super::path::{Place, TracedPath};
use super::surface::Surfaces;
use super::tiles::{Piece, Tiles};
use crate::paths::{Interaction, Kind};
use crate::random::Stream;
use crate::scene::{Scene, Vec3};

/// Tiles closer than this to either end scatter by their quarters, m.
const NEAR_M: f64 = 10.0;

/// Streams of the seed from here on belong to tiles.
const STREAMS: u64 = 1 << 63;

/// Number of the path that gathers the weak tiles of a face; those that gather the tiles of its blocks count down from it.
const GATHERED: u32 = u32::MAX;

/// Whether a piece that would add less than this to the sum of all, were nothing in the way, is seen is asked of its centre
/// alone; of others, of points all over it.
const FAINT: f64 = 1e-4;

/// A piece that would add more than this is asked everywhere, even where all around it agrees: shadows are thin.
const STRONG: f64 = 5e-4;

/// Less than this part of what would come were nothing in the way comes through gaps.
const GAPS: f64 = 0.03;

impl Lit {
    fn heard(&self, power: f64) -> Heard {
        Heard {
            power,
            face: self.face,
            number: self.piece.number,
            block: self.piece.block,
            point: self.piece.centre,
            length_m: None,
        }
    }
}

/// What the receiver hears of a piece, or of several.
#[derive(Clone, Copy)]
struct Heard {
    power: f64,
    face: u32,
    number: u32,
    block: u32,
    /// Where it scatters, m.
    point: Vec3,
    /// Of several, the mean length of their ways, m.
    length_m: Option<f64>,
}

/// The tiles that a transmitter lights.
#[derive(Debug)]
pub(super) struct LitTiles<'t> {
    tiles: &'t Tiles,
    options: Diffuse,
    lit: Vec<Lit>,
}

impl<'t> LitTiles<'t> {
    pub(super) fn of(
        scene: &Scene,
        tiles: &'t Tiles,
        options: Diffuse,
        tx: &Vec3,
        surfaces: &Surfaces<'_>,
    ) -> Self {
        let mut lit = Vec::new();
        for (index, tile) in tiles.tiles.iter().enumerate() {
            if is_near(&tile.whole, tx) {
                let quarters = tiles.quarters_of(tile).iter();
                lit.extend(quarters.filter_map(|q| light(scene, tx, tile.face, q, surfaces)));
            } else if let Some(whole) = light(scene, tx, tile.face, &tile.whole, surfaces) {
                lit.push(Lit {
                    tile: Some(index as u32),
                    ..whole
                });
            }
        }
        let mut all = Self { tiles, options, lit };
        let eye = Eye::new(scene, tx);
        let seen = all.shares(&all.lit, |_| false, |lit, point| eye.sees(lit.face, point));
        for (lit, seen) in all.lit.iter_mut().zip(seen) {
            lit.seen = seen;
        }
        all.lit.retain(|lit| lit.seen > 0.0);
        all
    }

    /// The scattered paths to a receiver beside others, of which the strongest has a power.
    ///
    /// Half of the places are the strongest tiles'; what is left is gathered block by block, and face by face the weakest.
    pub(super) fn trace(
        &self,
        scene: &Scene,
        tx: &Vec3,
        rx: &Vec3,
        surfaces: &Surfaces<'_>,
        strongest: f64,
    ) -> Vec<TracedPath> {
        let heard = by_power(self.heard(scene, tx, rx, surfaces));
        let strongest = heard
            .first()
            .map_or(strongest, |first| strongest.max(first.power));
        let least = strongest * libm::pow(10.0, -0.1 * self.options.range_db);
        let above = heard.iter().take_while(|h| h.power >= least).count();
        let most = self.options.most_paths;
        let single = above.min(if heard.len() <= most { most } else { most / 2 });
        let (single, weak) = heard.split_at(single);
        let blocks = by_power(gather(weak, tx, rx, |h| (h.face, GATHERED - 1 - h.block)));
        let faces = gather(weak, tx, rx, |h| (h.face, GATHERED)).len();
        let kept = blocks.iter().take_while(|h| h.power >= least).count();
        let (kept, rest) = blocks.split_at(kept.min(most.saturating_sub(single.len() + faces)));
        let rest = by_power(gather(rest, tx, rx, |h| (h.face, GATHERED)));
        let single = single.iter().map(|h| Heard {
            point: self.scatterer(scene, h),
            ..*h
        });
        single
            .chain(kept.iter().chain(&rest).copied())
            .map(|h| self.path(tx, rx, &h))
            .collect()
    }

    /// What every piece adds that both ends see.
    fn heard(&self, scene: &Scene, tx: &Vec3, rx: &Vec3, surfaces: &Surfaces<'_>) -> Vec<Heard> {
        let eyes = [tx, rx].map(|end| Eye::new(scene, end));
        let mut all: Vec<(Lit, f64)> = Vec::with_capacity(self.lit.len());
        for lit in &self.lit {
            if scene.faces()[lit.face as usize].height_m(rx) <= SLACK_M {
                continue;
            }
            let tile = lit.tile.filter(|_| is_near(&lit.piece, rx));
            let Some(tile) = tile.map(|tile| &self.tiles.tiles[tile as usize]) else {
                all.extend(hear(scene, lit, rx).map(|power| (*lit, power)));
                continue;
            };
            for quarter in self.tiles.quarters_of(tile) {
                let Some(mut lit) = light(scene, tx, tile.face, quarter, surfaces) else {
                    continue;
                };
                lit.seen = self.sixteenths(&lit, quarter, &|lit, point| eyes[0].sees(lit.face, point));
                all.extend(hear(scene, &lit, rx).map(|power| (lit, power)));
            }
        }
        let sum = all.iter().map(|(lit, power)| lit.seen * power).sum::<f64>();
        let (strong, weak): (Vec<_>, Vec<_>) = all
            .into_iter()
            .filter(|(lit, _)| lit.seen > 0.0)
            .partition(|(lit, power)| lit.seen * power > FAINT * sum);
        let mut seen = self.look(&eyes, &strong, STRONG * sum);
        let power = |seen: &[Heard]| seen.iter().map(|h| h.power).sum::<f64>();
        // What is heard through gaps alone is looked at closely altogether.
        if power(&seen) < GAPS * sum {
            seen = self.look(&eyes, &strong, 0.0);
        }
        // Those that are faint beside hidden ones may be all that is heard.
        let heard = power(&seen);
        let left: f64 = weak.iter().map(|(lit, power)| lit.seen * power).sum();
        if left > 0.1 * heard {
            seen.extend(self.look(&eyes, &weak, 0.0));
        } else if left > 1e-3 * heard {
            let by_centre = weak
                .iter()
                .filter(|(lit, _)| eyes[1].sees(lit.face, &lit.piece.centre));
            seen.extend(by_centre.map(|(lit, power)| lit.heard(power * lit.seen)));
        }
        seen
    }

    /// What is heard of lit pieces with their powers, shadows taken off; those above a power are looked at closely.
    fn look(&self, [tx, rx]: &[Eye<'_>; 2], pieces: &[(Lit, f64)], close: f64) -> Vec<Heard> {
        let lit: Vec<Lit> = pieces.iter().map(|(lit, _)| *lit).collect();
        let closely = |index: usize| pieces[index].1 > close;
        let shares = self.shares(&lit, closely, |lit, point| {
            // Where the transmitter sees a part, both boundaries may cross it.
            rx.sees(lit.face, point) && (lit.seen >= 1.0 || tx.sees(lit.face, point))
        });
        let heard = pieces.iter().zip(shares).filter(|(_, share)| *share > 0.0);
        heard
            .map(|((lit, power), share)| lit.heard(power * share))
            .collect()
    }

    /// Share of each piece for whose points something holds: asked of the quarters of a tile, and of their quarters where these
    /// or neighbouring tiles disagree, or the piece is one to look at closely.
    fn shares(
        &self,
        lit: &[Lit],
        closely: impl Fn(usize) -> bool,
        holds: impl Fn(&Lit, &Vec3) -> bool,
    ) -> Vec<f64> {
        let quarters_of = |lit: &Lit| {
            let tile = lit.tile.map(|tile| &self.tiles.tiles[tile as usize]);
            tile.map(|tile| self.tiles.quarters_of(tile))
        };
        let mut states: HashMap<(u32, u32), Option<bool>> = HashMap::with_capacity(lit.len());
        let roughly: Vec<Option<bool>> = lit
            .iter()
            .enumerate()
            .map(|(index, lit)| {
                let quarters = quarters_of(lit)?;
                if closely(index) {
                    return None;
                }
                let held = quarters.iter().filter(|q| holds(lit, &q.centre)).count();
                let all = (held == 0 || held == quarters.len()).then_some(held > 0);
                states.insert((lit.face, lit.piece.number), all);
                all
            })
            .collect();
        let share = |(lit, roughly): (&Lit, &Option<bool>)| {
            if let Some(all) = roughly {
                let [number, above] = [lit.piece.number, 5 * self.tiles.columns[lit.face as usize]];
                let around = [
                    number.checked_sub(5),
                    Some(number + 5),
                    number.checked_sub(above),
                    Some(number + above),
                ];
                let disagrees = |number: u32| {
                    states
                        .get(&(lit.face, number))
                        .is_some_and(|other| *other != Some(*all))
                };
                if !around.into_iter().flatten().any(disagrees) {
                    return f64::from(u8::from(*all));
                }
            }
            match quarters_of(lit) {
                None => self.sixteenths(lit, &lit.piece, &holds),
                Some(quarters) => {
                    let held = quarters
                        .iter()
                        .map(|q| q.area_m2 * self.sixteenths(lit, q, &holds));
                    held.sum::<f64>() / lit.piece.area_m2
                }
            }
        };
        lit.iter().zip(&roughly).map(share).collect()
    }

    /// Share of the four parts of a piece of a lit one for whose centres something holds.
    fn sixteenths(&self, lit: &Lit, piece: &Piece, holds: &impl Fn(&Lit, &Vec3) -> bool) -> f64 {
        let [along, across] = self.tiles.axes[lit.face as usize].map(|axis| axis * (0.5 * piece.half_m));
        let points = [along + across, along - across, across - along, -along - across];
        0.25 * points
            .iter()
            .filter(|off| holds(lit, &(piece.centre + *off)))
            .count() as f64
    }

    /// Where in a piece it scatters.
    fn scatterer(&self, scene: &Scene, heard: &Heard) -> Vec3 {
        let face = &scene.faces()[heard.face as usize];
        let mut stream = stream(self.options.seed, heard.face, heard.number);
        // The first number is the phase's. Tiles have numbers that quarters do not have.
        stream.uniform();
        let side_m = if heard.number.is_multiple_of(5) { 0.5 } else { 0.25 } * self.tiles.side_m;
        let jitter_m = [0, 1].map(|_| (stream.uniform() - 0.5) * side_m);
        let [along, across] = self.tiles.axes[heard.face as usize];
        let place = heard.point + along * jitter_m[0] + across * jitter_m[1];
        if face.contains(&place) { place } else { heard.point }
    }

    fn path(&self, tx: &Vec3, rx: &Vec3, heard: &Heard) -> TracedPath {
        let phase = TAU * stream(self.options.seed, heard.face, heard.number).uniform();
        let (sin, cos) = libm::sincos(phase);
        let place = Place {
            point: heard.point,
            face: Some(heard.face),
        };
        let mut path = TracedPath::through(
            Kind::of(&[Interaction::Scattering]).unwrap_or(Kind::reflections(1)),
            tx,
            core::iter::once(place),
            rx,
            Complex::new(cos, sin) * heard.power.sqrt(),
        );
        path.length_m = heard.length_m.unwrap_or(path.length_m);
        path
    }
}

/// Strongest first; of equal strength, by face and number.
fn by_power(mut heard: Vec<Heard>) -> Vec<Heard> {
    heard.sort_by(|a, b| {
        let weaker = b.power.total_cmp(&a.power);
        weaker.then((a.face, a.number).cmp(&(b.face, b.number)))
    });
    heard
}

/// All of equal key (face, number) as one: their power, at its centre, with its mean length.
fn gather(heard: &[Heard], tx: &Vec3, rx: &Vec3, key: impl Fn(&Heard) -> (u32, u32)) -> Vec<Heard> {
    let mut sums: BTreeMap<(u32, u32), (f64, Vec3, f64)> = BTreeMap::new();
    for one in heard {
        let length_m = one
            .length_m
            .unwrap_or_else(|| (one.point - tx).norm() + (one.point - rx).norm());
        let (power, moment, length) = sums.entry(key(one)).or_insert((0.0, Vec3::zeros(), 0.0));
        *power += one.power;
        *moment += one.point * one.power;
        *length += length_m * one.power;
    }
    let heard = |((face, number), (power, moment, length)): ((u32, u32), (f64, Vec3, f64))| Heard {
        power,
        face,
        number,
        block: 0,
        point: moment / power,
        length_m: Some(length / power),
    };
    sums.into_iter()
        .filter(|(_, sum)| sum.0 > 0.0)
        .map(heard)
        .collect()
}

/// An end that looks at points of faces.
struct Eye<'s> {
    scene: &'s Scene,
    at: Vec3,
    /// What stood in the way of the last point that was not seen: often it hides the next one too. It changes no answer.
    last: Cell<Option<u32>>,
}

impl<'s> Eye<'s> {
    fn new(scene: &'s Scene, at: &Vec3) -> Self {
        Self {
            scene,
            at: *at,
            last: Cell::new(None),
        }
    }

    /// Whether it sees a point of a face.
    fn sees(&self, face: u32, point: &Vec3) -> bool {
        let hides = |last: u32| last != face && self.scene.blocked_by(last, *point, self.at);
        if self.last.get().is_some_and(hides) {
            return false;
        }
        let hiding = self.scene.find_crossed(*point, self.at, |other| other != face);
        if hiding.is_some() {
            self.last.set(hiding);
        }
        hiding.is_none()
    }
}

/// The random numbers of a piece: its phase, then where in it it scatters.
fn stream(seed: u64, face: u32, number: u32) -> Stream {
    Stream::new(seed, STREAMS | u64::from(face) << 32 | u64::from(number))
}

fn is_near(piece: &Piece, end: &Vec3) -> bool {
    (piece.centre - end).norm_squared() < NEAR_M * NEAR_M
}

#[cfg(test)]
mod tests;
