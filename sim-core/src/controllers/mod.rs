//! The controllers, which decide the actions of robots.

mod braitenberg;
mod neural;

pub(crate) use braitenberg::BraitenbergLightFollower;
pub(crate) use neural::{NeuralController, bounded};

use crate::communication::Mode;
use crate::lanes::Lanes;
use determinism::random::Stream;

/// Decides for all robots of one object of the world in all trials, one lane per robot and trial.
pub(crate) trait Controller {
    /// Gives a lane its reward for the previous step.
    fn reward(&mut self, _lane: usize, _reward: f64) {}

    /// Gives the controller the stimuli of one environment step, `[input][lane]`.
    fn perceive(&mut self, stimuli: &Lanes);

    /// Sets the actions of one lane; `action` holds the defaults. `stream`: the robot's stream
    /// for stochastic decisions; every step draws the same number of values from it.
    fn act(&mut self, lane: usize, stream: &mut Stream, action: &mut Action<'_>);

    /// Activities of its neurons, `[neuron][lane]`, if it has any.
    fn activity(&self) -> Option<Lanes> {
        None
    }

    /// Voltages of its neurons, mV, `[neuron][lane]`, if they spike.
    fn voltages(&self) -> Option<Lanes> {
        None
    }
}

/// Decides nothing, because the script plans the actions.
pub(crate) struct Scripted;

impl Controller for Scripted {
    fn perceive(&mut self, _: &Lanes) {}

    fn act(&mut self, _: usize, _: &mut Stream, _: &mut Action<'_>) {}
}

/// The actions of one robot in one step.
#[derive(Debug)]
pub(crate) struct Action<'a> {
    /// Right and left wheel, in \[-1, 1\].
    pub wheels: &'a mut [f64; 2],
    /// Colour of the LED, 0 off.
    pub led: &'a mut u32,
    /// Communication mode.
    pub mode: &'a mut Mode,
    /// Message, before quantisation.
    pub message: &'a mut [f64],
}
