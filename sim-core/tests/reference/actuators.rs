//! Decodes activities to actions, and moves robots by their wheel actions.

use determinism::random::Stream;
use experiment_file::{ActuatorQuery, DecodingConfig, TopologyConfig, WheelActuatorConfig};

use super::communication::draw;
use super::network::neurons_of;
use super::robot::Robot;
use super::torus::{Torus, wrap_angle};

/// The actions of a robot in a step.
#[derive(Clone, Debug)]
pub struct Actions {
    /// Right and left, in [-1, 1].
    pub wheels: [f64; 2],
    /// Colour; 0 is off.
    pub led: u32,
    /// `None` if the network does not control the mode.
    pub send: Option<bool>,
    /// Before quantisation.
    pub message: Vec<f64>,
}

/// Decodes the activities of every output, in the order of `outputs`.
pub fn decode(
    topology: &TopologyConfig,
    activities: &[f64],
    msg_length: usize,
    stream: &mut Stream,
) -> Actions {
    let mut actions =
        Actions { wheels: [0.0, 0.0], led: 0, send: None, message: vec![0.0; msg_length] };
    for (name, output) in &topology.outputs {
        let neurons = neurons_of(topology, &output.ensemble).expect("outputs name an ensemble");
        let values = decode_output(topology.decoding[name], &activities[neurons], stream);
        match output.actuator {
            ActuatorQuery::Wheels => {
                let [right, left] = match values[..] {
                    [w] => [w, -w],
                    [right, left] => [right, left],
                    _ => panic!("wheels have one or two neurons"),
                };
                actions.wheels = [right.clamp(-1.0, 1.0), left.clamp(-1.0, 1.0)];
            }
            ActuatorQuery::Led => actions.led = category(&values),
            ActuatorQuery::Mode => actions.send = Some(category(&values) > 0),
            ActuatorQuery::Message => actions.message = values,
        }
    }
    actions
}

fn decode_output(decoding: DecodingConfig, u: &[f64], stream: &mut Stream) -> Vec<f64> {
    match decoding {
        DecodingConfig::IdentityDecoding {} => u.to_vec(),
        DecodingConfig::ThresholdDecoding { stochastic: false } => {
            u.iter().map(|&u| if u >= 0.5 { 1.0 } else { 0.0 }).collect()
        }
        DecodingConfig::ThresholdDecoding { stochastic: true } => {
            u.iter().map(|&u| if stream.uniform() < u { 1.0 } else { 0.0 }).collect()
        }
        DecodingConfig::SoftmaxDecoding {} => {
            let largest = u.iter().copied().fold(f64::NEG_INFINITY, f64::max);
            let weights: Vec<f64> = u.iter().map(|u| (u - largest).exp()).collect();
            vec![draw(&weights, stream.uniform()) as f64]
        }
        _ => panic!("rate neurons have no spikes to decode"),
    }
}

/// A bit, or the number of a category.
fn category(values: &[f64]) -> u32 {
    match values {
        &[value] => value as u32,
        _ => panic!("the LED and the mode take one value"),
    }
}

/// Eq. 3.3-3.6: motion on an arc during one environment step, straight in the
/// limit.
pub fn drive(robot: &mut Robot<'_>, config: &WheelActuatorConfig, torus: Torus) {
    let factors = robot.reality.as_ref().map_or([1.0; 2], |reality| reality.wheel_factors);
    let [v_right, v_left] = [0, 1].map(|i| robot.wheels[i] * factors[i] * config.max_speed);
    let v = (v_right + v_left) / 2.0;
    let omega = (v_right - v_left) / config.axle_length;
    let dk = config.step_duration;
    let [x, y] = robot.position;
    let theta = robot.heading;
    let turned = theta + omega * dk;
    let moved = if omega.abs() < 1e-9 {
        [x + v * dk * theta.cos(), y + v * dk * theta.sin()]
    } else {
        let radius = v / omega;
        [x + radius * (turned.sin() - theta.sin()), y - radius * (turned.cos() - theta.cos())]
    };
    robot.position = torus.wrap(moved);
    robot.heading = wrap_angle(turned);
}
