//! Monte Carlo of localization: flights through a traced scene, sensed with every error of the budget, flown by the
//! filter that flies and by the paper's HPC.
//!
//! The samples are left out: a path's delay and directions come from the tracer, with the errors of both ends' arrays
//! from their physical causes ([`Hardware`]). So a flight of two minutes takes a second, and hundreds can be flown.
//! `cslam reproduce localization` prints the tables, `docs/localization.md` holds them.

mod baseline;
mod figures;
mod flights;
mod fly;
mod lies;
mod phases;
mod radio;
mod recorded;

pub use baseline::{AttitudeSource, hpc};
pub use figures::Figures;
pub use flights::{Heard, Prepared, TruePath, TrueSweep, planes_of};
pub use fly::{Outliers, Record, Scenario, Start, fly};
pub use lies::{LieFigures, SHOWN_SIGMAS, fly_lie};
pub use phases::{OutageFigures, StartFigures, outage_start_s, sighted_start_s};
pub use radio::{Ends, Hardware, RadioErrors};
pub use recorded::RecordedFlight;
