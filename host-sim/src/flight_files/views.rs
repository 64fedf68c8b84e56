//! Ways to look at a point cloud on paper: from above, and at a slant.

/// Azimuth that the slanted view looks along, clockwise from north, and how far it looks down, rad.
const AZIMUTH_RAD: f64 = -0.45;
const DOWN_RAD: f64 = 0.75;

/// Where a place in the world lies in a view: across, up, and how near it is to who looks, m. Linear: it turns directions, too, and
/// a surface whose normal comes nearer shows its front.
pub(crate) type View = fn([f64; 3]) -> [f64; 3];

/// The view from above, north up.
pub(crate) fn above([x, y, z]: [f64; 3]) -> [f64; 3] {
    [x, y, z]
}

/// The slanted view, without perspective: parallel stays parallel.
pub(crate) fn slanted([x, y, z]: [f64; 3]) -> [f64; 3] {
    let (sin, cos) = (libm::sin(AZIMUTH_RAD), libm::cos(AZIMUTH_RAD));
    let (down, level) = (libm::sin(DOWN_RAD), libm::cos(DOWN_RAD));
    let depth = x * sin + y * cos;
    [
        x * cos - y * sin,
        depth * down + z * level,
        z * down - depth * level,
    ]
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_slanted_view_puts_what_is_high_higher_and_what_is_far_behind() {
        let [_, low, _] = slanted([5.0, 5.0, 0.0]);
        let [_, high, _] = slanted([5.0, 5.0, 3.0]);
        assert!(high > low);
        let (near, far) = (slanted([0.0, 0.0, 0.0]), slanted([10.0, 10.0, 0.0]));
        assert!(far[1] > near[1] && far[2] < near[2]);
    }
}
