//! The lines at the end.

use std::fmt;
use std::time::Duration;

/// How a stage ended.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(crate) enum Outcome {
    Passed,
    /// Why, in one line.
    Failed(String),
}

/// The outcomes so far.
#[derive(Default)]
pub(crate) struct Report {
    stages: Vec<(&'static str, Outcome, Duration)>,
}

impl Report {
    pub(crate) fn add(&mut self, name: &'static str, outcome: Outcome, elapsed: Duration) {
        self.stages.push((name, outcome, elapsed));
    }

    /// Whether a stage has run and not passed.
    pub(crate) fn has_failed(&self, name: &str) -> bool {
        self.stages
            .iter()
            .any(|(stage, outcome, _)| *stage == name && *outcome != Outcome::Passed)
    }

    /// Whether something ran and all of it passed.
    pub(crate) fn passed(&self) -> bool {
        !self.stages.is_empty()
            && self
                .stages
                .iter()
                .all(|(_, outcome, _)| *outcome == Outcome::Passed)
    }
}

impl fmt::Display for Report {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        for (name, outcome, elapsed) in &self.stages {
            let seconds = elapsed.as_secs_f64();
            match outcome {
                Outcome::Passed => writeln!(f, "{name:<16}ok      {seconds:7.1} s")?,
                Outcome::Failed(reason) => writeln!(f, "{name:<16}FAILED  {seconds:7.1} s  {reason}")?,
            }
        }
        let total: f64 = self
            .stages
            .iter()
            .map(|(_, _, elapsed)| elapsed.as_secs_f64())
            .sum();
        let failed: Vec<_> = self
            .stages
            .iter()
            .filter(|(_, outcome, _)| *outcome != Outcome::Passed)
            .collect();
        if failed.is_empty() {
            writeln!(
                f,
                "verify: all {} stages passed in {total:.0} s",
                self.stages.len()
            )
        } else {
            writeln!(
                f,
                "verify: {} of {} stages FAILED after {total:.0} s",
                failed.len(),
                self.stages.len()
            )
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn one_failure_fails_the_whole() {
        let mut report = Report::default();
        assert!(!report.passed(), "nothing has run");
        report.add("fmt", Outcome::Passed, Duration::from_millis(1500));
        assert!(
            report.passed()
                && report
                    .to_string()
                    .ends_with("verify: all 1 stages passed in 2 s\n")
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
        assert!(
            text.ends_with("verify: 1 of 2 stages FAILED after 4 s\n"),
            "{text}"
        );
    }
}
