//! Encoders of stimuli.

use serde_json::{Value, json};

use super::{Dice, insert, object};

/// An entry of `encoding` for a stimulus of `n` values.
pub(super) fn entry(dice: &mut Dice, n: usize, time_scale: usize) -> Value {
    let scheme = if n <= time_scale && dice.chance(0.3) {
        "RankOrderCoding"
    } else {
        dice.pick(&["LIF_Encoding", "PoissonRateCoding"])
    };
    // Rank order may not have more nodes, over all values, than substeps.
    let n_neurons = if scheme == "RankOrderCoding" { time_scale / n } else { 3 };
    let n_neurons = dice.die(n_neurons.min(3));
    let name = dice.pick(&[
        "identity_receptive_field",
        "gaussian_receptive_field",
        "triangular_receptive_field",
        "conic_receptive_field",
        "parabolic_receptive_field",
        "linear_receptive_field",
    ]);
    let mut params = json!({});
    if name != "identity_receptive_field" {
        insert(&mut params, "n_neurons", json!(n_neurons));
    }
    if !["identity_receptive_field", "linear_receptive_field"].contains(&name) {
        let [low, high] = match scheme {
            "LIF_Encoding" => [-1e6, 1e6],
            "PoissonRateCoding" => [0.0, 10_000.0],
            _ => [1.0, time_scale as f64],
        };
        let middle = (low + high) / 2.0 + if scheme == "LIF_Encoding" { 16.0 } else { 0.0 };
        let (min_val, max_val) = (dice.number(low, middle), dice.number(middle, high));
        let (min_stim, max_stim) = (dice.number(-1e6, 0.0), dice.number(1.0, 1e6));
        let inverted = json!(dice.chance(0.5));
        let steepness = if name == "gaussian_receptive_field" { "sigma" } else { "slope" };
        let k = dice.number(0.0, 1e6);
        let keys = [
            ("min_stim", min_stim),
            ("max_stim", max_stim),
            ("inverted", inverted),
            (steepness, k),
        ];
        if scheme == "LIF_Encoding" || dice.chance(0.7) {
            insert(&mut params, "min_val", min_val);
            insert(&mut params, "max_val", max_val);
        }
        for (key, value) in object(dice, keys).as_object().unwrap() {
            insert(&mut params, key, value.clone());
        }
    }
    let mut field = object(dice, [("params", params.clone())]);
    if name != "gaussian_receptive_field" || dice.chance(0.5) {
        insert(&mut field, "name", json!(name));
    }
    // The default current of LIF nodes is too small, and by default a field has only one node per
    // value.
    if scheme != "PoissonRateCoding" {
        insert(&mut field, "params", params);
    }
    json!({"scheme": scheme, "receptive_field": field})
}
