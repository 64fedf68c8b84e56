//! The lines at the end.

use std::fmt;
use std::time::{Duration, Instant};

use crate::stages::Stage;

/// How a stage ended.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(crate) enum Outcome {
    Passed,
    /// Why, in one line.
    Failed(String),
}

/// The outcomes so far.
pub(crate) struct Report {
    began: Instant,
    /// Every stage that is to run, and how it ended, when it has.
    stages: Vec<(&'static str, Option<(Outcome, Duration)>)>,
}

impl Report {
    /// Stages that are all to run, from now on.
    pub(crate) fn new(stages: &[&'static Stage]) -> Self {
        Self {
            began: Instant::now(),
            stages: stages.iter().map(|stage| (stage.name, None)).collect(),
        }
    }

    pub(crate) fn add(&mut self, name: &'static str, outcome: Outcome, elapsed: Duration) {
        if let Some((_, ended)) = self.stages.iter_mut().find(|(stage, _)| *stage == name) {
            *ended = Some((outcome, elapsed));
        }
    }

    fn of(&self, name: &str) -> Option<&Option<(Outcome, Duration)>> {
        self.stages
            .iter()
            .find(|(stage, _)| *stage == name)
            .map(|(_, ended)| ended)
    }

    /// Whether none of these is still to end.
    pub(crate) fn have_ended(&self, names: &[&str]) -> bool {
        names.iter().all(|name| self.of(name).is_none_or(Option::is_some))
    }

    /// Whether a stage has run and not passed.
    pub(crate) fn has_failed(&self, name: &str) -> bool {
        self.of(name)
            .and_then(Option::as_ref)
            .is_some_and(|(outcome, _)| *outcome != Outcome::Passed)
    }

    /// Whether something ran and all of it passed.
    pub(crate) fn passed(&self) -> bool {
        !self.stages.is_empty() && self.failed() == 0
    }

    /// How many stages have not passed.
    fn failed(&self) -> usize {
        let passed = |ended: &Option<(Outcome, Duration)>| {
            ended
                .as_ref()
                .is_some_and(|(outcome, _)| *outcome == Outcome::Passed)
        };
        self.stages.iter().filter(|(_, ended)| !passed(ended)).count()
    }
}

impl fmt::Display for Report {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        for (name, ended) in &self.stages {
            match ended {
                None => writeln!(f, "{name:<16}has not run")?,
                Some((Outcome::Passed, elapsed)) => {
                    writeln!(f, "{name:<16}ok      {:7.1} s", elapsed.as_secs_f64())?;
                }
                Some((Outcome::Failed(reason), elapsed)) => {
                    writeln!(f, "{name:<16}FAILED  {:7.1} s  {reason}", elapsed.as_secs_f64())?;
                }
            }
        }
        let (count, total) = (self.stages.len(), self.began.elapsed().as_secs_f64());
        match self.failed() {
            0 => writeln!(f, "verify: all {count} stages passed in {total:.0} s"),
            failed => writeln!(f, "verify: {failed} of {count} stages FAILED after {total:.0} s"),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::stages::STAGES;

    fn stages(names: [&str; 2]) -> Vec<&'static Stage> {
        let chosen = STAGES.iter().filter(|stage| names.contains(&stage.name));
        chosen.collect()
    }

    #[test]
    fn one_failure_fails_the_whole() {
        assert!(!Report::new(&[]).passed(), "nothing has run");
        let mut report = Report::new(&stages(["fmt", "test"]));
        report.add("fmt", Outcome::Passed, Duration::from_millis(1500));
        assert!(
            !report.passed() && report.have_ended(&["fmt", "loop"]) && !report.have_ended(&["test"]),
            "{report}"
        );
        report.add("test", Outcome::Passed, Duration::from_secs(3));
        assert!(
            report.passed() && report.to_string().contains("verify: all 2 stages passed in "),
            "{report}"
        );
        report.add(
            "test",
            Outcome::Failed("because".to_owned()),
            Duration::from_secs(3),
        );
        assert!(!report.passed() && report.has_failed("test") && !report.has_failed("fmt"));
        let text = report.to_string();
        assert!(text.contains("fmt             ok          1.5 s\n"), "{text}");
        assert!(
            text.contains("test            FAILED      3.0 s  because\n"),
            "{text}"
        );
        assert!(text.contains("verify: 1 of 2 stages FAILED after "), "{text}");
    }
}
