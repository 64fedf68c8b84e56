//! A receiver that knows its pose and its clock: from raw samples to classified and solved paths by exactly the code that
//! flies, without what localization adds to the errors.

use cslam_core::array::{Codebook, UavArrays};
use cslam_core::geometry::{Gmt, Matrix3, Position, Rotation, World};
use cslam_core::link_state::{
    Classifier, LinkGeometry, LinkState, PaperClassifier, Probabilities, Received, models,
};
use cslam_core::path::{Departure, Path};
use cslam_core::paths::{ElementErrors, EstimatedPath, EstimatorConfig, PathEstimator};
use cslam_core::receiver::{Config, LinkStates, Mapped};
use cslam_core::reflection::{Ends, ReflectionPoint, Verdict, solve};
use cslam_core::signal::Waveform;

use crate::channel::{Impairments, Instant, Sweep};
use crate::estimate::{Mode, estimator};
use crate::paths::{Link, LinkPath};

/// Errors do not make a path shorter than this, m.
const SHORTEST_M: f64 = -5.0;

/// Which errors the arrays have.
#[derive(Clone, Copy, Debug, PartialEq, Eq, clap::ValueEnum)]
pub(super) enum Arrays {
    /// None, but a free oscillator phase of each array in each beam
    Ideal,
    /// Those of the error budget: element phases, axes, delays at both ends
    Budget,
}

impl Arrays {
    pub(super) fn impairments(self) -> Impairments {
        match self {
            Self::Ideal => Impairments {
                free_array_phase: true,
                ..Impairments::none()
            },
            Self::Budget => Impairments::budget(),
        }
    }
}

/// The receiver of a mode.
pub(super) struct KnownPose {
    pub(super) mode: Mode,
    pub(super) config: Config<'static>,
}

/// What it makes of one sweep.
#[derive(Clone, Debug)]
pub(super) struct Perceived {
    pub(super) ends: Ends,
    /// Estimated paths in world axes, strongest first.
    pub(super) paths: Vec<Received>,
    /// What each is, where this mode looks at it.
    pub(super) probabilities: Vec<Option<Probabilities>>,
}

impl KnownPose {
    /// The models that fly, the gates of the mode.
    pub(super) fn new(mode: Mode) -> anyhow::Result<Self> {
        let config = match mode {
            Mode::Best => Config::best(LinkStates::Geometric(Classifier::new(
                models::geometric()?,
                models::geometric_without_departure()?,
            )?)),
            Mode::Paper | Mode::PaperInterpolated => Config::paper(PaperClassifier::new(models::paper()?)?),
        };
        Ok(Self { mode, config })
    }

    /// The estimator of the mode; one for each thread.
    pub(super) fn estimator(&self, arrays: Arrays) -> Box<dyn PathEstimator<32, 9>> {
        let mut config = EstimatorConfig {
            arrays: UavArrays::default(),
            codebook: Codebook::default(),
            ..EstimatorConfig::single_sweeps()
        };
        if arrays == Arrays::Ideal {
            config.element_errors = ElementErrors::Known(0.0);
        }
        estimator(self.mode, &config)
    }

    /// Estimates and classifies the paths of a sweep; works on its blocks in place.
    pub(super) fn perceive(
        &self,
        estimator: &mut dyn PathEstimator<32, 9>,
        sweep: &mut Sweep,
        link: &Link,
        instant: &Instant,
    ) -> anyhow::Result<Perceived> {
        for block in sweep.strongest_first() {
            estimator.push_beam(block.view());
        }
        let estimated = estimator.finish();
        let position = |p: [f64; 3]| Position::new(p[0] as f32, p[1] as f32, p[2] as f32);
        let ends = Ends {
            uav: position(link.rx)?,
            uav_covariance: Matrix3::zeros(),
            gmt: position(link.tx)?,
        };
        let attitude = Rotation::from_matrix(instant.attitude.matrix().map(|c| c as f32))?;
        let gmt = Rotation::from_matrix(instant.gmt_attitude.matrix().map(|c| c as f32))?;
        let clock_m = instant.clock_offset_s * cslam_core::constants::SPEED_OF_LIGHT_M_PER_S;
        let paths: Vec<Received> = estimated
            .iter()
            .map(|found| {
                let found = found.with_departure_in_world(&gmt);
                // Delays are cyclic; what comes out a little below nothing is a short path with its error.
                let length_m = f64::from(found.path.c_tau_m) - clock_m - SHORTEST_M;
                let path = Path {
                    c_tau_m: (length_m.rem_euclid(Waveform::default().delay_period().length_m()) + SHORTEST_M)
                        as f32,
                    aod: found.path.aod.map(|aod| self.departure(&aod)),
                    covariance: found.path.covariance + self.residuals(),
                    ..found.path
                };
                Received {
                    path: path.to_world(&attitude, &Matrix3::zeros()),
                    gain_db: self.gain_db(&found, &gmt),
                }
            })
            .collect();
        let probabilities = self.classify(&ends, &paths);
        Ok(Perceived {
            ends,
            paths,
            probabilities,
        })
    }

    /// What calibration leaves, which the estimator's own covariance does not hold.
    fn residuals(&self) -> Matrix3<f32> {
        let residuals = &self.config.residuals;
        let angle = residuals.angle_rad * residuals.angle_rad;
        Matrix3::from_diagonal(&[residuals.delay_m * residuals.delay_m, angle, angle].into())
    }

    fn departure(&self, departure: &Departure) -> Departure {
        let residual = self.config.residuals.departure_rad;
        Departure {
            sigma_rad: (departure.sigma_rad * departure.sigma_rad + residual * residual).sqrt(),
            ..*departure
        }
    }

    fn gain_db(&self, found: &EstimatedPath<World>, gmt: &Rotation<Gmt, World>) -> Option<f32> {
        let radio = &self.config.radio;
        let (arrays, codebook): (UavArrays, Codebook) = (radio.uav_arrays(), radio.codebook());
        let budget = &self.config.budget;
        budget.path_gain_db(found, &arrays, &codebook, &radio.waveform, gmt)
    }

    fn classify(&self, ends: &Ends, paths: &[Received]) -> Vec<Option<Probabilities>> {
        match &self.config.link_states {
            LinkStates::Trees(classifier) => {
                let link = LinkGeometry::new(ends, paths, &self.config.radio.waveform).ok();
                let path = |path| link.as_ref().and_then(|link| classifier.path(link, path).ok());
                paths.iter().map(path).collect()
            }
            LinkStates::Geometric(classifier) => {
                let link = LinkGeometry::new(ends, paths, &self.config.radio.waveform).ok();
                let path = |path| link.as_ref().and_then(|link| classifier.path(link, path).ok());
                paths.iter().map(path).collect()
            }
            LinkStates::Paper(classifier) => {
                let link = classifier.link(paths).ok().flatten();
                (0..paths.len()).map(|i| link.filter(|_| i == 0)).collect()
            }
            LinkStates::Rules(_) => vec![None; paths.len()],
        }
    }

    /// The point of a path whatever its state, by the closed form of the mode with every gate open.
    pub(super) fn solve(&self, perceived: &Perceived, index: usize) -> Option<ReflectionPoint> {
        let path = &perceived.paths.get(index)?.path;
        let open = cslam_core::reflection::Gates::open();
        match solve(&perceived.ends, path, self.config.form, &open) {
            Ok(Verdict::Accepted(point)) => Some(point),
            _ => None,
        }
    }

    /// What becomes of a path: the point that this mode takes into its map, or why there is none.
    ///
    /// # Errors
    /// The reason in words.
    pub(super) fn outcome(
        &self,
        perceived: &Perceived,
        index: usize,
    ) -> Result<ReflectionPoint, &'static str> {
        let path = perceived.paths.get(index).ok_or("no such path")?;
        if self.config.mapped == Mapped::Strongest && index > 0 {
            return Err("not the strongest");
        }
        let probabilities = perceived.probabilities.get(index).copied().flatten();
        let probabilities = probabilities.ok_or("not classified")?;
        if probabilities.state() != LinkState::FirstOrder {
            return Err("not first order");
        }
        if self.mode != Mode::Best {
            return self.solve(perceived, index).ok_or("no solution");
        }
        let gate = &self.config.accept;
        match solve(&perceived.ends, &path.path, self.config.form, &gate.point) {
            Err(error) => Err(error.as_str()),
            Ok(_) if !probabilities.is_first_order(gate.min_probability) => {
                Err("first order not sure enough")
            }
            Ok(Verdict::Rejected(reason)) => Err(reason.as_str()),
            Ok(Verdict::Accepted(point)) => Ok(point),
        }
    }
}

/// Squared distance of a perceived path from a true one in units of 1 m and 3 degrees; `None` beyond either.
fn apart(received: &Received, truth: &LinkPath) -> Option<f32> {
    const GATES: [f32; 2] = [1.0, 3.0 * core::f32::consts::PI / 180.0];
    let truth = crate::measurement::path::<f32>(truth, &crate::measurement::Sigmas::default()).ok()?;
    let path = &received.path;
    let parts = [
        (path.c_tau_m - truth.c_tau_m).abs() / GATES[0],
        truth.aoa.angle_to_rad(&path.aoa) / GATES[1],
    ];
    let near = parts.iter().all(|part| *part < 1.0);
    near.then_some(parts[0] * parts[0] + parts[1] * parts[1])
}

/// Place of the least distance.
fn least(distances: impl Iterator<Item = Option<f32>>) -> Option<usize> {
    distances
        .enumerate()
        .filter_map(|(place, distance)| Some((place, distance?)))
        .min_by(|a, b| a.1.total_cmp(&b.1))
        .map(|(place, _)| place)
}

/// Place of the perceived path that is nearest to a true one, within 1 m and 3 degrees.
pub(super) fn nearest(perceived: &Perceived, link: &Link, index: usize) -> Option<usize> {
    let truth = link.paths.get(index)?;
    least(perceived.paths.iter().map(|received| apart(received, truth)))
}

/// Place of the true path that is nearest to a perceived one, within 1 m and 3 degrees.
pub(super) fn truth_of(received: &Received, link: &Link) -> Option<usize> {
    least(link.paths.iter().map(|truth| apart(received, truth)))
}

/// Distance of a point from where the wave was reflected last, m.
pub(super) fn error_m(point: &ReflectionPoint, truth_m: [f64; 3]) -> f64 {
    let found = point.position.to_array().map(f64::from);
    let squares: f64 = (0..3).map(|k| (found[k] - truth_m[k]).powi(2)).sum();
    squares.sqrt()
}
