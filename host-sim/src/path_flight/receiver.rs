//! The receiver of a path list: poses are given and paths measured, so what is left of a flight is link state, reflection point,
//! map and packets, each as it flies.

use cslam_core::estimator::{Health, SweepVerdict};
use cslam_core::link_state::{AcceptGate, LinkState, Probabilities};
use cslam_core::map::PointCloud;
use cslam_core::reflection::{Form, ReflectionPoint, Rejection, Verdict, solve};
use cslam_core::telemetry::{
    Batch, HealthCounters, HealthReport, LinkReport, MAX_FRAME, MAX_OUTCOMES, Message, PathOutcome,
    PointReport, Sender, TelemetryError,
};

use super::Sweep;
use crate::link_state::judge::{Judge, received};
use crate::paths::Link;

/// The map of a board.
pub type ListMap = PointCloud<4096>;

/// Points wait until a batch is full: nobody watches.
const PATIENCE_NS: u64 = u64::MAX;
/// Coordinates up to here can be sent, m.
const FARTHEST_M: f32 = 2.0e6;

/// How paths are judged.
#[derive(Clone, Copy, Debug)]
pub struct Methods<'m> {
    /// Link state.
    pub judge: Judge<'m>,
    /// When a path is taken for one reflection.
    pub accept: AcceptGate,
    /// Closed form of the reflection point.
    pub form: Form,
    /// Whether the strongest path alone may become a point.
    pub strongest_only: bool,
}

/// What became of a path.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Answer {
    /// What the ground is told.
    pub outcome: PathOutcome,
    /// The point, when it is one.
    pub point: Option<ReflectionPoint>,
    /// What it is; `None` where nothing judged it.
    pub probabilities: Option<Probabilities>,
}

/// What became of a sweep.
#[derive(Clone, Debug, PartialEq)]
pub struct Answered {
    /// State of the link.
    pub link: Option<Probabilities>,
    /// What became of its paths.
    pub paths: Vec<Answer>,
}

/// A receiver with its map.
#[derive(Debug)]
pub struct ListReceiver<'m> {
    methods: Methods<'m>,
    map: Box<ListMap>,
    sender: Sender,
    batch: Batch,
    stop: u16,
    gmt_m: Option<[f32; 3]>,
    counters: HealthCounters,
    packets: Vec<u8>,
}

impl<'m> ListReceiver<'m> {
    /// A receiver with an empty map that sends as `sender` does.
    pub fn new(methods: Methods<'m>, sender: Sender) -> Self {
        Self {
            methods,
            map: Box::new(ListMap::new()),
            sender,
            batch: Batch::new(PATIENCE_NS),
            stop: 0,
            gmt_m: None,
            counters: HealthCounters::default(),
            packets: Vec::new(),
        }
    }

    /// Judges the paths of a sweep, maps their points and reports them.
    ///
    /// # Errors
    /// In words, when the link can be no measurement although each of its paths might be one, or cannot be sent.
    pub fn hear(&mut self, link: &Link, sweep: &Sweep, time_ns: u64) -> Result<Answered, String> {
        let gmt_m = sweep.ends.gmt.to_array();
        if self.gmt_m.is_some_and(|before| before != gmt_m) {
            self.stop = self.stop.saturating_add(1);
        }
        self.gmt_m = Some(gmt_m);
        let mut answered = self.judge(link, sweep)?;
        for answer in &mut answered.paths {
            self.count(answer);
            if let (PathOutcome::Point, Some(point)) = (answer.outcome, &answer.point) {
                let report = PointReport {
                    sweep: sweep.link,
                    stop: self.stop,
                    position_m: point.position.to_array(),
                    sigma_m: point.sigma_m(),
                    probability: answer.probabilities.map_or(0.0, |p| p.first_order),
                    surface: None,
                };
                match self.batch.push(time_ns, &report) {
                    Ok(full) => self.send(full.map(Message::Points)).map_err(|e| e.to_string())?,
                    Err(_) => answer.outcome = PathOutcome::PointOutOfRange,
                }
            }
        }
        self.report(link, sweep, &answered, time_ns)
            .map_err(|e| e.to_string())?;
        Ok(answered)
    }

    /// Sends what is left, and the totals: the map, and every byte that was sent.
    ///
    /// # Errors
    /// When a packet cannot be encoded.
    pub fn end(mut self) -> Result<(Box<ListMap>, Vec<u8>), TelemetryError> {
        let points = self.batch.close();
        self.send(points.map(Message::Points))?;
        let map = self.map.counters();
        let counters = HealthCounters {
            map_points: u32::try_from(self.map.len()).unwrap_or(u32::MAX),
            map_dropped: map.dropped.saturating_add(map.out_of_range),
            ..self.counters
        };
        self.send(Some(Message::Health(HealthReport {
            counters,
            ..HealthReport::default()
        })))?;
        Ok((self.map, self.packets))
    }

    fn judge(&mut self, link: &Link, sweep: &Sweep) -> Result<Answered, String> {
        let Methods {
            judge, accept, form, ..
        } = self.methods;
        let verdicts: Vec<_> = sweep
            .paths
            .iter()
            .map(|path| solve(&sweep.ends, path, form, &accept.point))
            .collect();
        let heard: Vec<_> = sweep
            .paths
            .iter()
            .zip(&link.paths)
            .map(|(path, listed)| received(*path, listed))
            .collect();
        let judged = match judge.link(&sweep.ends, &heard) {
            Ok(judged) => judged,
            // Every path says for itself what is wrong.
            Err(_) if verdicts.iter().all(Result::is_err) => crate::link_state::judge::Judged {
                link: None,
                paths: vec![None; heard.len()],
            },
            Err(why) => return Err(why),
        };
        let mut paths = Vec::with_capacity(verdicts.len());
        for ((index, verdict), probabilities) in verdicts.into_iter().enumerate().zip(&judged.paths) {
            let (mut outcome, mut point) = (PathOutcome::NotFirstOrder, None);
            match (verdict, probabilities) {
                (Err(error), _) => outcome = PathOutcome::Input(error),
                _ if self.methods.strongest_only && index > 0 => outcome = PathOutcome::Unused,
                (_, None) => {}
                (_, Some(p)) if p.state() == LinkState::LineOfSight => {
                    outcome = PathOutcome::Rejected(Rejection::LineOfSight);
                }
                // In this order a probability that is no number accepts nothing.
                (Ok(verdict), Some(p)) if p.is_first_order(accept.min_probability) => {
                    match verdict {
                        Verdict::Rejected(reason) => outcome = PathOutcome::Rejected(reason),
                        Verdict::Accepted(solved) => {
                            // The map counts what it does not take.
                            outcome = match self.map.insert(&solved) {
                                Ok(_) => PathOutcome::Point,
                                Err(_) => PathOutcome::PointOutOfRange,
                            };
                            point = Some(solved);
                        }
                    }
                }
                _ => {}
            }
            paths.push(Answer {
                outcome,
                point,
                probabilities: *probabilities,
            });
        }
        Ok(Answered {
            link: judged.link,
            paths,
        })
    }

    fn count(&mut self, answer: &Answer) {
        let counters = &mut self.counters;
        // Paths stand for blocks: what came is what was judged.
        counters.blocks = counters.blocks.saturating_add(1);
        let counter = match answer.outcome {
            PathOutcome::Point | PathOutcome::PointOutOfRange => &mut counters.points,
            PathOutcome::Input(_) => &mut counters.invalid,
            _ => &mut counters.rejected,
        };
        *counter = counter.saturating_add(1);
    }

    /// Reports what became of the paths, in as many packets as they need; an outage in one.
    fn report(
        &mut self,
        link: &Link,
        sweep: &Sweep,
        answered: &Answered,
        time_ns: u64,
    ) -> Result<(), TelemetryError> {
        let gmt_m = sweep.ends.gmt.to_array();
        let known = gmt_m.iter().all(|coordinate| coordinate.abs() < FARTHEST_M);
        let snr_db = link.paths.first().and_then(|path| path.snr_db);
        let outcomes: Vec<_> = answered.paths.iter().map(|answer| answer.outcome).collect();
        let mut first_path = 0;
        loop {
            let rest = outcomes.get(usize::from(first_path)..).unwrap_or_default();
            let part = &rest[..rest.len().min(MAX_OUTCOMES)];
            self.send(Some(Message::Link(LinkReport {
                sweep: sweep.link,
                time_ns,
                state: answered.link.map_or(LinkState::Outage, |p| p.state()),
                verdict: SweepVerdict::NoSight,
                beams: 0,
                snr_db: snr_db.map(|snr_db| snr_db as f32),
                gmt_m: known.then(|| gmt_m.map(f64::from)),
                stop: self.stop,
                health: Health::default(),
                first_path,
                outcomes: part.iter().copied().collect(),
            })))?;
            if rest.len() <= MAX_OUTCOMES {
                return Ok(());
            }
            first_path += MAX_OUTCOMES as u8;
        }
    }

    fn send(&mut self, message: Option<Message>) -> Result<(), TelemetryError> {
        let Some(message) = message else {
            return Ok(());
        };
        let mut frame = [0; MAX_FRAME];
        self.packets
            .extend_from_slice(self.sender.encode(&message, &mut frame)?);
        self.counters.packets_sent = self.counters.packets_sent.saturating_add(1);
        Ok(())
    }
}
