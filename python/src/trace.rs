//! The recorded values of episodes, as arrays.

use numpy::{Element, IntoPyArray as _, PyArrayMethods as _, PyUntypedArrayMethods as _};
use pyo3::{prelude::*, types::PyDict};
use sim_core::{EpisodeSummary, Mode, RobotRecord, Simulation, StepRecord};

/// An episode; each field is an array `[step][robot][component]`, `[step][component]` or
/// `[component]`, flat.
#[derive(Default)]
pub struct Recording {
    n_robots: usize,
    positions: Vec<f64>,
    headings: Vec<f64>,
    wheels: Vec<f64>,
    leds: Vec<u32>,
    sends: Vec<bool>,
    messages: Vec<f64>,
    frame_emitters: Vec<i32>,
    frame_originators: Vec<i32>,
    frame_hops: Vec<u32>,
    frame_sectors: Vec<i32>,
    frame_signals: Vec<f64>,
    frame_messages: Vec<f64>,
    targets: Vec<i8>,
    stimuli: Vec<f32>,
    activities: Vec<f32>,
    voltages: Vec<f32>,
    step_fitness: Vec<f64>,
    measures: Vec<f64>,
    lights: Vec<f64>,
    areas: Vec<f64>,
    movables: Vec<f64>,
    touches: Vec<bool>,
    fitness: Vec<f64>,
    /// Maximum number of stimuli, neurons and voltages of a robot.
    widths: [usize; 3],
}

impl Recording {
    /// Adds a step of an episode of an experiment.
    pub fn add(&mut self, step: &StepRecord, of: &Simulation) {
        if step.step == 0 {
            self.begin(step, of.n_steps() as usize);
        }
        let measures = of.measure_names().iter();
        let measures = measures.map(|name| step.measures.get(name).copied().unwrap_or(f64::NAN));
        self.measures.extend(measures);
        for robot in &step.robots {
            self.add_robot(robot);
        }
        self.step_fitness.push(step.fitness.unwrap_or(f64::NAN));
        self.lights.extend(step.lights.iter().flat_map(|light| [light.x, light.y]));
        let movables = step.movables.iter();
        self.movables
            .extend(movables.flat_map(|body| [body.position.x, body.position.y, body.heading]));
    }

    /// Makes room for all steps.
    fn begin(&mut self, step: &StepRecord, n_steps: usize) {
        let n = n_steps * step.robots.len();
        self.n_robots = step.robots.len();
        self.positions.reserve_exact(2 * n);
        self.headings.reserve_exact(n);
        self.wheels.reserve_exact(2 * n);
        self.leds.reserve_exact(n);
        self.sends.reserve_exact(n);
        self.frame_emitters.reserve_exact(n);
        self.frame_originators.reserve_exact(n);
        self.frame_hops.reserve_exact(n);
        self.frame_sectors.reserve_exact(n);
        self.frame_signals.reserve_exact(n);
        self.targets.reserve_exact(n);
        self.touches.reserve_exact(n);
        self.movables.reserve_exact(3 * n_steps * step.movables.len());
        let message_len = step.robots.iter().map(|robot| robot.message.len()).max().unwrap_or(0);
        self.messages.reserve_exact(n * message_len);
        self.frame_messages.reserve_exact(n * message_len);
        let n_stimuli = step.robots.iter().map(|robot| robot.stimuli.len()).max().unwrap_or(0);
        let n_neurons = step.robots.iter().map(|robot| robot.activity.len()).max().unwrap_or(0);
        let n_voltages = step.robots.iter().map(|robot| robot.voltages.len()).max().unwrap_or(0);
        self.widths = [n_stimuli, n_neurons, n_voltages];
        self.stimuli.reserve_exact(n * n_stimuli);
        self.activities.reserve_exact(n * n_neurons);
        self.voltages.reserve_exact(n * n_voltages);
        self.areas.extend(step.areas.iter().flat_map(|area| [area.x, area.y]));
    }

    fn add_robot(&mut self, robot: &RobotRecord) {
        self.positions.extend([robot.position.x, robot.position.y]);
        self.headings.push(robot.heading);
        self.wheels.extend(robot.wheels);
        self.leds.push(robot.led);
        self.sends.push(robot.mode == Mode::Send);
        self.messages.extend(&robot.message);
        let frame = robot.received.as_ref();
        self.frame_emitters.push(frame.map_or(-1, |frame| frame.emitter as i32));
        self.frame_originators.push(frame.map_or(-1, |frame| frame.originator as i32));
        self.frame_hops.push(frame.map_or(0, |frame| frame.hops));
        self.frame_sectors.push(frame.map_or(-1, |frame| frame.sector as i32));
        self.frame_signals.push(frame.map_or(0.0, |frame| frame.signal));
        self.frame_messages.extend(&robot.received_message);
        self.targets.push(robot.target.map_or(-1, i8::from));
        self.touches.push(robot.touches);
        // The simulator computes them with 32 bits.
        let [n_stimuli, n_neurons, n_voltages] = self.widths;
        pad(&mut self.stimuli, &robot.stimuli, n_stimuli);
        pad(&mut self.activities, &robot.activity, n_neurons);
        pad(&mut self.voltages, &robot.voltages, n_voltages);
    }

    /// The episode is over.
    pub fn end(&mut self, summary: &EpisodeSummary) {
        self.fitness.push(summary.fitness);
    }

    /// T episodes, as arrays by name.
    pub fn to_arrays(
        py: Python<'_>,
        episodes: Vec<Self>,
        n_steps: usize,
    ) -> PyResult<Bound<'_, PyDict>> {
        let arrays = Arrays {
            n_trials: episodes.len(),
            n_steps,
            n_robots: episodes.first().map_or(0, |episode| episode.n_robots),
            dict: PyDict::new(py),
        };
        let mut all = Self::default();
        for episode in episodes {
            all.append(episode);
        }
        arrays.of_robots("positions", all.positions)?;
        arrays.of_robots("wheels", all.wheels)?;
        arrays.of_robots("messages", all.messages)?;
        arrays.of_robots("frame_messages", all.frame_messages)?;
        arrays.of_robots("stimuli", all.stimuli)?;
        arrays.of_robots("activities", all.activities)?;
        arrays.of_robots("voltages", all.voltages)?;
        arrays.one_per_robot("headings", all.headings)?;
        arrays.one_per_robot("leds", all.leds)?;
        arrays.one_per_robot("sends", all.sends)?;
        arrays.one_per_robot("frame_emitters", all.frame_emitters)?;
        arrays.one_per_robot("frame_originators", all.frame_originators)?;
        arrays.one_per_robot("frame_hops", all.frame_hops)?;
        arrays.one_per_robot("frame_sectors", all.frame_sectors)?;
        arrays.one_per_robot("frame_signals", all.frame_signals)?;
        arrays.one_per_robot("targets", all.targets)?;
        arrays.one_per_robot("touches", all.touches)?;
        let (trials, steps) = (arrays.n_trials, arrays.n_steps);
        arrays.set("step_fitness", all.step_fitness, [trials, steps])?;
        let n_measures = all.measures.len() / (trials * steps).max(1);
        arrays.set("measures", all.measures, [trials, steps, n_measures])?;
        arrays.set("fitness", all.fitness, [trials])?;
        let n_lights = all.lights.len() / (2 * trials * steps).max(1);
        arrays.set("lights", all.lights, [trials, steps, n_lights, 2])?;
        let n_areas = all.areas.len() / (2 * trials).max(1);
        arrays.set("areas", all.areas, [trials, n_areas, 2])?;
        let n_movables = all.movables.len() / (3 * trials * steps).max(1);
        arrays.set("movables", all.movables, [trials, steps, n_movables, 3])?;
        Ok(arrays.dict)
    }

    /// Appends an episode. An empty recording takes its arrays; another one copies the values.
    fn append(&mut self, other: Self) {
        join(&mut self.positions, other.positions);
        join(&mut self.headings, other.headings);
        join(&mut self.wheels, other.wheels);
        join(&mut self.leds, other.leds);
        join(&mut self.sends, other.sends);
        join(&mut self.messages, other.messages);
        join(&mut self.frame_emitters, other.frame_emitters);
        join(&mut self.frame_originators, other.frame_originators);
        join(&mut self.frame_hops, other.frame_hops);
        join(&mut self.frame_sectors, other.frame_sectors);
        join(&mut self.frame_signals, other.frame_signals);
        join(&mut self.frame_messages, other.frame_messages);
        join(&mut self.targets, other.targets);
        join(&mut self.stimuli, other.stimuli);
        join(&mut self.activities, other.activities);
        join(&mut self.voltages, other.voltages);
        join(&mut self.step_fitness, other.step_fitness);
        join(&mut self.measures, other.measures);
        join(&mut self.lights, other.lights);
        join(&mut self.areas, other.areas);
        join(&mut self.movables, other.movables);
        join(&mut self.touches, other.touches);
        join(&mut self.fitness, other.fitness);
    }
}

/// Adds a robot's values, and NaN for values that only other robots have.
fn pad(column: &mut Vec<f32>, values: &[f64], width: usize) {
    column.extend(values.iter().map(|&value| value as f32));
    column.extend((values.len()..width).map(|_| f32::NAN));
}

fn join<T>(all: &mut Vec<T>, mut values: Vec<T>) {
    if all.is_empty() {
        *all = values;
    } else {
        all.append(&mut values);
    }
}

/// Arrays by name.
struct Arrays<'py> {
    n_trials: usize,
    n_steps: usize,
    n_robots: usize,
    dict: Bound<'py, PyDict>,
}

impl Arrays<'_> {
    /// `[trial, step, robot, component]`.
    fn of_robots<T: Element>(&self, name: &str, values: Vec<T>) -> PyResult<()> {
        let n = self.n_trials * self.n_steps * self.n_robots;
        let width = values.len() / n.max(1);
        self.set(name, values, [self.n_trials, self.n_steps, self.n_robots, width])
    }

    /// `[trial, step, robot]`.
    fn one_per_robot<T: Element>(&self, name: &str, values: Vec<T>) -> PyResult<()> {
        self.set(name, values, [self.n_trials, self.n_steps, self.n_robots])
    }

    fn set<T: Element, const N: usize>(
        &self,
        name: &str,
        values: Vec<T>,
        shape: [usize; N],
    ) -> PyResult<()> {
        let array = values.into_pyarray(self.dict.py());
        debug_assert_eq!(array.len(), shape.iter().product::<usize>(), "{name}");
        self.dict.set_item(name, array.reshape(&shape[..])?)
    }
}
