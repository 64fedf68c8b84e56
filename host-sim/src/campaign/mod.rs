//! Many flights, and what they say together: scenes, seeds, worlds and modes.
//!
//! Every flight leaves a shard of its own, a file that says how it was flown and holds its whole report. So a campaign that was ended goes
//! on where it was, shards of several machines can lie in one directory, and two builds are compared flight by flight.

mod compare;
mod constants;
mod effects;
mod figure;
mod seeds;
mod shard;
mod summary;

pub use compare::{Comparison, compare};
pub use constants::{AS_THEY_ARE, Constant, ConstantsTable, Varied};
pub use effects::{EffectsTable, alone, left_out};
pub use figure::{FIGURES, Figure, number};
pub use seeds::{Lists, Purpose};
pub use shard::{Build, Flight, Shard, read_shards};
pub use summary::{Summary, Worst};
