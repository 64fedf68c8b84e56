//! What became of surfaces, for the ground to be told again: an event may be lost, and then its map would keep points that the
//! receiver's has not.
//!
//! The last [`KEPT`] events are kept and told in turn, one with each report of health, so that the ground's map is right in the end
//! however long nothing was heard. The ground takes an event for every point that went out before it, so one that is told again
//! must not come behind a new point of a surface that it withdraws: before that point it is told for the last time, together with
//! all events before it, for their order matters.

use cslam_core::telemetry::{Event, EventReport};
use heapless::Deque;

/// Most events that are told again; the oldest makes room. Surfaces change a few times a minute.
const KEPT: usize = 8;

/// Events of surfaces, the oldest first.
#[derive(Clone, Debug)]
pub(super) struct SurfaceNews {
    events: Deque<EventReport, KEPT>,
    /// Place of the one that is told next.
    turn: usize,
}

impl SurfaceNews {
    /// Nothing to tell.
    pub(super) const fn new() -> Self {
        Self {
            events: Deque::new(),
            turn: 0,
        }
    }

    /// Keeps an event if it is one of a surface, and says whether it is.
    pub(super) fn keep(&mut self, report: &EventReport) -> bool {
        let is_kept = matches!(
            report.event,
            Event::SurfaceWithdrawn(_) | Event::SurfaceMerged { .. }
        );
        if is_kept {
            if self.events.is_full() {
                self.forget_oldest();
            }
            let _fits = self.events.push_back(*report);
        }
        is_kept
    }

    /// The event whose turn it is.
    pub(super) fn next(&mut self) -> Option<EventReport> {
        if self.turn >= self.events.len() {
            self.turn = 0;
        }
        let report = self.events.iter().nth(self.turn).copied();
        self.turn += 1;
        report
    }

    /// How many events there are up to the last one that withdraws this surface, itself included.
    pub(super) fn until_withdrawn(&self, surface: Option<u16>) -> usize {
        let Some(surface) = surface else { return 0 };
        let withdraws = |report: &EventReport| report.event == Event::SurfaceWithdrawn(surface);
        (1..)
            .zip(&self.events)
            .filter(|(_, report)| withdraws(report))
            .map(|(place, _)| place)
            .last()
            .unwrap_or(0)
    }

    /// The oldest event, which is not told again.
    pub(super) fn forget_oldest(&mut self) -> Option<EventReport> {
        self.turn = self.turn.saturating_sub(1);
        self.events.pop_front()
    }
}

#[cfg(test)]
mod tests {
    extern crate std;

    use std::format;
    use std::string::String;
    use std::vec::Vec;

    use cslam_core::telemetry::{Decoder, HealthReport, Key, Message, PointReport};

    use super::super::Downlink;
    use super::*;

    fn event(event: Event) -> Message {
        Message::Event(EventReport {
            time_ns: 5_000,
            event,
        })
    }

    fn withdrawn(surface: u16) -> Message {
        event(Event::SurfaceWithdrawn(surface))
    }

    fn merged(gone: u16, stays: u16) -> Message {
        event(Event::SurfaceMerged { gone, stays })
    }

    fn point(surface: u16) -> PointReport {
        PointReport {
            sweep: 7,
            stop: 0,
            position_m: [1.0, 2.0, 3.0],
            sigma_m: 0.1,
            probability: 1.0,
            surface: Some(surface),
        }
    }

    /// What goes out, each message in a few letters.
    fn heard(downlink: &mut Downlink) -> Vec<String> {
        let mut decoder = Decoder::new(1, &Key::TEST);
        let (mut heard, mut bytes) = (Vec::new(), [0; super::super::QUEUE]);
        let length = downlink.take(&mut bytes);
        for byte in &bytes[..length] {
            let Some(packet) = decoder.push(*byte) else {
                continue;
            };
            heard.push(match packet.expect("sound").message {
                Message::Points(points) => format!("{} points", points.len()),
                Message::Event(report) => match report.event {
                    Event::SurfaceWithdrawn(surface) => format!("{surface} goes"),
                    Event::SurfaceMerged { gone, stays } => format!("{gone} into {stays}"),
                    other => format!("{other:?}"),
                },
                _ => "health".into(),
            });
        }
        heard
    }

    fn link() -> Downlink {
        Downlink::new(1, &Key::TEST, 0)
    }

    #[test]
    fn points_that_wait_go_before_an_event_of_a_surface() {
        let mut downlink = link();
        downlink.point(0, &point(3));
        downlink.send(&event(Event::Refixed));
        downlink.send(&withdrawn(3));
        assert_eq!(heard(&mut downlink), ["Refixed", "1 points", "3 goes"]);
    }

    #[test]
    fn events_of_surfaces_are_told_again_in_turn() {
        let mut downlink = link();
        downlink.send(&merged(4, 2));
        downlink.send(&withdrawn(2));
        heard(&mut downlink);
        for _ in 0..3 {
            downlink.send(&Message::Health(HealthReport::default()));
        }
        let told = ["health", "4 into 2", "health", "2 goes", "health", "4 into 2"];
        assert_eq!(heard(&mut downlink), told);
        // The oldest makes room.
        for surface in 10..10 + KEPT as u16 {
            downlink.send(&withdrawn(surface));
        }
        heard(&mut downlink);
        for _ in 0..KEPT {
            downlink.send(&Message::Health(HealthReport::default()));
        }
        let told = heard(&mut downlink);
        assert!(
            told.contains(&"10 goes".into()) && !told.contains(&"2 goes".into()),
            "{told:?}"
        );
    }

    #[test]
    fn a_new_point_of_a_withdrawn_surface_is_behind_the_last_word_on_it() {
        let mut downlink = link();
        for message in [merged(4, 2), withdrawn(2), withdrawn(9)] {
            downlink.send(&message);
        }
        heard(&mut downlink);
        downlink.point(0, &point(3));
        assert!(
            heard(&mut downlink).is_empty(),
            "nothing was withdrawn of surface 3"
        );
        downlink.point(0, &point(2));
        assert_eq!(heard(&mut downlink), ["4 into 2", "2 goes"]);
        downlink.point(0, &point(2));
        downlink.close_batch();
        downlink.send(&Message::Health(HealthReport::default()));
        downlink.send(&Message::Health(HealthReport::default()));
        let told = ["3 points", "health", "9 goes", "health", "9 goes"];
        assert_eq!(heard(&mut downlink), told);
    }
}
