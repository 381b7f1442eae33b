//! Plasticity.

use serde_json::{Value, json};

use super::{Dice, insert, object};

/// `learning`, and the names of its plastic groups.
pub(super) fn learning(dice: &mut Dice, groups: &[String]) -> (Value, Vec<String>) {
    let keys = [
        ("learning_rate", dice.number(0.0, 1.0)),
        ("max_weight", dice.number(0.0, 1e6)),
        ("A", dice.number(-1e6, 1e6)),
        ("B", dice.number(-1e6, 1e6)),
        ("C", dice.number(-1e6, 1e6)),
        ("D", dice.number(-1e6, 1e6)),
    ];
    let mut learning = object(dice, keys);
    if dice.chance(0.5) {
        let keys = [("delay", json!(dice.die(20))), ("discount", dice.number(0.0, 1.0))];
        let reward = object(dice, keys);
        insert(&mut learning, "reward", reward);
    } else if dice.chance(0.3) {
        insert(&mut learning, "reward", json!(null));
    }
    let mut plastic = dice.some(groups);
    if plastic.is_empty() {
        plastic = groups.to_vec();
    } else {
        let is_one = plastic.len() == 1 && dice.chance(0.5);
        let names = if is_one { json!(plastic[0]) } else { json!(plastic) };
        insert(&mut learning, "synapses", names);
    }
    (learning, plastic)
}
