//! Testimonies: what a robot perceived, drew, decided and sent in a step, so that the same
//! controller outside of this program can prove to do the same.

use std::ops::{ControlFlow, Range};

use crate::communication::FrameOrigin;
use crate::episode;
use crate::simulation::{EvaluateError, Simulation};
use determinism::random::TrialSet;

/// One robot in one step.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Testimony {
    /// The environment step, from 0.
    pub step: u32,
    /// The robot, from 0 among those of the evolvable object.
    pub robot: usize,
    /// What its network perceives, one value per input.
    pub stimuli: Vec<f32>,
    /// The reward of the previous step, for networks that learn.
    pub reward: f32,
    /// The uniform numbers that it draws, in this order: for encoders, substep by substep; for
    /// decoders.
    pub draws: Vec<f64>,
    /// Activity of every neuron after the step.
    pub activity: Vec<f32>,
    /// Voltage of every spiking neuron after the step, mV; empty without spiking neurons.
    pub voltages: Vec<f32>,
    /// The network's decision for the right and left wheel, in \[-1, 1\].
    pub wheels: [f64; 2],
    /// The network's decision for the colour of the LED, 0 off.
    pub led: u32,
    /// Whether the network decides to send its own message; otherwise it relays.
    pub sends: bool,
    /// The network's message, before quantisation.
    pub message: Vec<f64>,
    /// Its radio.
    pub radio: RadioTestimony,
}

/// A robot's radio in one step.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct RadioTestimony {
    /// The strongest frame in each sector; empty without a receiver.
    pub heard: Vec<HeardFrame>,
    /// The uniform number that chooses among them.
    pub reception: f64,
    /// The sector of the chosen frame; `None` if no frame was valid.
    pub sector: Option<usize>,
    /// What the radio reads, before any inhibition: the message, the signal, the receiving
    /// direction, the sending direction, and the state.
    pub readings: Vec<f32>,
    /// Whether the robot sends its own message in this step, whatever its network decided.
    pub sends: bool,
    /// The uniform number that chooses the symbol.
    pub quantisation: f64,
    /// The frame that it puts on the air; `None` without a transmitter.
    pub sent: Option<Frame>,
}

/// A frame that a sector hears.
#[derive(Debug, Clone, PartialEq)]
pub struct HeardFrame {
    /// The frame; with `u32::MAX` hops if there is none.
    pub frame: Frame,
    /// (cos, sin) of the emitter's sector that faces the receiver, in the emitter's own frame of
    /// reference; zero if it is not observed.
    pub facing: [f64; 2],
    /// Its strength as the radio measures it, in \[0, 1\].
    pub signal: f64,
}

/// A frame on the air.
#[derive(Debug, Clone, PartialEq)]
pub struct Frame {
    /// The robot whose message it carries; `u32::MAX` if there is none.
    pub originator: u32,
    /// Number of emissions so far, from 1.
    pub hops: u32,
    /// The message.
    pub message: Vec<f64>,
    /// Direction in which the originator sent the message; zero if nobody has observed it.
    pub sending_direction: [f64; 2],
}

impl Frame {
    pub(crate) fn new(origin: FrameOrigin, message: &[f64]) -> Self {
        let FrameOrigin { originator, hops, sending_direction } = origin;
        Self {
            originator: u32::try_from(originator).unwrap_or(u32::MAX),
            hops,
            message: message.to_vec(),
            sending_direction: [sending_direction.x, sending_direction.y],
        }
    }
}

impl Simulation {
    /// The numbers of the robots that testify, among all robots.
    pub fn witnesses(&self) -> Range<usize> {
        self.world.evaluated()
    }

    /// Simulates the episode of one trial, and shows what each robot of the evolvable object
    /// perceived and did, step by step and robot by robot, until the observer breaks off. The
    /// episode has the same bits as in [`simulate`](Self::simulate); a decision is the network's
    /// own, before any perturbation.
    ///
    /// # Errors
    ///
    /// As [`evaluate`](Self::evaluate).
    pub fn testify(
        &self,
        genotype: &[f64],
        trial_set: impl Into<TrialSet>,
        trial: u32,
        observe: &mut dyn FnMut(&Testimony) -> ControlFlow<()>,
    ) -> Result<(), EvaluateError> {
        let phenotype = self.phenotype(genotype)?;
        let trials: Range<u32> = trial..trial.saturating_add(1);
        self.check_trials(&trials)?;
        episode::testify(self, &phenotype, trial_set.into(), trial, observe)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::Mode;
    use crate::record::StepRecord;
    use crate::testing::{experiment_a, experiment_a_spiking, experiment_d, genotype};
    use experiment_file::NeuronModel;

    /// Robots testify to the episode that `simulate` shows; their decisions are those of the
    /// network, which perturbations and the first steps overrule.
    #[test]
    fn testimonies_are_of_the_same_episode() {
        let mut n_overruled = 0;
        for config in [experiment_a(), experiment_a_spiking(NeuronModel::Lif), experiment_d()] {
            let simulation = Simulation::compile(&config).unwrap();
            let genotype = genotype(simulation.genotype_len(), 3);
            let mut records: Vec<StepRecord> = Vec::new();
            simulation.simulate(&genotype, 4, 1, &mut |step| records.push(step.clone())).unwrap();
            let mut n_testimonies = 0;
            let mut check = |testimony: &Testimony| {
                n_testimonies += 1;
                let robot = &records[testimony.step as usize].robots[testimony.robot];
                let as_f64 = |values: &[f32]| -> Vec<f64> {
                    values.iter().map(|&value| value.into()).collect()
                };
                assert_eq!(as_f64(&testimony.stimuli), robot.stimuli);
                assert_eq!(as_f64(&testimony.activity), robot.activity);
                assert_eq!(as_f64(&testimony.voltages), robot.voltages);
                assert_eq!(testimony.wheels, robot.wheels);
                let radio = &testimony.radio;
                assert_eq!(radio.sends, robot.mode == Mode::Send);
                assert_eq!(radio.sector, robot.received.map(|frame| frame.sector));
                if let (Some(sector), Some(received)) = (radio.sector, robot.received) {
                    let heard = &radio.heard[sector];
                    assert_eq!(heard.frame.originator as usize, received.originator);
                    assert_eq!(heard.frame.message, robot.received_message);
                    assert_eq!(heard.signal, received.signal);
                }
                let sent = radio.sent.as_ref().unwrap();
                let message = if radio.sends { &robot.message } else { &robot.received_message };
                assert_eq!(&sent.message, message);
                n_overruled += u32::from(radio.sends != testimony.sends);
                ControlFlow::Continue(())
            };
            simulation.testify(&genotype, 4, 1, &mut check).unwrap();
            assert_eq!(n_testimonies, records.len() * simulation.witnesses().len());
            let mut n_more = 3;
            let mut break_off = |_: &Testimony| {
                n_more -= 1;
                if n_more == 0 { ControlFlow::Break(()) } else { ControlFlow::Continue(()) }
            };
            simulation.testify(&genotype, 4, 1, &mut break_off).unwrap();
            assert_eq!(n_more, 0);
        }
        assert!(n_overruled > 0, "the first steps overrule no decision");
    }
}
