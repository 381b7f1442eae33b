//! What others cannot see of a trial: random streams and radios, for testimonies.

use super::Trial;
use crate::communication::Mode;
use crate::controllers::bounded;
use crate::testimony::RadioTestimony;
use determinism::random::{Purpose, Stream};
use experiment_file::SensorQuery;

/// The radio's readings, with their numbers of values except the message's.
const READINGS: [(SensorQuery, usize); 5] = [
    (SensorQuery::ReceiverMessage, 0),
    (SensorQuery::ReceiverSignal, 1),
    (SensorQuery::ReceiverReceivingDirection, 2),
    (SensorQuery::ReceiverSendingDirection, 2),
    (SensorQuery::ReceiverState, 1),
];

impl Trial<'_> {
    /// A robot's random stream for a purpose, at its beginning.
    pub fn stream(&self, purpose: Purpose, robot: usize) -> Stream {
        self.address.stream(purpose, robot)
    }

    /// The stream of a robot's decoders, at its present place.
    pub fn decoding_stream(&self, robot: usize) -> Stream {
        self.decoding[robot].clone()
    }

    /// The reward of the previous step.
    pub fn last_reward(&self) -> f32 {
        bounded(self.reward)
    }

    /// What a robot's radio heard, chose and reads in this step, before the actions.
    pub fn hear(&self, robot: usize, radio: &mut RadioTestimony) {
        let neighbours = self.audible.as_ref().unwrap_or(&self.neighbours);
        radio.heard = self.radio.heard(robot, neighbours, &self.swarm);
        radio.sector = self.swarm.received[robot].as_ref().map(|received| received.sector);
        let number = self.world.group_of(robot);
        let (robots, senses) = (&self.world.groups[number].robots, &self.groups[number].senses);
        radio.readings.clear();
        for reading in READINGS {
            let values = senses.reading(reading, robots, robot - robots.start, &self.swarm);
            radio.readings.extend(values.iter().map(|&value| value as f32));
        }
    }

    /// What a robot's radio sent in this step, after the actions.
    pub fn send(&self, robot: usize, radio: &mut RadioTestimony) {
        radio.sends = self.swarm.modes[robot] == Mode::Send;
        let emits = self.world.antennas[robot].emits_within.is_some();
        radio.sent = emits.then(|| self.radio.sent(robot));
    }
}
