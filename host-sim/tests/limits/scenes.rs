//! Scenes that are too large, broken, or make no sense.

use super::*;

fn face(vertices: usize) -> String {
    // Every second one on an inner circle: nothing but the number of vertices decides what this costs.
    let corner = |i: usize| {
        let (angle, radius) = (
            std::f64::consts::TAU * i as f64 / vertices as f64,
            50.0 + (i % 2) as f64,
        );
        [radius * angle.cos(), radius * angle.sin()]
    };
    let corners: Vec<String> = (0..vertices)
        .map(corner)
        .map(|[x, y]| format!("[{x},{y},0]"))
        .collect();
    format!(
        "{{\"name\":\"t\",\"units\":\"metre\",\"frequency_hz\":3e10,\"material\":{{\"relative_permittivity\":15,\
         \"conductivity_S_per_m\":0.015,\"model\":\"half-space\"}},\n\"faces\":[{{\"vertices\":[{}]}}]}}",
        corners.join(",")
    )
}

#[test]
fn scenes() {
    let trace = |file: &'static str| -> [&'static str; 7] {
        ["trace", "--scene", file, "--tx", "0,0,2", "--rx", "5,5,5"]
    };
    let (json, obj, ply) = (trace("s.json"), trace("s.obj"), trace("s.ply"));
    let mesh = "v 0 0 0\nv 1 0 0\nv 1 1 0\n";
    let polygon = |count: usize| (0..count).map(|i| format!(" {}", 1 + i % 3)).collect::<String>();
    let header = "ply\nformat ascii 1.0\nelement vertex 3\nproperty float x\nproperty float y\nproperty float z\n\
        element face 1\nproperty list uint int vertex_indices\nend_header\n";
    all_refused(&[
        (
            "s.json",
            face(100_000),
            &json,
            "s.json: face 0: has 100000 vertices, at most 1024 are read",
        ),
        (
            "s.json",
            face(4).replace("units", "unit"),
            &json,
            "s.json:1: not a scene: unknown field `unit`",
        ),
        (
            "s.json",
            face(4).replace("\"vertices\"", "\"normals\":[0,0,1],\"vertices\""),
            &json,
            "s.json:2: not a scene: unknown field `normals`",
        ),
        (
            "s.json",
            face(4).replace("\"model\"", "\"density\":1,\"model\""),
            &json,
            "s.json:1: not a scene: unknown field `density`",
        ),
        (
            "s.obj",
            format!("{mesh}f{}\n", polygon(100_000)),
            &obj,
            "s.obj:4: not an OBJ mesh: a face has 100000 vertices, expected 3 to 1024",
        ),
        (
            "s.obj",
            format!("{mesh}F 1 2 3\n"),
            &obj,
            "s.obj:4: not an OBJ mesh: unknown statement \"F\"",
        ),
        (
            "s.obj",
            format!("{mesh}\nf 1 2 4\n"),
            &obj,
            "s.obj:5: not an OBJ mesh: a face names vertex 4, there are 3 before it",
        ),
        (
            "s.obj",
            mesh.replace("1 1 0", "1 one 0"),
            &obj,
            "s.obj:3: not an OBJ mesh: expected v x y z",
        ),
        (
            "s.ply",
            format!("{header}0 0 0 1 0 0 1 1 0\n100000{}\n", polygon(100_000)),
            &ply,
            "s.ply: not a PLY mesh: face 0: vertex_indices: a face has 100000 vertices, at most 1024 are read",
        ),
        (
            "s.ply",
            header.replace("face 1", "face 9999999"),
            &ply,
            "s.ply: not a PLY mesh: element face: 9999999 in it",
        ),
    ]);
}

#[test]
fn scenes_of_what_makes_no_sense() {
    let trace: &[&str] = &["trace", "--scene", "s.json", "--tx", "0,0,2", "--rx", "5,5,5"];
    let fly: &[&str] = &["fly", "--scene", "s.json", "--out", "x"];
    let record: &[&str] = &["record", "--scene", "s.json", "--out", "x"];
    let materials = |values: &str| {
        face(4).replace(
            "\"faces\"",
            &format!("\"materials\":{{\"m\":{{{values}}}}},\"faces\""),
        )
    };
    let no_face = format!("{}[]}}", face(4).split_once("[{").expect("faces").0);
    for command in [trace, fly, record] {
        all_refused(&[
            (
                "s.json",
                materials("\"name\":\"brick\",\"rms_height_m\":-0.001"),
                command,
                "s.json: materials: \"m\": expected rms_height_m >= 0",
            ),
            (
                "s.json",
                face(4).replace("\"vertices\"", "\"material\":\"adobe\",\"vertices\""),
                command,
                "s.json: face 0: material \"adobe\" is not known, expected one of",
            ),
            (
                "s.json",
                materials("\"name\":\"adobe\""),
                command,
                "s.json: materials: \"m\": name: material \"adobe\" is not known, expected one of",
            ),
            (
                "s.json",
                no_face.clone(),
                command,
                "s.json: a scene needs at least one face",
            ),
        ]);
    }
    let options = |options: &[&'static str]| -> Vec<&'static str> {
        let command = ["trace", "--scene", "street", "--tx", "9,20,2", "--rx", "50,20,5"];
        [&command[..], options].concat()
    };
    for (more, expected) in [
        (
            &["--relief", "-0.1"][..],
            "surfaces.ground_relief_rms_m is -0.1, expected 0 to 1",
        ),
        (
            &["--turned", "nan"],
            "placement.turned_deg is NaN, expected -360 to 360",
        ),
        (
            &["--moved", "1e6,0,0"],
            "placement.moved_m holds 1000000, expected",
        ),
    ] {
        all_refused(&[("unused", String::new(), &options(more), expected)]);
    }
}
