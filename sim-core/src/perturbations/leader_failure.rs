//! `leader_failure`: a robot that has led for long breaks down, so that the swarm
//! has to find another leader.

use std::ops::Range;

use crate::communication::Mode;
use crate::leadership::Leadership;

/// Faults among the robots of one object, in one trial.
#[derive(Debug, Clone)]
pub(super) struct LeaderFailure {
    time_to_failure: u32,
    leadership: Leadership,
    robots: Range<usize>,
    faulty: Vec<bool>,
}

impl LeaderFailure {
    /// All of `robots` are well. One fails after `time_to_failure` consecutive
    /// steps in which it is the only robot of the world with its LED on.
    pub fn new(time_to_failure: u32, robots: Range<usize>) -> Self {
        let faulty = vec![false; robots.len()];
        Self { time_to_failure, leadership: Leadership::default(), robots, faulty }
    }

    /// Faulty robots have their LED off and relay, to the end of the episode. Takes
    /// LEDs and modes of all robots.
    pub fn rewrite(&self, leds: &mut [u32], modes: &mut [Mode]) {
        for (robot, _) in self.robots.clone().zip(&self.faulty).filter(|(_, faulty)| **faulty) {
            leds[robot] = 0;
            modes[robot] = Mode::Relay;
        }
    }

    /// Takes in what the LEDs of all robots show in the end: a robot whose time is
    /// up is faulty from the next step on.
    pub fn observe(&mut self, leds: &[u32]) {
        if let Some(leader) = self.leadership.observe(leds)
            && leader.n_steps >= self.time_to_failure
            && self.robots.contains(&leader.robot)
        {
            self.faulty[leader.robot - self.robots.start] = true;
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// What the LEDs of robots show that want to show `wanted` in each step.
    fn shown<const N: usize>(failure: &mut LeaderFailure, wanted: &[[u32; N]]) -> Vec<[u32; N]> {
        let show = |leds: &[u32; N]| {
            let (mut leds, mut modes) = (*leds, [Mode::Send; N]);
            let before = leds;
            failure.rewrite(&mut leds, &mut modes);
            failure.observe(&leds);
            for robot in 0..N {
                assert!(leds[robot] == before[robot] || modes[robot] == Mode::Relay);
            }
            leds
        };
        wanted.iter().map(show).collect()
    }

    #[test]
    fn a_leader_fails_after_its_time_and_for_good() {
        let leds = shown(&mut LeaderFailure::new(3, 0..2), &[[0, 1]; 6]);
        assert_eq!(leds, [[0, 1], [0, 1], [0, 1], [0, 0], [0, 0], [0, 0]]);
    }

    #[test]
    fn an_interrupted_term_starts_anew() {
        let wanted = [[1, 0], [1, 0], [1, 1], [1, 0], [1, 0], [1, 0], [1, 0]];
        let leds = shown(&mut LeaderFailure::new(3, 0..2), &wanted);
        assert_eq!(leds[..6], wanted[..6]);
        assert_eq!(leds[6], [0, 0]);
    }

    #[test]
    fn the_next_leader_may_be_a_robot_that_shone_all_the_time() {
        let wanted = [[1, 0], [1, 0], [1, 1], [1, 1], [1, 1]];
        let leds = shown(&mut LeaderFailure::new(2, 0..2), &wanted);
        assert_eq!(leds, [[1, 0], [1, 0], [0, 1], [0, 1], [0, 0]]);
    }

    #[test]
    fn robots_of_other_objects_lead_too_but_do_not_fail() {
        let wanted = [[1, 0, 0], [1, 0, 0], [1, 0, 1], [0, 0, 1], [0, 0, 1], [0, 0, 1]];
        let leds = shown(&mut LeaderFailure::new(2, 1..3), &wanted);
        assert_eq!(leds[..5], wanted[..5]);
        assert_eq!(leds[5], [0, 0, 0]);
    }
}
