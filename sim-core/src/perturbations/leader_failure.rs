//! `leader_failure`: a robot that has led for long breaks down, so that the swarm
//! has to find another leader.

use crate::communication::Mode;
use crate::leadership::Leadership;

/// Faults among the robots of one object, in one trial.
#[derive(Debug, Clone)]
pub(super) struct LeaderFailure {
    time_to_failure: u32,
    leadership: Leadership,
    faulty: Vec<bool>,
}

impl LeaderFailure {
    /// The state without faults. A robot fails after `time_to_failure` consecutive steps of sole
    /// leadership.
    pub fn new(time_to_failure: u32, n_robots: usize) -> Self {
        Self { time_to_failure, leadership: Leadership::default(), faulty: vec![false; n_robots] }
    }

    /// Faulty robots have their LED off and relay, to the end of the episode. A leader that reaches
    /// its time is faulty from the next step on.
    pub fn rewrite(&mut self, leds: &mut [u32], modes: &mut [Mode]) {
        for ((led, mode), _) in
            leds.iter_mut().zip(modes).zip(&self.faulty).filter(|(_, faulty)| **faulty)
        {
            *led = 0;
            *mode = Mode::Relay;
        }
        if let Some(leader) = self.leadership.observe(leds)
            && leader.n_steps >= self.time_to_failure
        {
            self.faulty[leader.robot] = true;
            self.leadership.reset();
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_leader_fails_after_its_time_and_for_good() {
        let mut failure = LeaderFailure::new(3, 2);
        for step in 0..10 {
            let (mut leds, mut modes) = ([0, 1], [Mode::Send; 2]);
            failure.rewrite(&mut leds, &mut modes);
            let well = step < 3;
            assert_eq!(leds, [0, u32::from(well)], "step {step}");
            assert_eq!(modes, [Mode::Send, if well { Mode::Send } else { Mode::Relay }]);
        }
    }

    #[test]
    fn an_interrupted_term_starts_anew() {
        let mut failure = LeaderFailure::new(3, 2);
        for leds in [[1, 0], [1, 0], [1, 1], [1, 0], [1, 0], [1, 0]] {
            let mut shown = leds;
            failure.rewrite(&mut shown, &mut [Mode::Send; 2]);
            assert_eq!(shown, leds);
        }
        let mut leds = [1, 0];
        failure.rewrite(&mut leds, &mut [Mode::Send; 2]);
        assert_eq!(leds, [0, 0]);
    }

    #[test]
    fn the_next_leader_may_be_a_robot_that_shone_all_the_time() {
        let mut failure = LeaderFailure::new(2, 2);
        let mut shown = Vec::new();
        for leds in [[1, 0], [1, 0], [1, 1], [1, 1], [1, 1]] {
            let mut leds = leds;
            failure.rewrite(&mut leds, &mut [Mode::Send; 2]);
            shown.push(leds);
        }
        assert_eq!(shown, [[1, 0], [1, 0], [0, 1], [0, 1], [0, 0]]);
    }
}
