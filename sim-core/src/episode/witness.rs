//! Simulates one trial, and testifies what each robot perceived and did.

use std::ops::ControlFlow;

use super::{Episodes, GroupController};
use crate::communication::Mode;
use crate::controllers::Action;
use crate::network::Phenotype;
use crate::simulation::{EvaluateError, Simulation};
use crate::testimony::Testimony;
use crate::trial::Trial;
use determinism::random::{Purpose, Stream, TrialSet};

/// Observes one robot. Its own copies of the robot's streams give the numbers that it draws.
struct Witness {
    robot: usize,
    encoding: Stream,
    n_encoding: usize,
    decoding: Stream,
    n_decoding: usize,
    reception: Stream,
    quantisation: Stream,
    testimony: Testimony,
}

/// Simulates the episode of one trial, and shows what each robot of the evolvable object perceived
/// and did, until the observer breaks off.
pub(crate) fn testify(
    simulation: &Simulation,
    phenotype: &Phenotype,
    trial_set: TrialSet,
    trial: u32,
    observe: &mut dyn FnMut(&Testimony) -> ControlFlow<()>,
) -> Result<(), EvaluateError> {
    let (group, trials) = (simulation.world.evolvable, trial..trial + 1);
    let mut episodes = Episodes::new(simulation, phenotype, trial_set, trials, &|| true)?;
    let robots = simulation.world.evaluated();
    let mut witnesses: Vec<Witness> = robots
        .clone()
        .map(|robot| Witness::new(simulation, &episodes.trials[0], robot, robot - robots.start))
        .collect();
    for step in 0..simulation.n_steps {
        episodes.trials[0].sense(step)?;
        for witness in &mut witnesses {
            witness.perceive(step, &episodes.trials[0]);
        }
        for controller in &mut episodes.controllers {
            controller.decide(&mut episodes.trials);
        }
        for witness in &mut witnesses {
            witness.decide(&mut episodes.controllers[group]);
        }
        episodes.trials[0].act(step)?;
        for witness in &mut witnesses {
            episodes.trials[0].send(witness.robot, &mut witness.testimony.radio);
            if observe(&witness.testimony).is_break() {
                return Ok(());
            }
        }
        episodes.trials[0].move_things(step)?;
    }
    episodes.trials[0].end()
}

impl Witness {
    fn new(simulation: &Simulation, trial: &Trial<'_>, robot: usize, number: usize) -> Self {
        let network = &simulation.network;
        let message_len = simulation.world.message_len;
        let n_decoding = network.outputs.iter().map(|output| output.n_draws(message_len));
        Self {
            robot,
            encoding: trial.stream(Purpose::Encoding, robot),
            n_encoding: network.n_drawing() * network.n_substeps as usize,
            decoding: trial.decoding_stream(robot),
            n_decoding: n_decoding.sum(),
            reception: trial.stream(Purpose::Reception, robot),
            quantisation: trial.stream(Purpose::Quantisation, robot),
            testimony: Testimony {
                robot: number,
                message: vec![0.0; message_len],
                ..Testimony::default()
            },
        }
    }

    /// Before the robots decide.
    fn perceive(&mut self, step: u32, trial: &Trial<'_>) {
        let testimony = &mut self.testimony;
        testimony.step = step;
        testimony.reward = trial.last_reward();
        self.decoding = trial.decoding_stream(self.robot);
        trial.hear(self.robot, &mut testimony.radio);
        testimony.radio.reception = self.reception.uniform();
        testimony.radio.quantisation = self.quantisation.uniform();
    }

    /// After the robots have decided: what this robot's network decides, even if a script or a
    /// perturbation overrules it.
    fn decide(&mut self, group: &mut GroupController<'_>) {
        let Self { testimony, encoding, decoding, .. } = self;
        let lane = testimony.robot;
        let mut draws = decoding.clone();
        testimony.draws.clear();
        testimony.draws.extend((0..self.n_encoding).map(|_| encoding.uniform()));
        testimony.draws.extend((0..self.n_decoding).map(|_| draws.uniform()));
        testimony.stimuli.clear();
        testimony.stimuli.extend(group.stimuli.column(lane));
        testimony.activity.clear();
        let activity = group.controller.activity();
        testimony.activity.extend(activity.iter().flat_map(|u| u.column(lane)));
        testimony.voltages.clear();
        let voltages = group.controller.voltages();
        testimony.voltages.extend(voltages.iter().flat_map(|v| v.column(lane)));
        let Testimony { wheels, led, message, .. } = testimony;
        let mut mode = Mode::Send;
        (*wheels, *led) = ([0.0; 2], 0);
        message.fill(0.0);
        group.controller.act(lane, decoding, &mut Action { wheels, led, mode: &mut mode, message });
        testimony.sends = mode == Mode::Send;
    }
}
