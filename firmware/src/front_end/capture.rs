//! One frame out of the camera port: when READY rises and falls, and what became of the buffer.
//!
//! A rise of READY is a credit for one frame (docs/front-end.md section 7): [`Capture::offer`] arms the port first and raises READY then,
//! so the frame that it lets begin is always the one that the port waits for. Nothing depends on how soon READY falls again. Every
//! wait has an end: a frame that stops short, runs over, stalls or never ends costs itself, is told apart and given up, and the port is
//! armed anew for the next rise of VSYNC.
//!
//! The machine knows no chip and no clock: a board drives it with its registers behind [`Port`], the tests with a model of them.

use super::FRAME_LENGTH;

/// Words of a frame.
pub const FRAME_WORDS: u32 = (FRAME_LENGTH / 4) as u32;

/// An offer without a frame is looked after this often, us. A front end that has restarted has forgotten the credit: it gets another.
pub const OFFER_US: u64 = 50_000;
/// The longest frame, pauses included, us (docs/front-end.md section 3).
pub const LONGEST_FRAME_US: u64 = 3_000;
/// After READY has fallen, a frame that is going to begin has begun this much later, us: the front end has 8 clocks (0.2 us) for that, and
/// a clock that counts microseconds may be one short.
pub const WITHDRAWN_US: u64 = 2;
/// After the end of a frame, its last words are in memory, us: the port's FIFO holds four, and the DMA has 60 clocks of its bus for each
/// in the one microsecond that is left of two when the clock is one short.
pub const DRAIN_US: u64 = 2;

/// A camera port with its DMA, and the line READY beside it.
pub trait Port {
    /// Empties the port, points the DMA at the buffer, and lets the port take the next frame that begins: that one only, whole from its
    /// beginning.
    fn arm(&mut self);
    /// Stops port and DMA, now. The buffer is the processor's again.
    fn disarm(&mut self);
    /// Sets READY.
    fn ready(&mut self, high: bool);
    /// How far port and DMA are.
    fn look(&mut self) -> Look;
}

/// What is seen of a port.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Look {
    /// Words that the DMA has not written yet, of [`FRAME_WORDS`].
    pub missing: u32,
    /// VSYNC is high: a frame is on the lines, whether the port takes it or not.
    pub on_lines: bool,
    /// The frame that the port took has ended.
    pub ended: bool,
    /// The port had a word and no room for it.
    pub overrun: bool,
    /// Words are in the port that the DMA has not fetched.
    pub unfetched: bool,
}

/// Why a frame was given up.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub enum Cut {
    /// It ended early.
    Short {
        /// Words that did not come.
        missing: u32,
    },
    /// It did not end where it should have.
    Long,
    /// The DMA was kept from the bus for too long.
    Overrun,
    /// It began and did not end.
    Stalled,
}

/// What to do.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Step {
    /// Wait for the port to say that a frame has ended or overrun, and no longer than this; then [`Capture::step`].
    Wait {
        /// On the clock that `now_us` is read from, us.
        until_us: u64,
    },
    /// The buffer holds a frame. The port is disarmed.
    Whole,
    /// The buffer holds nothing of use. The port is disarmed.
    Cut(Cut),
}

#[derive(Clone, Copy, Debug)]
enum State {
    /// READY is high.
    Offered { until_us: u64 },
    /// READY has fallen, a frame may just have begun.
    Withdrawn { until_us: u64 },
    /// A frame comes; READY is low.
    Coming { until_us: u64 },
    /// It has ended, its last words are on their way.
    Draining { until_us: u64 },
}

/// A buffer on offer to the front end. Dropping this alone does not stop the port: see [`Port::disarm`].
#[derive(Debug)]
pub struct Capture {
    state: State,
}

impl Capture {
    /// Offers a buffer: [`Port`] must be over one. READY must be low.
    pub fn offer(port: &mut impl Port, now_us: u64) -> Self {
        port.arm();
        Self {
            state: offered(port, now_us),
        }
    }

    /// Goes on, when the port has called or the time is up; more often does no harm.
    pub fn step(&mut self, port: &mut impl Port, now_us: u64) -> Step {
        let look = port.look();
        if look.overrun {
            // A word beyond the last has no place in memory: it stays in the port, and those behind it overrun.
            let cut = if look.missing == 0 {
                Cut::Long
            } else {
                Cut::Overrun
            };
            return end(port, Step::Cut(cut));
        }
        if look.ended && look.missing == 0 {
            let step = if look.unfetched {
                Step::Cut(Cut::Long)
            } else {
                Step::Whole
            };
            return end(port, step);
        }
        let due = |until_us| now_us >= until_us;
        let begun = look.missing < FRAME_WORDS;
        self.state = match self.state {
            State::Draining { until_us } if due(until_us) => {
                let missing = look.missing;
                return end(port, Step::Cut(Cut::Short { missing }));
            }
            draining @ State::Draining { .. } => draining,
            _ if look.ended => State::Draining {
                until_us: now_us + DRAIN_US,
            },
            State::Coming { until_us } if due(until_us) && begun => {
                return end(port, Step::Cut(Cut::Stalled));
            }
            // One that had begun before the port was armed: the rest of what was given up, or nobody had asked for it.
            State::Coming { until_us } if due(until_us) && look.on_lines => coming(port, now_us),
            State::Coming { until_us } if due(until_us) => offered(port, now_us),
            State::Offered { .. } | State::Withdrawn { .. } if begun => coming(port, now_us),
            State::Offered { until_us } if due(until_us) => {
                port.ready(false);
                State::Withdrawn {
                    until_us: now_us + WITHDRAWN_US,
                }
            }
            State::Withdrawn { until_us } if due(until_us) && look.on_lines => coming(port, now_us),
            State::Withdrawn { until_us } if due(until_us) => offered(port, now_us),
            waiting => waiting,
        };
        let (State::Offered { until_us }
        | State::Withdrawn { until_us }
        | State::Coming { until_us }
        | State::Draining { until_us }) = self.state;
        Step::Wait { until_us }
    }
}

fn offered(port: &mut impl Port, now_us: u64) -> State {
    port.ready(true);
    State::Offered {
        until_us: now_us + OFFER_US,
    }
}

fn coming(port: &mut impl Port, now_us: u64) -> State {
    port.ready(false);
    State::Coming {
        until_us: now_us + LONGEST_FRAME_US,
    }
}

fn end(port: &mut impl Port, step: Step) -> Step {
    port.ready(false);
    port.disarm();
    step
}
