//! What the sights of a window would show, were it one of the place's image.

use nalgebra::Vector3;

use super::{Fix, LEAST_NORM, Segment};

/// Chi-square of the scatter between both ends of the sights, were these an image's in an upright wall: what turns to the left turns to the right
/// in it, and its sights part by twice as much. Up and down it turns as the straight way does. `towards` is the mean of the sights.
pub(super) fn image_apart(motion: &[(Segment, Fix)], towards: &Vector3<f64>) -> f64 {
    let Some(side) = Vector3::z().cross(towards).try_normalize(LEAST_NORM) else {
        return 0.0;
    };
    let apart = |(_, fix): &(Segment, Fix)| {
        let parted_rad = 2.0 * side.dot(&fix.towards_gmt);
        parted_rad * parted_rad / fix.sight_variance_rad2.dot(&side.component_mul(&side))
    };
    motion.iter().map(apart).sum()
}
