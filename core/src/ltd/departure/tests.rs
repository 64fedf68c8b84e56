use super::*;

type Default72 = Departures<72, 3, 8, 8>;

/// Amplitudes of the beams above a share of the strongest, by the codebook's own field.
fn looks(codebook: &Codebook<f64>, u: &Direction<Gmt, f64>, share: f64) -> Vec<Look, 72> {
    let amplitude = |m| {
        let field: Complex<f64> = codebook.field(m, u);
        libm::sqrt(field.norm_sqr())
    };
    let strongest = (0..72).map(amplitude).fold(0.0, f64::max);
    let mut looks: Vec<Look, 72> = (0..72)
        .filter(|m| amplitude(*m) > share * strongest)
        .map(|m| Look {
            beam: m as u16,
            amplitude: amplitude(m) as f32,
            variance: 1e-6,
        })
        .collect();
    looks.sort_unstable_by(|a, b| b.amplitude.total_cmp(&a.amplitude));
    looks
}

#[test]
fn direction_comes_back_from_exact_amplitudes() {
    let codebook = Codebook::<f64>::default();
    let departures = Default72::new(&Codebook::<f32>::default(), 0.06);
    for k in 0..300 {
        let azimuth = -3.1 + 6.2 * (0.618_034 * f64::from(k)).fract();
        let elevation = 0.44 * (0.414_214 * f64::from(k)).fract();
        let truth =
            Direction::<Gmt, f64>::from_zenith_azimuth(core::f64::consts::FRAC_PI_2 - elevation, azimuth)
                .expect("angles");
        let looks = looks(&codebook, &truth, 0.03);
        let (found, sigma_rad) = departures.fit(looks.iter().copied()).expect("looks");
        let off = found
            .vector()
            .cast::<f64>()
            .cross(truth.vector())
            .norm()
            .to_degrees();
        assert!(
            off < 0.1,
            "{off} deg off at azimuth {azimuth}, elevation {elevation}"
        );
        assert!(sigma_rad > 0.0 && sigma_rad < 0.01);
    }
}

#[test]
fn single_look_is_the_beam_and_says_how_little_it_knows() {
    let codebook = Codebook::<f32>::default();
    let departures = Default72::new(&codebook, 0.06);
    let look = Look {
        beam: 30,
        amplitude: 1.0,
        variance: 1e-4,
    };
    let (found, sigma_rad) = departures.fit([look].into_iter()).expect("a look");
    let beam = codebook.beam(30).expect("beam").direction();
    assert!((found.vector() - beam).norm() < 1e-3);
    assert!((sigma_rad - PRIOR_RAD).abs() < 0.01, "{sigma_rad}");
    assert!(departures.fit(core::iter::empty()).is_none());
    assert!(
        departures.fit([Look { beam: 72, ..look }].into_iter()).is_none(),
        "no such beam"
    );
}

/// Amplitudes with noise and gain errors of the stated size: the direction errs as much as it says.
#[test]
fn error_is_what_the_fit_says() {
    let codebook = Codebook::<f64>::default();
    let mut state = 5_u32;
    let mut normal = || {
        let mut sum = -6.0_f32;
        for _ in 0..12 {
            state = state.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
            sum += (state >> 8) as f32 / 16_777_216.0;
        }
        sum
    };
    let departures = Default72::new(&Codebook::<f32>::default(), 0.06);
    let (mut squares, mut sigmas, mut refused, trials) = (0.0, 0.0, 0, 150);
    for k in 0..trials {
        let azimuth = -3.1 + 6.2 * (0.618_034 * f64::from(k)).fract();
        let elevation = 0.05 + 0.33 * (0.414_214 * f64::from(k)).fract();
        let truth =
            Direction::<Gmt, f64>::from_zenith_azimuth(core::f64::consts::FRAC_PI_2 - elevation, azimuth)
                .expect("angles");
        let mut looks = looks(&codebook, &truth, 0.1);
        let noise = 0.01 * looks[0].amplitude;
        for look in &mut looks {
            look.amplitude += look.amplitude * 0.06 * normal() + noise * normal();
            look.variance = noise * noise;
        }
        looks.sort_unstable_by(|a, b| b.amplitude.total_cmp(&a.amplitude));
        let Some((found, sigma_rad)) = departures.fit(looks.iter().copied()) else {
            refused += 1;
            continue;
        };
        let off = found.vector().cast::<f64>().cross(truth.vector()).norm();
        squares += 0.5 * (off / f64::from(sigma_rad)).powi(2);
        sigmas += f64::from(sigma_rad).to_degrees();
    }
    let told = f64::from(trials - refused);
    let (honest, sigma_deg) = (squares / told, sigmas / told);
    assert!(refused <= 3, "{refused}");
    assert!((0.6..1.4).contains(&honest), "{honest}, sigma {sigma_deg} deg");
    assert!(sigma_deg < 0.4, "{sigma_deg}");
}

#[test]
fn heavier_beams_decide() {
    let codebook = Codebook::<f64>::default();
    let departures = Default72::new(&Codebook::<f32>::default(), 0.0);
    let truth = Direction::<Gmt, f64>::from_zenith_azimuth(1.45, 0.2).expect("angles");
    let mut looks = looks(&codebook, &truth, 0.2);
    // One beam lies by 30 %, and says so.
    looks[1].amplitude *= 1.3;
    looks[1].variance = 100.0;
    let (found, _) = departures.fit(looks.iter().copied()).expect("looks");
    let off = found
        .vector()
        .cast::<f64>()
        .cross(truth.vector())
        .norm()
        .to_degrees();
    assert!(off < 0.1, "{off} deg");
    // Taken at its word it pulls, so far that no direction is believed.
    looks[1].variance = 1e-6;
    assert!(departures.fit(looks.iter().copied()).is_none());
}

/// Where the amplitudes fit, the Gauss-Newton Hessian is the curvature of the cost, strength eliminated: the standard
/// deviation comes from it.
#[test]
fn hessian_is_the_curvature_of_the_cost() {
    let codebook = Codebook::<f64>::default();
    let departures = Default72::new(&Codebook::<f32>::default(), 0.0);
    for (zenith, azimuth) in [(1.45, 0.2), (1.25, 0.6), (1.5, -2.0)] {
        let truth = Direction::<Gmt, f64>::from_zenith_azimuth(zenith, azimuth).expect("angles");
        let u = Direction::<Gmt>::from_vector(truth.vector().cast()).expect("unit");
        // Three beams: the strength they leave open matters.
        let looks: Vec<(Aim, f32, f32), LOOKS> = looks(&codebook, &truth, 0.1)
            .iter()
            .take(3)
            .filter_map(|look| Some((departures.aims[usize::from(look.beam)]?, look.amplitude, 1e4)))
            .collect();
        let state = departures.expand(&looks, &u, u.vector());
        let (e1, e2) = u.tangents();
        let step = 2e-3;
        let cost = |a: f32, b: f32| {
            let moved = Direction::from_vector(u.vector() + (e1 * a + e2 * b) * step).expect("unit");
            departures.cost(&looks, &moved, u.vector())
        };
        let curvature = |a: f32, b: f32| (cost(a, b) + cost(-a, -b) - 2.0 * state.cost) / (2.0 * step * step);
        let [h11, h12, h22] = state.hessian;
        for (measured, expected) in [
            (curvature(1.0, 0.0), h11),
            (curvature(0.0, 1.0), h22),
            (curvature(1.0, 1.0), h11 + 2.0 * h12 + h22),
        ] {
            assert!((measured / expected - 1.0).abs() < 0.05, "{measured} {expected}");
        }
    }
}
