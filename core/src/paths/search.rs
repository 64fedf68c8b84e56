//! What the search of a beam works with: its tools, the beam, and what was found in it.

use heapless::Vec;

use super::cancel::{Change, Source, change, reach};
use super::cholesky::spread;
use super::effort::{Effort, Work};
use super::fit::{Fit, fit};
use super::grid::AngleGrid;
use super::meter::{Meter, Stage, within};
use super::model::ArrayModel;
use super::place::Place;
use super::template::Template;
use super::window::Window;
use crate::kernels::stages::Channel;
use crate::paths::warm_start::{KnownPaths, Levels};
use crate::signal::{Detector, SAMPLES};

/// Sources cancelled in a beam: paths, and remainders that the arrays' errors leave behind.
/// Capacity: memory of a beam.
pub(super) const SOURCES: usize = 8;
/// Steps of a single fit.
/// Capacity: work of a fit, which usually ends before.
pub(super) const SINGLE_STEPS: usize = 6;
/// Members of a group.
/// Capacity: memory and work of a joint fit.
pub(super) const MEMBERS: usize = 4;
/// Sidelobes are cancelled as if a tap had at least this share of the weakest reportable path's energy for noise.
/// Derived: those that stay hold a hundredth of that energy in all channels, 20 dB under it.
const IGNORED: f32 = 1.0 / 360.0;

/// What one draw of the arrays' errors leaves beside a path, in units of the mean.
/// Derived: of 24 variables of equal variance (32 channels without what four gains and two angles explain) one sum in a thousand is larger.
const ONE_DRAW: f32 = 2.0;

/// A path found in a beam.
#[derive(Clone, Copy, Debug)]
pub(super) struct Found<const A: usize> {
    pub(super) source: Source<A>,
    /// Inverse Hessian over (delay in taps, two angles in rad); times noise / (2 occupancy) it is the covariance.
    pub(super) spread: [[f32; 3]; 3],
    /// Sources of one group are fitted jointly.
    pub(super) group: u8,
    /// Not a path: what the model of a path could not explain.
    pub(super) remainder: bool,
    /// Noise when it was fitted.
    pub(super) noise: f32,
}

/// Immutable tools of the search.
#[derive(Clone, Copy)]
pub(super) struct Search<'a, const A: usize, const E: usize, M = ()> {
    pub(super) model: &'a ArrayModel<A, E>,
    pub(super) template: &'a Template,
    pub(super) grid: &'a AngleGrid<A>,
    /// Noise floor of the profile.
    pub(super) detector: &'a Detector,
    /// What is asked for.
    pub(super) levels: Levels,
    /// What the sweep has shown already.
    pub(super) known: &'a KnownPaths,
    /// What the sweep has taken already.
    pub(super) effort: &'a Effort,
    /// Told where the time goes.
    pub(super) meter: &'a M,
}

/// The beam under search: residual taps, their profile, and what was found.
pub(super) struct Beam<'a, const A: usize, const C: usize> {
    pub(super) taps: &'a mut [Channel; C],
    pub(super) profile: &'a mut [u64; SAMPLES],
    pub(super) found: &'a mut Vec<Found<A>, SOURCES>,
}

impl<const A: usize, const E: usize, M: Meter> Search<'_, A, E, M> {
    pub(super) fn fit<const L: usize, const D: usize, const C: usize, const W: usize>(
        &self,
        window: &Window<C, W>,
        start: [Place; L],
        noise: f32,
        steps: usize,
    ) -> Fit<L, D, A> {
        let fit = fit::<L, D, A, E, C, W>(self.model, self.template, window, start, noise, steps);
        self.effort.spend(Work::Fit {
            paths: L,
            evaluations: fit.evaluations as usize,
        });
        fit
    }

    pub(super) fn found<const L: usize, const D: usize>(
        &self,
        fit: &Fit<L, D, A>,
        index: usize,
        origin: usize,
        noise: f32,
        group: u8,
    ) -> Found<A> {
        let place = fit.places[index];
        Found {
            source: Source {
                origin,
                delay_taps: place.delay_taps,
                u: place.u,
                gains: fit.gains[index],
            },
            spread: spread(&fit.hessian, index),
            group,
            remainder: false,
            noise,
        }
    }

    /// Most energy that errors of the arrays leave of paths at a delay, taps from `origin`: each path's share, under its pulse.
    #[inline(never)]
    pub(super) fn errors_of<'f, const C: usize>(
        &self,
        paths: impl Iterator<Item = &'f Found<A>>,
        origin: usize,
        delay_taps: f32,
    ) -> f32 {
        let under = |found: &Found<A>| {
            let apart = found.source.delay_from(origin) - delay_taps;
            found.source.power() * C as f32 / lobes(self.template.occupancy() * apart)
        };
        ONE_DRAW * self.model.calibration_share() * paths.map(under).sum::<f32>()
    }

    /// Taps on both sides over which a source of this amplitude stands out.
    pub(super) fn reach(&self, amplitude: f32, noise: f32) -> usize {
        let noise = noise.max(IGNORED * self.levels.floor);
        reach(amplitude, noise, self.template.occupancy())
    }

    /// Subtracts sources that were fitted together, or adds them back, over `reach` taps on both sides.
    pub(super) fn change<const L: usize, const C: usize>(
        &self,
        beam: &mut Beam<'_, A, C>,
        found: &[Found<A>; L],
        reach: usize,
        way: Change,
    ) {
        let sources = found.map(|f| f.source);
        within(self.meter, Stage::Cancel, || {
            let taps = change(
                self.model,
                self.template,
                beam.taps,
                beam.profile,
                &sources,
                reach,
                way,
            );
            self.effort.spend(Work::Cancel { paths: L, taps });
        });
    }
}

/// Power of a path's peak over that of its sidelobes so many resolution cells away, at least.
pub(super) fn lobes(apart_cells: f32) -> f32 {
    let lobes = (core::f32::consts::PI * apart_cells).abs().max(1.0);
    lobes * lobes
}

/// What is left at the tap of a path: sums over the channels, squared LSB.
#[derive(Clone, Copy, Debug)]
pub(super) struct Left {
    /// All but the paths, with what was taken out there as a remainder.
    pub(super) left: f32,
    /// What noise leaves on average.
    pub(super) noise: f32,
    /// Energy of all paths that were fitted jointly there.
    pub(super) energy: f32,
}

impl<const A: usize, const C: usize> Beam<'_, A, C> {
    /// What the search has left where the first path was found. Its peak may lie between two taps.
    pub(super) fn left_beside_first(&self, noise: f32) -> Option<Left> {
        let first = self.found.first()?;
        let at = |n: usize| {
            self.profile
                .get(n & (SAMPLES - 1))
                .map_or(0.0, |power| *power as f32)
        };
        let tap = first.source.origin;
        let near = |f: &&Found<A>| f.source.delay_from(tap).abs() <= 1.0;
        let energy = |found: &Found<A>| found.source.power() * C as f32;
        let remainders: f32 = self
            .found
            .iter()
            .filter(|f| f.remainder)
            .filter(near)
            .map(energy)
            .sum();
        Some(Left {
            left: at(tap) + remainders,
            noise: C as f32 * noise,
            energy: self
                .found
                .iter()
                .filter(|f| f.group == first.group && !f.remainder)
                .map(energy)
                .sum(),
        })
    }

    /// Paths found so far, without remainders.
    pub(super) fn paths(&self) -> usize {
        self.found.iter().filter(|f| !f.remainder).count()
    }

    /// Whether a source is the first of its group.
    pub(super) fn is_first(&self, index: usize, group: u8) -> bool {
        self.found.iter().position(|f| f.group == group) == Some(index)
    }

    /// Indices of a group's members.
    pub(super) fn members(&self, group: u8) -> Vec<usize, MEMBERS> {
        let mut members = Vec::new();
        for (index, found) in self.found.iter().enumerate() {
            if found.group == group && members.push(index).is_err() {
                break;
            }
        }
        members
    }

    pub(super) fn all<const L: usize>(&self, members: [usize; L]) -> Option<[Found<A>; L]> {
        let first = self.found.get(members[0]).copied()?;
        Some(members.map(|index| self.found.get(index).copied().unwrap_or(first)))
    }
}

impl<const A: usize> Source<A> {
    /// Place in the coordinates of another origin.
    pub(super) fn place(&self, origin: usize) -> Place {
        Place {
            delay_taps: self.delay_from(origin),
            u: self.u,
        }
    }
}
