//! Controllers as graphs of ONNX, for runtimes of neural networks.
//!
//! [`export`] writes one step of the environment, of any number of robots: `rate` the neurons,
//! `decisions` what robots do, `builder` operations, `proto` the file. Runtimes add up in other
//! orders than the simulation, so that the bits differ.

mod builder;
mod decisions;
mod proto;
mod rate;

use controller_c::About;
use prost::Message as _;
use sim_core::blueprint::{Blueprint, Neurons};
use sim_core::{EvaluateError, FINGERPRINT, Simulation};

use builder::{Builder, table};
use proto::{ModelProto, OperatorSetIdProto, StringStringEntryProto};

/// The name of the file.
pub const NAME: &str = "controller.onnx";

/// Most weights of a graph, whose matrices also have places for synapses that do not exist.
const WEIGHTS_MAX: usize = 16_000_000;

/// Why a controller cannot be exported.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum ExportError {
    /// The robots have another controller.
    #[error(transparent)]
    NoNetwork(controller_c::ExportError),
    /// Spiking neurons.
    #[error("its neurons spike, and only rate neurons become a graph of ONNX: export it as C")]
    Spiking,
    /// Plastic weights.
    #[error(
        "its weights change while the robot lives, but those of ONNX are constant: export it as C"
    )]
    Plastic,
    /// The matrices are too large.
    #[error(
        "its {0} inputs and neurons need matrices of more than {WEIGHTS_MAX} weights: export it as C"
    )]
    TooLarge(usize),
    /// The genotype does not fit.
    #[error(transparent)]
    Evaluate(#[from] EvaluateError),
}

/// The controller that a genotype encodes, as the content of a file.
///
/// Inputs: `stimulus_NAME` `[robots, n]` for each stimulus, and `state` `[robots, s]`, which the
/// caller leaves out in the first step. Outputs: `next_state`, `activities` `[robots, neurons]`,
/// and `wheels`, `led`, `send` and `message`, as far as the network decides them; for drawn
/// decisions `led_probability` and the like.
///
/// # Errors
///
/// If the evolvable robots have no network, or one that ONNX cannot express.
pub fn export(
    simulation: &Simulation,
    genotype: &[f64],
    about: &About,
) -> Result<Vec<u8>, ExportError> {
    let blueprint = simulation.blueprint(genotype)?;
    let blueprint =
        blueprint.ok_or(ExportError::NoNetwork(controller_c::ExportError::NoNetwork))?;
    if blueprint.plasticity.is_some() {
        return Err(ExportError::Plastic);
    }
    let Neurons::Rate(neurons) = &blueprint.neurons else { return Err(ExportError::Spiking) };
    let n_neurons = neurons.rows_of.len();
    let n_inputs = blueprint.stimuli.last().map_or(0, |stimulus| stimulus.inputs.end);
    if (n_inputs + n_neurons).saturating_mul(n_neurons) > WEIGHTS_MAX {
        return Err(ExportError::TooLarge(n_inputs + n_neurons));
    }
    let mut graph = Builder::default();
    let names: Vec<String> =
        blueprint.stimuli.iter().map(|stimulus| format!("stimulus_{}", stimulus.name)).collect();
    let mut inputs: Vec<_> = names
        .iter()
        .zip(&blueprint.stimuli)
        .map(|(name, stimulus)| table(name.clone(), stimulus.inputs.len(), stimulus.sensor.name()))
        .collect();
    let start = rate::start(neurons);
    inputs.push(table("state".into(), start.len(), "next_state of the step before"));
    graph.default_row("state", &start);
    let stimuli = gather(&mut graph, &names);
    let state = match &stimuli {
        Some(stimuli) => for_each_robot(&mut graph, "state", stimuli),
        None => "state".into(),
    };
    let stimuli = stimuli.as_deref().map(|stimuli| (stimuli, n_inputs));
    let next = rate::advance(&mut graph, neurons, blueprint.n_substeps, &state, stimuli);
    next.put(&mut graph, "next_state");
    graph.put("Identity", &[&next.activities], None, "activities");
    let mut outputs = vec![
        table("next_state".into(), start.len(), "state of the next step"),
        table("activities".into(), n_neurons, "activities of all neurons, in the file's order"),
    ];
    outputs.extend(decisions::put(&mut graph, &blueprint, &next.activities));
    let graph = graph.finish(inputs, outputs);
    Ok(model(graph, about, &blueprint).encode_to_vec())
}

/// All stimuli side by side; `None` if there is none.
fn gather(graph: &mut Builder, names: &[String]) -> Option<String> {
    let names: Vec<&str> = names.iter().map(String::as_str).collect();
    match names[..] {
        [] => None,
        [name] => Some(name.to_owned()),
        _ => Some(graph.along("Concat", 1, &names)),
    }
}

/// A table with as many rows as another one, if it has a single row.
fn for_each_robot(graph: &mut Builder, table: &str, other: &str) -> String {
    let shape = graph.op("Shape", &[other]);
    let first = graph.numbers(&[0]);
    let n_robots = graph.along("Gather", 0, &[&shape, &first]);
    let one = graph.numbers(&[1]);
    let shape = graph.along("Concat", 0, &[&n_robots, &one]);
    graph.op("Expand", &[table, &shape])
}

fn model(graph: proto::GraphProto, about: &About, blueprint: &Blueprint) -> ModelProto {
    let fact = |key: &str, value: String| StringStringEntryProto { key: key.into(), value };
    let mut metadata_props = vec![
        fact("experiment", about.experiment.clone()),
        fact("controller", about.genotype.clone()),
        fact("config_digest", about.config_digest.clone()),
        fact("simulation", FINGERPRINT.into()),
    ];
    if let Some(seconds) = blueprint.step_duration {
        metadata_props.push(fact("step_duration", format!("{seconds} s")));
    }
    ModelProto {
        // Of ONNX 1.12, which has version 17 of the operators.
        ir_version: 8,
        opset_import: vec![OperatorSetIdProto { domain: String::new(), version: 17 }],
        producer_name: "swarmevo".into(),
        producer_version: env!("CARGO_PKG_VERSION").into(),
        doc_string: "One step of a robot's controller. Leave `state` out in the first step; then \
                     it is `next_state` of the step before."
            .into(),
        graph: Some(graph),
        metadata_props,
    }
}
