//! Totals of an independent tracer, link by link and face by face.

use std::path::Path;

use super::*;

/// What an independent tracer lists of a link.
struct Listed {
    ends: [[f64; 3]; 2],
    total_db: f64,
    /// Face, power (dB), mean length (m).
    faces: Vec<(u32, f64, f64)>,
}

/// The scene and the whole list, of S = 0.3 and exponent 4, summed over tiles of 0.25 m that both ends see the centre of.
fn reference() -> (Scene, Vec<Listed>) {
    let fixture = |name: &str| Path::new(env!("CARGO_MANIFEST_DIR")).join("fixtures").join(name);
    let scene = Scene::read(&fixture("outdoor_a_scene.json")).unwrap();
    let limit = crate::input::limits::PATH_LIST;
    let text = crate::input::read_text(&fixture("outdoor_a_diffuse.jsonl.gz"), &limit).unwrap();
    let mut lines = text
        .lines()
        .map(|line| serde_json::from_str::<serde_json::Value>(line).unwrap());
    let parameters = lines.next().unwrap();
    assert_eq!(parameters["scattering_coefficient"], 0.3);
    assert_eq!(parameters["lobe_exponent"], 4);
    let link = |line: serde_json::Value| {
        let number = |value: &serde_json::Value| value.as_f64().unwrap();
        let face = |face: &serde_json::Value| (number(&face[0]) as u32, number(&face[1]), number(&face[2]));
        Listed {
            ends: ["tx", "rx"].map(|end| [0, 1, 2].map(|i| number(&line[end][i]))),
            total_db: number(&line["total_db"]),
            faces: line["faces"].as_array().unwrap().iter().map(face).collect(),
        }
    };
    (scene, lines.map(link).collect())
}

/// Power of a face summed over squares of a side that both ends see the centre of: the list's own sum, at any fineness.
fn summed(tracer: &Tracer<'_>, face: u32, [tx, rx]: &[Vec3; 2], side_m: f64) -> f64 {
    let scene = tracer.scene();
    let polygon = &scene.faces()[face as usize];
    let along = (polygon.vertices()[1] - polygon.vertices()[0]).normalize();
    let across = polygon.normal().cross(&along);
    let origin = polygon.vertices()[0];
    let extent = |axis: &Vec3| {
        let places = || polygon.vertices().iter().map(|v| (v - origin).dot(axis));
        let (low, high) = (places().fold(0.0, f64::min), places().fold(0.0, f64::max));
        let count = libm::ceil((high - low) / side_m) as u32;
        (low, (high - low) / f64::from(count), count)
    };
    let ((x, dx, columns), (y, dy, rows)) = (extent(&along), extent(&across));
    let eyes = [Eye::new(scene, tx), Eye::new(scene, rx)];
    let square = |row: u32, column: u32| {
        let place = |from: f64, step: f64, index: u32| from + step * (f64::from(index) + 0.5);
        let centre = origin + along * place(x, dx, column) + across * place(y, dy, row);
        let piece = Piece {
            centre,
            area_m2: dx * dy,
            number: 0,
            half_m: 0.5 * side_m,
            block: 0,
        };
        let lit = polygon
            .contains(&centre)
            .then(|| light(scene, tx, face, &piece, &tracer.surfaces))??;
        let power = hear(scene, &lit, rx)?;
        eyes.iter().all(|eye| eye.sees(face, &centre)).then_some(power)
    };
    let squares = (0..rows).flat_map(|row| (0..columns).map(move |column| (row, column)));
    squares.filter_map(|(row, column)| square(row, column)).sum()
}

/// Power, and power times length, that every face scatters.
fn by_face(tracer: &Tracer<'_>, [tx, rx]: [[f64; 3]; 2]) -> BTreeMap<u32, (f64, f64)> {
    let mut of_face: BTreeMap<u32, (f64, f64)> = BTreeMap::new();
    for path in tracer.transmitter(tx).trace(rx) {
        if path.kind().interactions() == [Interaction::Scattering] {
            let sum = of_face.entry(path.faces()[0]).or_default();
            sum.0 += path.gain.norm_sqr();
            sum.1 += path.gain.norm_sqr() * path.length_m();
        }
    }
    of_face
}

#[test]
fn totals_and_faces_are_those_of_the_reference() {
    let (scene, listed) = reference();
    let with_tiles_of = |tile_m| {
        let options = Diffuse {
            tile_m,
            ..Diffuse::default()
        };
        Tracer::with(&scene, 0, diffuse(options)).unwrap()
    };
    let (tracer, closer) = (with_tiles_of(1.0), with_tiles_of(0.25));
    let (mut links, mut faces, mut finer, mut closer_off_db) = (0, 0, 0, 0.0_f64);
    let (mut total_off_db, mut face_off_db, mut length_off_m) = (0.0_f64, 0.0_f64, 0.0_f64);
    for link in &listed {
        let of_face = by_face(&tracer, link.ends);
        if link.total_db < -200.0 {
            // The list's word for nothing.
            assert!(of_face.is_empty(), "{link:?}", link = link.ends);
            continue;
        }
        let ends = link.ends.map(Vec3::from);
        // Where the list's own squares of 0.25 m are too coarse for the shadows, the same sum over squares of 1/16 m decides.
        let mut off_db = |found_db: f64, listed_db: f64, over: &[u32]| {
            if (found_db - listed_db).abs() < 0.3 {
                return (found_db - listed_db).abs();
            }
            let sum = |side_m| {
                db(over
                    .iter()
                    .map(|face| summed(&tracer, *face, &ends, side_m))
                    .sum())
            };
            let (coarse_db, fine_db) = (sum(0.25), sum(0.0625));
            let closer = by_face(&closer, link.ends);
            let power = |face: &u32| closer.get(face).map_or(0.0, |sum| sum.0);
            let closer_db = db(over.iter().map(power).sum());
            println!(
                "faces {over:?}: {found_db:.3} dB, at tiles of 1/4 m {closer_db:.3}; listed {listed_db:.3}, summed over 1/4 m \
                 {coarse_db:.3}, over 1/16 m {fine_db:.3}"
            );
            closer_off_db = closer_off_db.max((closer_db - fine_db).abs());
            assert!((coarse_db - listed_db).abs() < 0.05, "the list is another sum");
            finer += 1;
            (found_db - fine_db).abs()
        };
        let total_db = db(of_face.values().map(|sum| sum.0).sum());
        let all: Vec<u32> = link.faces.iter().map(|face| face.0).collect();
        total_off_db = total_off_db.max(off_db(total_db, link.total_db, &all));
        for (face, listed_db, length_m) in &link.faces {
            let (power, moment) = of_face.get(face).copied().unwrap_or((1e-30, 0.0));
            face_off_db = face_off_db.max(off_db(db(power), *listed_db, &[*face]));
            length_off_m = length_off_m.max((moment / power - length_m).abs());
            faces += 1;
        }
        links += 1;
    }
    println!(
        "{links} links, {faces} faces within 20 dB of the strongest: totals within {total_off_db:.3} dB, faces within {face_off_db:.3} dB, \
         {finer} of them of a finer sum than the list's, and {closer_off_db:.3} dB at tiles of 1/4 m, mean lengths within \
         {length_off_m:.3} m"
    );
    assert!(links == 60 && faces == 184 && finer < 10);
    // Seen through gaps, two faces are .37 and .46 dB off their finer sums at tiles of 1 m.
    assert!(
        total_off_db < 0.3 && face_off_db < 0.47 && closer_off_db < 0.3,
        "{total_off_db} {face_off_db} {closer_off_db}"
    );
    assert!(length_off_m < 0.3, "{length_off_m}");
}
