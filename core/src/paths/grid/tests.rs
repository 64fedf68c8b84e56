use super::*;
use crate::array::UavArrays;
use crate::signal::Waveform;

#[test]
fn grid_leaves_no_hole() {
    // Any direction lies within 0.75 steps of a grid direction (half the diagonal of a square cell is 0.71).
    let mut worst = 0.0_f32;
    for k in 0..500 {
        let z = 1.0 - (k as f32 + 0.5) / 250.0;
        let azimuth = phasor(0.618_034 * k as f32);
        let s = (1.0 - z * z).sqrt();
        let u = Vector3::new(s * azimuth.re, s * azimuth.im, z);
        let nearest = (0..DIRECTIONS).map(|i| direction(i).dot(&u)).fold(-1.0, f32::max);
        worst = worst.max(libm::acosf(nearest.min(1.0)).to_degrees());
    }
    assert!(worst < 0.75 * STEP_DEG as f32, "{worst} deg");
}

#[test]
fn bound_holds_and_changes_nothing() {
    let model = ArrayModel::<4, 8>::new(&UavArrays::default(), &Waveform::default());
    let grid = AngleGrid::new(&model);
    for pair in grid.bins.windows(2) {
        for (a, b) in pair[0].iter().zip(&pair[1]) {
            let apart = a.wrapping_sub(*b) & 31;
            assert!(apart <= NEAR as u8 || apart >= 32 - NEAR as u8, "{pair:?}");
        }
    }
    let mut state = 1_u32;
    for round in 0..300 {
        let powers: [[f32; BINS]; 4] = core::array::from_fn(|_| {
            core::array::from_fn(|_| {
                state = state.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
                // Few levels, so that equals occur; some all zero.
                (state >> 28) as f32 * (round % 10) as f32
            })
        });
        let (mut best, mut most) = (0, 0.0);
        for (index, bins) in grid.bins.iter().enumerate() {
            let sum = total(&powers, bins);
            if sum > most {
                (best, most) = (index, sum);
            }
        }
        assert_eq!(grid.scan(&powers), (direction(best), most));
    }
}

#[test]
fn spectrum_of_eight_is_the_definition() {
    let grid = AngleGrid::new(&ArrayModel::<4, 8>::new(
        &UavArrays::default(),
        &Waveform::default(),
    ));
    for k in 0..20 {
        let elements: [Complex<f32>; 8] = core::array::from_fn(|i| {
            phasor(0.37 * ((k * i * i) as f32) + 0.11 * i as f32) * (1.0 + i as f32)
        });
        let mut powers = [0.0; BINS];
        grid.spectrum(&elements, &mut powers);
        for (bin, power) in powers.iter().enumerate() {
            let exact = grid.sum(&elements, bin).norm_sqr();
            assert!(
                (power - exact).abs() < 1e-5 * 36.0 * 36.0,
                "{bin}: {power} {exact}"
            );
        }
    }
}

/// Never a direction that explains less than asked for; always one that explains more.
#[test]
fn promising_is_the_strongest_that_explains_enough() {
    let grid = AngleGrid::new(&ArrayModel::<4, 8>::new(
        &UavArrays::default(),
        &Waveform::default(),
    ));
    let snapshot: [Complex<f32>; 32] =
        core::array::from_fn(|c| phasor(0.618_034 * (c * c) as f32) * (3.0 + (c % 5) as f32));
    let (u, sum) = grid.scan(&grid.spectra::<8, 32>(&snapshot));
    assert_eq!(grid.promising::<8, 32>(&snapshot, 0.999 * sum / 8.0), Some(u));
    assert_eq!(grid.promising::<8, 32>(&snapshot, 1.001 * sum / 8.0), None);
    assert_eq!(grid.promising::<8, 32>(&snapshot, 100.0 * sum), None);
}

#[test]
fn strongest_direction_is_the_neighbour_of_the_truth() {
    let waveform = Waveform::default();
    let model = ArrayModel::<4, 8>::new(&UavArrays::default(), &waveform);
    let grid = AngleGrid::new(&model);
    for k in 0..200 {
        let z = 1.0 - (k as f32 + 0.5) / 100.0;
        let azimuth = phasor(0.618_034 * k as f32);
        let s = (1.0 - z * z).sqrt();
        let u = Vector3::new(s * azimuth.re, s * azimuth.im, z);
        let mut snapshot = [Complex::new(0.0, 0.0); 32];
        for (j, (step, rows)) in model
            .steps()
            .iter()
            .zip(snapshot.as_chunks_mut::<8>().0)
            .enumerate()
        {
            // A phase of its own for each array.
            let gain = phasor(0.3 * j as f32);
            for (x, s) in rows.iter_mut().zip(steering::<8>(step.dot(&u))) {
                *x = s * gain;
            }
        }
        let found = grid.strongest::<8, 32>(&snapshot);
        let off = libm::acosf(found.dot(&u).min(1.0)).to_degrees();
        assert!(off < 1.5 * STEP_DEG as f32, "{off} deg off at {u}");
    }
}
