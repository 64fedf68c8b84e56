//! Surfaces that the paths of a sweep suggest.

use super::learn::Seen;
use super::prior::{is_blocked, known};
use crate::surfaces::birth::{Birth, Known, from_pair, from_single};
use crate::surfaces::{SurfaceIds, Surfaces};

impl<const N: usize> Surfaces<N> {
    /// The surface that a single reflection off an unknown one suggests; its point waits with it.
    pub(super) fn bear_single<const K: usize>(&mut self, seen: &Seen<'_, K>) {
        if let Some(birth) = from_single(&seen.birth_path(), self.config()) {
            self.bear(seen, &birth, |id| SurfaceIds::from_slice(&[id]).ok());
        }
    }

    fn bear<const K: usize>(
        &mut self,
        seen: &Seen<'_, K>,
        birth: &Birth,
        chain: impl Fn(u16) -> Option<SurfaceIds>,
    ) {
        let transmitter_m = seen.sweep.transmitter.position_m.map(|c| c as f32);
        if let Some(id) = self.add(birth, &transmitter_m, seen.sweep.sweep)
            && let Some(chain) = chain(id)
        {
            self.enqueue(seen.waiting(chain));
        }
    }

    /// The other surface of a pair, that an unexplained path of several reflections suggests.
    pub(super) fn bear_pair<const K: usize>(&mut self, seen: &Seen<'_, K>) {
        if let Some((birth, of, which)) = self.other_of_pair(seen) {
            self.bear(seen, &birth, |id| {
                let chain = if which == Known::First { [of, id] } else { [id, of] };
                SurfaceIds::from_slice(&chain).ok()
            });
        }
    }

    /// Of all pairs with a confirmed surface the one whose departure fits best, with that surface and its place in the pair.
    fn other_of_pair<const K: usize>(&self, seen: &Seen<'_, K>) -> Option<(Birth, u16, Known)> {
        let several = seen.probabilities.is_some_and(|p| p.higher_order > 0.5);
        let departure = seen.measured.departure?;
        if !several || seen.measured.neighbourhood.may_be_artefact {
            return None;
        }
        let path = seen.birth_path();
        // The pose moves the point that the wave left for, by about as much as itself.
        let place_m2 = path.uav_covariance_m2.trace() / 3.0;
        let within = |way_m: f64| {
            let variance = seen.measured.noise.m44 + place_m2 / (way_m * way_m);
            f64::from(seen.config.gate_sigmas) * libm::sqrt(variance)
        };
        let mut best: Option<(f64, Birth, u16, Known)> = None;
        let store = known(self);
        for confirmed in store.iter().filter(|known| known.surface.is_confirmed()) {
            let id = confirmed.surface.id;
            for which in [Known::First, Known::Last] {
                let Some((birth, points)) = from_pair(&path, confirmed.surface, which, self.config()) else {
                    continue;
                };
                let [first, _] = &points;
                let way = first - path.transmitter_m;
                let way_m = way.norm();
                let off = (way / way_m - departure).norm();
                let ends = [&path.transmitter_m, &path.uav_m];
                let open = !is_blocked(&store, ends, &points, seen.config);
                let better = best.as_ref().is_none_or(|(least, ..)| off < *least);
                if off < within(way_m) && open && better {
                    best = Some((off, birth, id, which));
                }
            }
        }
        best.map(|(_, birth, id, which)| (birth, id, which))
    }
}
