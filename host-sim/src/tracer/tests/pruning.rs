//! The pruned search against one without any pruning.

use super::*;

/// Face sequences of all paths: every sequence is tried, every leg is tested against every face.
fn unpruned(scene: &Scene, tx: [f64; 3], rx: [f64; 3], max_order: usize) -> Vec<Vec<u32>> {
    fn extend(
        scene: &Scene,
        chain: &mut Vec<(u32, Vec3)>,
        ends: [Vec3; 2],
        left: usize,
        found: &mut Vec<Vec<u32>>,
    ) {
        if clear(scene, chain, ends) {
            found.push(chain.iter().map(|(f, _)| *f).collect());
        }
        let last = chain.last().copied();
        for (i, face) in scene.faces().iter().enumerate() {
            let image = last.map_or(ends[0], |(_, image)| image);
            if left > 0 && face.height_m(&image) > 0.0 && last.is_none_or(|(f, _)| f != i as u32) {
                chain.push((i as u32, face.mirror(&image)));
                extend(scene, chain, ends, left - 1, found);
                chain.pop();
            }
        }
    }
    /// Whether the chain's reflection points exist and all legs are free.
    fn clear(scene: &Scene, chain: &[(u32, Vec3)], [tx, rx]: [Vec3; 2]) -> bool {
        let mut points = vec![rx];
        for (index, image) in chain.iter().rev() {
            let face: &Face = &scene.faces()[*index as usize];
            let from = *points.last().unwrap();
            let Some(t) = face.crossing(&from, image) else {
                return false;
            };
            if face.height_m(&from) <= 0.0 {
                return false;
            }
            points.push(from + (image - from) * t);
        }
        points.push(tx);
        points.windows(2).enumerate().all(|(leg, ends)| {
            let own = |i: usize| {
                let here = |bounce: usize| {
                    chain
                        .iter()
                        .rev()
                        .nth(bounce)
                        .is_some_and(|(f, _)| *f as usize == i)
                };
                here(leg) || leg.checked_sub(1).is_some_and(here)
            };
            scene
                .faces()
                .iter()
                .enumerate()
                .all(|(i, f)| own(i) || f.crossing(&ends[0], &ends[1]).is_none())
        })
    }
    let mut found = Vec::new();
    extend(
        scene,
        &mut Vec::new(),
        [tx.into(), rx.into()],
        max_order,
        &mut found,
    );
    found.sort();
    found
}

/// The scene less all objects from a number on.
fn first_objects(scene: &Scene, objects: u32) -> Scene {
    let raw = scene
        .faces()
        .iter()
        .filter(|f| f.object() < objects)
        .map(|f| RawFace {
            vertices: f.vertices().iter().map(|v| (*v).into()).collect(),
            normal: None,
            object: Some(f.object()),
        });
    Scene::new("part", Material::PAPER, 30e9, Some(scene.bounds()), raw.collect()).unwrap()
}

#[test]
fn pruning_loses_nothing_in_any_kind_of_scene() {
    let mut by_order = [0; 4];
    let cases = [
        ("outdoor", 99, 2),
        ("indoor", 99, 2),
        ("street", 99, 2),
        ("city:4", 9, 3),
        ("city:9", 9, 3),
        ("indoor", 8, 3),
    ];
    for (stream, (name, objects, order)) in cases.into_iter().enumerate() {
        let scene = first_objects(&Scene::load(name).unwrap(), objects);
        let tracer = Tracer::new(&scene, order).unwrap();
        let mut random = Stream::new(3, stream as u64);
        for _ in 0..if order == 2 { 40 } else { 12 } {
            let [tx, rx] = [0, 1].map(|_| free_point(&scene, &mut random));
            let mut traced: Vec<Vec<u32>> = tracer
                .transmitter(tx)
                .trace(rx)
                .iter()
                .map(|p| p.faces().to_vec())
                .collect();
            traced.sort();
            assert_eq!(
                traced,
                unpruned(&scene, tx, rx, order),
                "{name}: {tx:?} to {rx:?}"
            );
            traced.iter().for_each(|faces| by_order[faces.len()] += 1);
        }
    }
    assert!(
        by_order.iter().all(|&n| n > 40),
        "the test compares few paths: {by_order:?}"
    );
}
