//! Pose from a window of fixes, on a turning and accelerating flight in closed form.

use nalgebra::{Matrix3, Vector3};

use super::super::nominal::{Nominal, rotation};
use super::super::window::{WINDOW, Window};
use crate::constants::STANDARD_GRAVITY_M_PER_S2;
use crate::inertial::{ImuErrors, ImuIncrement};
use crate::signal::Waveform;

pub(super) const G: Vector3<f64> = Vector3::new(3.0, -2.0, 1.5);

pub(super) fn position(t: f64) -> Vector3<f64> {
    Vector3::new(
        20.0 + 3.0 * t + 0.4 * t * t,
        -15.0 + 2.0 * libm::sin(0.8 * t),
        12.0 + 0.5 * libm::cos(t),
    )
}

pub(super) fn attitude(t: f64) -> Matrix3<f64> {
    rotation(&Vector3::new(0.0, 0.0, 1.0 + 0.6 * t)) * rotation(&Vector3::new(0.15 * libm::sin(t), 0.1, 0.0))
}

/// Velocity by central difference.
pub(super) fn velocity(t: f64) -> Vector3<f64> {
    (position(t + 1e-4) - position(t - 1e-4)) / 2e-4
}

/// Exact increment over 10 ms from the curve itself.
pub(super) fn increment(t: f64) -> ImuIncrement {
    let dt = 0.01;
    let gravity = Vector3::z() * -STANDARD_GRAVITY_M_PER_S2;
    let (r, turn) = (attitude(t), attitude(t).transpose() * attitude(t + dt));
    let angle = Vector3::new(turn.m32 - turn.m23, turn.m13 - turn.m31, turn.m21 - turn.m12) * 0.5;
    let gained = velocity(t + dt) - velocity(t) - gravity * dt;
    let moved = position(t + dt) - position(t) - velocity(t) * dt - gravity * (0.5 * dt * dt);
    ImuIncrement {
        start_ns: (t * 1e9) as u64,
        end_ns: (t * 1e9) as u64 + 10_000_000,
        delta_angle_rad: angle.map(|c| c as f32),
        delta_velocity_m_per_s: r.tr_mul(&gained).map(|c| c as f32),
        delta_position_m: r.tr_mul(&moved).map(|c| c as f32),
        removed: ImuErrors::default(),
    }
}

/// A clock without error.
fn clock() -> Nominal {
    Nominal::origin(0, Waveform::default().delay_period())
}

/// A window after fixes at the given steps of half a second; `disturb` changes the position of each.
fn window(steps: &[u32], disturb: impl Fn(u32, Vector3<f64>) -> Vector3<f64>) -> Window {
    poor_window(steps, 0.0, disturb)
}

/// The same of fixes that are known to `sigma_m`.
fn poor_window(steps: &[u32], sigma_m: f64, disturb: impl Fn(u32, Vector3<f64>) -> Vector3<f64>) -> Window {
    let mut window = Window::new();
    let mut now = 0;
    for &step in steps {
        for k in now..50 * step {
            window.advance(&increment(f64::from(k) * 0.01));
        }
        now = 50 * step;
        let t = f64::from(now) * 0.01;
        let towards = (G - position(t)).normalize();
        let seen = attitude(t).tr_mul(&towards);
        window.push(
            &clock(),
            disturb(step, position(t)),
            &[sigma_m, 0.0].map(Vector3::repeat),
            towards,
            seen,
        );
    }
    window
}

/// Six fixes of a body that stays level and moves at a steady velocity from 20 m east of the GMT on.
fn steady(velocity_m_per_s: Vector3<f64>) -> Window {
    let mut window = Window::new();
    let (gmt, up) = (Vector3::zeros(), Vector3::z() * STANDARD_GRAVITY_M_PER_S2);
    for step in 0..WINDOW as u64 {
        let place = Vector3::new(20.0, 0.0, 2.0) + velocity_m_per_s * (0.5 * step as f64);
        let towards = (gmt - place).normalize();
        if step > 0 {
            window.advance(&ImuIncrement {
                start_ns: (step - 1) * 500_000_000,
                end_ns: step * 500_000_000,
                delta_angle_rad: Vector3::zeros(),
                delta_velocity_m_per_s: (up * 0.5).map(|c| c as f32),
                delta_position_m: (up * 0.125).map(|c| c as f32),
                removed: ImuErrors::default(),
            });
        }
        window.push(
            &clock(),
            place,
            &[Vector3::repeat(0.01), Vector3::zeros()],
            towards,
            towards,
        );
    }
    window
}

/// Six fixes of a body that hovers.
pub(super) fn hovering() -> Window {
    steady(Vector3::zeros())
}

#[test]
fn only_a_sight_that_turns_to_the_side_is_told_from_an_image() {
    let told = |velocity_m_per_s| {
        let solution = steady(velocity_m_per_s).solve(WINDOW, None);
        solution.expect("consistent").is_no_image
    };
    assert!(!told(Vector3::zeros()));
    assert!(!told(Vector3::new(5.0, 0.0, 0.0)) && !told(Vector3::new(0.0, 0.0, 3.0)));
    assert!(!told(Vector3::new(0.0, 0.3, 0.0)) && told(Vector3::new(0.0, 3.0, 0.0)));
}

/// What turns to the left turns to the right in the image: one that turns by as much as tells it apart makes no window.
#[test]
fn an_image_whose_sights_turn_makes_no_window() {
    let mut window = Window::new();
    for fix in 0..WINDOW as u32 {
        for k in 50 * fix.max(1) - 50..50 * fix {
            window.advance(&increment(f64::from(k) * 0.01));
        }
        let t = 0.5 * f64::from(fix);
        let mirrored = |v: Vector3<f64>| Vector3::new(v.x, 80.0 - v.y, v.z);
        let towards = (G - mirrored(position(t))).normalize();
        let seen = attitude(t).tr_mul(&(mirrored(G) - position(t)).normalize());
        window.push(
            &clock(),
            mirrored(position(t)),
            &[Vector3::zeros(); 2],
            towards,
            seen,
        );
    }
    assert!(window.solve(WINDOW, None).is_none());
}

#[test]
fn exact_fixes_give_the_exact_pose() {
    for steps in [&[0, 1, 2, 3, 4][..], &[0, 1, 3, 4, 6, 7], &[1, 2, 3]] {
        let solution = window(steps, |_, p| p)
            .solve(steps.len(), None)
            .expect("consistent");
        let t = f64::from(*steps.last().expect("some")) * 0.5;
        assert!((solution.position_m - position(t)).norm() < 2e-3, "{steps:?}");
        assert!(
            (solution.velocity_m_per_s - velocity(t)).norm() < 5e-3,
            "{steps:?}"
        );
        assert!((solution.attitude - attitude(t)).norm() < 2e-3, "{steps:?}");
    }
}

#[test]
fn noisy_fixes_give_the_attitude_that_is_claimed() {
    for sigma_m in [0.0, 0.1] {
        let (mut square, mut claimed, trials) = (0.0, 0.0, 200);
        for trial in 0..trials {
            let noise = |step: u32| {
                let k = f64::from(10 * trial + step);
                // Irrational phases: spread evenly, 6 cm rms per axis beside what is claimed.
                Vector3::new(
                    libm::sin(12.9 * k * k),
                    libm::sin(78.2 * k * k + 1.0),
                    libm::sin(37.7 * k * k + 2.0),
                ) * (libm::hypot(0.06, sigma_m) * core::f64::consts::SQRT_2)
            };
            let solution = poor_window(&[0, 1, 2, 3, 4], sigma_m, |step, p| p + noise(step))
                .solve(5, None)
                .expect("consistent");
            let turn = solution.attitude * attitude(2.0).transpose();
            let angle = Vector3::new(turn.m32 - turn.m23, turn.m13 - turn.m31, turn.m21 - turn.m12) * 0.5;
            square += angle.norm_squared() / f64::from(trials);
            // The claim also covers an accelerometer bias of 20 mg (0.02 rad), which this flight has not; the sine between line
            // of sight and force is 0.9 here.
            let attitude_sigma_rad = solution.attitude_sigma_rad;
            claimed = libm::sqrt(attitude_sigma_rad * attitude_sigma_rad - 0.02 * 0.02 / 0.81);
        }
        let found = libm::sqrt(square);
        assert!(
            (0.4..1.6).contains(&(found / claimed)),
            "{sigma_m}: {found} {claimed}"
        );
    }
}

/// It would be taken for the pose of now.
#[test]
fn a_window_that_has_moved_on_gives_nothing() {
    let mut window = window(&[0, 1, 2, 3, 4], |_, p| p);
    assert!(window.solve(5, None).is_some());
    window.advance(&increment(2.0));
    assert!(window.solve(5, None).is_none());
}

#[test]
fn a_wrong_fix_spoils_the_window_until_it_has_left() {
    for wrong in 0..5 {
        let shift = |step: u32, p: Vector3<f64>| {
            if step == wrong {
                p + Vector3::new(2.0, 1.0, -2.0)
            } else {
                p
            }
        };
        assert!(
            window(&[0, 1, 2, 3, 4], shift).solve(5, None).is_none(),
            "fix {wrong}"
        );
    }
    let first_wrong = |step: u32, p: Vector3<f64>| if step == 0 { p * 3.0 } else { p };
    assert!(window(&[0, 1, 2, 3, 4, 5], first_wrong).solve(5, None).is_some());
    // All wrong in the same way: nothing contradicts it here, the filter's patience has to.
    assert!(
        window(&[0, 1, 2, 3, 4], |_, p| p + Vector3::new(0.0, 0.0, 3.0))
            .solve(5, None)
            .is_some()
    );
}

#[test]
fn three_fixes_do_when_the_attitude_is_known() {
    let scattered =
        |step: u32, p: Vector3<f64>| p + Vector3::new(0.05, -0.05, 0.05) * if step == 1 { 1.0 } else { -0.5 };
    let solution = window(&[0, 1, 2], scattered)
        .solve(3, Some(&attitude(1.0)))
        .expect("consistent");
    assert!((solution.position_m - position(1.0)).norm() < 0.1);
    assert!((solution.velocity_m_per_s - velocity(1.0)).norm() < 0.1);
    assert_eq!(solution.attitude_sigma_rad, 0.0);
    // An attitude that is not the one is noticed.
    let wrong = rotation(&Vector3::new(0.0, 0.0, 0.1)) * attitude(1.0);
    assert!(window(&[0, 1, 2], scattered).solve(3, Some(&wrong)).is_none());
}

#[test]
fn too_few_fixes_or_too_far_apart_give_nothing() {
    assert!(window(&[0, 1], |_, p| p).solve(2, None).is_none());
    assert!(window(&[0, 1, 2], |_, p| p).solve(5, None).is_none());
    assert!(window(&[0, 1, 2, 3, 9, 10], |_, p| p).solve(5, None).is_none());
    assert!(
        window(&[0, 1, 2], |_, _| Vector3::repeat(f64::NAN))
            .solve(3, None)
            .is_none()
    );
    assert_eq!(WINDOW, 6);
}

#[test]
fn fixes_that_scatter_more_than_they_claim_widen_the_pose() {
    let solve = |size_m: f64| {
        let scattered = |step: u32, p: Vector3<f64>| {
            let side = if step.is_multiple_of(2) { size_m } else { -size_m };
            p + Vector3::new(side, 0.0, 0.0)
        };
        window(&[0, 1, 2, 3, 4, 5], scattered)
            .solve(6, None)
            .expect("within the tolerance")
    };
    let (sound, scattered) = (solve(0.0), solve(0.3));
    for (claimed, sound) in [
        (scattered.errors.excess, sound.errors.excess),
        (scattered.attitude_sigma_rad, sound.attitude_sigma_rad),
    ] {
        assert!(claimed > 1.5 * sound, "{claimed} beside {sound}");
    }
}

/// A flight past the GMT at walking pace, as it is and as a wall shows it: every fix mirrored, each sight from the image of the GMT.
/// No fix is off the line, no sight by more than three degrees; but the line of sight turns the other way.
#[test]
fn the_image_of_a_flight_that_turns_about_the_gmt_gives_no_pose() {
    let mirrored = |v: Vector3<f64>| Vector3::new(v.x, 80.0 - v.y, v.z);
    let solved = |image: bool, sight_sigma_rad: Vector3<f64>| {
        let mut window = Window::new();
        for k in 0..=250_u64 {
            let t = k as f64 * 0.01;
            if k.is_multiple_of(50) {
                // The image is 43 m abeam: it turns by 40 mrad, by which its sights part from the gyroscope to each side.
                let true_place = Vector3::new(46.0, 81.1 + 0.7 * t, 11.0);
                let (place, from) = if image {
                    (mirrored(true_place), mirrored(G))
                } else {
                    (true_place, G)
                };
                let turned = rotation(&Vector3::new(0.0, 0.0, 0.5 * t));
                let seen = turned.tr_mul(&(from - true_place).normalize());
                window.push(
                    &clock(),
                    place,
                    &[Vector3::repeat(0.1), sight_sigma_rad],
                    (G - place).normalize(),
                    seen,
                );
            }
            if k < 250 {
                window.advance(&super::flight::increment(k * super::flight::STEP_NS));
            }
        }
        window.solve(6, None)
    };
    let sure = Vector3::repeat(0.003);
    assert!(solved(false, sure).is_some());
    assert_eq!(solved(true, sure), None);
    // Elevations that the ground's bounce has made unsure say nothing of azimuths.
    let low = Vector3::new(0.003, 0.003, 0.03);
    assert_eq!(solved(true, low), None);
    assert!(solved(true, Vector3::repeat(0.03)).is_some());
}

/// The clock's drift is found between the fixes: those before are where it has them by now.
#[test]
fn a_drift_that_is_found_late_is_no_velocity() {
    let drift_m_per_s = 5.0;
    let mut window = Window::new();
    let mut now = clock();
    for k in 0..=200_u32 {
        let t = f64::from(k) * 0.01;
        if k.is_multiple_of(50) {
            let towards = (G - position(t)).normalize();
            let offset_m = drift_m_per_s * t;
            let found = k >= 150;
            now.clock_drift_m_per_s = if found { drift_m_per_s } else { 0.0 };
            now.clock_offset_m = if found { offset_m } else { 0.0 };
            let place = position(t) + towards * (now.clock_offset_m - offset_m);
            let seen = attitude(t).tr_mul(&towards);
            window.push(&now, place, &[Vector3::zeros(); 2], towards, seen);
        }
        if k < 200 {
            window.advance(&increment(t));
        }
    }
    let solution = window.solve(5, None).expect("consistent");
    assert!((solution.position_m - position(2.0)).norm() < 2e-3);
    assert!((solution.velocity_m_per_s - velocity(2.0)).norm() < 5e-3);
}

#[test]
fn a_window_of_six_does_without_the_one_that_is_wrong() {
    let wrong = |which: &'static [u32]| {
        move |step: u32, place: Vector3<f64>| {
            let aside = if which.contains(&step) { 3.0 } else { 0.0 };
            place + Vector3::new(0.0, aside, -aside)
        }
    };
    let steps = [0, 1, 2, 3, 4, 5];
    for which in [&[0_u32] as &[u32], &[2], &[4]] {
        let window = window(&steps, wrong(which));
        assert!(window.solve(6, None).is_none(), "{which:?}");
        let solution = window.solve_most(6, None).expect("five agree");
        assert!(
            (solution.position_m - position(2.5)).norm() < 0.05,
            "{solution:?}"
        );
        let error = solution.attitude * attitude(2.5).transpose() - Matrix3::identity();
        assert!(error.norm() < 0.02, "{error}");
        assert!(window.solve_most(6, Some(&attitude(2.5))).is_some(), "{which:?}");
        // Five, a start's number, have none to spare.
        assert_eq!(window.solve_most(5, None).is_some(), which == [0], "{which:?}");
    }
    // Two that are wrong are too many, and of a wrong last one the pose would be.
    for which in [&[1_u32, 3] as &[u32], &[5]] {
        assert!(
            window(&steps, wrong(which)).solve_most(6, None).is_none(),
            "{which:?}"
        );
    }
}
