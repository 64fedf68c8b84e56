//! Several stages at once: one lane builds without optimisation, the other with. Each has its own folder of builds, so neither waits for the
//! other's lock, and while one links or runs a single test the other has work for the second core.

use std::fs::{self, File};
use std::path::{Path, PathBuf};
use std::process::{Command, Stdio};
use std::sync::{Condvar, Mutex, PoisonError};
use std::time::Instant;
use std::{env, io, thread};

use crate::report::{Outcome, Report};
use crate::stages::{Lane, Stage};

/// Where the output of each stage goes, from the workspace's root.
const LOGS: &str = "target/verify";

/// Runs the stages, each in its lane and in the order of the table, as soon as those that it needs have passed.
///
/// # Errors
/// The folder of the logs cannot be made, or this program not be copied there.
pub(crate) fn run_all(stages: &[&'static Stage]) -> io::Result<Report> {
    fs::create_dir_all(LOGS)?;
    // A stage may build this program anew: what runs the stages must not change under way.
    let driver = Path::new(LOGS).join(format!("driver{}", env::consts::EXE_SUFFIX));
    fs::copy(env::current_exe()?, &driver)?;
    Ok(schedule(stages, &|stage| run_apart(&driver, stage)))
}

/// The stages of both lanes, each run by `run`.
fn schedule(stages: &[&'static Stage], run: &(impl Fn(&Stage) -> Outcome + Sync)) -> Report {
    let report = Mutex::new(Report::new(stages));
    let ended = Condvar::new();
    thread::scope(|scope| {
        for lane in [Lane::Unoptimised, Lane::Optimised] {
            let (report, ended) = (&report, &ended);
            scope.spawn(move || {
                for stage in stages.iter().filter(|stage| stage.lane == lane) {
                    // No lane waits for ever: what a stage needs comes earlier in the table.
                    let waiting = |report: &mut Report| !report.have_ended(stage.needs);
                    let held = report.lock().unwrap_or_else(PoisonError::into_inner);
                    let held = ended
                        .wait_while(held, waiting)
                        .unwrap_or_else(PoisonError::into_inner);
                    let failed = stage.needs.iter().find(|name| held.has_failed(name));
                    drop(held);
                    let started = Instant::now();
                    let outcome = match failed {
                        Some(name) => Outcome::Failed(format!("could not run: it needs {name}")),
                        None => run(stage),
                    };
                    let mut held = report.lock().unwrap_or_else(PoisonError::into_inner);
                    held.add(stage.name, outcome, started.elapsed());
                    ended.notify_all();
                }
            });
        }
    });
    report.into_inner().unwrap_or_else(PoisonError::into_inner)
}

/// Runs a stage in a process of its own, its output in a file; prints that where the stage fails.
fn run_apart(driver: &Path, stage: &Stage) -> Outcome {
    let log: PathBuf = Path::new(LOGS).join(format!("{}.log", stage.name));
    println!("== {}: {} ({})", stage.name, stage.what, log.display());
    let started = Instant::now();
    let status = File::create(&log).and_then(|out| {
        Command::new(driver)
            .args(["--only", stage.name])
            .stdin(Stdio::null())
            .stderr(out.try_clone()?)
            .stdout(out)
            .status()
    });
    let seconds = started.elapsed().as_secs_f64();
    let reason = match status {
        Ok(status) if status.success() => {
            println!("== {} passed in {seconds:.1} s", stage.name);
            return Outcome::Passed;
        }
        Ok(_) => format!("{} says why", log.display()),
        Err(error) => format!("{} cannot be run: {error}", driver.display()),
    };
    let said = fs::read_to_string(&log).unwrap_or_default();
    println!("{said}\n== {} FAILED after {seconds:.1} s: {reason}", stage.name);
    Outcome::Failed(reason)
}

#[cfg(test)]
mod tests {
    use std::sync::mpsc;
    use std::time::Duration;

    use super::*;
    use crate::stages::Work;

    const fn stage(name: &'static str, needs: &'static [&'static str], lane: Lane) -> Stage {
        Stage {
            name,
            what: "",
            needs,
            lane,
            work: Work::Steps(&[]),
        }
    }

    const TABLE: [Stage; 5] = [
        stage("tools", &[], Lane::Optimised),
        stage("test", &["tools"], Lane::Unoptimised),
        stage("image", &["tools"], Lane::Optimised),
        stage("chip", &["image"], Lane::Unoptimised),
        stage("last", &["chip"], Lane::Optimised),
    ];

    fn outcomes(run: impl Fn(&Stage) -> Outcome + Sync) -> (bool, String) {
        static STAGES: [&Stage; 5] = [&TABLE[0], &TABLE[1], &TABLE[2], &TABLE[3], &TABLE[4]];
        let report = schedule(&STAGES, &run);
        (report.passed(), report.to_string())
    }

    #[test]
    fn lanes_run_at_once_and_wait_for_what_they_need() {
        // `test` ends when `image` has begun, which is in the other lane.
        let (begun, has_begun) = mpsc::channel();
        let has_begun = Mutex::new(has_begun);
        let order = Mutex::new(Vec::new());
        let (passed, said) = outcomes(|stage| {
            if stage.name == "image" {
                begun.send(()).expect("received");
            }
            if stage.name == "test" {
                let waited = has_begun.lock().expect("whole");
                waited.recv_timeout(Duration::from_secs(60)).expect("at once");
            }
            order.lock().expect("whole").push(stage.name);
            Outcome::Passed
        });
        assert!(passed && said.contains("all 5 stages passed"), "{said}");
        let order = order.into_inner().expect("whole");
        let place = |name| order.iter().position(|other| *other == name);
        assert!(place("tools") == Some(0) && place("image") < place("chip") && place("chip") < place("last"));
    }

    #[test]
    fn what_needs_a_stage_that_failed_has_failed_and_the_rest_runs() {
        let (passed, said) = outcomes(|stage| match stage.name {
            "image" => Outcome::Failed("because".to_owned()),
            "chip" | "last" => panic!("{} has been run", stage.name),
            _ => Outcome::Passed,
        });
        assert!(!passed && said.contains("3 of 5 stages FAILED"), "{said}");
        assert!(said.contains("could not run: it needs image"), "{said}");
    }
}
