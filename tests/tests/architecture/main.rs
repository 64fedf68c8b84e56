//! Modules import downwards only, and no files in a circle: `tests/floors.toml` has the order, for every crate. A file that is long says why.

mod lengths;
mod modules;
mod rules;

use std::collections::BTreeMap;
use std::fs;
use std::path::Path;

use modules::Modules;
use rules::violations;

/// Floors of each crate, the lowest first, by the crate's root file.
fn floors(root: &Path) -> BTreeMap<String, Vec<String>> {
    let text = fs::read_to_string(root.join("tests/floors.toml")).expect("the list of floors");
    toml::from_str(&text).expect("a list of names for each root file")
}

#[test]
fn imports_go_down() {
    let root = Path::new(env!("CARGO_MANIFEST_DIR"))
        .parent()
        .expect("the workspace");
    let mut wrong = Vec::new();
    for (file, floors) in floors(root) {
        let modules = Modules::read(&root.join(&file));
        assert!(
            modules.files.len() > floors.len(),
            "{file}: read {} files",
            modules.files.len()
        );
        wrong.extend(violations(&modules, &floors));
    }
    let shown = wrong.join("\n").replace(&format!("{}/", root.display()), "");
    assert!(
        wrong.is_empty(),
        "{} against tests/floors.toml:\n{shown}",
        wrong.len()
    );
}

/// What is wrong with a crate of these files.
fn wrong(floors: &[&str], files: &[(&str, &str)]) -> Vec<String> {
    let folder = tempfile::tempdir().expect("a folder");
    for (name, text) in files {
        let path = folder.path().join(name);
        fs::create_dir_all(path.parent().expect("a folder")).expect("a folder");
        fs::write(path, text).expect("a file");
    }
    let floors: Vec<String> = floors.iter().map(ToString::to_string).collect();
    let before = format!("{}/", folder.path().display());
    let told = violations(&Modules::read(&folder.path().join("lib.rs")), &floors);
    told.iter().map(|line| line.replace(&before, "")).collect()
}

const LIB: (&str, &str) = ("lib.rs", "mod low; mod high;");

#[test]
fn downwards_is_allowed_and_tests_may_look_up() {
    let low = "pub struct Low; #[cfg(test)] mod tests { use crate::high::High; }";
    let found = wrong(
        &["low", "high"],
        &[
            LIB,
            ("low.rs", low),
            ("high.rs", "pub struct High(crate::low::Low);"),
        ],
    );
    assert_eq!(found, [""; 0]);
}

#[test]
fn an_upward_import_is_told_with_both_files() {
    for import in [
        "use crate::high::High;",
        "use super::{high::{self, High}};",
        "fn f() -> crate::high::High { todo!() }",
        "mod inner { use super::super::high::High; }",
        "fn f() { println!(\"{}\", crate::high::X); }",
    ] {
        let found = wrong(&["low", "high"], &[LIB, ("low.rs", import), ("high/mod.rs", "")]);
        assert_eq!(found, ["upwards: low.rs imports high/mod.rs"], "{import}");
    }
}

#[test]
fn a_circle_of_files_is_told_once() {
    let files = [
        ("lib.rs", "mod room;"),
        ("room/mod.rs", "mod a; mod b; mod c; pub use a::A;"),
        ("room/a.rs", "use super::b::B; use super::A;"),
        ("room/b.rs", "use crate::room::c::C;"),
        ("room/c.rs", "use super::a::A;"),
    ];
    assert_eq!(
        wrong(&["room"], &files),
        ["circle: room/a.rs, room/b.rs, room/c.rs"]
    );
}

#[test]
fn a_module_without_a_floor_and_a_floor_without_a_module_are_told() {
    let found = wrong(&["low", "gone"], &[LIB, ("low.rs", ""), ("high.rs", "")]);
    assert_eq!(found, ["floor `gone` is no module", "module `high` has no floor"]);
}
