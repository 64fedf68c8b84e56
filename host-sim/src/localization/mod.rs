//! Monte Carlo of localization: flights through a traced scene, sensed with every error of the budget, flown by the
//! filter that flies and by the paper's HPC.
//!
//! The samples are left out: a path's delay and directions come from the tracer, with the errors of both ends' arrays
//! from their physical causes ([`Hardware`]). So a flight of two minutes takes a second, and hundreds can be flown.
//! `docs/localization.md` holds the tables.

mod flights;
mod fly;
mod radio;
mod recorded;

pub use flights::{Heard, Planes, Prepared, TruePath, TrueSweep};
pub use fly::{Outliers, Record, Scenario, Start, fly};
pub use radio::{Ends, Hardware, RadioErrors};
pub use recorded::RecordedFlight;
