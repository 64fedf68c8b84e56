//! What is known of the line of sight before its squint symbols are heard, and what stands beside it.

use heapless::Vec;

use super::NULLS;
use super::bounce::Mirror;
use crate::array::GmtFace;
use crate::geometry::{Body, Direction, Frame, Gmt};
use crate::paths::EstimatedPath;
use crate::signal::DelayPeriod;

/// Paths closer than this to the line of sight in arrival are images of it that the transmitter's element errors make,
/// or cannot be told from it: not nulled, rad. Half a degree.
/// Tuned: `cslam campaign` with tuning seeds (docs/flights.md). Half a degree.
const IMAGE_RAD: f32 = 0.0087;
/// A path this near to where the ground bounce must come from is the ground bounce, rad. Two degrees.
/// Tuned: `cslam campaign` with tuning seeds (docs/flights.md). Two degrees.
const BOUNCE_RAD: f32 = 0.035;

/// What path estimation and link state said of the line of sight in the sweep before the symbols.
#[derive(Clone, Debug)]
pub struct Sighting {
    /// Whether the link state is line of sight.
    pub line_of_sight: bool,
    /// Face of the GMT that sent the strongest beam.
    pub face: usize,
    /// Angle of arrival of the line of sight.
    pub aoa: Direction<Body>,
    /// Its delay on the receiver's clock, m. Good to a metre is enough.
    pub c_tau_m: f32,
    /// Angles of arrival of paths that come nearly at the same time: nulled.
    pub interferers: Vec<Direction<Body>, NULLS>,
    /// Where it is expected, if anything says so. Beside a wall a reflection that leaves the GMT towards the middle of the
    /// face is heard stronger than a line of sight at its edge.
    pub expected: Option<Expected>,
    /// Flat ground whose bounce follows it, if there is any.
    pub ground: Option<Ground>,
}

/// Flat ground under the GMT.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Ground {
    /// The vertical in the GMT's axes.
    pub up: Direction<Gmt>,
    /// Height of the GMT's antenna over the ground, m.
    pub height_m: f32,
    /// Length of the line of sight, m. Good to a few metres is enough.
    pub range_m: f32,
    /// Where the bounce arrives: nulled by the arrays that tell it from the line of sight.
    pub arrival: Direction<Body>,
}

/// Where a fit looks for the line of sight.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Expected {
    /// Direction cosines along the row and up the column of the face.
    pub cosines: [f32; 2],
    /// How far from there it may be, in either cosine.
    pub radius: f32,
}

impl Expected {
    /// Whether a place is near enough.
    pub(super) fn holds(&self, cosines: &[f32; 2]) -> bool {
        let [x, z] = self.cosines;
        (cosines[0] - x).abs() <= self.radius && (cosines[1] - z).abs() <= self.radius
    }
}

impl Sighting {
    /// Interferers are sought among the paths that come up to this much later than the line of sight, m.
    /// Derived: such a path is not told apart by its delay in the narrow part of the band in which a symbol looks at the UAV.
    pub const NEAR_M: f32 = 30.0;

    /// From the paths of a sweep (strongest first, delays of this period), of which number `los` is the line of sight if there is one, sent by
    /// this face. None when there is no such path.
    #[must_use]
    pub fn new<D: Frame>(
        line_of_sight: bool,
        paths: &[EstimatedPath<D>],
        los: usize,
        face: usize,
        delay_period: &DelayPeriod,
    ) -> Option<Self> {
        let direct = paths.get(los)?;
        let mut sighting = Self {
            line_of_sight,
            face,
            aoa: direct.path.aoa,
            c_tau_m: direct.path.c_tau_m,
            interferers: Vec::new(),
            expected: None,
            ground: None,
        };
        for path in paths {
            // Delays are cyclic: the line of sight may come at the end of a period and the next path after its start.
            let later_m = f64::from(path.path.c_tau_m - direct.path.c_tau_m);
            let later_m = delay_period.wrap_m(later_m) as f32;
            if later_m > 0.0
                && later_m < Self::NEAR_M
                && path.path.aoa.angle_to_rad(&direct.path.aoa) > IMAGE_RAD
                && sighting.interferers.push(path.path.aoa).is_err()
            {
                break;
            }
        }
        Some(sighting)
    }

    /// The same with the ground bounce where flat ground puts it: `range_m` is the length of the line of sight, `height_m`
    /// the GMT antenna's over the ground, `down` the vertical in body axes, good to a few degrees, and `up` that of the GMT. The
    /// bounce comes from the GMT's image, `2 height_m` under it.
    ///
    /// Far away, or low, path estimation does not resolve the bounce and its two paths are anywhere; the angle between
    /// the two is known far better than that, and an error that both share only costs signal. Takes the place of the
    /// paths that may be the bounce.
    #[must_use]
    pub fn with_ground(
        mut self,
        range_m: f32,
        height_m: f32,
        down: &Direction<Body>,
        up: &Direction<Gmt>,
    ) -> Self {
        let image = self.aoa.vector() * range_m + down.vector() * (2.0 * height_m);
        let Ok(arrival) = Direction::from_vector(image) else {
            return self;
        };
        self.interferers.retain(|u| u.angle_to_rad(&arrival) > BOUNCE_RAD);
        self.ground = Some(Ground {
            up: *up,
            height_m,
            range_m,
            arrival,
        });
        self
    }

    /// The ground as the face sees it, one of so many.
    pub(super) fn mirror(&self, faces: usize) -> Option<Mirror> {
        let ground = self.ground.filter(|_| self.face < faces)?;
        let face = GmtFace::of(self.face, faces);
        let (up, column) = (ground.up.vector(), face.normal.cross(&face.tangent));
        Some(Mirror {
            up: [face.tangent, column, face.normal].map(|axis| axis.dot(up)),
            height_m: ground.height_m,
            range_m: ground.range_m,
        })
    }
}
