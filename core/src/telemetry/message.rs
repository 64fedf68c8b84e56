//! What a packet says.

use super::bits::{BitReader, BitWriter};
use super::{ConfigReport, Direction, EventReport, HealthReport, LinkReport, PointBatch, PoseReport, Uplink};

/// What the UAV says.
#[derive(Clone, Debug, PartialEq)]
#[expect(
    clippy::large_enum_variant,
    reason = "there is no heap to put the larger one on, and one lives at a time"
)]
pub enum Message {
    /// Points of the map.
    Points(PointBatch),
    /// Where the UAV is.
    Pose(PoseReport),
    /// What became of a sweep.
    Link(LinkReport),
    /// How the receiver is.
    Health(HealthReport),
    /// What happened.
    Event(EventReport),
    /// What the receiver is set to.
    Config(ConfigReport),
}

/// The messages of a direction, [`Message`] and [`Uplink`].
pub trait Content: sealed::Content {}

impl Content for Message {}
impl Content for Uplink {}

/// Nothing else can be sent.
pub(super) mod sealed {
    use super::{BitReader, BitWriter, Direction};

    /// How a message becomes a body and back.
    pub trait Content: Sized {
        /// Which way it goes.
        const DIRECTION: Direction;
        /// Number of its kind, less than 64.
        fn kind(&self) -> u8;
        /// Writes the body.
        fn write(&self, to: &mut BitWriter<'_>);
        /// Reads a body; `None` when it is none.
        fn read(kind: u8, from: &mut BitReader<'_>) -> Option<Self>;
    }
}

impl sealed::Content for Message {
    const DIRECTION: Direction = Direction::Down;

    fn kind(&self) -> u8 {
        match self {
            Self::Points(_) => 0,
            Self::Pose(_) => 1,
            Self::Link(_) => 2,
            Self::Health(_) => 3,
            Self::Event(_) => 4,
            Self::Config(_) => 5,
        }
    }

    fn write(&self, to: &mut BitWriter<'_>) {
        match self {
            Self::Points(points) => points.write(to),
            Self::Pose(pose) => pose.write(to),
            Self::Link(link) => link.write(to),
            Self::Health(health) => health.write(to),
            Self::Event(event) => event.write(to),
            Self::Config(config) => config.write(to),
        }
    }

    fn read(kind: u8, from: &mut BitReader<'_>) -> Option<Self> {
        Some(match kind {
            0 => Self::Points(PointBatch::read(from)?),
            1 => Self::Pose(PoseReport::read(from)?),
            2 => Self::Link(LinkReport::read(from)?),
            3 => Self::Health(HealthReport::read(from)?),
            4 => Self::Event(EventReport::read(from)?),
            5 => Self::Config(ConfigReport::read(from)?),
            _ => return None,
        })
    }
}

impl sealed::Content for Uplink {
    const DIRECTION: Direction = Direction::Up;

    fn kind(&self) -> u8 {
        self.number()
    }

    fn write(&self, to: &mut BitWriter<'_>) {
        self.write_body(to);
    }

    fn read(kind: u8, from: &mut BitReader<'_>) -> Option<Self> {
        Self::read_body(kind, from)
    }
}
