//! What speaks against surfaces in a sweep.

use heapless::Vec;

use super::chain::Chain;
use super::config::AssociationConfig;
use super::learn::SweepPaths;
use super::prior::{is_blocked, known};
use super::verdict::{Association, Verdict};
use crate::surfaces::{Kind, Surfaces};

impl<const N: usize> Surfaces<N> {
    /// Counts in what speaks against surfaces: reflections that should have been seen, lines of sight through a surface, its paths through confirmed ones.
    pub(super) fn count_against<const K: usize>(
        &mut self,
        association: &Association<K>,
        sweep: &SweepPaths<'_, K>,
        config: &AssociationConfig,
    ) {
        let own = *self.config();
        for (id, odds) in self.against(association, sweep, config) {
            if let Some(surface) = self.get_mut(id) {
                surface.add_log_odds(odds, &own);
            }
        }
    }

    /// Log-odds against each surface that something speaks against.
    fn against<const K: usize>(
        &self,
        association: &Association<K>,
        sweep: &SweepPaths<'_, K>,
        config: &AssociationConfig,
    ) -> Vec<(u16, f32), N> {
        let own = self.config();
        let (transmitter_m, uav_m) = (&sweep.transmitter.position_m, &sweep.pose.position_m);
        let seen_straight = association.verdicts.iter().any(Verdict::is_line_of_sight);
        let mut against = Vec::<(u16, f32), N>::new();
        let store = known(self);
        for known in store.iter().filter(|known| known.surface.kind != Kind::Ground) {
            let surface = known.surface;
            let mut odds = 0.0;
            if seen_straight && surface.stands_between(transmitter_m, uav_m, config.clear_m) {
                odds -= own.contradiction_log_odds;
            }
            let contradicted = |verdict: &Verdict| verdict.contradicts == Some(surface.id);
            if association.verdicts.iter().any(contradicted) {
                odds -= own.contradiction_log_odds;
            }
            let in_front = |verdict: &Verdict| verdict.chain.contains(&surface.id);
            let predicted = Chain::over(core::slice::from_ref(&known.plane)).predict(transmitter_m, uav_m);
            if let Some(predicted) = predicted
                && !association.verdicts.iter().any(in_front)
                && predicted
                    .points
                    .iter()
                    .all(|point| surface.outside_m(point) <= own.same_m)
                && sweep.transmitter.leaves_in_beams(&predicted.departure)
                && !is_blocked(&store, [transmitter_m, uav_m], &predicted.points, config)
            {
                odds += own.missed_log_odds();
            }
            if odds < 0.0 {
                // There is room for all of them.
                let _fits = against.push((surface.id, odds));
            }
        }
        against
    }
}
