//! What the modules of a crate must keep to: they import downwards, and their files in no circle.

use std::collections::{BTreeMap, BTreeSet};

use crate::modules::{Module, Modules};

/// What is wrong with a crate whose top modules stand in this order, the lowest first: one line each.
pub(crate) fn violations(modules: &Modules, floors: &[String]) -> Vec<String> {
    let floor: BTreeMap<&str, usize> = floors
        .iter()
        .enumerate()
        .map(|(at, name)| (name.as_str(), at))
        .collect();
    let mut wrong = Vec::new();
    let tops: BTreeSet<&str> = modules.files.keys().filter_map(|module| top(module)).collect();
    for name in floors.iter().filter(|name| !tops.contains(name.as_str())) {
        wrong.push(format!("floor `{name}` is no module"));
    }
    for name in tops.iter().filter(|name| !floor.contains_key(*name)) {
        wrong.push(format!("module `{name}` has no floor"));
    }
    for (module, imports) in &modules.imports {
        for other in imports {
            let of = |module| top(module).and_then(|name| floor.get(name));
            if let (Some(mine), Some(its)) = (of(module), of(other))
                && its > mine
            {
                let (from, to) = (modules.files[module].display(), modules.files[other].display());
                wrong.push(format!("upwards: {from} imports {to}"));
            }
        }
    }
    wrong.extend(circles(modules));
    wrong
}

fn top(module: &Module) -> Option<&str> {
    module.first().map(String::as_str)
}

/// The circles of files: sets of modules of which each reaches each.
fn circles(modules: &Modules) -> Vec<String> {
    let reach: BTreeMap<&Module, BTreeSet<&Module>> = modules
        .imports
        .keys()
        .map(|module| (module, reached(modules, module)))
        .collect();
    let mut told = BTreeSet::new();
    for (module, reached) in &reach {
        let circle: BTreeSet<&Module> = reached
            .iter()
            .copied()
            .filter(|other| reach[other].contains(module))
            .collect();
        if circle.len() > 1 {
            told.insert(circle);
        }
    }
    let file = |module: &&Module| modules.files[*module].display().to_string();
    told.iter()
        .map(|circle| {
            format!(
                "circle: {}",
                circle.iter().map(file).collect::<Vec<_>>().join(", ")
            )
        })
        .collect()
}

/// The modules that lie behind the imports of one.
fn reached<'m>(modules: &'m Modules, from: &'m Module) -> BTreeSet<&'m Module> {
    let mut reached = BTreeSet::new();
    let mut open = vec![from];
    while let Some(module) = open.pop() {
        for other in &modules.imports[module] {
            if reached.insert(other) {
                open.push(other);
            }
        }
    }
    reached
}
