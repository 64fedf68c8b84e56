//! The modules of a crate and what each imports, read from its sources. What only tests see is left out.

use std::collections::{BTreeMap, BTreeSet};
use std::fs;
use std::path::{Path, PathBuf};

use proc_macro2::{TokenStream, TokenTree};
use syn::visit::{self, Visit};
use syn::{Attribute, Item, ItemMod, ItemUse, Macro, UseTree};

/// A module's path within its crate; empty for the root.
pub(crate) type Module = Vec<String>;

/// The modules of one crate that have a file of their own.
#[derive(Debug, Default)]
pub(crate) struct Modules {
    /// File of each module.
    pub(crate) files: BTreeMap<Module, PathBuf>,
    /// Modules that each module names, itself and what lies above or below it in the tree left out.
    pub(crate) imports: BTreeMap<Module, BTreeSet<Module>>,
}

impl Modules {
    /// Of the crate whose root is this file.
    pub(crate) fn read(root: &Path) -> Self {
        let mut modules = Self::default();
        let mut paths = BTreeMap::new();
        modules.enter(&mut paths, Vec::new(), root);
        for (module, named) in paths {
            let imports = named.iter().filter_map(|path| modules.home(path));
            let imports = imports.filter(|other| !module.starts_with(other) && !other.starts_with(&module));
            modules.imports.insert(module.clone(), imports.collect());
        }
        modules
    }

    /// Reads a module's file and those of its children.
    fn enter(&mut self, paths: &mut BTreeMap<Module, Vec<Module>>, module: Module, file: &Path) {
        let text = fs::read_to_string(file).unwrap_or_else(|error| panic!("{}: {error}", file.display()));
        let syntax = syn::parse_file(&text).unwrap_or_else(|error| panic!("{}: {error}", file.display()));
        let mut reader = Reader {
            module: module.clone(),
            depth: 0,
            named: Vec::new(),
            children: Vec::new(),
        };
        reader.visit_file(&syntax);
        // `a.rs` has its children in `a/`; `lib.rs`, `main.rs` and `mod.rs` beside them.
        let is_root = module.is_empty() || file.ends_with("mod.rs");
        let folder = if is_root {
            file.parent().expect("a file").to_path_buf()
        } else {
            file.with_extension("")
        };
        paths.insert(module.clone(), reader.named);
        for child in reader.children {
            let flat = folder.join(&child).with_extension("rs");
            let nested = folder.join(&child).join("mod.rs");
            let path = [module.clone(), vec![child]].concat();
            self.enter(paths, path, if flat.exists() { &flat } else { &nested });
        }
        self.files.insert(module, file.to_path_buf());
    }

    /// The module that a path leads into: the longest part of it that is one.
    fn home(&self, path: &[String]) -> Option<Module> {
        (1..=path.len())
            .rev()
            .map(|length| path[..length].to_vec())
            .find(|part| self.files.contains_key(part))
    }
}

/// Collects the paths that a file names, as paths from the crate's root.
struct Reader {
    module: Module,
    /// Modules within the file that the reader is in.
    depth: usize,
    named: Vec<Module>,
    children: Vec<String>,
}

impl Reader {
    fn name(&mut self, path: &[String]) {
        let mut base = self.module.clone();
        let mut rest = path;
        match rest.first().map(String::as_str) {
            Some("crate") => {
                base.clear();
                rest = &rest[1..];
            }
            Some("self") => rest = &rest[1..],
            Some("super") => {
                let mut inside = self.depth;
                while rest.first().is_some_and(|segment| segment == "super") {
                    if inside > 0 {
                        inside -= 1;
                    } else {
                        base.pop();
                    }
                    rest = &rest[1..];
                }
                if inside > 0 {
                    return;
                }
            }
            _ => return,
        }
        base.extend_from_slice(rest);
        self.named.push(base);
    }

    fn tree(&mut self, before: &[String], tree: &UseTree) {
        let with = |segment: &syn::Ident| [before, &[segment.to_string()]].concat();
        match tree {
            UseTree::Path(path) => self.tree(&with(&path.ident), &path.tree),
            UseTree::Name(name) => self.name(&with(&name.ident)),
            UseTree::Rename(rename) => self.name(&with(&rename.ident)),
            UseTree::Glob(_) => self.name(before),
            UseTree::Group(group) => group.items.iter().for_each(|item| self.tree(before, item)),
        }
    }

    /// Paths in the arguments of a macro, which are not parsed.
    fn tokens(&mut self, tokens: TokenStream) {
        let mut path: Vec<String> = Vec::new();
        let mut joined = false;
        for token in tokens {
            match token {
                TokenTree::Ident(ident) if joined && !path.is_empty() => path.push(ident.to_string()),
                TokenTree::Ident(ident) => {
                    self.name(&std::mem::take(&mut path));
                    path = vec![ident.to_string()];
                }
                TokenTree::Punct(punct) if punct.as_char() == ':' => {}
                TokenTree::Group(group) => {
                    self.name(&std::mem::take(&mut path));
                    self.tokens(group.stream());
                    joined = false;
                    continue;
                }
                _ => self.name(&std::mem::take(&mut path)),
            }
            joined = matches!(&path[..], [first, ..] if ["crate", "super", "self"].contains(&first.as_str()));
        }
        self.name(&path);
    }
}

impl<'s> Visit<'s> for Reader {
    fn visit_item(&mut self, item: &'s Item) {
        if !attributes(item).iter().any(is_test) {
            visit::visit_item(self, item);
        }
    }

    fn visit_item_mod(&mut self, item: &'s ItemMod) {
        if item.content.is_none() {
            assert_eq!(self.depth, 0, "a file's module stands at its top level");
            self.children.push(item.ident.to_string());
        }
        self.depth += 1;
        visit::visit_item_mod(self, item);
        self.depth -= 1;
    }

    fn visit_item_use(&mut self, item: &'s ItemUse) {
        self.tree(&[], &item.tree);
    }

    fn visit_path(&mut self, path: &'s syn::Path) {
        let segments: Vec<String> = path
            .segments
            .iter()
            .map(|segment| segment.ident.to_string())
            .collect();
        self.name(&segments);
        visit::visit_path(self, path);
    }

    fn visit_macro(&mut self, invocation: &'s Macro) {
        self.tokens(invocation.tokens.clone());
    }
}

fn attributes(item: &Item) -> &[Attribute] {
    match item {
        Item::Mod(item) => &item.attrs,
        Item::Fn(item) => &item.attrs,
        Item::Use(item) => &item.attrs,
        Item::Impl(item) => &item.attrs,
        Item::Struct(item) => &item.attrs,
        Item::Const(item) => &item.attrs,
        _ => &[],
    }
}

/// `#[cfg(test)]`
fn is_test(attribute: &Attribute) -> bool {
    attribute.path().is_ident("cfg")
        && attribute
            .parse_args::<syn::Path>()
            .is_ok_and(|argument| argument.is_ident("test"))
}
