//! What a flight came to, as text with every bit: equal lines on two machines mean equal trajectories and equal maps.

use core::fmt;

use cslam_core::association::Decision;
use cslam_core::map::MapPoint;
use cslam_core::receiver::{Outcome, PATHS, SweepReport};

/// A sweep: number, verdict, what became of each path, and the pose after it.
#[derive(Clone, Copy, Debug)]
pub struct SweepLine<'a>(pub &'a SweepReport<PATHS>);

impl fmt::Display for SweepLine<'_> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let report = self.0;
        write!(f, "sweep {} {:?} ", report.sweep, report.verdict)?;
        for path in &report.paths {
            let letter = match &path.outcome {
                Outcome::NoPose => '-',
                Outcome::Unused => 'u',
                Outcome::Input(_) => 'i',
                Outcome::LineOfSight => 'L',
                Outcome::NotFirstOrder => 'h',
                Outcome::Rejected(_) => 'r',
                Outcome::Point => 'P',
                Outcome::Associated(verdict) => match verdict.decision {
                    Decision::Explained => 'E',
                    Decision::Tentative => 't',
                    Decision::Ambiguous => 'a',
                    Decision::New => 'n',
                    Decision::Unexplained => 'x',
                },
            };
            write!(f, "{letter}{:08x}", path.estimated.path.c_tau_m.to_bits())?;
        }
        let Some(pose) = &report.pose else {
            return f.write_str(" no pose");
        };
        for part in pose.position.vector().iter() {
            write!(f, " {:016x}", part.to_bits())?;
        }
        for part in pose.attitude.matrix().iter().chain(pose.velocity_m_per_s.iter()) {
            write!(f, " {:08x}", part.to_bits())?;
        }
        for part in pose.position_covariance_m2.iter() {
            write!(f, " {:08x}", part.to_bits())?;
        }
        write!(f, " {:016x}", pose.clock.offset_m.to_bits())
    }
}

/// A point of the map.
#[derive(Clone, Copy, Debug)]
pub struct PointLine<'a>(pub &'a MapPoint);

impl fmt::Display for PointLine<'_> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str("point")?;
        for part in self.0.position.to_array() {
            write!(f, " {:08x}", part.to_bits())?;
        }
        write!(f, " {:08x} {}", self.0.variance_m2.to_bits(), self.0.hits)
    }
}
