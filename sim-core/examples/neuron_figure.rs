//! Draws the response of each spiking neuron model to a constant current: writes
//! `docs/figures/neuron-MODEL.svg`, with a voltage over time and the spikes per second against
//! the current.
//!
//! ```sh
//! cargo run --release -p sim-core --example neuron_figure
//! ```
//!
//! The neuron has the default parameters of experiment files and a weight of 1, so its stimulus
//! is its current. Spikes per second are counted over 2 s of 1 ms substeps, after half a second.

use std::{error::Error, fmt::Write as _, fs};

use evolution::ALGORITHMS;
use experiment_file::{ExperimentConfig, NeuronModel};
use serde_json::json;
use sim_core::Simulation;
use sim_core::bench::NetworkLoad;

const FIGURES: &str = concat!(env!("CARGO_MANIFEST_DIR"), "/../docs/figures");
/// Substeps of the plot of voltage over time. The current is on in some of them.
const N_SUBSTEPS: usize = 500;
const ON: std::ops::Range<usize> = 50..400;
/// Number of currents of a curve, and of substeps that count spikes.
const N_POINTS: usize = 160;
const COUNTED: std::ops::Range<usize> = 500..2_500;

/// The ranges of a model's figure.
struct Subject {
    model: NeuronModel,
    /// Current in the plot of voltage over time.
    current: f64,
    /// Largest current of the curve.
    largest: f64,
    /// Voltage at the bottom, at the top, and between ticks, mV.
    voltages: [f64; 3],
}

const SUBJECTS: [Subject; 5] = [
    Subject {
        model: NeuronModel::Lif,
        current: 20.0,
        largest: 100.0,
        voltages: [-70.0, -45.0, 5.0],
    },
    Subject {
        model: NeuronModel::ExpLif,
        current: 55.0,
        largest: 150.0,
        voltages: [-70.0, -20.0, 10.0],
    },
    Subject {
        model: NeuronModel::AdEx,
        current: 60.0,
        largest: 200.0,
        voltages: [-80.0, 40.0, 20.0],
    },
    Subject {
        model: NeuronModel::Izhikevich,
        current: 100.0,
        largest: 300.0,
        voltages: [-90.0, 40.0, 30.0],
    },
    Subject {
        model: NeuronModel::MorrisLecar,
        current: 100.0,
        largest: 300.0,
        voltages: [-70.0, 50.0, 20.0],
    },
];

fn main() -> Result<(), Box<dyn Error>> {
    for subject in &SUBJECTS {
        let simulation = Simulation::compile(&experiment(subject.model)?)?;
        let course = course(&simulation, subject.current)?;
        let curve = curve(&simulation, subject.largest)?;
        let threshold = curve.iter().find(|(_, rate)| *rate > 0.0).map(|(current, _)| *current);
        let highest = curve.iter().map(|(_, rate)| *rate).fold(0.0, f64::max);
        let name = subject.model.name();
        println!("{name:13} fires from {threshold:?}, at most {highest:.1} Hz");
        fs::write(format!("{FIGURES}/neuron-{name}.svg"), figure(subject, &course, &curve))?;
    }
    Ok(())
}

/// A robot whose network is one neuron.
fn experiment(model: NeuronModel) -> Result<ExperimentConfig, Box<dyn Error>> {
    let place = json!({"positions": {"name": "fixed", "params": {"values": [[500, 500]]}}});
    let file = json!({
        "topology": {
            "time_scale": 1,
            "neuron_model": model,
            "stimuli": {"ground": {"n": 1, "sensor": "ground_sensor"}},
            "ensembles": {"N": {"n": 1}},
            "synapses": {"in": {"pre": "ground", "post": "N"}},
            "outputs": {"led": {"ensemble": "N", "actuator": "led_actuator"}},
            "decoding": {"led": {"scheme": "LinearPopulationDecoding"}}
        },
        "algorithm": {
            "name": "SNES", "evolvable_object": "robot", "fitness_function": "identify_leader",
            "population_size": 10, "generations": 1, "evaluation_steps": 1, "num_evaluations": 1,
            "populations": {"all": {
                "objects": ["synapses:weights:all"], "min_vals": 0, "max_vals": 1
            }}
        },
        "world": {"objects": {
            "robot": {
                "type": "robot", "num_instances": 1, "controller": "neural_controller",
                "sensors": {"ground_sensor": {}}, "actuators": {"led_actuator": {}},
                "initializers": place
            }
        }}
    });
    Ok(ExperimentConfig::from_json(&file.to_string(), "neurons", ALGORITHMS)?.0)
}

/// For each substep, the voltage after it, mV, and whether it has a spike.
fn course(simulation: &Simulation, current: f64) -> Result<Vec<(f64, bool)>, Box<dyn Error>> {
    let mut neuron = NetworkLoad::new(simulation, &[1.0], 1)?;
    let step = |substep| {
        neuron.set_stimulus(0, 0, if ON.contains(&substep) { current } else { 0.0 });
        neuron.step();
        let voltage = neuron.voltage(0, 0).ok_or("rate neurons have no voltage")?;
        Ok((voltage, neuron.activity(0, 0) > 0.0))
    };
    (0..N_SUBSTEPS).map(step).collect()
}

/// Currents, and spikes per second: a lane for each.
fn curve(simulation: &Simulation, largest: f64) -> Result<Vec<(f64, f64)>, Box<dyn Error>> {
    let current = |lane: usize| largest * lane as f64 / N_POINTS as f64;
    let mut neurons = NetworkLoad::new(simulation, &[1.0], N_POINTS + 1)?;
    let mut counts = [0.0; N_POINTS + 1];
    (0..=N_POINTS).for_each(|lane| neurons.set_stimulus(0, lane, current(lane)));
    for substep in 0..COUNTED.end {
        neurons.step();
        for (lane, count) in counts.iter_mut().enumerate() {
            *count += if COUNTED.contains(&substep) { neurons.activity(0, lane) } else { 0.0 };
        }
    }
    let seconds = COUNTED.len() as f64 / 1_000.0;
    Ok(counts.iter().enumerate().map(|(lane, count)| (current(lane), count / seconds)).collect())
}

/// A rectangle of the figure with the values at its edges.
struct Frame {
    left: f64,
    top: f64,
    width: f64,
    height: f64,
    x: [f64; 2],
    y: [f64; 2],
}

impl Frame {
    fn x(&self, value: f64) -> f64 {
        self.left + self.width * (value - self.x[0]) / (self.x[1] - self.x[0])
    }

    fn y(&self, value: f64) -> f64 {
        self.top + self.height * (self.y[1] - value) / (self.y[1] - self.y[0])
    }

    fn line(&self, points: impl Iterator<Item = (f64, f64)>, color: &str) -> String {
        let points = points.fold(String::new(), |mut text, (x, y)| {
            let _ = write!(text, "{:.1},{:.1} ", self.x(x), self.y(y));
            text
        });
        let points = points.trim_end();
        format!(
            "<polyline points=\"{points}\" fill=\"none\" stroke=\"{color}\" stroke-width=\"1.5\" \
             stroke-linejoin=\"round\"/>\n"
        )
    }

    /// Axes with ticks every `steps`, light lines across, and their names.
    fn axes(&self, steps: [f64; 2], names: [&str; 2]) -> String {
        let (bottom, right) = (self.top + self.height, self.left + self.width);
        let mut text = String::new();
        for value in ticks(self.x, steps[0]) {
            let (x, below) = (self.x(value), bottom + 15.0);
            let _ = writeln!(
                text,
                "<path d=\"M{x:.1},{bottom}v4\" stroke=\"#444\"/>\
                 <text x=\"{x:.1}\" y=\"{below}\" text-anchor=\"middle\">{value}</text>"
            );
        }
        for value in ticks(self.y, steps[1]) {
            let (y, before) = (self.y(value), self.left - 6.0);
            let shown = value.to_string().replace('-', "\u{2212}");
            let _ = writeln!(
                text,
                "<path d=\"M{},{y:.1}H{right}\" stroke=\"#e4e4e4\"/>\
                 <text x=\"{before}\" y=\"{y:.1}\" dy=\"4\" text-anchor=\"end\">{shown}</text>",
                self.left
            );
        }
        let (middle, label) = (self.left + self.width / 2.0, bottom + 32.0);
        let (across, half) = (self.left - 44.0, self.top + self.height / 2.0);
        let _ = writeln!(
            text,
            "<path d=\"M{},{}V{bottom}H{right}\" fill=\"none\" stroke=\"#444\"/>\n\
             <text x=\"{middle}\" y=\"{label}\" text-anchor=\"middle\">{}</text>\n\
             <text transform=\"translate({across},{half}) rotate(-90)\" \
             text-anchor=\"middle\">{}</text>",
            self.left, self.top, names[0], names[1]
        );
        text
    }
}

/// Multiples of a step within a range.
fn ticks([low, high]: [f64; 2], step: f64) -> impl Iterator<Item = f64> {
    let (first, last) = ((low / step).ceil() as i64, (high / step).floor() as i64);
    (first..=last).map(move |tick| tick as f64 * step)
}

fn figure(subject: &Subject, course: &[(f64, bool)], curve: &[(f64, f64)]) -> String {
    const BLUE: &str = "#1f6fb4";
    const RED: &str = "#c8442e";
    let [low, high, step] = subject.voltages;
    let time = [0.0, N_SUBSTEPS as f64];
    let voltage =
        Frame { left: 62.0, top: 48.0, width: 470.0, height: 170.0, x: time, y: [low, high] };
    let highest = curve.iter().map(|(_, rate)| *rate).fold(0.0, f64::max);
    let rate_step = [10.0, 25.0, 50.0, 100.0].into_iter().find(|step| highest <= 5.0 * step);
    let rate_step = rate_step.unwrap_or(200.0);
    let top = (highest / rate_step).ceil() * rate_step;
    let rates = Frame {
        left: 620.0,
        top: 48.0,
        width: 230.0,
        height: 170.0,
        x: [0.0, subject.largest],
        y: [0.0, top],
    };
    let on = [ON.start as f64, ON.end as f64].map(|time| voltage.x(time));
    let spikes = course.iter().enumerate().filter(|(_, (_, spiked))| *spiked);
    let spikes = spikes.fold(String::new(), |mut text, (substep, _)| {
        let _ = write!(text, "M{:.1},30v10", voltage.x(substep as f64 + 1.0));
        text
    });
    let points = (1..).map(f64::from).zip(course.iter().map(|(v, _)| *v));
    let current_step = if subject.largest > 200.0 { 100.0 } else { 50.0 };
    format!(
        "<svg xmlns=\"http://www.w3.org/2000/svg\" viewBox=\"0 0 870 262\" width=\"870\" \
         height=\"262\" font-family=\"sans-serif\" font-size=\"12\" fill=\"#222\">\n\
         <rect width=\"870\" height=\"262\" fill=\"white\"/>\n\
         <rect x=\"{on_left:.1}\" y=\"48\" width=\"{on_width:.1}\" height=\"170\" \
         fill=\"#f2f6fa\"/>\n\
         <text x=\"62\" y=\"20\" font-weight=\"bold\">{name}</text>\n\
         <text x=\"{on_middle:.1}\" y=\"20\" text-anchor=\"middle\">spikes with I = {current} \
         from {from} to {to} ms</text>\n\
         {voltage_axes}{voltage_line}\
         <path d=\"{spikes}\" stroke=\"{RED}\" stroke-width=\"1.5\"/>\n\
         {rate_axes}{rate_line}\
         <text x=\"735\" y=\"20\" text-anchor=\"middle\">spikes per second, constant I</text>\n\
         </svg>\n",
        on_left = on[0],
        on_width = on[1] - on[0],
        on_middle = (on[0] + on[1]) / 2.0,
        name = subject.model.name(),
        current = subject.current,
        from = ON.start,
        to = ON.end,
        voltage_axes = voltage.axes([100.0, step], ["time, ms", "v, mV"]),
        voltage_line = voltage.line(points, BLUE),
        rate_axes = rates.axes([current_step, rate_step], ["current I", "Hz"]),
        rate_line = rates.line(curve.iter().copied(), BLUE),
    )
}
