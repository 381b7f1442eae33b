//! Changes that a new simulation of a swarm can have.

use evolution::ALGORITHMS;
use experiment_file::{
    ConfigError, ExperimentConfig, InhibitedStimulus, LeaderFailureConfig, ObjectConfig, Problem,
    RobotConfig, SensorQuery, StimuliInhibitionConfig, TopologySwitchConfig,
};
use serde::Deserialize;
use serde_json::{from_value, json};
use sim_core::{InterventionError, Simulation, TrialSet};

use crate::Interventions;

/// Changes of an episode; `None` keeps the value of the experiment.
#[derive(Debug, Clone, Default, PartialEq, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct WhatIf {
    /// Seed of all randomness.
    pub seed: Option<u64>,
    /// Generation of the worlds.
    pub generation: Option<u64>,
    /// Trial of that generation. Without generation and trial, a champion plays a trial of its
    /// judgement.
    pub trial: Option<u32>,
    /// Trial of the judgement; the median one without a number.
    pub judged: Option<u32>,
    /// Steps of the episode.
    pub steps: Option<u32>,
    /// Number of robots of the evolving object.
    pub robots: Option<u32>,
    /// A reading that all these robots lack, such as `wireless_receiver:msg`.
    pub inhibit: Option<String>,
    /// A perturbation with its default parameters: `leader_failure` or `topology_switch`.
    pub perturb: Option<String>,
    /// Changes in the middle of the episode.
    pub interventions: Interventions,
}

/// Why changes are refused.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum WhatIfError {
    /// The changed experiment is not valid.
    #[error(transparent)]
    Config(#[from] ConfigError),
    /// Interventions do not fit it.
    #[error(transparent)]
    Interventions(#[from] InterventionError),
}

impl WhatIf {
    /// Reads the query of an address.
    pub fn from_query(query: &str) -> Result<Self, String> {
        serde_urlencoded::from_str(query).map_err(|error| error.to_string())
    }

    /// Worlds and trial of the changed episode of an individual of a generation. `set` and `trial`:
    /// those without changes.
    pub fn world(&self, generation: u64, set: TrialSet, trial: u32) -> (TrialSet, u32) {
        match (self.judged, set) {
            (Some(judged), TrialSet::Judgement(_)) => (set, judged),
            _ if self.generation.is_none() && self.trial.is_none() => (set, trial),
            _ => {
                let generation = self.generation.unwrap_or(generation);
                (TrialSet::Generation(generation), self.trial.unwrap_or_default())
            }
        }
    }

    /// Reads and compiles an experiment file with the changes.
    pub fn compile(
        &self,
        config_json: &str,
    ) -> Result<(ExperimentConfig, Simulation), WhatIfError> {
        let (config, _) = ExperimentConfig::from_json(config_json, "", ALGORITHMS)?;
        let config = self.apply(config)?;
        let simulation = Simulation::compile(&config)?;
        let simulation = simulation.with_interventions(self.interventions.0.clone())?;
        Ok((config, simulation))
    }

    /// The experiment with the changes, checked like any file.
    fn apply(&self, mut config: ExperimentConfig) -> Result<ExperimentConfig, ConfigError> {
        config.seed = self.seed.unwrap_or(config.seed);
        let algorithm = &mut config.algorithm;
        algorithm.evaluation_steps = self.steps.unwrap_or(algorithm.evaluation_steps);
        let evolves = config.world.objects.get_mut(&algorithm.evolvable_object);
        if let Some(ObjectConfig::Robot(robot)) = evolves {
            self.change(robot)?;
        }
        let read = ExperimentConfig::from_json(&config.to_canonical_json(), "", ALGORITHMS);
        read.map(|(config, _)| config)
    }

    fn change(&self, robot: &mut RobotConfig) -> Result<(), ConfigError> {
        robot.num_instances = self.robots.unwrap_or(robot.num_instances);
        if let Some(name) = &self.inhibit {
            let reading: SensorQuery =
                from_value(json!(name)).map_err(|_| unknown("reading", name))?;
            robot.perturbations.stimuli_inhibition.push(StimuliInhibitionConfig {
                stimuli: InhibitedStimulus::Reading(reading),
                affected_robots: robot.num_instances,
            });
        }
        match self.perturb.as_deref() {
            None => {}
            Some("leader_failure") => {
                robot.perturbations.leader_failure = Some(LeaderFailureConfig::default());
            }
            Some("topology_switch") => {
                robot.perturbations.topology_switch = Some(TopologySwitchConfig::default());
            }
            Some(name) => return Err(unknown("perturbation", name)),
        }
        Ok(())
    }
}

fn unknown(kind: &str, name: &str) -> ConfigError {
    let name: String = name.chars().take(80).collect();
    let message = format!("there is no {kind} `{name}`");
    ConfigError { problems: vec![Problem { path: String::new(), line: None, message }] }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn quickstart() -> ExperimentConfig {
        let text = include_str!("../../../configs/quickstart.json");
        ExperimentConfig::from_json(text, "", ALGORITHMS).unwrap().0
    }

    #[test]
    fn nothing_changes_without_a_request() {
        assert_eq!(WhatIf::default().apply(quickstart()), Ok(quickstart()));
    }

    #[test]
    fn robots_readings_and_perturbations_change() {
        let what_if = WhatIf {
            robots: Some(7),
            steps: Some(12),
            inhibit: Some("wireless_receiver:msg".into()),
            perturb: Some("leader_failure".into()),
            ..WhatIf::default()
        };
        let changed = what_if.apply(quickstart()).unwrap();
        let (_, robot) = changed.robots().next().unwrap();
        assert_eq!((robot.num_instances, changed.algorithm.evaluation_steps), (7, 12));
        assert_eq!(robot.perturbations.stimuli_inhibition[0].affected_robots, 7);
        assert!(robot.perturbations.leader_failure.is_some());
    }

    #[test]
    fn a_query_names_changes_and_worlds() {
        let played = (TrialSet::Judgement(7), 3);
        let world = |query| WhatIf::from_query(query).unwrap().world(5, played.0, played.1);
        assert_eq!(world("robots=7&interventions=1:robot:0:mute"), played);
        assert_eq!(world("judged=5"), (TrialSet::Judgement(7), 5));
        assert_eq!(world("trial=2"), (TrialSet::Generation(5), 2));
        assert_eq!(world("generation=4"), (TrialSet::Generation(4), 0));
        for wrong in ["robots=many", "weather=rain", "interventions=1:robot"] {
            assert!(WhatIf::from_query(wrong).is_err(), "{wrong}");
        }
    }

    #[test]
    fn interventions_must_fit_the_changed_experiment() {
        let text = include_str!("../../../configs/quickstart.json");
        let compile = |query| WhatIf::from_query(query).unwrap().compile(text).map(|_| ());
        assert_eq!(compile("interventions=50:robot:4:mute"), Ok(()));
        assert_eq!(compile("robots=9&interventions=50:robot:8:mute"), Ok(()));
        let error = compile("steps=50&interventions=50:robot:4:mute").unwrap_err();
        assert_eq!(error.to_string(), "step 50: the episode has the steps 0 to 49");
    }

    #[test]
    fn senseless_changes_are_refused() {
        let refused = |what_if: WhatIf| what_if.apply(quickstart()).unwrap_err().to_string();
        let error = refused(WhatIf { robots: Some(0), ..WhatIf::default() });
        assert!(error.contains("num_instances"), "{error}");
        let error = refused(WhatIf { perturb: Some("rain".into()), ..WhatIf::default() });
        assert_eq!(error, "there is no perturbation `rain`");
        let error = refused(WhatIf { inhibit: Some("smell".into()), ..WhatIf::default() });
        assert_eq!(error, "there is no reading `smell`");
    }
}
