//! The tracer against the committed reference lists and against closed forms.

use std::path::Path;

use super::*;
use crate::paths;

fn fixture(name: &str) -> std::path::PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("fixtures").join(name)
}

fn compare(name: &str) -> Comparison {
    let scene = Scene::read(&fixture(&format!("{name}_scene.json"))).unwrap();
    let links = paths::read(&fixture(&format!("{name}.jsonl.gz"))).unwrap();
    Comparison::run(&Tracer::new(&scene, 3).unwrap(), &links)
}

#[test]
fn both_reference_lists_are_found_whole_and_nothing_else() {
    for (name, links, confirmed) in [("outdoor_a", 1000, 1), ("indoor", 40, 1)] {
        let result = compare(name);
        println!("{name}: {result:?}");
        assert_eq!(result.links, links);
        assert!(result.confirmed.total > confirmed, "{name}: {result:?}");
        assert!(result.passes(), "{name}: {result:?}");
    }
}
