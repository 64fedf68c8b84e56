//! How far a wave that reaches into a shadow is off the straight way.
//!
//! What stands before the transmitter dims the line of sight long before it ends it: a wave bends round an edge, by a way that is hardly longer
//! than the straight one. The loss says how deep in the shadow the receiver is (Fresnel's parameter `nu`), and that how much longer the way is
//! and from how far beside it comes. A bent wave places the UAV as the line of sight does, only less precisely by its angles.
//!
//! Knife edge: J(nu) = 6.9 + 20 log10(sqrt((nu - 0.1)^2 + 1) + nu - 0.1) dB (Recommendation ITU-R P.526, for nu > -0.78), the detour is
//! lambda nu^2 / 4, and an edge at a share `s` of a way of length r turns the wave at its near end by nu sqrt(lambda (1 - s) / (2 s r)). How the edge lies
//! nobody knows: along each of two tangents the square is half of that.

/// A path that came straight may have lost this much more than through free space, dB.
/// Derived: A reflection costs 8 dB at normal incidence (docs/signal-model.md, "Waveform and link budget") and less the more it grazes;
/// near the edge of the beams the gain is known to 5 dB. Nor can it be so much stronger: the ground's bounce adds 6 dB at most.
pub(super) const UNREFLECTED_DB: f32 = 7.0;
/// A wave that has lost more is no longer told from the images that the arrays make of others, dB.
/// Tuned: `cslam campaign` with tuning seeds (docs/flights.md).
const MOST_DB: f32 = 25.0;
/// The mean of (1 - s) / s over edges from a tenth to nine tenths of the way.
/// Derived: ln 9 - 0.8 over 0.8.
const MEAN_LEVER: f64 = 1.75;
/// Delay of what dims a wave without an edge, standard deviation, m.
/// Given: a board of plaster holds it up by 20 to 30 mm.
const HELD_UP_M: f64 = 0.03;

/// Standard deviations of a bent wave beside those of the line of sight; zeros where it is not bent.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(super) struct Bend {
    /// Of either end's direction along a tangent, rad.
    pub(super) angle_rad: f64,
    /// Of the length, m.
    pub(super) length_m: f64,
}

impl Bend {
    /// Of a wave that is `over_db` against free space after a way of `range_m`; `None` when it lost too much for one that is only bent.
    pub(super) fn of(over_db: f32, range_m: f64, wavelength_m: f64) -> Option<Self> {
        if over_db >= -UNREFLECTED_DB {
            return Some(Self::default());
        }
        if over_db < -MOST_DB {
            return None;
        }
        let nu = fresnel_parameter(f64::from(-over_db));
        Some(Self {
            angle_rad: nu * libm::sqrt(MEAN_LEVER * wavelength_m / (4.0 * range_m.max(1.0))),
            length_m: HELD_UP_M + 0.25 * wavelength_m * nu * nu,
        })
    }
}

/// Fresnel's parameter of a knife edge that costs so much, dB.
fn fresnel_parameter(loss_db: f64) -> f64 {
    // By the exponential, which is there already: a power takes kilobytes of its own.
    let x = libm::exp((loss_db - 6.9) * (core::f64::consts::LN_10 / 20.0));
    0.5 * (x - 1.0 / x) + 0.1
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_loss_of_an_edge_tells_how_deep_in_its_shadow() {
        for nu in [0.2, 1.0, 2.4, 4.0] {
            let u: f64 = nu - 0.1;
            let loss_db = 6.9 + 20.0 * libm::log10(libm::sqrt(u * u + 1.0) + u);
            assert!((fresnel_parameter(loss_db) - nu).abs() < 1e-9);
        }
        // At the edge of the shadow half of the amplitude is left.
        assert!(fresnel_parameter(6.02).abs() < 0.01);
    }

    #[test]
    fn a_wave_is_bent_the_more_the_more_it_lost() {
        let bend = |over_db| Bend::of(over_db, 40.0, 0.01);
        assert_eq!(bend(-5.0), Some(Bend::default()));
        assert_eq!(bend(-26.0), None);
        let (shallow, deep) = (bend(-9.0).expect("bent"), bend(-20.0).expect("bent"));
        // 0.2 degrees and 1.3: an edge in the middle of the way bends by as much, 0.2 and 1.4 degrees, in one direction.
        assert!((shallow.angle_rad - 0.0036).abs() < 4e-4 && (deep.angle_rad - 0.0233).abs() < 1.5e-3);
        assert!(shallow.length_m < 0.031 && (deep.length_m - 0.043).abs() < 2e-3);
    }
}
