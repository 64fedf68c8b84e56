//! Numbers of a source: constants, defaults of structures, and conditions that hold a number without a name.

use std::collections::BTreeMap;

use syn::spanned::Spanned;
use syn::visit::{self, Visit};
use syn::{Attribute, Expr, ExprBinary, ExprLit, ExprStruct, Fields, ItemImpl, ItemStruct, Lit, Meta, Type};

use super::{Class, Constant, Found, Source};

/// Literals that no condition must name: a half, and counts up to four.
const PLAIN: [f64; 6] = [0.0, 0.5, 1.0, 2.0, 3.0, 4.0];

/// Adds what a source of a room holds.
///
/// # Panics
/// When it cannot be read as Rust.
pub(super) fn scan(room: &'static str, file: &str, text: &str, found: &mut Found) {
    let syntax = syn::parse_file(text).unwrap_or_else(|e| panic!("{file}: {e}"));
    let mut scanner = Scanner {
        room,
        file,
        of_file: source(&syntax.attrs),
        of_struct: BTreeMap::new(),
        of_default: None,
        found,
    };
    // Defaults stand behind their structure, or before it.
    for item in &syntax.items {
        if let syn::Item::Struct(item) = item {
            scanner.structure(item);
        }
    }
    scanner.visit_file(&syntax);
}

struct Scanner<'a> {
    room: &'static str,
    file: &'a str,
    of_file: Option<Source>,
    /// Source of each structure's field: its own, or that of the structure.
    of_struct: BTreeMap<String, BTreeMap<String, Option<Source>>>,
    /// Structure whose default is looked at.
    of_default: Option<String>,
    found: &'a mut Found,
}

impl Scanner<'_> {
    fn structure(&mut self, item: &ItemStruct) {
        let whole = source(&item.attrs);
        let mut fields = BTreeMap::new();
        if let Fields::Named(named) = &item.fields {
            for field in &named.named {
                let name = field.ident.as_ref().map(ToString::to_string).unwrap_or_default();
                fields.insert(name, source(&field.attrs).or_else(|| whole.clone()));
            }
        }
        self.of_struct.insert(item.ident.to_string(), fields);
    }

    fn constant(&mut self, name: &str, own: Option<Source>, kind: Option<&Type>, value: &Expr) {
        let mut numbers = Numbers::default();
        numbers.visit_expr(value);
        let is_primitive = kind.map_or_else(|| !matches!(value, Expr::Call(_) | Expr::Repeat(_)), is_number);
        let is_plain = numbers
            .literals
            .iter()
            .all(|&number| PLAIN[..4].contains(&number));
        if (numbers.literals.is_empty() && !numbers.has_constant)
            || (is_plain && !is_primitive)
            || (numbers.literals.is_empty() && !is_primitive)
        {
            return;
        }
        let in_code = || {
            (is_plain && numbers.has_constant).then(|| Source {
                class: Class::Derived,
                text: "in code.".into(),
            })
        };
        self.found.constants.push(Constant {
            room: self.room,
            file: self.file.to_owned(),
            name: name.to_owned(),
            value: written(value),
            numbers: count(value),
            source: own.or_else(in_code).or_else(|| self.of_file.clone()),
        });
    }
}

impl<'ast> Visit<'ast> for Scanner<'_> {
    fn visit_item_mod(&mut self, item: &'ast syn::ItemMod) {
        if !is_of_tests(&item.attrs) {
            visit::visit_item_mod(self, item);
        }
    }

    fn visit_item_fn(&mut self, item: &'ast syn::ItemFn) {
        if !is_of_tests(&item.attrs) {
            visit::visit_item_fn(self, item);
        }
    }

    fn visit_impl_item_fn(&mut self, item: &'ast syn::ImplItemFn) {
        if !is_of_tests(&item.attrs) {
            visit::visit_impl_item_fn(self, item);
        }
    }

    fn visit_item_const(&mut self, item: &'ast syn::ItemConst) {
        if !is_of_tests(&item.attrs) {
            self.constant(
                &item.ident.to_string(),
                source(&item.attrs),
                Some(&item.ty),
                &item.expr,
            );
        }
    }

    fn visit_impl_item_const(&mut self, item: &'ast syn::ImplItemConst) {
        self.constant(
            &item.ident.to_string(),
            source(&item.attrs),
            Some(&item.ty),
            &item.expr,
        );
    }

    fn visit_item_impl(&mut self, item: &'ast ItemImpl) {
        if is_of_tests(&item.attrs) {
            return;
        }
        let is_default = item
            .trait_
            .as_ref()
            .is_some_and(|(_, path, _)| path.is_ident("Default"));
        if is_default && let Type::Path(path) = &*item.self_ty {
            self.of_default = path.path.segments.last().map(|s| s.ident.to_string());
        }
        visit::visit_item_impl(self, item);
        self.of_default = None;
    }

    fn visit_expr_struct(&mut self, value: &'ast ExprStruct) {
        let is_self = value.path.is_ident("Self");
        if let (true, Some(structure)) = (is_self, self.of_default.clone()) {
            for field in &value.fields {
                let name = match &field.member {
                    syn::Member::Named(name) => name.to_string(),
                    syn::Member::Unnamed(index) => index.index.to_string(),
                };
                let own = self
                    .of_struct
                    .get(&structure)
                    .and_then(|fields| fields.get(&name));
                let own = own.cloned().flatten();
                self.constant(&format!("{structure}.{name}"), own, None, &field.expr);
            }
        }
        visit::visit_expr_struct(self, value);
    }

    fn visit_expr_binary(&mut self, value: &'ast ExprBinary) {
        use syn::BinOp::{Ge, Gt, Le, Lt};
        if matches!(value.op, Lt(_) | Le(_) | Gt(_) | Ge(_)) {
            let mut numbers = Numbers::default();
            numbers.visit_expr_binary(value);
            if numbers.decimals.iter().any(|number| !PLAIN.contains(number)) {
                let line = value.span().start().line;
                let text = format!("core/src/{}:{line}: {}", self.file, written(value));
                self.found.nameless.push(text);
            }
        }
        visit::visit_expr_binary(self, value);
    }
}

/// Numbers of an expression.
#[derive(Default)]
struct Numbers {
    /// Every literal.
    literals: Vec<f64>,
    /// Those with a point or an exponent.
    decimals: Vec<f64>,
    /// Whether it names a constant.
    has_constant: bool,
}

impl<'ast> Visit<'ast> for Numbers {
    fn visit_expr_lit(&mut self, literal: &'ast ExprLit) {
        match &literal.lit {
            Lit::Int(number) => self
                .literals
                .extend(number.base10_parse::<u64>().map(|n| n as f64)),
            Lit::Float(number) => {
                let value = number.base10_parse::<f64>();
                self.literals.extend(value.iter());
                self.decimals.extend(value.iter());
            }
            _ => {}
        }
    }

    fn visit_path(&mut self, path: &'ast syn::Path) {
        let name = path.segments.last().map(|segment| segment.ident.to_string());
        self.has_constant |= name.is_some_and(|name| {
            name.len() > 1
                && name
                    .chars()
                    .all(|c| c.is_ascii_uppercase() || c.is_ascii_digit() || c == '_')
        });
        visit::visit_path(self, path);
    }
}

/// How many numbers an expression is: those of a list that name no other constant.
fn count(value: &Expr) -> usize {
    let of = |elements: &syn::punctuated::Punctuated<Expr, syn::Token![,]>| {
        let is_own = |element: &&Expr| {
            let mut numbers = Numbers::default();
            numbers.visit_expr(element);
            !numbers.literals.is_empty()
        };
        elements.iter().filter(is_own).count().max(1)
    };
    match value {
        Expr::Tuple(tuple) => of(&tuple.elems),
        Expr::Array(array) => of(&array.elems),
        _ => 1,
    }
}

/// Whether a constant of this type is a number, or a list of numbers.
fn is_number(kind: &Type) -> bool {
    match kind {
        Type::Path(path) => path.path.get_ident().is_some_and(|name| {
            let name = name.to_string();
            let bits = name.trim_start_matches(['f', 'u', 'i']);
            ["8", "16", "32", "64", "128", "size"].contains(&bits)
        }),
        Type::Array(array) => is_number(&array.elem),
        Type::Tuple(tuple) => !tuple.elems.is_empty() && tuple.elems.iter().all(is_number),
        _ => false,
    }
}

fn is_of_tests(attributes: &[Attribute]) -> bool {
    attributes.iter().any(|attribute| {
        attribute.path().is_ident("test")
            || (attribute.path().is_ident("cfg") && written(&attribute.meta).contains("test"))
    })
}

/// What is written, on one line.
fn written(syntax: &impl Spanned) -> String {
    let text = syntax.span().source_text().unwrap_or_default();
    text.split_whitespace().collect::<Vec<_>>().join(" ")
}

/// What the last paragraph of a doc comment says of where a number comes from.
pub(super) fn source(attributes: &[Attribute]) -> Option<Source> {
    let mut found: Option<Source> = None;
    for attribute in attributes {
        let Meta::NameValue(pair) = &attribute.meta else {
            continue;
        };
        let Expr::Lit(ExprLit {
            lit: Lit::Str(line), ..
        }) = &pair.value
        else {
            continue;
        };
        let line = line.value();
        let line = line.trim();
        let class = Class::ALL.into_iter().find_map(|class| {
            let rest = line.strip_prefix(class.name())?.strip_prefix(':')?;
            Some((class, rest.trim().to_owned()))
        });
        match (class, &mut found) {
            (Some((class, text)), _) => found = Some(Source { class, text }),
            // A blank line ends the paragraph: what follows is no source.
            (None, Some(_)) if line.is_empty() => return None,
            (None, Some(source)) => source.text = format!("{} {line}", source.text),
            (None, None) => {}
        }
    }
    found.filter(|source| !source.text.is_empty())
}
