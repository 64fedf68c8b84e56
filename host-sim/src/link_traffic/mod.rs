//! What the link to the ground costs, and what it does when the radio loses packets.
//!
//! [`Budget`]: bytes by kind of message, over a flight. [`loss`]: a grid of losses, bursts and reordering, and what of the map
//! arrives. [`damage`]: bytes lost, changed and inserted on a serial line, and how soon the receiver is in step again.

mod budget;
mod channel;
pub mod damage;
pub mod loss;

pub use budget::{BAUD, Budget, BudgetRow, rivals};
