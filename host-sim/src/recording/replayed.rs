//! A flight again, from what path estimation made of it, where some sweeps hear nothing.

use std::collections::{BTreeMap, BTreeSet};

use cslam_firmware::app::Estimated;

use crate::flight_log::PoseTruth;
use crate::input::InputError;
use crate::raw_flight::{Given, Source};
use crate::sensors::Stamped;

/// The events of a source with paths that were kept of it ([`super::Keeper::replayed`]). It tells no truth of its sweeps.
#[derive(Debug)]
pub struct Replayed<'s, S> {
    pub(super) source: &'s S,
    pub(super) estimated: BTreeMap<u32, Estimated>,
    /// Sweeps that lose all paths.
    pub(super) silent: BTreeSet<u32>,
}

impl<S: Source> Source for Replayed<'_, S> {
    fn sweeps(&self) -> u32 {
        self.source.sweeps()
    }

    fn events(&self) -> Box<dyn Iterator<Item = Stamped> + '_> {
        self.source.events()
    }

    fn sweep(&self, sweep: u32) -> Result<Given, InputError> {
        let mut estimated = self.estimated.get(&sweep).cloned().unwrap_or_default();
        if self.silent.contains(&sweep) {
            estimated.paths.clear();
            estimated.sighted = None;
        }
        Ok(Given {
            estimated: Some(estimated),
            ..Given::default()
        })
    }

    fn truth(&self, uav_time_ns: u64) -> Option<PoseTruth> {
        self.source.truth(uav_time_ns)
    }
}

#[cfg(test)]
mod tests {
    use super::super::Keeper;
    use super::*;

    /// Three sweeps that were estimated already: three, four and five beams of each are left.
    #[derive(Debug)]
    struct Fixed;

    impl Source for Fixed {
        fn sweeps(&self) -> u32 {
            3
        }

        fn events(&self) -> Box<dyn Iterator<Item = Stamped> + '_> {
            Box::new(std::iter::empty())
        }

        fn sweep(&self, sweep: u32) -> Result<Given, InputError> {
            let mut estimated = Estimated {
                beams: 3 + sweep as u16,
                ..Estimated::default()
            };
            let path = cslam_core::paths::EstimatedPath {
                path: cslam_core::path::Path {
                    c_tau_m: 50.0,
                    aoa: cslam_core::geometry::Direction::from_zenith_azimuth(1.5, 0.0).expect("angles"),
                    aod: None,
                    covariance: cslam_core::geometry::Matrix3::identity(),
                },
                beam: 0,
                snr_db: 20.0,
                energy: 1.0,
                range_rate: None,
            };
            estimated.paths.push(path).expect("room for one");
            Ok(Given {
                estimated: Some(estimated),
                ..Given::default()
            })
        }

        fn truth(&self, _: u64) -> Option<PoseTruth> {
            None
        }
    }

    #[test]
    fn silent_sweeps_lose_their_paths_and_nothing_else() {
        let keeper = Keeper::new(&Fixed);
        for sweep in 0..3 {
            keeper.sweep(sweep).expect("given");
        }
        let replayed = keeper.replayed(BTreeSet::from([1]));
        let heard = |sweep| {
            let estimated = replayed.sweep(sweep).expect("kept").estimated.expect("estimated");
            (estimated.beams, estimated.paths.len())
        };
        assert_eq!([0, 1, 2].map(heard), [(3, 1), (4, 0), (5, 1)]);
        // One that was never given hears nothing.
        assert_eq!(heard(3), (0, 0));
    }
}
