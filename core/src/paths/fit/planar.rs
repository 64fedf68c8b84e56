//! The fit of paths at a planar array, whose rows share one oscillator: one free gain a path.
//!
//! Rows and columns lie symmetrically, and all elements have one kernel, so every inner product is that along a row times that up a column
//! times that over the taps. The columns of a path are `A`, its derivatives `W` by the phase step along the rows, `V` by that from row to
//! row, and `T` by the delay.

use nalgebra::Complex;

use super::{Normal, column, correlate, eliminate, spatial, taps};
use crate::paths::model::{ArrayModel, Planar, place, steering};
use crate::paths::place::Place;
use crate::paths::template::Template;
use crate::paths::window::Window;

/// Columns of at most four paths.
/// Capacity: four paths are fitted jointly at most.
const MOST_COLUMNS: usize = 16;

/// Derivatives of a path's `W`, `V` and `T` (in this order) by its delay and its two angles.
type Slopes = [[f32; 3]; 3];

/// Gram matrix of all columns, element `r^H s`.
type Gram = [[f32; MOST_COLUMNS]; MOST_COLUMNS];

/// As [`super::normal_equations`], of a planar array.
pub(super) fn normal_equations<
    const L: usize,
    const D: usize,
    const A: usize,
    const E: usize,
    const C: usize,
    const W: usize,
>(
    model: &ArrayModel<A, E>,
    planar: &Planar,
    template: &Template,
    window: &Window<C, W>,
    places: &[Place; L],
) -> Normal<L, D, A> {
    const { assert!(4 * L <= MOST_COLUMNS) };
    let mut normal = Normal::zero();
    let Some((step, lead)) = model.arrays().next() else {
        return normal;
    };
    let rows: [[Complex<f32>; E]; L] = places.each_ref().map(|place| steering(step.dot(&place.u)));
    let columns: [[Complex<f32>; A]; L] = places
        .each_ref()
        .map(|place| steering(planar.row_turns.dot(&place.u)));
    let mut kernel = [[[0.0; 2]; W]; L];
    for (kernel, place) in kernel.iter_mut().zip(places) {
        let first = window.first() - (place.delay_taps - lead.dot(&place.u));
        template.row(first, kernel.get_mut(..window.len()).unwrap_or_default());
    }
    let mut correlation = [Complex::new(0.0, 0.0); MOST_COLUMNS];
    for (j, elements) in window.rows().as_chunks::<E>().0.iter().enumerate() {
        let of_row = correlate::<L, D, E, W>(elements, &rows, &kernel);
        for (p, columns) in columns.iter().enumerate() {
            let turned = [0, 1, 2].map(|kind| columns[j].conj() * of_row[column::<L>(kind, p)]);
            let [a, w, t] = turned;
            let v = Complex::new(a.im, -a.re) * place::<A>(j);
            for (kind, value) in [a, w, v, t].into_iter().enumerate() {
                correlation[column::<L>(kind, p)] += value;
            }
        }
    }
    let mut gram = gram::<L, A, E, W>(&rows, &columns, &kernel);
    normal.energy = eliminate::<L, MOST_COLUMNS>(&mut gram, &mut correlation);
    let gains: [Complex<f32>; L] = core::array::from_fn(|p| {
        let power = gram[p][p];
        if power > 0.0 {
            correlation[p] / power
        } else {
            Complex::new(0.0, 0.0)
        }
    });
    for ((all, gain), columns) in normal.gains.iter_mut().zip(gains).zip(&columns) {
        *all = columns.map(|phase| phase * gain);
    }
    let slopes: [Slopes; L] = places.each_ref().map(|place| {
        const TURN: f32 = core::f32::consts::TAU;
        let (e1, e2) = place.tangents();
        let by_angle = |e| [TURN * step.dot(e), TURN * planar.row_turns.dot(e), -lead.dot(e)];
        [[0.0, 0.0, 1.0], by_angle(&e1), by_angle(&e2)]
    });
    accumulate(&mut normal, &gram, &correlation, &gains, &slopes);
    normal
}

/// Inner products of all columns of all paths.
fn gram<const L: usize, const A: usize, const E: usize, const W: usize>(
    rows: &[[Complex<f32>; E]; L],
    columns: &[[Complex<f32>; A]; L],
    kernel: &[[[f32; 2]; W]; L],
) -> Gram {
    let mut gram = [[0.0; MOST_COLUMNS]; MOST_COLUMNS];
    for p in 0..L {
        for q in p..L {
            let [t00, t01, t10, t11] = taps(&kernel[p], &kernel[q]);
            let [r0, r1, r2] = spatial(&rows[p], &rows[q]);
            let [c0, c1, c2] = spatial(&columns[p], &columns[q]);
            // Between A, W and V of both paths.
            let plane = [
                [r0 * c0, -r1 * c0, -r0 * c1],
                [r1 * c0, r2 * c0, -r1 * c1],
                [r0 * c1, -r1 * c1, r0 * c2],
            ];
            let mut fill = |k: usize, l: usize, product: f32| {
                let (r, s) = (column::<L>(k, p), column::<L>(l, q));
                gram[r][s] = product;
                gram[s][r] = product;
            };
            for (k, products) in plane.iter().enumerate() {
                for (l, product) in products.iter().enumerate() {
                    fill(k, l, product * t00);
                }
                // T is the slope of the kernel with the other sign.
                fill(k, 3, -products[0] * t01);
                fill(3, k, -plane[0][k] * t10);
            }
            fill(3, 3, r0 * c0 * t11);
        }
    }
    gram
}

/// Gradient and Hessian over the parameters of all paths.
fn accumulate<const L: usize, const D: usize, const A: usize>(
    normal: &mut Normal<L, D, A>,
    gram: &Gram,
    correlation: &[Complex<f32>; MOST_COLUMNS],
    gains: &[Complex<f32>; L],
    slopes: &[Slopes; L],
) {
    // Each sum is over W, V and T.
    let dot = |a: &[f32; 3], b: &[f32; 3]| a.iter().zip(b).map(|(a, b)| a * b).sum::<f32>();
    for p in 0..L {
        let along = [1, 2, 3].map(|kind| (gains[p].conj() * correlation[column::<L>(kind, p)]).re);
        for (k, slope) in slopes[p].iter().enumerate() {
            normal.gradient[3 * p + k] = dot(slope, &along);
        }
        for q in 0..L {
            let cross = (gains[p].conj() * gains[q]).re;
            for (k, first) in slopes[p].iter().enumerate() {
                let with = [1, 2, 3].map(|kind| {
                    let of_first = [1, 2, 3].map(|other| gram[column::<L>(other, p)][column::<L>(kind, q)]);
                    dot(first, &of_first)
                });
                for (l, second) in slopes[q].iter().enumerate() {
                    normal.hessian[3 * p + k][3 * q + l] = cross * dot(&with, second);
                }
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use nalgebra::Vector3;

    use super::super::{Fit, fit};
    use super::*;
    use crate::array::{UavArrayConfig, UavArrays, UavLayout};
    use crate::kernels::Iq;
    use crate::paths::grid::AngleGrid;
    use crate::paths::window::JOINT;
    use crate::signal::{SAMPLES, Waveform, phasor};

    type Joint = Window<64, JOINT>;

    fn tools() -> (ArrayModel<8, 8>, Template) {
        let config = UavArrayConfig {
            layout: UavLayout::Planar { azimuth_rad: 0.0 },
            tilt_rad: 0.0,
            ..UavArrayConfig::default()
        };
        let waveform = Waveform::default();
        let arrays = UavArrays::new(&config);
        (ArrayModel::new(&arrays, &waveform), Template::new(&waveform))
    }

    fn towards(y: f32, z: f32) -> Vector3<f32> {
        Vector3::new((1.0 - y * y - z * z).sqrt(), y, z)
    }

    /// Two paths without noise.
    fn truth() -> [Place; 2] {
        [(0.1, towards(0.3, 0.2)), (0.8, towards(0.25, 0.45))].map(|(delay_taps, u)| Place { delay_taps, u })
    }

    fn window(model: &ArrayModel<8, 8>, template: &Template) -> Joint {
        let mut window = Joint::new();
        let taps = [[Iq::ZERO; SAMPLES]; 64];
        window.load(
            &taps,
            100,
            -super::super::REACH,
            super::super::REACH + 2,
            template.centre_turns(),
        );
        for (place, phase) in truth().iter().zip([0.0, 0.4]) {
            let row_turns = model.planar().expect("planar").row_turns;
            let gains = steering::<8>(row_turns.dot(&place.u)).map(|s| s * phasor(phase) * 700.0);
            window.add(model, template, place, &gains);
        }
        window
    }

    fn at(places: &[Place; 2]) -> Normal<2, 6, 8> {
        let (model, template) = tools();
        super::super::normal_equations::<2, 6, 8, 8, 64, JOINT>(
            &model,
            &template,
            &window(&model, &template),
            places,
        )
    }

    fn moved(places: &[Place; 2], parameter: usize, by: f32) -> [Place; 2] {
        let mut step = [0.0; 3];
        step[parameter % 3] = by;
        let mut moved = *places;
        moved[parameter / 3] = moved[parameter / 3].moved(step);
        moved
    }

    #[test]
    fn gradient_is_that_of_the_energy() {
        let places = [(0.2, towards(0.33, 0.17)), (0.6, towards(0.22, 0.43))]
            .map(|(delay_taps, u)| Place { delay_taps, u });
        let here = at(&places);
        let largest = here.gradient.iter().fold(0.0_f32, |m, g| m.max(g.abs()));
        for i in 0..6 {
            let side = |by: f32| at(&moved(&places, i, by)).energy;
            let slope = 0.5 * (side(2e-3) - side(-2e-3)) / 4e-3;
            assert!(
                (slope - here.gradient[i]).abs() < 0.01 * largest,
                "{i}: {slope} {}",
                here.gradient[i]
            );
        }
    }

    #[test]
    fn hessian_is_the_curvature_of_the_energy() {
        let places = truth();
        let here = at(&places);
        for i in 0..6 {
            let side = |by: f32| at(&moved(&places, i, by)).gradient;
            let (above, below) = (side(2e-3), side(-2e-3));
            for j in 0..6 {
                let bend = -(above[j] - below[j]) / 4e-3;
                let scale = (here.hessian[i][i] * here.hessian[j][j]).sqrt();
                assert!(
                    (bend - here.hessian[i][j]).abs() < 0.02 * scale,
                    "{i} {j}: {bend} {}",
                    here.hessian[i][j]
                );
            }
        }
    }

    #[test]
    fn two_paths_are_found_with_one_gain_each() {
        let (model, template) = tools();
        let window = window(&model, &template);
        let start = [(0.2, towards(0.33, 0.17)), (0.6, towards(0.22, 0.43))]
            .map(|(delay_taps, u)| Place { delay_taps, u });
        let found: Fit<2, 6, 8> = fit::<2, 6, 8, 8, 64, JOINT>(&model, &template, &window, start, 1.0, 24);
        for (found, truth) in found.places.iter().zip(truth()) {
            assert!((found.u - truth.u).norm() < 1e-3 && (found.delay_taps - truth.delay_taps).abs() < 1e-3);
        }
        let first = found.gains[0].map(|gain| gain.norm_sqr().sqrt());
        assert!(first.iter().all(|gain| (gain - 700.0).abs() < 2.0), "{first:?}");
    }

    #[test]
    fn the_grid_finds_a_direction_before_the_array_and_none_behind() {
        let (model, _) = tools();
        let grid = AngleGrid::<8>::new(&model);
        let planar = model.planar().expect("planar");
        for (y, z) in [(0.0, 0.0), (0.4, -0.3), (-0.7, 0.5), (0.1, 0.8)] {
            let u = towards(y, z);
            let (row, column) = (
                steering::<8>(model.steps()[0].dot(&u)),
                steering::<8>(planar.row_turns.dot(&u)),
            );
            let snapshot: [Complex<f32>; 64] = core::array::from_fn(|c| row[c % 8] * column[c / 8]);
            let found = grid.strongest::<8, 64>(&snapshot);
            assert!(found.x > 0.0 && found.dot(&u) > libm::cosf(0.07), "{u} {found}");
            // All of the energy is explained, and nearly all on the grid.
            assert!((model.explained(&snapshot, &u) - 64.0).abs() < 1e-3);
            assert!(grid.promising::<8, 64>(&snapshot, 45.0).is_some());
            assert!(grid.promising::<8, 64>(&snapshot, 66.0).is_none());
        }
    }
}
