//! `stimuli_inhibition`: the networks of some robots lose a stimulus. Their sensors and radios
//! still work, so these robots still relay received frames.

use super::draw_affected;
use determinism::random::Stream;
use experiment_file::{InhibitedStimulus, SensorQuery, StimuliInhibitionConfig};

/// The affected robots, and the stimulus that they lose.
#[derive(Debug, Clone)]
pub(super) struct Inhibition {
    stimulus: InhibitedStimulus,
    affected: Vec<bool>,
}

impl Inhibition {
    /// Draws the affected robots.
    pub fn new(config: &StimuliInhibitionConfig, n_robots: usize, stream: &mut Stream) -> Self {
        let affected = draw_affected(config.affected_robots, n_robots, stream);
        Self { stimulus: config.stimuli, affected }
    }

    /// Whether the network of a robot gets zeros for a reading.
    pub fn inhibits(&self, robot: usize, reading: SensorQuery) -> bool {
        self.affected[robot]
            && match self.stimulus {
                InhibitedStimulus::Reading(inhibited) => inhibited == reading,
                InhibitedStimulus::Receiver(_) => matches!(
                    reading,
                    SensorQuery::ReceiverMessage
                        | SensorQuery::ReceiverSignal
                        | SensorQuery::ReceiverReceivingDirection
                        | SensorQuery::ReceiverSendingDirection
                        | SensorQuery::ReceiverState
                ),
            }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use determinism::random::Purpose;
    use experiment_file::WholeReceiver;

    fn inhibition(stimuli: InhibitedStimulus) -> Inhibition {
        let config = StimuliInhibitionConfig { stimuli, affected_robots: 3 };
        Inhibition::new(&config, 5, &mut Stream::new(0, 0, 0, Purpose::Perturbation, 1))
    }

    #[test]
    fn one_reading_of_the_affected_robots_is_lost() {
        let inhibition = inhibition(InhibitedStimulus::Reading(SensorQuery::Light));
        let inhibited = |reading| (0..5).filter(|&r| inhibition.inhibits(r, reading)).count();
        assert_eq!(inhibited(SensorQuery::Light), 3);
        assert_eq!(inhibited(SensorQuery::Distance), 0);
    }

    #[test]
    fn a_lost_receiver_takes_all_its_readings_along() {
        let receiver = WholeReceiver::WirelessReceiver;
        let inhibition = inhibition(InhibitedStimulus::Receiver(receiver));
        let robot = (0..5).find(|&robot| inhibition.affected[robot]).unwrap();
        for reading in [
            SensorQuery::ReceiverMessage,
            SensorQuery::ReceiverSignal,
            SensorQuery::ReceiverReceivingDirection,
            SensorQuery::ReceiverSendingDirection,
            SensorQuery::ReceiverState,
        ] {
            assert!(inhibition.inhibits(robot, reading));
        }
        assert!(!inhibition.inhibits(robot, SensorQuery::Ground));
    }
}
