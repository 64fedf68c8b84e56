//! The numbers of the flight code, and where each comes from: read off the sources, printed as `docs/constants.md`.
//!
//! A number says where it comes from in the last paragraph of its doc comment, which begins with the name of its [`Class`]:
//! `/// Derived: one beam of noise in forty is beyond.` A structure or a file (`//!`) may say so for all its numbers that do not
//! say it themselves. An expression of other constants alone needs no such line.

mod effect;
mod scan;
mod table;

use std::fs;
use std::path::Path;

pub use effect::{Effect, Effects};
pub use table::page;

/// Where a number comes from.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum Class {
    /// From outside: mathematics, physics, a format, a data sheet, the error budget, what is asked for.
    Given,
    /// From other numbers: a formula, the quantile of a stated rate.
    Derived,
    /// Read off a measurement that the text names.
    Measured,
    /// A bound of memory or of work.
    Capacity,
    /// A step, a guard or a tolerance of an iteration, beside which the result does not change.
    Numerical,
    /// None of these: chosen by what flights make of it.
    Tuned,
}

impl Class {
    /// Every class, in the order of the page.
    pub const ALL: [Self; 6] = [
        Self::Tuned,
        Self::Measured,
        Self::Derived,
        Self::Given,
        Self::Capacity,
        Self::Numerical,
    ];

    /// Its name in doc comments and on the page.
    #[must_use]
    pub const fn name(self) -> &'static str {
        match self {
            Self::Given => "Given",
            Self::Derived => "Derived",
            Self::Measured => "Measured",
            Self::Capacity => "Capacity",
            Self::Numerical => "Numerical",
            Self::Tuned => "Tuned",
        }
    }
}

/// Where a number comes from, as its text says.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Source {
    /// Which kind.
    pub class: Class,
    /// The rest of the paragraph.
    pub text: String,
}

/// A number of the flight code.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Constant {
    /// Room of [`ROOMS`].
    pub room: &'static str,
    /// File below `core/src`.
    pub file: String,
    /// Name of a constant, `Structure.field` of a default.
    pub name: String,
    /// Its expression as it is written.
    pub value: String,
    /// How many numbers it is: one, or those of a list that are literals.
    pub numbers: usize,
    /// Where it comes from; `None` where no text says so.
    pub source: Option<Source>,
}

impl Constant {
    /// What tells it apart: its name behind those of its room and its file, without folders; a default has its structure instead.
    #[must_use]
    pub fn key(&self) -> String {
        if self.name.contains('.') {
            return self.name.clone();
        }
        let path = Path::new(&self.file).with_extension("");
        let path = if path.ends_with("mod") {
            path.parent().unwrap_or(&path)
        } else {
            &path
        };
        let stem = path.file_name().unwrap_or_default().to_string_lossy();
        format!("{}.{stem}.{}", self.room, self.name)
    }
}

/// Rooms whose numbers are on the page, each with its folders below `core/src`.
pub const ROOMS: [(&str, &[&str]); 7] = [
    ("paths", &["kernels", "paths", "signal"]),
    ("surfaces", &["surfaces"]),
    ("association", &["association"]),
    ("estimator", &["estimator"]),
    ("inertial", &["inertial"]),
    ("receiver", &["receiver", "beam_squint"]),
    ("map", &["map"]),
];

/// Rooms whose tuned numbers are counted together, and the most that they may have.
pub const COUNTED: (&[&str], usize) = (&["paths", "surfaces", "association", "estimator"], 40);

/// What the sources of the rooms hold.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Found {
    /// Numbers, room by room and file by file.
    pub constants: Vec<Constant>,
    /// Conditions with a number that has no name: file, line and condition.
    pub nameless: Vec<String>,
}

impl Found {
    /// What is not as this module asks for, a line each.
    #[must_use]
    pub fn wrong(&self) -> Vec<String> {
        let classes = Class::ALL.map(|class| format!("`{}:`", class.name())).join(", ");
        let unsaid = self.constants.iter().filter(|constant| constant.source.is_none());
        let unsaid = unsaid.map(|constant| {
            format!(
                "core/src/{}: {} does not say where it comes from: expected a last paragraph of its doc comment that begins with one of {classes}",
                constant.file, constant.name
            )
        });
        let nameless = self
            .nameless
            .iter()
            .map(|condition| format!("{condition}: expected a constant with a name"));
        unsaid.chain(nameless).collect()
    }
}

/// Everything in the rooms of the flight code.
///
/// # Panics
/// When a room is not there, or a source cannot be read as Rust: with its name.
#[must_use]
pub fn found() -> Found {
    let core = crate::root().join("core/src");
    let mut found = Found::default();
    for (room, places) in ROOMS {
        for place in places {
            for file in crate::files(&core.join(place), &[".rs"]) {
                if is_of_tests(file.strip_prefix(&core).unwrap_or(&file)) {
                    continue;
                }
                let text = fs::read_to_string(&file).unwrap_or_else(|e| panic!("{}: {e}", file.display()));
                let below = file.strip_prefix(&core).unwrap_or(&file);
                scan::scan(room, &below.to_string_lossy(), &text, &mut found);
            }
        }
    }
    found
}

/// Whether a file of core holds tests alone.
fn is_of_tests(file: &Path) -> bool {
    file.iter().any(|part| {
        let name = part.to_string_lossy();
        name == "tests" || name == "tests.rs" || name.ends_with("_tests.rs")
    })
}
