//! The trace: the state of every robot in every step, as CSV (RFC 4180).

use std::{
    io::{self, BufWriter, IntoInnerError},
    path::{Path, PathBuf},
};

use clap::ValueEnum;
use experiment_file::{ExperimentConfig, RobotController};
use indexmap::IndexSet;
use sim_core::{MeasureName, Mode, ReceivedFrame, RobotRecord, Simulation, StepRecord};

use crate::{
    error::Error,
    output_file::{OutputFile, Overwrite, unwritable},
};

/// Columns of a trace that are written on request only.
#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
pub enum ExtraColumns {
    /// neuron_ENSEMBLE_0, ...: activity of every neuron after the step.
    Neurons,
    /// frame_emitter, frame_message_0, ...: the robot that was heard, and its message.
    Frames,
    /// led_target: 1 if the task wants the LED on, 0 if off; empty if the task has no
    /// target.
    Targets,
}

/// A CSV file being written: one row per trial, step and robot.
pub struct Trace {
    path: PathBuf,
    rows: Rows<BufWriter<OutputFile>>,
    /// The first failure; nothing is written after it.
    result: io::Result<()>,
}

impl Trace {
    /// Begins the file, which appears when it is finished.
    pub fn create(
        path: &Path,
        config: &ExperimentConfig,
        simulation: &Simulation,
        extra: &[ExtraColumns],
        overwrite: Overwrite,
    ) -> Result<Self, Error> {
        let file = overwrite.begin(path)?;
        let rows = Rows::new(BufWriter::new(file), config, simulation, extra);
        Ok(Self { path: path.into(), rows, result: Ok(()) })
    }

    /// Adds the rows of a step.
    pub fn record(&mut self, trial: u32, record: &StepRecord) {
        if self.result.is_ok() {
            self.result = self.rows.write(trial, record);
        }
    }

    /// Finishes the file; returns its number of rows, or the first error of writing it.
    pub fn finish(self) -> Result<u64, Error> {
        let Self { path, rows, result } = self;
        let flushed =
            result.and_then(|()| rows.out.into_inner().map_err(IntoInnerError::into_error));
        flushed.map_err(|error| unwritable(&path, &error))?.finish()?;
        Ok(rows.n_rows)
    }
}

/// Formats the rows and writes them.
struct Rows<W> {
    out: W,
    /// Per robot, the index of its object in `objects`.
    robots: Vec<usize>,
    objects: Vec<Object>,
    /// Names of all inputs of all controllers.
    stimuli: IndexSet<String>,
    /// Names of all neurons, in the order of their activities; empty unless requested.
    neurons: Vec<String>,
    /// Whether neurons have voltages, too.
    has_voltages: bool,
    has_frames: bool,
    has_targets: bool,
    has_bodies: bool,
    /// Names of the measures, which some steps may lack.
    measures: Vec<MeasureName>,
    n_rows: u64,
}

/// An object of the experiment file, and the common properties of its robots.
struct Object {
    name: String,
    /// Per input of the controller, its index in `Rows::stimuli`.
    inputs: Vec<usize>,
}

impl<W: io::Write> Rows<W> {
    fn new(
        out: W,
        config: &ExperimentConfig,
        simulation: &Simulation,
        extra: &[ExtraColumns],
    ) -> Self {
        let (mut robots, mut objects, mut stimuli) = (Vec::new(), Vec::new(), IndexSet::new());
        for (name, robot) in config.robots() {
            let inputs: Vec<(&str, u32)> = match robot.controller {
                RobotController::NeuralController => {
                    let stimuli = config.topology.stimuli.iter();
                    stimuli.map(|(name, stimulus)| (name.as_str(), stimulus.n)).collect()
                }
                RobotController::BraitenbergLightFollower => {
                    let sensor = robot.sensors.light_sensor.iter();
                    sensor.map(|sensor| ("light_sensor", sensor.n_sectors)).collect()
                }
                // A trace does not contain the values that scripts read.
                RobotController::ScriptController => Vec::new(),
            };
            let inputs = inputs.iter().flat_map(|(name, n)| (0..*n).map(move |i| (name, i)));
            let inputs = inputs.map(|(name, i)| stimuli.insert_full(format!("{name}_{i}")).0);
            robots.extend((0..robot.num_instances).map(|_| objects.len()));
            objects.push(Object { name: name.to_owned(), inputs: inputs.collect() });
        }
        let wants = |columns| extra.contains(&columns);
        let ensembles = config.topology.ensembles.iter().filter(|_| wants(ExtraColumns::Neurons));
        let neurons = ensembles
            .flat_map(|(name, ensemble)| (0..ensemble.n).map(move |i| format!("{name}_{i}")));
        Self {
            out,
            robots,
            objects,
            stimuli,
            neurons: neurons.collect(),
            has_voltages: config.topology.neuron_model.is_spiking(),
            has_frames: wants(ExtraColumns::Frames),
            has_targets: wants(ExtraColumns::Targets),
            has_bodies: config.world.bodies.is_some(),
            measures: simulation.measure_names().to_vec(),
            n_rows: 0,
        }
    }

    fn write(&mut self, trial: u32, record: &StepRecord) -> io::Result<()> {
        if self.n_rows == 0 {
            writeln!(self.out, "{}", self.heading(record).join(","))?;
        }
        for (index, robot) in record.robots.iter().enumerate() {
            let object = &self.objects[self.robots[index]];
            let mut row = vec![
                trial.to_string(),
                record.step.to_string(),
                index.to_string(),
                quoted(&object.name),
            ];
            row.extend(robot_cells(robot));
            let mut stimuli = vec![String::new(); self.stimuli.len()];
            for (place, value) in object.inputs.iter().zip(&robot.stimuli) {
                stimuli[*place] = number(*value);
            }
            row.extend(stimuli);
            row.extend(record.lights.iter().flat_map(|light| [number(light.x), number(light.y)]));
            row.extend(record.movables.iter().flat_map(|movable| {
                [movable.position.x, movable.position.y, movable.heading].map(number)
            }));
            if self.has_bodies {
                row.push(u8::from(robot.touches).to_string());
            }
            row.push(record.fitness.map(number).unwrap_or_default());
            let measure = |name| record.measures.get(name).copied().map(number).unwrap_or_default();
            row.extend(self.measures.iter().map(measure));
            row.extend(self.extra_cells(robot));
            writeln!(self.out, "{}", row.join(","))?;
            self.n_rows += 1;
        }
        Ok(())
    }

    /// The requested cells.
    fn extra_cells(&self, robot: &RobotRecord) -> Vec<String> {
        // Robots without a network have no activity.
        let activity = |i| robot.activity.get(i).copied().map(number).unwrap_or_default();
        let mut cells: Vec<String> = (0..self.neurons.len()).map(activity).collect();
        if self.has_voltages {
            let voltage = |i| robot.voltages.get(i).copied().map(number).unwrap_or_default();
            cells.extend((0..self.neurons.len()).map(voltage));
        }
        if self.has_frames {
            cells.push(robot.received.map(|frame| frame.emitter.to_string()).unwrap_or_default());
            let message = robot.received_message.iter();
            let heard = |value: &f64| robot.received.map(|_| number(*value)).unwrap_or_default();
            cells.extend(message.map(heard));
        }
        if self.has_targets {
            cells.push(robot.target.map(|is_on| u8::from(is_on).to_string()).unwrap_or_default());
        }
        cells
    }

    /// The columns of messages, lights and movables are the same in all steps of an
    /// experiment.
    fn heading(&self, record: &StepRecord) -> Vec<String> {
        let place = ["trial", "step", "robot", "object", "x_cm", "y_cm", "heading_rad"];
        let actions = ["wheel_right", "wheel_left", "led", "mode"];
        let frame = ["frame_originator", "frame_hops", "frame_sector", "frame_signal"];
        let message_len = record.robots.first().map_or(0, |robot| robot.message.len());
        let mut heading: Vec<String> =
            place.iter().chain(&actions).map(ToString::to_string).collect();
        heading.extend((0..message_len).map(|i| format!("message_{i}")));
        heading.extend(frame.map(String::from));
        heading.extend(self.stimuli.iter().map(|input| quoted(&format!("stimulus_{input}"))));
        let light = |i| [format!("light_{i}_x_cm"), format!("light_{i}_y_cm")];
        heading.extend((0..record.lights.len()).flat_map(light));
        let movable = |i| ["x_cm", "y_cm", "heading_rad"].map(|name| format!("movable_{i}_{name}"));
        heading.extend((0..record.movables.len()).flat_map(movable));
        if self.has_bodies {
            heading.push("touches".into());
        }
        heading.push("step_fitness".into());
        heading.extend(self.measures.iter().map(|name| format!("metric_{name}")));
        heading.extend(self.neurons.iter().map(|neuron| quoted(&format!("neuron_{neuron}"))));
        if self.has_voltages {
            let voltages = self.neurons.iter();
            heading.extend(voltages.map(|neuron| quoted(&format!("voltage_{neuron}"))));
        }
        if self.has_frames {
            heading.push("frame_emitter".into());
            heading.extend((0..message_len).map(|i| format!("frame_message_{i}")));
        }
        if self.has_targets {
            heading.push("led_target".into());
        }
        heading
    }
}

/// The cells from the position to the received frame.
fn robot_cells(robot: &RobotRecord) -> Vec<String> {
    let [right, left] = robot.wheels;
    let mut cells: Vec<String> =
        [robot.position.x, robot.position.y, robot.heading, right, left].map(number).into();
    cells.push(robot.led.to_string());
    let mode = match robot.mode {
        Mode::Send => "send",
        Mode::Relay => "relay",
    };
    cells.push(mode.into());
    cells.extend(robot.message.iter().copied().map(number));
    cells.extend(robot.received.map_or_else(Default::default, |frame| {
        let ReceivedFrame { originator, hops, sector, signal, .. } = frame;
        [originator.to_string(), hops.to_string(), sector.to_string(), number(signal)]
    }));
    cells
}

/// The shortest decimal that reads back to the same bits.
fn number(value: f64) -> String {
    format!("{value:?}")
}

/// A name, which may contain separators of cells but no control characters.
fn quoted(name: &str) -> String {
    if name.contains([',', '"']) {
        format!("\"{}\"", name.replace('"', "\"\""))
    } else {
        name.into()
    }
}

#[cfg(test)]
mod tests;
