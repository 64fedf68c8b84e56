//! The ground station: hears UAVs over UDP, a serial port or from a file, merges their maps, records, passes on, and shows a
//! live page.
//!
//! Packets come in on one thread ([`engine`]) that owns decoders and outputs; the state ([`station`]) lies behind a lock in the
//! [`hub`], from which a web server ([`page`]) on another thread tells every open page what has changed.

pub mod cloud;
pub mod hub;
pub mod inputs;
pub mod losses;
pub mod mavlink;
pub mod model;
pub mod page;
pub mod record;
pub mod station;
pub mod trail;
pub mod uav;
