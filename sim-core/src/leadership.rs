//! Tracks the leader, the only robot with its LED on, and its term.

/// The sole leader and its term so far.
#[derive(Debug, Clone, Default)]
pub(crate) struct Leadership {
    leader: Option<usize>,
    n_steps: u32,
}

/// The sole leader of a step.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) struct Leader {
    /// The robot.
    pub robot: usize,
    /// Consecutive steps of its sole leadership, including this one.
    pub n_steps: u32,
}

impl Leadership {
    /// Observes the LEDs of one step; returns the sole leader, if there is one.
    pub fn observe(&mut self, leds: &[u32]) -> Option<Leader> {
        let sole = sole_leader(leds);
        self.n_steps = if sole.is_some() && sole == self.leader { self.n_steps + 1 } else { 1 };
        self.leader = sole;
        sole.map(|robot| Leader { robot, n_steps: self.n_steps })
    }

    /// Whether the last step had a sole leader.
    pub fn has_leader(&self) -> bool {
        self.leader.is_some()
    }

    /// Forgets the leader, so that the next term starts at 0.
    pub fn reset(&mut self) {
        self.leader = None;
    }
}

/// The only robot with its LED on.
fn sole_leader(leds: &[u32]) -> Option<usize> {
    let mut on = leds.iter().enumerate().filter(|&(_, &led)| led > 0);
    let (robot, _) = on.next()?;
    on.next().is_none().then_some(robot)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn terms_count_consecutive_steps_of_the_same_robot() {
        let mut leadership = Leadership::default();
        let mut term = |leds: [u32; 3]| leadership.observe(&leds).map(|l| (l.robot, l.n_steps));
        assert_eq!(term([0, 0, 0]), None);
        assert_eq!(term([0, 1, 0]), Some((1, 1)));
        assert_eq!(term([0, 2, 0]), Some((1, 2)));
        assert_eq!(term([0, 0, 1]), Some((2, 1)));
        assert_eq!(term([1, 0, 1]), None);
        assert_eq!(term([0, 0, 1]), Some((2, 1)));
        leadership.reset();
        assert_eq!(leadership.observe(&[0, 0, 1]), Some(Leader { robot: 2, n_steps: 1 }));
    }
}
