//! Tuning and reporting apart: on which flights a constant may be looked at, and which are flown to report only.

use serde::Deserialize;

use crate::input::InputError;

/// The lists, as they stand in the repository.
const LISTS: &str = include_str!("../../../tests/seeds.toml");

/// What a flight is there for.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Purpose {
    /// Constants may be found on it.
    Tuning,
    /// It is flown when the code is finished.
    Reporting,
}

/// The lists of both purposes.
#[derive(Clone, Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Lists {
    tuning: Vec<Row>,
    reporting: Vec<Row>,
    network: Network,
}

/// Scenes of the network that flies.
#[derive(Clone, Debug, Deserialize)]
#[serde(deny_unknown_fields)]
struct Network {
    /// Its links to learn from.
    training: Vec<String>,
    /// Those that decide when to stop and what the temperature is.
    validation: Vec<String>,
}

/// Scenes and the seeds that are flown in them.
#[derive(Clone, Debug, Deserialize)]
#[serde(deny_unknown_fields)]
struct Row {
    scenes: Vec<String>,
    /// First and last.
    seeds: [u64; 2],
    /// The first scene with the first seed, and so on.
    #[serde(default)]
    pairs: bool,
}

impl Row {
    fn flights(&self) -> Vec<(String, u64)> {
        let seeds = self.seeds[0]..=self.seeds[1];
        if self.pairs {
            return self.scenes.iter().cloned().zip(seeds).collect();
        }
        let of_scene = |scene: &String| {
            seeds
                .clone()
                .map(|seed| (scene.clone(), seed))
                .collect::<Vec<_>>()
        };
        self.scenes.iter().flat_map(of_scene).collect()
    }
}

impl Lists {
    /// The lists of this repository.
    ///
    /// # Errors
    /// [`InputError`] when the file that was built in is none.
    pub fn of_the_repository() -> Result<Self, InputError> {
        toml::from_str(LISTS).map_err(|e| InputError::new(format!("tests/seeds.toml: {e}")))
    }

    /// All flights of a purpose: scene and seed.
    pub fn flights(&self, purpose: Purpose) -> Vec<(String, u64)> {
        let rows = match purpose {
            Purpose::Tuning => &self.tuning,
            Purpose::Reporting => &self.reporting,
        };
        rows.iter().flat_map(Row::flights).collect()
    }

    /// Scenes that the network that flies is trained on, and those that decide when its training stops.
    pub fn network(&self) -> [&[String]; 2] {
        [&self.network.training, &self.network.validation]
    }

    /// Refuses to train a network on a scene that is flown to report: it would know the walls by heart.
    ///
    /// # Errors
    /// [`InputError`] naming the scene.
    pub fn refuse_training(&self, scene: &str) -> Result<(), InputError> {
        let reported = self.flights(Purpose::Reporting);
        if reported.iter().any(|(reported, _)| reported == scene) {
            return Err(InputError::new(format!(
                "{scene} is flown to report, so no network is trained on it (tests/seeds.toml): expected other scenes, or --any-scene"
            )));
        }
        Ok(())
    }

    /// Refuses flights to report together with any others: whoever looks at both tunes on both.
    ///
    /// # Errors
    /// [`InputError`] naming one of each.
    pub fn refuse_mixture(&self, flights: &[(String, u64)]) -> Result<(), InputError> {
        let listed = self.flights(Purpose::Reporting);
        let is_reporting = |flight: &&(String, u64)| listed.contains(flight);
        let (reporting, other) = (
            flights.iter().find(is_reporting),
            flights.iter().find(|flight| !is_reporting(flight)),
        );
        match (reporting, other) {
            (Some((scene, seed)), Some((other, number))) => Err(InputError::new(format!(
                "{scene} with seed {seed} is flown to report only, {other} with seed {number} is not: expected one kind (tests/seeds.toml), or --any-seed"
            ))),
            _ => Ok(()),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn no_flight_is_on_both_lists_and_no_reporting_city_is_tuned_on() {
        let lists = Lists::of_the_repository().expect("a list");
        let (tuning, reporting) = (lists.flights(Purpose::Tuning), lists.flights(Purpose::Reporting));
        assert_eq!((tuning.len(), reporting.len()), (40 + 40 + 200, 12 + 18 + 12));
        for flight in &reporting {
            assert!(!tuning.contains(flight), "{flight:?}");
            let seen = |(scene, _): &(String, u64)| scene.starts_with("city:") && *scene == flight.0;
            assert!(!tuning.iter().any(seen), "{flight:?}");
        }
        assert!(
            reporting.contains(&("city:22".into(), 202)) && !reporting.contains(&("city:22".into(), 201))
        );
    }

    #[test]
    fn the_network_learns_in_no_scene_that_is_flown_to_report() {
        let lists = Lists::of_the_repository().expect("a list");
        let [training, validation] = lists.network();
        assert!(training.len() > 10 && !validation.is_empty());
        for scene in training.iter().chain(validation) {
            assert_eq!(lists.refuse_training(scene), Ok(()));
        }
        for scene in ["outdoor", "street", "indoor", "outdoor_a", "city:27"] {
            let error = lists.refuse_training(scene).expect_err("reported").to_string();
            assert!(error.contains(&format!("{scene} is flown to report")), "{error}");
        }
        // The recipe makes links of these scenes, and of no others.
        let recipe = include_str!("../../models/make.sh");
        let own = recipe.split("# The paper's network").next().expect("there");
        let mut made: [Vec<String>; 2] = Default::default();
        let mut values: Vec<&str> = Vec::new();
        for line in own.lines().map(str::trim) {
            if let Some((_, list)) = line.strip_prefix("for ").and_then(|rest| rest.split_once(" in ")) {
                values = list.trim_end_matches("; do").split(' ').collect();
            }
            let Some(call) = line.strip_prefix("links \"") else {
                continue;
            };
            let (scene, rest) = call.split_once("\" ").expect("a scene, a set");
            let set = usize::from(rest.starts_with("validation"));
            let prefix = scene.split('$').next().expect("the kind of scene");
            made[set].extend(values.iter().map(|value| format!("{prefix}{value}")));
        }
        assert_eq!(made, [training.to_vec(), validation.to_vec()]);
    }

    #[test]
    fn flights_to_report_are_not_mixed_with_others() {
        let lists = Lists::of_the_repository().expect("a list");
        let flights = |list: &[(&str, u64)]| {
            list.iter()
                .map(|(s, n)| ((*s).to_owned(), *n))
                .collect::<Vec<_>>()
        };
        assert!(
            lists
                .refuse_mixture(&flights(&[("outdoor", 1), ("house.json", 300)]))
                .is_ok()
        );
        assert!(
            lists
                .refuse_mixture(&flights(&[("outdoor", 201), ("street", 206)]))
                .is_ok()
        );
        let error = lists
            .refuse_mixture(&flights(&[("outdoor", 201), ("outdoor", 40)]))
            .expect_err("mixed")
            .to_string();
        assert!(
            error.contains("outdoor with seed 201") && error.contains("seed 40"),
            "{error}"
        );
        assert!(
            lists
                .refuse_mixture(&flights(&[("outdoor", 201), ("outdoor", 213)]))
                .is_err()
        );
    }
}
