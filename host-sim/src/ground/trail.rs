//! Where something has been: a line of bounded length that keeps its whole course.

/// Most places of a trail. When it is full every second one goes, and new ones must lie twice as far apart.
pub const MOST_PLACES: usize = 4096;

/// Least distance between two places of a young trail, m.
const SPACING_M: f64 = 0.25;

/// Places in their order.
#[derive(Clone, Debug)]
pub struct Trail {
    places: Vec<[f64; 3]>,
    spacing_m: f64,
}

impl Trail {
    /// A trail without a place.
    pub fn new() -> Self {
        Self {
            places: Vec::new(),
            spacing_m: SPACING_M,
        }
    }

    /// Goes on to a place, unless it is too near to the last one. Whether it became part of the trail.
    pub fn go(&mut self, place_m: [f64; 3]) -> bool {
        let near = self.places.last().is_some_and(|last| {
            let square: f64 = (0..3).map(|i| (place_m[i] - last[i]).powi(2)).sum();
            square < self.spacing_m * self.spacing_m
        });
        if near || !place_m.iter().all(|c| c.is_finite()) {
            return false;
        }
        if self.places.len() == MOST_PLACES {
            let mut index = 0;
            self.places.retain(|_| {
                index += 1;
                index % 2 == 1
            });
            self.spacing_m *= 2.0;
        }
        self.places.push(place_m);
        true
    }

    /// The places.
    pub fn places(&self) -> &[[f64; 3]] {
        &self.places
    }
}

impl Default for Trail {
    fn default() -> Self {
        Self::new()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_long_way_stays_whole_and_bounded() {
        let mut trail = Trail::new();
        for k in 0..20_000 {
            trail.go([f64::from(k) * 0.3, 0.0, 0.0]);
        }
        let places = trail.places();
        assert!(places.len() <= MOST_PLACES && places.len() > MOST_PLACES / 4);
        assert_eq!(places[0], [0.0; 3]);
        assert!(places[places.len() - 1][0] > 5990.0);
        assert!(places.windows(2).all(|w| w[0][0] < w[1][0]));
    }
}
