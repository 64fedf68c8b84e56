//! A flight that is flown from its samples once, and then again from its paths: with other faults of its sensors, with a GMT
//! that lies, without line of sight for a while, with measurements that do not err, with another localization. The whole receiver flies, at about a hundredth of the work.

mod again;
mod blocked;
mod error_free;
mod errors;
mod flight;
mod lies;
mod outages;
mod phases;
mod starts;
mod straight;

pub use blocked::Blocked;
pub use error_free::ErrorFree;
pub use errors::{PoseErrors, pose_errors};
pub use flight::{Changes, KeptFlight};
pub use lies::{LieFigures, SHOWN_SIGMAS, fly_lie};
pub use outages::{OutageEnd, fly_outage, outage_start_s};
pub use phases::{Phase, PhasedSweep, STARTING_S, fly_phases};
pub use starts::{Conditions, Start, SwitchOn, WATCHED_S, WRONG_SIGMAS, fly_start};
