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
        let (found, sigma_rad) = departures.fit(looks.iter().copied(), &mut 1).expect("looks");
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
    let (found, sigma_rad) = departures.fit([look].into_iter(), &mut 1).expect("a look");
    let beam = codebook.beam(30).expect("beam").direction();
    assert!((found.vector() - beam).norm() < 1e-3);
    assert!((sigma_rad - PRIOR_RAD).abs() < 0.01, "{sigma_rad}");
    assert!(departures.fit(core::iter::empty(), &mut 1).is_none());
    assert!(
        departures
            .fit([Look { beam: 72, ..look }].into_iter(), &mut 1)
            .is_none(),
        "no such beam"
    );
}

/// Two looks are one number: which of all directions that explain it is the right one, they cannot tell, however loud they are.
/// Amplitudes and variances of a path that a flight through a city has heard.
#[test]
fn two_looks_leave_one_direction_to_the_prior() {
    const GAIN_SIGMA: f32 = 0.035;
    let departures = Default72::new(&Codebook::<f32>::default(), GAIN_SIGMA);
    let at = |face: usize, cosines: [f32; 2]| {
        let near = |aim: &Aim| {
            let off = [aim.cosines[0] - cosines[0], aim.cosines[1] - cosines[1]];
            aim.face == face && off[0].abs().max(off[1].abs()) < 1e-3
        };
        departures
            .aims
            .iter()
            .position(|aim| aim.as_ref().is_some_and(near))
    };
    let look = |cosines, amplitude: f32, variance: f32| Look {
        beam: at(0, cosines).expect("a beam") as u16,
        amplitude,
        // Without the gain's share, which the fit adds.
        variance: variance - (GAIN_SIGMA * amplitude) * (GAIN_SIGMA * amplitude),
    };
    let heard = [
        look([0.098_110_7, 0.422_618_27], 3.646_338e-4, 1.670_006_4e-10),
        look([0.741_213_14, 0.207_911_7], 3.589_578e-4, 1.917_180_7e-10),
    ];
    for scale in [1.0, 0.999, 1.001, 1.1, 0.7] {
        let looks = heard.map(|look| Look {
            amplitude: look.amplitude * if look.beam == heard[0].beam { scale } else { 1.0 },
            ..look
        });
        let (_, sigma_rad) = departures.fit(looks.into_iter(), &mut 1).expect("a direction");
        assert!((0.08..=PRIOR_RAD).contains(&sigma_rad), "{scale}: {sigma_rad}");
    }
}

#[test]
fn a_hessian_of_rank_one_gives_a_finite_variance_whatever_its_rounding() {
    // As the flight had it: the determinant is zero in single precision.
    assert!((libm::sqrtf(mean_variance(2.162_862_6e9, 3.799_327_5e9, 6.673_974_3e9)) - 0.0863).abs() < 1e-3);
    for nudge in [-3, -1, 1, 3] {
        let h12 = f32::from_bits(3.799_327_5e9_f32.to_bits().wrapping_add_signed(nudge));
        let sigma = libm::sqrtf(mean_variance(2.162_862_6e9, h12, 6.673_974_3e9));
        assert!((sigma - 0.0863).abs() < 1e-3, "{nudge}: {sigma}");
    }
    assert_eq!(mean_variance(4.0, 0.0, 2.0), 0.375);
    assert!(mean_variance(f32::NAN, 0.0, 1.0).is_nan());
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
        let Some((found, sigma_rad)) = departures.fit(looks.iter().copied(), &mut 1) else {
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
    let (found, _) = departures.fit(looks.iter().copied(), &mut 1).expect("looks");
    let off = found
        .vector()
        .cast::<f64>()
        .cross(truth.vector())
        .norm()
        .to_degrees();
    assert!(off < 0.1, "{off} deg");
    // Taken at its word it pulls, so far that no direction is believed.
    looks[1].variance = 1e-6;
    assert!(departures.fit(looks.iter().copied(), &mut 1).is_none());
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
