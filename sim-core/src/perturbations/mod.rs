//! The perturbations of the robots of one object, in one trial.

mod inhibition;
mod leader_failure;
mod reality;
mod rotation;

use inhibition::Inhibition;
use leader_failure::LeaderFailure;
pub(crate) use reality::{Reality, Sensing};
use rotation::Rotation;

use crate::swarm::Swarm;
use crate::world::RobotGroup;
use determinism::random::Stream;
use experiment_file::{PerturbationsConfig, SensorQuery};

/// Stream numbers of the perturbations that draw robots: their places in [`PerturbationsConfig`].
/// The numbers are part of the format of a run.
const INHIBITION_STREAM: usize = 1;
const ROTATION_STREAM: usize = 3;

/// Perturbations of one group of robots.
#[derive(Debug)]
pub(crate) struct Perturbations {
    leader_failure: Option<LeaderFailure>,
    inhibitions: Vec<Inhibition>,
    rotation: Option<Rotation>,
    /// Period at which positions are redrawn, steps.
    switch_every: Option<u32>,
    reality: Option<Reality>,
}

impl Perturbations {
    /// Draws the affected robots among `n_robots`, and their reality. `stream` gives the trial's
    /// streams for perturbations by number, and `reality` that of the pseudo-reality.
    pub fn new(
        config: &PerturbationsConfig,
        n_robots: usize,
        stream: impl Fn(usize) -> Stream,
        reality: impl FnOnce() -> Stream,
    ) -> Self {
        let leader_failure = config.leader_failure.as_ref();
        let rotation = config.uncontrollable_rotation.as_ref();
        let mut inhibiting = stream(INHIBITION_STREAM);
        let inhibitions = config.stimuli_inhibition.iter();
        Self {
            leader_failure: leader_failure
                .map(|config| LeaderFailure::new(config.time_to_failure, n_robots)),
            inhibitions: inhibitions
                .map(|config| Inhibition::new(config, n_robots, &mut inhibiting))
                .collect(),
            rotation: rotation
                .map(|config| Rotation::new(config, n_robots, &mut stream(ROTATION_STREAM))),
            switch_every: config.topology_switch.as_ref().map(|config| config.every),
            reality: config
                .pseudo_reality
                .as_ref()
                .map(|config| Reality::new(config, n_robots, &mut reality())),
        }
    }

    /// The pseudo-reality.
    pub fn reality(&self) -> Option<&Reality> {
        self.reality.as_ref()
    }

    /// Whether positions are redrawn at the start of `step` (`topology_switch`).
    pub fn switches_topology(&self, step: u32) -> bool {
        self.switch_every.is_some_and(|every| step > 0 && step.is_multiple_of(every))
    }

    /// Whether the network of a robot, by its index in the group, gets zeros for a
    /// reading.
    pub fn inhibits(&self, robot: usize, reading: SensorQuery) -> bool {
        self.inhibitions.iter().any(|inhibition| inhibition.inhibits(robot, reading))
    }

    /// Replaces a value of a reading by zero for the robots whose networks do not get it; `row` has
    /// one value per robot of the group.
    pub fn inhibit(&self, reading: SensorQuery, row: &mut [f32]) {
        for inhibition in &self.inhibitions {
            for (robot, value) in row.iter_mut().enumerate() {
                if inhibition.inhibits(robot, reading) {
                    *value = 0.0;
                }
            }
        }
    }

    /// Rewrites the actions of the group.
    pub fn rewrite(&mut self, step: u32, group: &RobotGroup, swarm: &mut Swarm) {
        let robots = group.robots.clone();
        // Other perturbations see what the robots do now.
        if let Some(reality) = &mut self.reality {
            reality.delay(&mut swarm.wheels[robots.clone()], &mut swarm.leds[robots.clone()]);
        }
        if let Some(failure) = &mut self.leader_failure {
            failure.rewrite(&mut swarm.leds[robots.clone()], &mut swarm.modes[robots.clone()]);
        }
        if let Some(rotation) = &self.rotation {
            rotation.rewrite(step, &swarm.headings[robots.clone()], &mut swarm.wheels[robots]);
        }
    }
}

/// `n_affected` of `n_robots` robots, drawn without replacement.
fn draw_affected(n_affected: u32, n_robots: usize, stream: &mut Stream) -> Vec<bool> {
    let mut robots: Vec<usize> = (0..n_robots).collect();
    let mut affected = vec![false; n_robots];
    for index in 0..n_robots.min(n_affected as usize) {
        robots.swap(index, index + stream.below(n_robots - index));
        affected[robots[index]] = true;
    }
    affected
}

#[cfg(test)]
mod tests {
    use super::*;
    use determinism::random::Purpose;
    use experiment_file::TopologySwitchConfig;

    fn stream(number: usize) -> Stream {
        Stream::new(0, 0, 0, Purpose::Perturbation, number as u64)
    }

    #[test]
    fn affected_robots_are_distinct_and_uniform() {
        let mut stream = stream(0);
        let mut counts = [0; 10];
        for _ in 0..10_000 {
            let affected = draw_affected(4, 10, &mut stream);
            assert_eq!(affected.iter().filter(|affected| **affected).count(), 4);
            for (count, affected) in counts.iter_mut().zip(affected) {
                *count += i32::from(affected);
            }
        }
        assert!(counts.iter().all(|count| (3_800..4_200).contains(count)), "{counts:?}");
    }

    #[test]
    fn all_or_none_may_be_affected() {
        assert_eq!(draw_affected(0, 3, &mut stream(0)), [false; 3]);
        assert_eq!(draw_affected(3, 3, &mut stream(0)), [true; 3]);
        assert_eq!(draw_affected(9, 3, &mut stream(0)), [true; 3]);
    }

    #[test]
    fn the_topology_switches_periodically_but_not_at_the_start() {
        let config = PerturbationsConfig {
            topology_switch: Some(TopologySwitchConfig { every: 200 }),
            ..Default::default()
        };
        let perturbations = Perturbations::new(&config, 10, stream, || unreachable!());
        let switches: Vec<u32> =
            (0..700).filter(|&step| perturbations.switches_topology(step)).collect();
        assert_eq!(switches, [200, 400, 600]);
        let none = PerturbationsConfig::default();
        let none = Perturbations::new(&none, 10, stream, || unreachable!());
        assert!((0..700).all(|step| !none.switches_topology(step)));
    }
}
