//! The state of the ground station: every UAV, the merged map, and what was refused.
//!
//! It knows no clock, socket or page: packets and the time come in, so it can be tested and replayed. All of it is bounded: 256
//! link ids, a [`Cloud`] of stated capacity, and a fixed number of places, links and events for each UAV.

use std::collections::BTreeMap;

use super::cloud::{Came, Cloud, Size};
use super::model::{Event, Heard, Message};
use super::surfaces::Belongs;
use super::uav::Uav;

/// How many inputs are remembered by name.
const MOST_INPUTS: usize = 64;

/// Where packets come from.
#[derive(Clone, Debug, Default, PartialEq, serde::Serialize)]
pub struct Input {
    /// Bytes that came, damaged ones included.
    pub bytes: u64,
    /// What is wrong with it, in words; nothing when it is in order.
    pub trouble: Option<String>,
}

/// The state.
#[derive(Clone, Debug)]
pub struct Station {
    cloud: Cloud,
    uavs: BTreeMap<u8, Uav>,
    /// Frames that were refused, by reason.
    refused: BTreeMap<&'static str, u64>,
    inputs: BTreeMap<String, Input>,
}

impl Station {
    /// A station that has heard nothing.
    pub fn new(size: Size) -> Self {
        Self {
            cloud: Cloud::new(size),
            uavs: BTreeMap::new(),
            refused: BTreeMap::new(),
            inputs: BTreeMap::new(),
        }
    }

    /// Takes in a packet that took `bytes` bytes on the wire, at a time of the station, s. Whether it is news: an event may be told again.
    pub fn hear(&mut self, heard: &Heard, bytes: usize, now_s: f64) -> bool {
        let &Heard { uav: id, counter, .. } = heard;
        let uav = self.uavs.entry(id).or_default();
        let is_news = uav.hear(heard, bytes, now_s);
        match &heard.message {
            Message::Points { points } => {
                for point in points {
                    let surface = match uav.surfaces.belongs(id, counter, point.surface) {
                        Belongs::Nowhere => None,
                        Belongs::To(surface) => Some(surface),
                        Belongs::Withdrawn => {
                            self.cloud.leave_out();
                            continue;
                        }
                    };
                    self.cloud.insert(
                        Came {
                            uav: id,
                            counter,
                            surface,
                        },
                        point,
                        now_s as f32,
                    );
                }
            }
            Message::Event(Event {
                change: Some(change), ..
            }) => {
                for step in uav.surfaces.change(id, counter, *change) {
                    self.cloud.follow(&step);
                }
            }
            _ => {}
        }
        is_news
    }

    /// Counts a frame that was refused.
    pub fn refuse(&mut self, reason: &'static str) {
        *self.refused.entry(reason).or_default() += 1;
    }

    /// Counts bytes of an input.
    pub fn input(&mut self, name: &str, bytes: usize) {
        if let Some(input) = self.inputs.get_mut(name) {
            input.bytes += bytes as u64;
        } else if self.inputs.len() < MOST_INPUTS {
            let input = Input {
                bytes: bytes as u64,
                trouble: None,
            };
            self.inputs.insert(name.to_owned(), input);
        }
    }

    /// Says what is wrong with an input, or that it is in order again.
    pub fn trouble(&mut self, name: &str, trouble: Option<String>) {
        self.input(name, 0);
        if let Some(input) = self.inputs.get_mut(name) {
            input.trouble = trouble;
        }
    }

    /// The merged map.
    pub fn cloud(&self) -> &Cloud {
        &self.cloud
    }

    /// The merged map, for whoever takes its changes.
    pub fn cloud_mut(&mut self) -> &mut Cloud {
        &mut self.cloud
    }

    /// Every UAV by link id.
    pub fn uavs(&self) -> &BTreeMap<u8, Uav> {
        &self.uavs
    }

    /// Every UAV, for whoever takes its changes.
    pub fn uavs_mut(&mut self) -> &mut BTreeMap<u8, Uav> {
        &mut self.uavs
    }

    /// Frames that were refused, by reason.
    pub fn refused(&self) -> &BTreeMap<&'static str, u64> {
        &self.refused
    }

    /// Inputs by name.
    pub fn inputs(&self) -> &BTreeMap<String, Input> {
        &self.inputs
    }
}

#[cfg(test)]
mod tests;
