//! When the links of a list were heard.

use crate::input::InputError;
use crate::paths::Link;

/// Time from sweep to sweep of a list that does not say, s: two sweeps per second (design section 7).
const PERIOD_S: f64 = 0.5;

/// When each link was heard, s from the start of the flight.
#[derive(Clone, Debug, PartialEq)]
pub struct Times {
    given_s: Option<Vec<f64>>,
}

impl Times {
    /// Those of the list; of a list without any, one link every half second.
    ///
    /// # Errors
    /// [`InputError`] naming the link that has no time while another has, or whose time is not after the one before.
    pub fn new(links: &[Link]) -> Result<Self, InputError> {
        let Some(with) = links.iter().position(|link| link.time_s.is_some()) else {
            return Ok(Self { given_s: None });
        };
        let mut given_s: Vec<f64> = Vec::with_capacity(links.len());
        for (index, link) in links.iter().enumerate() {
            let time_s = link.time_s.ok_or_else(|| {
                InputError::new(format!(
                    "link {index} of the path list has no `time_s`, but link {with} has: expected one on every line, or on none"
                ))
            })?;
            if given_s.last().is_some_and(|before| time_s <= *before) {
                return Err(InputError::new(format!(
                    "link {index} of the path list has `time_s` {time_s}, which is not after that of the line before"
                )));
            }
            given_s.push(time_s);
        }
        Ok(Self {
            given_s: Some(given_s),
        })
    }

    /// When the link of this index was heard, s.
    pub fn of(&self, index: usize) -> f64 {
        let given = self.given_s.as_ref().and_then(|times| times.get(index));
        given.copied().unwrap_or((index as f64 + 1.0) * PERIOD_S)
    }

    /// Mean time from link to link, s.
    pub fn period_s(&self) -> f64 {
        match self.given_s.as_deref() {
            Some(times @ [first, .., last]) => (last - first) / (times.len() - 1) as f64,
            _ => PERIOD_S,
        }
    }
}
