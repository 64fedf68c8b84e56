//! Cars and people as upright boxes.

use serde::{Deserialize, Serialize};

use crate::scene::Vec3;

/// What a mover is.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum BodyKind {
    /// A box of 4.4 x 1.8 x 1.5 m: metal, the upper half of its sides glass.
    Car,
    /// A box of 0.5 x 0.3 x 1.75 m, of skin.
    Person,
}

/// Of what a side of a mover is.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Finish {
    /// A perfect mirror, nearly.
    Metal,
    /// Panes of 4 mm.
    Glass,
    /// Relative permittivity 16 - 17j at 30 GHz.
    Skin,
}

impl BodyKind {
    /// Length along its way, width and height, m. People face across their shoulders.
    pub fn size_m(self) -> [f64; 3] {
        match self {
            Self::Car => [4.4, 1.8, 1.5],
            Self::Person => [0.3, 0.5, 1.75],
        }
    }

    /// With which it starts and stops, m/s^2.
    pub(super) fn acceleration_m_per_s2(self) -> f64 {
        match self {
            Self::Car => 3.0,
            Self::Person => 1.0,
        }
    }
}

/// A mover at an instant.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Body {
    /// What it is.
    pub kind: BodyKind,
    /// Middle of its base, m, world frame.
    pub foot_m: Vec3,
    /// The way it faces, a horizontal unit vector.
    pub forward: Vec3,
    /// Velocity, m/s, world frame.
    pub velocity_m_per_s: Vec3,
}

/// A flat rectangle of a body.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Plate {
    /// Its middle, m.
    pub centre: Vec3,
    /// Unit vector outwards.
    pub normal: Vec3,
    /// Unit vectors along its sides.
    pub axes: [Vec3; 2],
    /// Halves of its sides, m.
    pub half_m: [f64; 2],
    /// Of what it is.
    pub finish: Finish,
}

impl Body {
    /// Forward, left and up.
    pub fn axes(&self) -> [Vec3; 3] {
        [self.forward, Vec3::z().cross(&self.forward), Vec3::z()]
    }

    /// Half of length, width and height, m.
    pub fn half_m(&self) -> [f64; 3] {
        self.kind.size_m().map(|side_m| 0.5 * side_m)
    }

    /// Middle of the box, m.
    pub fn centre(&self) -> Vec3 {
        self.foot_m + Vec3::z() * self.half_m()[2]
    }

    /// A point as the box sees it: forward, left and up of its middle, m.
    fn within(&self, point: &Vec3) -> [f64; 3] {
        let off = point - self.centre();
        self.axes().map(|axis| axis.dot(&off))
    }

    /// Distance of a point from the box, m; 0 inside.
    pub fn distance_m(&self, point: &Vec3) -> f64 {
        let (at, half_m) = (self.within(point), self.half_m());
        let beyond = |i: usize| (at[i].abs() - half_m[i]).max(0.0);
        (0..3).map(|i| beyond(i) * beyond(i)).sum::<f64>().sqrt()
    }

    /// Whether a straight line between two points goes through the box.
    pub fn crosses(&self, from: &Vec3, to: &Vec3) -> bool {
        let (a, b, half_m) = (self.within(from), self.within(to), self.half_m());
        let (mut enter, mut leave) = (0.0_f64, 1.0_f64);
        for i in 0..3 {
            let step = b[i] - a[i];
            if step == 0.0 {
                if a[i].abs() > half_m[i] {
                    return false;
                }
                continue;
            }
            let (p, q) = ((-half_m[i] - a[i]) / step, (half_m[i] - a[i]) / step);
            enter = enter.max(p.min(q));
            leave = leave.min(p.max(q));
        }
        enter < leave
    }

    /// Whether less than a gap, m, is between this body and another one, seen from above.
    pub fn is_close_to(&self, other: &Self, gap_m: f64) -> bool {
        let off = other.foot_m - self.foot_m;
        let reach = |body: &Self, axis: &Vec3| {
            let [along, across, _] = body.half_m();
            let [forward, left, _] = body.axes();
            along * forward.dot(axis).abs() + across * left.dot(axis).abs()
        };
        // Two rectangles are apart if they are so along a side of one of them.
        let sides = [self.axes(), other.axes()].map(|[forward, left, _]| [forward, left]);
        sides
            .iter()
            .flatten()
            .all(|axis| off.dot(axis).abs() < reach(self, axis) + reach(other, axis) + gap_m)
    }

    /// Its sides and its top.
    pub fn plates(&self) -> Vec<Plate> {
        let ([forward, left, up], half_m) = (self.axes(), self.half_m());
        let sides = [
            (forward, left, half_m[0], half_m[1]),
            (-forward, -left, half_m[0], half_m[1]),
            (left, -forward, half_m[1], half_m[0]),
            (-left, forward, half_m[1], half_m[0]),
        ];
        let mut plates = Vec::with_capacity(9);
        let mut side = |low_m: f64, high_m: f64, finish: Finish| {
            for (normal, along, out_m, half_side_m) in sides {
                plates.push(Plate {
                    centre: self.foot_m + normal * out_m + up * (0.5 * (low_m + high_m)),
                    normal,
                    axes: [along, up],
                    half_m: [half_side_m, 0.5 * (high_m - low_m)],
                    finish,
                });
            }
        };
        let height_m = 2.0 * half_m[2];
        let top = match self.kind {
            BodyKind::Car => {
                side(0.0, half_m[2], Finish::Metal);
                side(half_m[2], height_m, Finish::Glass);
                Finish::Metal
            }
            BodyKind::Person => {
                side(0.0, height_m, Finish::Skin);
                Finish::Skin
            }
        };
        plates.push(Plate {
            centre: self.foot_m + up * height_m,
            normal: up,
            axes: [forward, left],
            half_m: [half_m[0], half_m[1]],
            finish: top,
        });
        plates
    }
}
