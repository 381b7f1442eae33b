//! Rate neurons as operations on tables with a row per robot and a column per neuron.

use std::f64::consts::LN_2;

use experiment_file::Activation;
use sim_core::blueprint::{Link, RateNeurons, RateRow};

use crate::builder::Builder;

/// The state of neurons without learning: exponents and activities.
pub struct State {
    /// Exponents of the natural activation functions, `[robots, neurons]`.
    exponents: String,
    /// Activities, `[robots, neurons]`.
    pub activities: String,
}

/// The row of each neuron.
fn rows(neurons: &RateNeurons) -> impl Iterator<Item = &RateRow> {
    neurons.rows_of.iter().map(|&row| &neurons.rows[row])
}

/// The blueprint's activation functions are of powers of two, 1 / (1 + 2^y) and
/// (2^y - 1) / (2^y + 1). Those of ONNX take this multiple of y.
fn scale(row: &RateRow) -> f64 {
    match row.activation {
        Activation::Sigmoid => -LN_2,
        Activation::Tanh => 0.5 * LN_2,
    }
}

fn scaled(row: &RateRow, value: f32) -> f32 {
    (scale(row) * f64::from(value)) as f32
}

/// The state before the first step, as a row.
pub fn start(neurons: &RateNeurons) -> Vec<f32> {
    let exponents: Vec<f32> = rows(neurons).map(|row| scaled(row, row.start)).collect();
    let activities: Vec<f32> = rows(neurons)
        .zip(&exponents)
        .map(|(row, &y)| match (neurons.start_active, row.activation) {
            (false, _) => 0.0,
            (true, Activation::Sigmoid) => (1.0 / (1.0 + libm::exp(-f64::from(y)))) as f32,
            (true, Activation::Tanh) => libm::tanh(y.into()) as f32,
        })
        .collect();
    [exponents, activities].concat()
}

/// One step: from a state `[robots, 2 neurons]` and inputs `[robots, inputs]` to the next state.
pub fn advance(
    graph: &mut Builder,
    neurons: &RateNeurons,
    n_substeps: u32,
    state: &str,
    inputs: Option<(&str, usize)>,
) -> State {
    let n = neurons.rows_of.len();
    let halves = [0..n, n..2 * n].map(|half| graph.columns(state, half));
    let of_rows = |value: fn(&RateRow) -> f32| rows(neurons).map(value).collect::<Vec<_>>();
    let retention = graph.floats(&[n], &of_rows(|row| row.retention));
    let bias = graph.floats(&[n], &of_rows(|row| scaled(row, row.drive)));
    let drive = match inputs {
        Some((inputs, n_inputs)) => {
            let weights = matrix(neurons, n_inputs, |row| &row.afferent, Some);
            let weights = graph.floats(&[n_inputs, n], &weights);
            graph.op("Gemm", &[inputs, &weights, &bias])
        }
        None => bias,
    };
    let mut neuron_of = vec![None; neurons.rows.len()];
    for (neuron, &row) in neurons.rows_of.iter().enumerate() {
        neuron_of[row] = Some(neuron);
    }
    let weights = matrix(neurons, n, |row| &row.recurrent, |row| neuron_of[row]);
    let is_recurrent = weights.iter().any(|&weight| weight != 0.0);
    let weights = is_recurrent.then(|| graph.floats(&[n, n], &weights));
    let is_tanh: Vec<bool> = rows(neurons).map(|row| row.activation == Activation::Tanh).collect();
    let [exponents, activities] =
        graph.repeat(n_substeps, halves, [n, n], |graph, [exponents, activities]| {
            let sum = match &weights {
                Some(weights) => graph.op("Gemm", &[&activities, weights, &drive]),
                None => drive.clone(),
            };
            let kept = graph.op("Mul", &[&exponents, &retention]);
            let exponents = graph.op("Add", &[&kept, &sum]);
            let activities = activate(graph, &is_tanh, &exponents);
            [exponents, activities]
        });
    State { exponents, activities }
}

impl State {
    /// As one table.
    pub fn put(&self, graph: &mut Builder, name: &str) {
        graph.put("Concat", &[&self.exponents, &self.activities], Some(1), name);
    }
}

/// Weights, `[source, neuron]`. `source`: the source of a link.
fn matrix(
    neurons: &RateNeurons,
    n_sources: usize,
    links: impl Fn(&RateRow) -> &Vec<Link>,
    source: impl Fn(usize) -> Option<usize>,
) -> Vec<f32> {
    let n = neurons.rows_of.len();
    let mut sums = vec![0.0; n_sources * n];
    for (neuron, row) in rows(neurons).enumerate() {
        for link in links(row) {
            // A row without a neuron is never active.
            if let Some(source) = source(link.other) {
                sums[source * n + neuron] += scale(row) * f64::from(link.weight);
            }
        }
    }
    sums.into_iter().map(|sum: f64| sum as f32).collect()
}

fn activate(graph: &mut Builder, is_tanh: &[bool], exponents: &str) -> String {
    match (is_tanh.contains(&false), is_tanh.contains(&true)) {
        (true, true) => {
            let [sigmoid, tanh] = ["Sigmoid", "Tanh"].map(|kind| graph.op(kind, &[exponents]));
            // 1 for one of the two functions, 0 for the other.
            let mask = |of: bool| -> Vec<f32> {
                is_tanh.iter().map(|&is| f32::from(u8::from(is == of))).collect()
            };
            let [of_sigmoid, of_tanh] =
                [false, true].map(|of| graph.floats(&[is_tanh.len()], &mask(of)));
            let sigmoid = graph.op("Mul", &[&sigmoid, &of_sigmoid]);
            let tanh = graph.op("Mul", &[&tanh, &of_tanh]);
            graph.op("Add", &[&sigmoid, &tanh])
        }
        (_, true) => graph.op("Tanh", &[exponents]),
        _ => graph.op("Sigmoid", &[exponents]),
    }
}
