//! Surfaces of a UAV as its events tell of them: on which surface a point lies in the end, in whatever order packets come.
//!
//! An event concerns the points of packets before it. Points that are in the map already follow it there; for those that come late,
//! the last changes are remembered, as far back as packets may come late.

use cslam_core::telemetry::REORDERING;

use super::model::SurfaceChange;

/// A surface of a UAV.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub struct SurfaceId {
    /// Link id of the UAV.
    pub uav: u8,
    /// Which of its lives: numbers begin anew when it restarts.
    pub life: u16,
    /// Its number.
    pub number: u16,
}

/// Where a point belongs.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Belongs {
    /// To no surface.
    Nowhere,
    /// To this one.
    To(SurfaceId),
    /// To one that was withdrawn after the point was sent.
    Withdrawn,
}

/// The lives and last changes of a UAV's surfaces.
#[derive(Clone, Debug, Default)]
pub struct Surfaces {
    life: u16,
    /// First packet of this life.
    first: u32,
    newest: u32,
    /// Number of the packet and what it told, in the order of sending: [`REORDERING`] at most.
    changes: Vec<(u32, SurfaceChange)>,
}

impl Surfaces {
    /// The UAV has begun anew with this packet.
    pub fn restart(&mut self, counter: u32) {
        self.life = self.life.wrapping_add(1);
        self.first = counter;
        self.changes.clear();
    }

    /// A surface of the life that a packet belongs to.
    fn id(&self, uav: u8, counter: u32, number: u16) -> SurfaceId {
        let former = u16::from(counter < self.first);
        SurfaceId {
            uav,
            life: self.life.wrapping_sub(former),
            number,
        }
    }

    /// Where a point of a packet belongs by all that was told since.
    pub fn belongs(&self, uav: u8, counter: u32, surface: Option<u16>) -> Belongs {
        let Some(mut number) = surface else {
            return Belongs::Nowhere;
        };
        let since = self.changes.iter().filter(|(told, _)| *told > counter);
        for (_, change) in since {
            match *change {
                SurfaceChange::Withdrawn(gone) if gone == number => return Belongs::Withdrawn,
                SurfaceChange::Merged { gone, stays } if gone == number => number = stays,
                _ => {}
            }
        }
        Belongs::To(self.id(uav, counter, number))
    }

    /// A packet tells of a change. Gives all that the map has to follow, in their order: the change, and what was told after it, which
    /// overtook it.
    pub fn change(&mut self, uav: u8, counter: u32, change: SurfaceChange) -> Vec<Step> {
        let place = self.changes.partition_point(|(told, _)| *told < counter);
        self.changes.insert(place, (counter, change));
        let steps = self.changes.iter().skip(place).map(|&(before, change)| {
            let id = |number| self.id(uav, before, number);
            match change {
                SurfaceChange::Withdrawn(number) => Step::Withdraw {
                    surface: id(number),
                    before,
                },
                SurfaceChange::Merged { gone, stays } => Step::Merge {
                    gone: id(gone),
                    stays: id(stays),
                    before,
                },
            }
        });
        let steps = steps.collect();
        self.newest = self.newest.max(counter);
        let kept = self.newest.saturating_sub(REORDERING);
        self.changes.retain(|(told, _)| *told >= kept);
        steps
    }
}

/// What the map has to do to points of packets before one.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Step {
    /// They leave the map.
    Withdraw {
        /// Their surface.
        surface: SurfaceId,
        /// Number of the packet that told.
        before: u32,
    },
    /// They are of another surface.
    Merge {
        /// Their surface.
        gone: SurfaceId,
        /// That which they are of now.
        stays: SurfaceId,
        /// Number of the packet that told.
        before: u32,
    },
}
