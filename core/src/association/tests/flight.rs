//! A flight through a street of five façades and the ground: every path up to three reflections that the façades let through, a network that is
//! wrong one time in ten, and a store that begins with nothing but the ground's rough height.

extern crate std;

use std::vec::Vec;

use super::world::{Link, Noise, Paths, confirmed, measured, sweep, wall};
use crate::association::ReceivedPath;
use crate::association::chain::Chain;
use crate::geometry::{Plane, Position};
use crate::link_state::Probabilities;
use crate::surfaces::{GROUND, Kind, Status, Surface, SurfaceConfig, Surfaces};

/// The true façades, each seen whole, and flat ground at a height of nothing.
fn street() -> Surfaces<8> {
    let beneath = Position::new(0.0, 10.0, 0.0).expect("finite");
    let mut truth = Surfaces::with_ground(SurfaceConfig::default(), beneath);
    truth.get_mut(GROUND).expect("there").status = Status::Confirmed;
    let facades = [
        ([20.0, 0.0, 5.0], [-1.0, 0.0, 0.0], 16.0),
        ([23.0, 40.0, 5.0], [-1.0, 0.0, 0.0], 16.0),
        ([-12.0, 5.0, 5.0], [1.0, 0.03, 0.0], 18.0),
        ([-14.0, 45.0, 5.0], [1.0, 0.0, 0.0], 18.0),
        ([4.0, 75.0, 5.0], [0.05, -1.0, 0.0], 18.0),
    ];
    for (centre, normal, half_m) in facades {
        confirmed(&mut truth, &wall(centre, normal), half_m);
    }
    truth
}

/// Whether a path over true surfaces exists, and no true surface stands in its way.
fn exists(truth: &Surfaces<8>, chain: &[Surface], link: &Link) -> bool {
    let planes: Vec<Plane<f64>> = chain.iter().map(|surface| surface.plane.to_f64()).collect();
    let Some(path) = Chain::over(&planes).predict(&link.transmitter_m, &link.uav_m) else {
        return false;
    };
    let ends = [link.transmitter_m]
        .into_iter()
        .chain(path.points.iter().copied())
        .chain([link.uav_m]);
    let way: Vec<_> = ends.collect();
    chain
        .iter()
        .zip(&path.points)
        .all(|(surface, point)| surface.outside_m(point) <= 0.0)
        && !truth.iter().any(|other| {
            way.windows(2)
                .any(|leg| other.stands_between(&leg[0], &leg[1], 1e-3))
        })
}

/// Every path between the ends with the surfaces that made it, the strongest nine.
fn paths(truth: &Surfaces<8>, link: &Link, noise: &mut Noise) -> Vec<(ReceivedPath, Vec<Surface>)> {
    let all: Vec<Surface> = truth.iter().copied().collect();
    let mut chains: Vec<Vec<Surface>> = std::vec![std::vec![]];
    let mut last = chains.clone();
    for _ in 0..3 {
        let longer = last.iter().flat_map(|chain| {
            let met = chain.last().map(|surface| surface.id);
            let next = all.iter().filter(move |surface| Some(surface.id) != met);
            next.map(|surface| [chain.as_slice(), &[*surface]].concat())
                .collect::<Vec<_>>()
        });
        last = longer.collect();
        chains.extend(last.iter().cloned());
    }
    chains.retain(|chain| exists(truth, chain, link));
    let mut found: Vec<_> = chains
        .into_iter()
        .filter_map(|chain| {
            let planes: Vec<Plane> = chain.iter().map(|surface| surface.plane).collect();
            // Now and then the network is sure of the wrong thing.
            let right = noise.uniform() > 0.1;
            let one = if (chain.len() == 1) == right { 0.9 } else { 0.1 };
            let mut path = measured(&link.path(&planes, one)?, noise);
            if chain.is_empty() {
                path.probabilities = Some(Probabilities {
                    los: 0.94,
                    first_order: 0.03,
                    higher_order: 0.03,
                    artefact: 0.0,
                });
            }
            path.power_db -= 20.0 * libm::log10f(path.c_tau_m as f32);
            Some((path, chain))
        })
        .collect();
    found.sort_by(|(a, _), (b, _)| b.power_db.total_cmp(&a.power_db));
    found.truncate(9);
    found
}

#[test]
fn a_street_is_mapped_and_nothing_else() {
    let truth = street();
    let (mut right, mut wrong, mut singles, mut seen) = (0_u32, 0_u32, 0_u32, 0_u32);
    let mut squares = 0.0;
    for seed in 1..=4 {
        let mut noise = Noise::seeded(seed);
        let beneath = Position::new(0.0, 10.0, 0.3).expect("finite");
        let mut surfaces = Surfaces::<32>::with_ground(SurfaceConfig::default(), beneath);
        let mut sent: Vec<Vec<Vec<Surface>>> = Vec::new();
        for k in 0..160_u32 {
            let (t, stop) = (f64::from(k), f64::from(k / 4));
            let uav = [
                5.0 + 4.0 * libm::sin(0.05 * t),
                20.0 + 0.15 * t,
                7.0 + 2.0 * libm::cos(0.08 * t),
            ];
            let link = Link::between([1.0 + 0.1 * stop, -8.0 + 0.25 * stop, 1.5], uav);
            let found = paths(&truth, &link, &mut noise);
            let received: Paths = found.iter().map(|(path, _)| *path).collect();
            sent.push(found.into_iter().map(|(_, chain)| chain).collect());
            seen += sent[k as usize].iter().filter(|chain| chain.len() == 1).count() as u32;
            let pose = link.pose_with(&mut noise);
            let (_, learned) = sweep(&mut surfaces, &link, &pose, &received, k);
            for point in &learned.points {
                let chain = &sent[point.sweep as usize][usize::from(point.path)];
                let at = point.point.position.vector();
                let off = |surface: &Surface| surface.plane.height_m(at).abs();
                let least = chain.iter().map(off).fold(f32::INFINITY, f32::min);
                squares += least.min(9.0) * least.min(9.0);
                if least < 0.6 {
                    right += 1
                } else {
                    wrong += 1
                }
                singles += u32::from(chain.len() == 1);
            }
        }
        for found in surfaces
            .iter()
            .filter(|s| s.is_confirmed() && s.kind == Kind::Wall)
        {
            let is_true = truth.iter().any(|facade| {
                let centre = found.plane.centre.vector();
                facade.plane.height_m(centre).abs() < 0.6 && facade.outside_m(centre) < 6.0
            });
            assert!(is_true, "{seed}: {found:?}");
        }
        let walls = surfaces
            .iter()
            .filter(|s| s.is_confirmed() && s.kind == Kind::Wall)
            .count();
        assert!(walls >= 4, "{seed}: {walls} {:?}", surfaces.counters);
        std::println!("{seed}: {walls} walls, {:?}", surfaces.counters);
    }
    let points = right + wrong;
    let rms = libm::sqrtf(squares / points as f32);
    std::println!("{points} points, {wrong} wrong, rms {rms:.3} m, singles {singles} of {seen}");
    assert!(points > 1000 && wrong * 100 <= points, "{right} {wrong}");
    assert!(rms < 0.2 && singles * 2 > seen, "{rms} {singles} {seen}");
}
