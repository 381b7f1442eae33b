//! Reads `topology.learning`.

use super::node::{Node, Object};
use crate::{LearningConfig, RewardConfig, limits};

/// `groups`: names of all groups of synapses.
pub(super) fn learning(
    o: &mut Object<'_>,
    is_spiking: bool,
    groups: impl Iterator<Item = String>,
) -> LearningConfig {
    let coefficient = |o: &mut Object<'_>, key: &'static str, default: f64| {
        o.or(key, default, |node| node.number(-limits::COEFFICIENT..=limits::COEFFICIENT))
    };
    let max_weight = if is_spiking { 1_000.0 } else { 10.0 };
    LearningConfig {
        learning_rate: o.or("learning_rate", 1e-4, Node::probability),
        max_weight: o
            .or("max_weight", max_weight, |node| node.number(0.0..=limits::PLASTIC_WEIGHT)),
        a: coefficient(o, "A", 1.0),
        b: coefficient(o, "B", 0.0),
        c: coefficient(o, "C", 0.0),
        d: coefficient(o, "D", 0.0),
        synapses: o.optional("synapses").map_or_else(|| groups.collect(), Node::names),
        reward: o.optional("reward").and_then(|node| node.or_null(|node| node.object(reward))),
    }
}

fn reward(o: &mut Object<'_>) -> RewardConfig {
    RewardConfig {
        delay: o.or("delay", 30, |node| node.u32(1..=limits::REWARD_DELAY)),
        discount: o.or("discount", 0.9, Node::probability),
    }
}
