//! Random experiment files: every key, variant and form of the format, in valid combinations, and
//! ways to damage them.

mod algorithm;
mod bodies;
mod encoding;
mod learning;
mod network;
mod world;

use algorithm::algorithm;
use bodies::add_bodies;
use network::Network;
use serde_json::{Map, Value, json};
use world::Robot;

use determinism::random::{Purpose, Stream};

/// The random choices for one file.
pub(super) struct Dice(Stream);

impl Dice {
    pub(super) fn new(index: u64) -> Self {
        Self(Stream::new(0, index, 0, Purpose::Evolution, 0))
    }

    fn below(&mut self, n: usize) -> usize {
        self.0.below(n)
    }

    /// A random number in 1..=n.
    fn die(&mut self, n: usize) -> usize {
        1 + self.below(n)
    }

    pub(super) fn chance(&mut self, p: f64) -> bool {
        self.0.bernoulli(p)
    }

    fn pick<'a, T: ?Sized>(&mut self, choices: &[&'a T]) -> &'a T {
        choices[self.below(choices.len())]
    }

    /// A number of few digits, as people write them.
    fn number(&mut self, low: f64, high: f64) -> Value {
        let number = low + (high - low) * self.0.uniform();
        json!((number * 1000.0).round() / 1000.0)
    }

    /// A random subset of the choices.
    fn some<T: Clone>(&mut self, choices: &[T]) -> Vec<T> {
        choices.iter().filter(|_| self.chance(0.5)).cloned().collect()
    }
}

/// An object with some of the optional keys.
fn object<const N: usize>(dice: &mut Dice, optional: [(&str, Value); N]) -> Value {
    let keys = optional.into_iter().filter(|_| dice.chance(0.5));
    keys.map(|(key, value)| (key.to_owned(), value)).collect::<Map<_, _>>().into()
}

fn insert(object: &mut Value, key: &str, value: Value) {
    object[key] = value;
}

/// A valid experiment file.
pub(super) fn experiment(dice: &mut Dice) -> Value {
    let share_of_spiking = 0.4;
    experiment_with(dice, share_of_spiking)
}

/// A valid experiment file with spiking neurons.
pub(super) fn spiking_experiment(dice: &mut Dice) -> Value {
    experiment_with(dice, 1.0)
}

fn experiment_with(dice: &mut Dice, share_of_spiking: f64) -> Value {
    let robot = Robot::new(dice);
    let network = Network::new(dice, &robot, share_of_spiking);
    let semantics = json!(dice.pick(&["thesis", "original"]));
    let mut file = object(
        dice,
        [
            ("name", json!("generated")),
            ("checkpoint_file", json!("chk")),
            ("seed", json!(u64::MAX)),
            ("semantics", semantics),
        ],
    );
    insert(&mut file, "algorithm", algorithm(dice, &robot, &network));
    insert(&mut file, "world", robot.world(dice));
    insert(&mut file, "topology", network.topology);
    if dice.chance(0.25) {
        add_bodies(dice, &mut file["world"]);
    }
    file
}

/// Damages a file a little, or changes it to another valid file.
pub(super) fn damage(dice: &mut Dice, value: &mut Value) {
    match value {
        Value::Object(map) if !map.is_empty() && dice.chance(0.95) => {
            let key = map.keys().nth(dice.below(map.len())).unwrap().clone();
            match dice.below(20) {
                0 => drop(map.remove(&key)),
                1 => {
                    let inner = map.remove(&key).unwrap();
                    map.insert(format!("{key}s"), inner);
                }
                2 => drop(map.insert("unheard_of".to_owned(), json!(1))),
                _ => damage(dice, map.get_mut(&key).unwrap()),
            }
        }
        Value::Array(list) if !list.is_empty() && dice.chance(0.9) => {
            let index = dice.below(list.len());
            match dice.below(10) {
                0 => drop(list.remove(index)),
                1 => list.push(list[index].clone()),
                _ => damage(dice, &mut list[index]),
            }
        }
        _ => {
            *value = match dice.below(12) {
                0 => json!(null),
                1 => json!(true),
                2 => json!(0),
                3 => json!(-1),
                4 => json!(1e300),
                5 => json!(u64::MAX),
                6 => json!(0.5),
                7 => json!(2),
                8 => json!("H0"),
                9 => json!("all"),
                10 => json!([]),
                _ => json!({}),
            };
        }
    }
}
