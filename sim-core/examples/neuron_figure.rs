//! How often a neuron of each spiking model fires with a constant current: writes
//! `docs/figures/neurons.svg`.
//!
//! ```sh
//! cargo run --release -p sim-core --example neuron_figure
//! ```
//!
//! The neuron belongs to a robot on a black area, so that its stimulus is 1 and its weight
//! is the current. It has the parameters that files have by default; spikes are counted
//! over 2 s of 1 ms substeps, after half a second.

use std::{error::Error, fmt::Write as _, fs};

use evolution::ALGORITHMS;
use experiment_file::{ExperimentConfig, NeuronModel};
use serde_json::json;
use sim_core::Simulation;

const FIGURE: &str = concat!(env!("CARGO_MANIFEST_DIR"), "/../docs/figures/neurons.svg");
/// Substeps of an environment step, environment steps, and those that do not count.
const TIME_SCALE: u32 = 100;
const STEPS: u32 = 25;
const SETTLING: u32 = 5;
/// Currents of a curve.
const N_POINTS: u32 = 120;
/// Models with the largest current of their curve.
const CURVES: [(NeuronModel, f64); 5] = [
    (NeuronModel::Lif, 100.0),
    (NeuronModel::ExpLif, 150.0),
    (NeuronModel::AdEx, 200.0),
    (NeuronModel::Izhikevich, 300.0),
    (NeuronModel::MorrisLecar, 300.0),
];

fn main() -> Result<(), Box<dyn Error>> {
    let mut panels = String::new();
    for (index, (model, largest)) in CURVES.into_iter().enumerate() {
        let rates = rates(model, largest)?;
        let threshold = rates.iter().find(|(_, rate)| *rate > 0.0).map(|(current, _)| *current);
        let highest = rates.iter().map(|(_, rate)| *rate).fold(0.0, f64::max);
        println!("{:13} fires from {threshold:?}, at most {highest:.1} Hz", model.name());
        panels += &panel(index as f64 * 190.0, model.name(), largest, &rates);
    }
    let svg = format!(
        "<svg xmlns=\"http://www.w3.org/2000/svg\" viewBox=\"0 0 960 220\" \
         font-family=\"sans-serif\" font-size=\"11\">\n\
         <rect width=\"960\" height=\"220\" fill=\"white\"/>\n{panels}</svg>\n"
    );
    fs::write(FIGURE, svg)?;
    Ok(())
}

/// Currents, and spikes per second.
fn rates(model: NeuronModel, largest: f64) -> Result<Vec<(f64, f64)>, Box<dyn Error>> {
    let file = json!({
        "topology": {
            "time_scale": TIME_SCALE,
            "neuron_model": model,
            "stimuli": {"ground": {"n": 1, "sensor": "ground_sensor"}},
            "ensembles": {"N": {"n": 1}},
            "synapses": {"in": {"pre": "ground", "post": "N"}},
            "outputs": {"led": {"ensemble": "N", "actuator": "led_actuator"}},
            "decoding": {"led": {"scheme": "LinearPopulationDecoding"}}
        },
        "algorithm": {
            "name": "SNES", "evolvable_object": "robot", "fitness_function": "identify_leader",
            "population_size": 10, "generations": 1, "evaluation_steps": STEPS,
            "num_evaluations": 1,
            "populations": {"all": {
                "objects": ["synapses:weights:all"], "min_vals": 0, "max_vals": largest
            }}
        },
        "world": {"objects": {
            "robot": {
                "type": "robot", "num_instances": 1, "controller": "neural_controller",
                "sensors": {"ground_sensor": {}}, "actuators": {"led_actuator": {}},
                "initializers": {"positions": {
                    "name": "fixed", "params": {"values": [[500, 500]]}
                }}
            },
            "area": {
                "type": "ground_area", "num_instances": 1,
                "initializers": {"positions": {
                    "name": "fixed", "params": {"values": [[500, 500]]}
                }}
            }
        }}
    });
    let (config, _) = ExperimentConfig::from_json(&file.to_string(), "neurons", ALGORITHMS)?;
    let simulation = Simulation::compile(&config)?;
    let rate = |point: u32| {
        let gene = f64::from(point) / f64::from(N_POINTS);
        let mut n_spikes = 0.0;
        simulation.simulate(&[gene], 0, 0, &mut |step| {
            if step.step >= SETTLING {
                n_spikes += step.robots[0].activity[0] * f64::from(TIME_SCALE);
            }
        })?;
        let seconds = f64::from((STEPS - SETTLING) * TIME_SCALE) / 1000.0;
        Ok((gene * largest, n_spikes / seconds))
    };
    (0..=N_POINTS).map(rate).collect()
}

/// One curve with its axes, at `x`.
fn panel(x: f64, name: &str, largest: f64, rates: &[(f64, f64)]) -> String {
    const LEFT: f64 = 42.0;
    const TOP: f64 = 30.0;
    const WIDTH: f64 = 135.0;
    const HEIGHT: f64 = 140.0;
    let highest = rates.iter().map(|(_, rate)| *rate).fold(0.0, f64::max);
    let top = (highest / 50.0).ceil().max(1.0) * 50.0;
    let (left, bottom, right) = (x + LEFT, TOP + HEIGHT, x + LEFT + WIDTH);
    let points = rates.iter().fold(String::new(), |mut points, (current, rate)| {
        let (x, y) = (left + WIDTH * current / largest, bottom - HEIGHT * rate / top);
        let _ = write!(points, "{x:.1},{y:.1} ");
        points
    });
    format!(
        "<text x=\"{middle}\" y=\"18\" text-anchor=\"middle\" font-weight=\"bold\">{name}</text>\n\
         <path d=\"M{left},{TOP}V{bottom}H{right}\" fill=\"none\" stroke=\"black\"/>\n\
         <text x=\"{end}\" y=\"{TOP}\" dy=\"4\" text-anchor=\"end\">{top}</text>\n\
         <text x=\"{end}\" y=\"{bottom}\" text-anchor=\"end\">0 Hz</text>\n\
         <text x=\"{left}\" y=\"{below}\" text-anchor=\"middle\">0</text>\n\
         <text x=\"{right}\" y=\"{below}\" text-anchor=\"middle\">{largest}</text>\n\
         <text x=\"{middle}\" y=\"{label}\" text-anchor=\"middle\">current I</text>\n\
         <polyline points=\"{points}\" fill=\"none\" stroke=\"#0b6\" stroke-width=\"1.8\"/>\n",
        middle = left + WIDTH / 2.0,
        end = left - 4.0,
        below = bottom + 15.0,
        label = bottom + 30.0,
        points = points.trim_end(),
    )
}
