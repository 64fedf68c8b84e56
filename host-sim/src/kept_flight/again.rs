//! A world whose sweeps have been estimated already, with sensors of another one.

use std::borrow::Cow;

use cslam_core::constants::SPEED_OF_LIGHT_M_PER_S;
use cslam_firmware::app::Estimated;

use super::blocked::Blocked;
use super::error_free::ErrorFree;
use crate::flight_log::PoseTruth;
use crate::input::InputError;
use crate::paths::Link;
use crate::raw_flight::{Given, Source};
use crate::recording::Span;
use crate::sensors::Stamped;
use crate::world::World;

/// The events of `faulty`, the paths of `sound`: worlds that differ in their sensors only.
#[derive(Debug)]
pub(super) struct Again<'a> {
    /// The world in which the paths were estimated.
    pub(super) sound: &'a World<'a>,
    /// The world that is flown.
    pub(super) faulty: &'a World<'a>,
    /// All but samples, of the faulty one.
    pub(super) events: Cow<'a, [Stamped]>,
    /// Of sweeps 0, 1, 2 ...
    pub(super) estimated: &'a [Estimated],
    /// The same: what is there in truth.
    pub(super) links: &'a [Link],
    /// What is heard where the line of sight is blocked.
    pub(super) blocked: Option<&'a Blocked>,
    /// The part that is heard; all when absent.
    pub(super) heard: Option<Span>,
    /// What has no errors.
    pub(super) error_free: &'a [ErrorFree],
}

impl Source for Again<'_> {
    fn sweeps(&self) -> u32 {
        u32::try_from(self.estimated.len()).unwrap_or(u32::MAX)
    }

    fn events(&self) -> Box<dyn Iterator<Item = Stamped> + '_> {
        let heard = |stamped: &&Stamped| {
            let time_s = stamped.uav_time_ns as f64 * 1e-9;
            self.heard.is_none_or(|span| span.contains(time_s))
        };
        Box::new(self.events.iter().filter(heard).copied())
    }

    fn sweep(&self, sweep: u32) -> Result<Given, InputError> {
        let [sound, faulty] = [self.sound, self.faulty].map(|world| world.flight().sweep_truth(sweep));
        // All delays are read on the UAV's clock.
        let later_m = (faulty.clock_offset_s - sound.clock_offset_s) * SPEED_OF_LIGHT_M_PER_S;
        let blocked = self.blocked.filter(|blocked| blocked.span.contains(sound.time_s));
        let estimated = blocked.map_or(self.estimated, |blocked| &blocked.estimated);
        let kept = estimated.get(sweep as usize).cloned();
        let link = self.links.get(sweep as usize);
        let estimated = kept.zip(link).map(|(estimated, link)| {
            let estimated = ErrorFree::paths(self.error_free, estimated, &sound, link);
            if later_m == 0.0 {
                estimated
            } else {
                later(estimated, later_m as f32)
            }
        });
        Ok(Given {
            estimated,
            truth: link.map(|link| (PoseTruth::from(&faulty), link.clone())),
            ..Given::default()
        })
    }

    fn truth(&self, uav_time_ns: u64) -> Option<PoseTruth> {
        self.faulty.truth(uav_time_ns)
    }
}

/// A sweep whose delays are longer by this, m.
fn later(mut estimated: Estimated, by_m: f32) -> Estimated {
    for path in &mut estimated.paths {
        path.path.c_tau_m += by_m;
    }
    if let Some((_, Ok(bearing))) = &mut estimated.sighted
        && let Some(delay) = &mut bearing.delay
    {
        delay.c_tau_m += by_m;
    }
    estimated
}
