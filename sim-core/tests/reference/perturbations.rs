//! Perturbations of a swarm (chapter 6).

use determinism::random::Stream;
use experiment_file::{
    InhibitedStimulus, SensorQuery, UncontrollableRotationConfig, WholeReceiver,
};

use super::torus::angular_difference;

const HELD_WITHIN_RAD: f64 = 0.15;

/// `k` of `n` robots: partial Fisher-Yates.
pub fn affected_robots(n: u32, k: u32, stream: &mut Stream) -> Vec<bool> {
    let n = n as usize;
    let mut order: Vec<usize> = (0..n).collect();
    for i in 0..k as usize {
        let j = i + stream.below(n - i);
        order.swap(i, j);
    }
    let mut affected = vec![false; n];
    for &robot in &order[..k as usize] {
        affected[robot] = true;
    }
    affected
}

/// Whether `stimuli_inhibition` zeroes this reading.
pub fn inhibits(inhibited: InhibitedStimulus, query: SensorQuery) -> bool {
    match inhibited {
        InhibitedStimulus::Reading(reading) => reading == query,
        InhibitedStimulus::Receiver(WholeReceiver::WirelessReceiver) => matches!(
            query,
            SensorQuery::ReceiverMessage
                | SensorQuery::ReceiverSignal
                | SensorQuery::ReceiverReceivingDirection
                | SensorQuery::ReceiverSendingDirection
                | SensorQuery::ReceiverState
        ),
    }
}

/// Wheel actions of an affected robot in step `k`, once the rotation has started.
pub fn rotation(config: &UncontrollableRotationConfig, k: u32, heading: f64) -> Option<[f64; 2]> {
    if k < config.start {
        return None;
    }
    let target = ((k / config.switch_at) as usize).min(config.targets.len() - 1);
    let is_there = angular_difference(heading, config.targets[target]) <= HELD_WITHIN_RAD;
    Some(if is_there { [0.0, 0.0] } else { [config.speed, -config.speed] })
}

/// Consecutive steps in which the same robot was the only one with its LED on.
#[derive(Clone, Default)]
pub struct SoleLeader {
    pub robot: Option<usize>,
    /// Steps so far, the current one included.
    pub n_steps: u32,
}

impl SoleLeader {
    /// Observes the LED colours of one step.
    pub fn observe(&mut self, leds: &[u32]) {
        let lit: Vec<usize> = (0..leds.len()).filter(|&robot| leds[robot] > 0).collect();
        let leader = if let [robot] = lit[..] { Some(robot) } else { None };
        self.n_steps = match leader {
            None => 0,
            Some(_) if leader == self.robot => self.n_steps + 1,
            Some(_) => 1,
        };
        self.robot = leader;
    }
}
