//! Scenes from mesh files: solids are found again, holes kept, unknown names told.

use super::*;

const CUBE_OBJ: &str = "o cube\nv 0 0 0\nv 2 0 0\nv 2 2 0\nv 0 2 0\nv 0 0 3\nv 2 0 3\nv 2 2 3\nv 0 2 3\n\
    f 1 2 6\nf 1 6 5\nf 2 3 7\nf 2 7 6\nf 3 4 8\nf 3 8 7\nf 4 1 5\nf 4 5 8\nf 5 6 7 8\nf 4 3 2 1\n";

#[test]
fn an_obj_cube_of_triangles_becomes_six_faces_of_one_solid() {
    let folder = tempfile::tempdir().unwrap();
    let file = folder.path().join("cube.obj");
    std::fs::write(&file, CUBE_OBJ).unwrap();
    let scene = Scene::load(file.to_str().unwrap()).unwrap();
    assert_eq!(scene.faces().len(), 6);
    assert!(
        scene.faces().iter().all(Face::is_convex),
        "whichever way they look"
    );
    assert!(
        scene
            .faces()
            .iter()
            .all(|f| f.vertices().len() == 4 && f.object() == 0)
    );
    assert!(scene.inside_solid([1.0, 1.0, 1.5]) && !scene.inside_solid([1.0, 1.0, 3.5]));
    assert_eq!(scene.bounds().max_m, [2.0, 2.0, 3.0]);

    std::fs::write(&file, CUBE_OBJ.replace("v 2 2 3", "v 2 2 3.1")).unwrap();
    let error = Scene::read(&file).unwrap_err().to_string();
    assert!(error.contains("cube.obj: face 8: is not planar"), "{error}");
    std::fs::write(&file, CUBE_OBJ.replace("f 5 6 7 8", "f 5 6 7 9")).unwrap();
    let error = Scene::read(&file).unwrap_err().to_string();
    assert!(
        error.contains("cube.obj:18: not an OBJ mesh: a face names vertex 9, there are 8 before it"),
        "{error}"
    );
    std::fs::write(&file, CUBE_OBJ.replace("v 2 2 3", "v 2 nan 3")).unwrap();
    let error = Scene::read(&file).unwrap_err().to_string();
    assert!(error.contains("vertex 2 is not finite"), "{error}");
}

#[test]
fn a_wall_with_a_window_keeps_its_pieces_and_its_hole() {
    let folder = tempfile::tempdir().unwrap();
    let file = folder.path().join("wall.ply");
    let text = "ply\nformat ascii 1.0\nelement vertex 8\nproperty double x\nproperty double y\nproperty double z\n\
        element face 4\nproperty list uchar uint vertex_indices\nend_header\n\
        0 0 0\n4 0 0\n4 0 4\n0 0 4\n1 0 1\n3 0 1\n3 0 3\n1 0 3\n4 0 1 5 4\n4 1 2 6 5\n4 2 3 7 6\n4 3 0 4 7\n";
    std::fs::write(&file, text).unwrap();
    let scene = Scene::load(file.to_str().unwrap()).unwrap();
    assert_eq!(scene.faces().len(), 4);
    assert!(
        !scene.blocked([2.0, -1.0, 2.0], [2.0, 1.0, 2.0]),
        "through the window"
    );
    assert!(
        scene.blocked([0.5, -1.0, 2.0], [0.5, 1.0, 2.0]),
        "through the wall"
    );
}

#[test]
fn an_unknown_scene_is_told_what_there_is() {
    let error = Scene::load("nowhere").unwrap_err().to_string();
    assert_eq!(
        error,
        "scene nowhere: expected one of outdoor, indoor, street, outdoor_a, city:SEED, indoor:SEED, or a file ending in .json, .obj or .ply"
    );
    assert!(
        Scene::load("city:x")
            .unwrap_err()
            .to_string()
            .contains("expected city:SEED")
    );
    assert!(
        Scene::load("nowhere.json")
            .unwrap_err()
            .to_string()
            .contains("nowhere.json: cannot be read")
    );
}
