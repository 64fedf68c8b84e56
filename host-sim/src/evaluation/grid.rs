//! Points in cubes of space, to ask which are near.

use std::collections::HashMap;

/// Points sorted into cubes whose edge is the greatest distance that will be asked for.
pub(super) struct PointGrid {
    edge_m: f64,
    cells: HashMap<[i64; 3], Vec<[f64; 3]>>,
}

impl PointGrid {
    /// Sorts points for queries of up to `reach_m`.
    pub(super) fn new(points_m: impl IntoIterator<Item = [f64; 3]>, reach_m: f64) -> Self {
        let mut grid = Self {
            edge_m: reach_m,
            cells: HashMap::new(),
        };
        for point in points_m {
            grid.cells.entry(grid.cell(point)).or_default().push(point);
        }
        grid
    }

    fn cell(&self, point_m: [f64; 3]) -> [i64; 3] {
        point_m.map(|c| libm::floor(c / self.edge_m) as i64)
    }

    /// Distance to the nearest point, m; `None` when it is more than the reach.
    pub(super) fn nearest_m(&self, point_m: [f64; 3]) -> Option<f64> {
        let [x, y, z] = self.cell(point_m);
        let mut least = f64::INFINITY;
        for i in 0..27 {
            let cell = [x + i % 3 - 1, y + i / 3 % 3 - 1, z + i / 9 - 1];
            for other in self.cells.get(&cell).into_iter().flatten() {
                let square = |k: usize| (point_m[k] - other[k]) * (point_m[k] - other[k]);
                least = least.min(square(0) + square(1) + square(2));
            }
        }
        Some(libm::sqrt(least)).filter(|&distance_m| distance_m <= self.edge_m)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::random::Stream;

    #[test]
    fn the_nearest_point_is_found_up_to_the_reach() {
        let mut stream = Stream::new(8, 0);
        let mut place = || [0; 3].map(|_: u8| 6.0 * stream.uniform() - 3.0);
        let points: Vec<[f64; 3]> = (0..40).map(|_| place()).collect();
        let grid = PointGrid::new(points.iter().copied(), 0.7);
        let (mut near, mut far) = (0, 0);
        for _ in 0..500 {
            let query = place();
            let distance = |p: &[f64; 3]| (0..3).map(|k| (p[k] - query[k]).powi(2)).sum::<f64>().sqrt();
            let least = points.iter().map(distance).fold(f64::INFINITY, f64::min);
            match grid.nearest_m(query) {
                Some(found) => assert!((found - least).abs() < 1e-12),
                None => assert!(least > 0.7),
            }
            *(if least > 0.7 { &mut far } else { &mut near }) += 1;
        }
        assert!(near > 50 && far > 50, "{near} {far}");
    }
}
