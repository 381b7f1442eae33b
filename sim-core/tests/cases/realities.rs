//! `pseudo_reality`: wheels, sensors and radios unlike those of the design.

use experiment_file::{
    Drawn, ExperimentConfig, InhibitedStimulus, PseudoRealityConfig, SensorQuery,
    StimuliInhibitionConfig, UncontrollableRotationConfig,
};

use super::sensors::all_sensors;
use crate::configs::{experiment_a, experiment_c, swarm_mut};
use crate::reference::Episode;
use crate::{assert_agreement, assert_varied_agreement, random_genotype};

const fn range(low: f64, high: f64) -> Drawn<f64> {
    Drawn { low, high }
}

/// Every key, with a range.
fn reality() -> PseudoRealityConfig {
    PseudoRealityConfig {
        wheel_gain: range(0.8, 1.2),
        wheel_asymmetry: range(0.1, 0.3),
        slow_robot: range(0.2, 0.8),
        actuation_delay: Drawn { low: 0, high: 3 },
        sensor_gain: range(0.8, 1.2),
        sensor_offset: range(-0.1, 0.1),
        sensor_noise: range(0.0, 0.1),
        radio_range: range(0.7, 1.4),
        radio_loss: range(0.1, 0.5),
        antenna_heading: range(0.1, 0.6),
        ..Default::default()
    }
}

fn fitness(episodes: &[Episode]) -> Vec<f64> {
    episodes.iter().map(|episode| episode.fitness).collect()
}

fn with(mut config: ExperimentConfig, reality: PseudoRealityConfig) -> ExperimentConfig {
    config.algorithm.evaluation_steps = 40;
    swarm_mut(&mut config).perturbations.pseudo_reality = Some(reality);
    config
}

#[test]
fn each_key_agrees_and_changes_the_episode() {
    let neutral = PseudoRealityConfig::default();
    let all = reality();
    let nominal = fitness(&assert_varied_agreement(&with(all_sensors(), neutral)));
    let keys = [
        PseudoRealityConfig { wheel_gain: all.wheel_gain, ..neutral },
        PseudoRealityConfig { wheel_asymmetry: all.wheel_asymmetry, ..neutral },
        PseudoRealityConfig { slow_robot: all.slow_robot, ..neutral },
        PseudoRealityConfig { actuation_delay: all.actuation_delay, ..neutral },
        PseudoRealityConfig { sensor_gain: all.sensor_gain, ..neutral },
        PseudoRealityConfig { sensor_offset: all.sensor_offset, ..neutral },
        PseudoRealityConfig { sensor_noise: all.sensor_noise, ..neutral },
        PseudoRealityConfig { radio_range: all.radio_range, ..neutral },
        PseudoRealityConfig { radio_loss: all.radio_loss, ..neutral },
        PseudoRealityConfig { antenna_heading: all.antenna_heading, ..neutral },
    ];
    for key in keys {
        let config = with(all_sensors(), key);
        assert_ne!(fitness(&assert_varied_agreement(&config)), nominal, "{key:?}");
    }
}

#[test]
fn all_keys_together_agree_in_every_task() {
    for config in [all_sensors(), experiment_c()] {
        let config = with(config, reality());
        let episodes = assert_varied_agreement(&config);
        assert!(episodes.iter().all(|episode| episode.witness.n_lost > 0));
    }
    let mut config = with(experiment_a(), reality());
    config.algorithm.evaluation_steps = 100;
    for seed in [517, 175, 66] {
        assert_agreement(&config, &random_genotype(&config, seed), 3, 0..2);
    }
}

/// Other perturbations act on what a robot does after the delay, and on what it perceives.
#[test]
fn other_perturbations_agree_in_a_pseudo_reality() {
    let mut config = with(all_sensors(), reality());
    let perturbations = &mut swarm_mut(&mut config).perturbations;
    perturbations.stimuli_inhibition = vec![StimuliInhibitionConfig {
        stimuli: InhibitedStimulus::Reading(SensorQuery::Light),
        affected_robots: 5,
    }];
    perturbations.uncontrollable_rotation = Some(UncontrollableRotationConfig {
        affected_robots: 3,
        start: 5,
        targets: vec![1.0, 4.0],
        switch_at: 20,
        speed: 0.4,
    });
    let episodes = assert_varied_agreement(&config);
    for Episode { witness, .. } in &episodes {
        assert!(witness.n_uncontrollable > 0 && witness.n_inhibited > 0, "{witness:?}");
    }
}
