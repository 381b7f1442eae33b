//! The wireless link (section 3.3): frames, quantisation, reception.

use std::f64::consts::{PI, TAU};

use experiment_file::{SendingDirection, WirelessTransmitterConfig};

use super::robot::Robot;
use super::torus::{Torus, Vector, angular_difference, sector_direction};

/// The frame that a robot emits.
#[derive(Clone, Debug)]
pub struct Frame {
    pub message: Vec<f64>,
    /// `None`: a relaying robot had nothing to relay.
    pub originator: Option<usize>,
    pub hops: u32,
    /// Sending direction of the originator. The frame carries it from the second hop on; before
    /// that, the receiver observes it.
    pub original_direction: Option<Vector>,
}

/// A frame as its receiver perceives it.
#[derive(Clone, Debug)]
pub struct Reception {
    pub message: Vec<f64>,
    pub originator: usize,
    pub hops: u32,
    /// Strength, exp(-lr * rho - lp * phi_j).
    pub signal: f64,
    /// (cos, sin) of the receiving sector in the receiver's own frame.
    pub receiving_direction: Vector,
    /// (cos, sin) of the sending sector, of the emitter or of the originator.
    pub sending_direction: Vector,
    /// (cos, sin) of the originator's sector that faced the first robot to hear it.
    pub original_direction: Vector,
    /// Number of sectors that held a valid frame.
    pub n_candidates: usize,
}

impl Frame {
    /// Send mode: own message, first hop.
    pub fn sent(message: Vec<f64>, originator: usize) -> Self {
        Self { message, originator: Some(originator), hops: 1, original_direction: None }
    }

    /// Relay mode: a copy of the frame received in this step, with one more hop.
    pub fn relayed(received: Option<&Reception>, msg_length: usize) -> Self {
        match received {
            Some(reception) => Self {
                message: reception.message.clone(),
                originator: Some(reception.originator),
                hops: reception.hops + 1,
                original_direction: Some(reception.original_direction),
            },
            None => Self {
                message: vec![0.0; msg_length],
                originator: None,
                hops: 1,
                original_direction: None,
            },
        }
    }
}

/// Eq. 3.13: the lattice of K levels per component in row-major order, the last
/// component fastest; K = round(M*^(1/M)).
fn lattice(msg_length: u32, n_symbols: u32) -> Vec<Vec<f64>> {
    let n_levels = f64::from(n_symbols).powf(1.0 / f64::from(msg_length)).round();
    let mut points = vec![vec![]];
    for _ in 0..msg_length {
        let mut longer = Vec::new();
        for point in points {
            for level in 0..n_levels as u32 {
                let mut point: Vec<f64> = point.clone();
                point.push(f64::from(level) / (n_levels - 1.0));
                longer.push(point);
            }
        }
        points = longer;
    }
    points
}

/// Algorithm 4: a symbol drawn from softmax(beta * (1 - d / sqrt(M))), d being
/// the Euclidean distances to the lattice points. `uniform` chooses.
pub fn quantise(message: &[f64], config: &WirelessTransmitterConfig, uniform: f64) -> Vec<f64> {
    let symbols = lattice(config.msg_length, config.n_symbols);
    let distances: Vec<f64> = symbols
        .iter()
        .map(|symbol| {
            let squares = symbol.iter().zip(message).map(|(s, m)| (m.clamp(0.0, 1.0) - s).powi(2));
            squares.sum::<f64>().sqrt()
        })
        .collect();
    let least = distances.iter().copied().fold(f64::INFINITY, f64::min);
    let root_m = f64::from(config.msg_length).sqrt();
    let weights: Vec<f64> =
        distances.iter().map(|d| (-config.beta * (d - least) / root_m).exp()).collect();
    symbols[draw(&weights, uniform)].clone()
}

/// Inverse CDF: the smallest i with w_0 + ... + w_i > u * total.
pub fn draw(weights: &[f64], uniform: f64) -> usize {
    let total: f64 = weights.iter().sum();
    let mut cumulative = 0.0;
    for (i, weight) in weights.iter().enumerate() {
        cumulative += weight;
        if cumulative > uniform * total {
            return i;
        }
    }
    weights.len() - 1
}

/// Section 3.3.2: the frame that robot `receiver` takes from the air, if any. `uniform` chooses
/// among the sectors with a valid frame.
pub fn receive(
    receiver: usize,
    robots: &[Robot<'_>],
    torus: Torus,
    uniform: f64,
) -> Option<Reception> {
    let own = &robots[receiver];
    let config = own.config.sensors.wireless_receiver.as_ref()?;
    let mut candidates = Vec::new();
    for j in 0..config.n_sectors {
        let sector = sector_direction(own.antenna_heading(), j, config.n_sectors);
        let mut strongest: Option<(f64, usize, &Frame)> = None;
        for (emitter, robot) in robots.iter().enumerate() {
            let Some(frame) = &robot.on_air else { continue };
            if emitter == receiver {
                continue;
            }
            let rho = torus.distance(own.position, robot.position);
            let phi = angular_difference(sector, torus.bearing(own.position, robot.position));
            let reach = (own.radio_range() * config.range)
                .min(robot.radio_range() * robot.transmitter().range);
            if rho > reach || phi > PI / f64::from(config.n_sectors) {
                continue;
            }
            let strength = (-config.decay_rho * rho - config.decay_phi * phi).exp();
            if strongest.is_none_or(|(best, ..)| strength > best) {
                strongest = Some((strength, emitter, frame));
            }
        }
        if let Some((signal, emitter, frame)) = strongest
            && let Some(originator) = frame.originator
            && originator != receiver
            && frame.hops < config.max_hops
        {
            candidates.push((j, signal, emitter, frame, originator));
        }
    }
    if candidates.is_empty() {
        return None;
    }
    let n_candidates = candidates.len();
    let chosen = ((uniform * n_candidates as f64).floor() as usize).min(n_candidates - 1);
    let (j, signal, emitter, frame, originator) = candidates[chosen];
    let observed = observed_sending_direction(&robots[emitter], own.position, torus);
    let original_direction = frame.original_direction.unwrap_or(observed);
    Some(Reception {
        message: frame.message.clone(),
        originator,
        hops: frame.hops,
        signal,
        receiving_direction: unit(f64::from(j) * TAU / f64::from(config.n_sectors)),
        sending_direction: match config.sending_direction {
            SendingDirection::Emitter => observed,
            SendingDirection::Originator => original_direction,
        },
        original_direction,
        n_candidates,
    })
}

/// (cos, sin) of the emitter's sector whose direction is nearest to the bearing of the receiver,
/// in the emitter's own frame of reference; the lower sector wins ties.
fn observed_sending_direction(emitter: &Robot<'_>, receiver: Vector, torus: Torus) -> Vector {
    let n = emitter.n_receiver_sectors();
    let bearing = torus.bearing(emitter.position, receiver);
    let mut facing = 0;
    let mut least = f64::INFINITY;
    for s in 0..n {
        let difference =
            angular_difference(sector_direction(emitter.antenna_heading(), s, n), bearing);
        if difference < least {
            least = difference;
            facing = s;
        }
    }
    unit(f64::from(facing) * TAU / f64::from(n))
}

fn unit(angle: f64) -> Vector {
    [angle.cos(), angle.sin()]
}

#[test]
fn at_beta_100_the_quantiser_picks_the_nearest_symbol() {
    let config = WirelessTransmitterConfig {
        range: 100.0,
        msg_length: 2,
        quantize: true,
        n_symbols: 16,
        beta: 100.0,
        ..Default::default()
    };
    let points = lattice(2, 16);
    assert_eq!(points.len(), 16);
    assert_eq!(points[6], [1.0 / 3.0, 2.0 / 3.0]);
    assert_eq!([lattice(1, 16).len(), lattice(3, 16).len()], [16, 27]);
    for uniform in [0.001, 0.5, 0.999] {
        assert_eq!(quantise(&[0.35, 0.70], &config, uniform), points[6]);
        assert_eq!(quantise(&[1.7, -0.2], &config, uniform), [1.0, 0.0]);
    }
    let noisy = WirelessTransmitterConfig { beta: 0.0, ..config };
    assert_eq!(quantise(&[0.35, 0.70], &noisy, 3.5 / 16.0), [0.0, 1.0]);
}
