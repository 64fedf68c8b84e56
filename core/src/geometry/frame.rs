//! Coordinate frames as types.

mod sealed {
    pub trait Sealed {}
}

/// A right-handed coordinate frame. Sealed: a frame's meaning is a convention of the whole system, not of a caller.
pub trait Frame: sealed::Sealed + Copy + Default + core::fmt::Debug + PartialEq + 'static {
    /// Name for messages.
    const NAME: &'static str;
}

/// World frame: east-north-up, metres, fixed to the ground.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct World;

/// Body frame of the UAV: forward-left-up, origin at the centre of its antenna arrays.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Body;

/// Frame of the ground mobile transmitter (GMT): x along the azimuth its first antenna face looks at, z up its mast.
/// East-north-up while its heading and tilt are zero.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Gmt;

impl sealed::Sealed for World {}
impl sealed::Sealed for Body {}
impl sealed::Sealed for Gmt {}

impl Frame for World {
    const NAME: &'static str = "world";
}

impl Frame for Body {
    const NAME: &'static str = "body";
}

impl Frame for Gmt {
    const NAME: &'static str = "GMT";
}
