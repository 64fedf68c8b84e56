//! The search for diffracted paths against one without pruning, and against the committed reference list.

use crate::paths;
use crate::tracer::DiffractionComparison;

use super::*;

#[test]
fn pruning_loses_no_diffracted_path() {
    let mut by_kind = [0; 3];
    for (stream, name) in ["outdoor", "indoor", "street", "city:4"].into_iter().enumerate() {
        let scene = Scene::load(name).unwrap();
        let propagation = all();
        let tracer = Tracer::with(&scene, 1, propagation).unwrap();
        let faces: Vec<u32> = (0..scene.faces().len() as u32).collect();
        // Every source with the whole of every edge, every face behind it, no bound.
        let edges = Edges::of(&scene, false);
        for wedge in 0..edges.wedges.len() {
            edges.light_all(wedge, faces.clone());
        }
        let mut random = Stream::new(4, stream as u64);
        for _ in 0..6 {
            let [tx, rx] = [0, 1].map(|_| free_point(&scene, &mut random));
            let tree = tracer.transmitter(tx);
            let sources = core::iter::once((None, Vec3::from(tx))).chain(faces.iter().filter_map(|&face| {
                let mirror = &scene.faces()[face as usize];
                (mirror.height_m(&tx.into()) > 0.0).then(|| (Some(face), mirror.mirror(&tx.into())))
            }));
            let mut lit = Vec::new();
            for (face, source) in sources {
                for (index, wedge) in edges.wedges.iter().enumerate() {
                    if let Some(about) = wedge.about(&source) {
                        lit.push(LitEdge {
                            wedge: index as u32,
                            face,
                            source,
                            about,
                            phi_rad: about.angle_rad(),
                            part_m: [0.0, wedge.length_m],
                        });
                    }
                }
            }
            let unpruned = LitEdges {
                scene: &scene,
                tx: tx.into(),
                edges: &edges,
                options: propagation.diffraction.unwrap(),
                lit,
            };
            let surfaces = Surfaces::of_scene(&scene, &Propagation::default());
            let expected = unpruned.trace(&rx.into(), &surfaces, true);
            let mut found = tree.trace(rx);
            found.retain(|path| path.kind().edge().is_some());
            assert_eq!(found, expected, "{name}: {tx:?} to {rx:?}");
            for path in &found {
                let at = match (path.kind().edge(), path.order()) {
                    (_, 1) => 0,
                    (Some(1), _) => 1,
                    _ => 2,
                };
                by_kind[at] += 1;
            }
        }
    }
    println!("compared: {} D, {} RD, {} DR", by_kind[0], by_kind[1], by_kind[2]);
    assert!(by_kind.iter().all(|&n| n > 60), "{by_kind:?}");
}

#[test]
fn the_reference_list_is_found_whole_and_nothing_strong_besides() {
    let scene = Scene::read(&fixture("outdoor_a_scene.json")).unwrap();
    let list = paths::read(&fixture("outdoor_a_diffraction.jsonl.gz")).unwrap();
    let compare =
        |propagation| DiffractionComparison::run(&Tracer::with(&scene, 1, propagation).unwrap(), &list);
    let result = compare(all());
    println!("{result:?}");
    assert!(result.passes(), "{result:?}");
    let at_edge = [result.confirmed, result.unconfirmed, result.traced].map(|tally| tally.at_edge);
    assert_eq!((result.links, at_edge), (REFERENCE_LINKS, [0; 3]));
    assert_eq!(result.confirmed.total, REFERENCE_CONFIRMED);
    // What differs is how many digits the list has.
    assert!(
        result.worst_length_m < 1e-9 && result.worst_angle_rad < 1e-8,
        "{result:?}"
    );
    assert!(
        result.worst_point_m < 2e-5 && result.worst_gain_db < 2e-3,
        "{result:?}"
    );
    // What is missing or extra is seen.
    let mut fewer = list.clone();
    let link = fewer.iter().position(|link| link.paths.len() > 20).unwrap();
    fewer[link].paths.remove(0);
    let tracer = Tracer::with(&scene, 1, all()).unwrap();
    assert_eq!(
        DiffractionComparison::run(&tracer, &fewer).traced.unexplained(),
        1
    );
    let mut few = all();
    few.diffraction.as_mut().unwrap().most_paths = 2;
    assert!(!compare(few).passes());
}

/// Links and strong confirmed paths of the committed list.
const REFERENCE_LINKS: usize = 22;
const REFERENCE_CONFIRMED: usize = 159;
