//! Reads `algorithm`.

use super::Algorithms;
use super::node::{Node, Object};
use super::population::{ParamsReader, population};
use crate::semantics::Semantics;
use crate::{AlgorithmConfig, FitnessFunction, limits, parameters};

/// `has_task`: whether the file has a task of its own, which computes the fitness unless a
/// function is named.
pub(super) fn algorithm(
    o: &mut Object<'_>,
    algorithms: Algorithms,
    has_task: bool,
) -> AlgorithmConfig {
    let name = o.required("name");
    let (name, params) = match algorithms {
        Algorithms::Unchecked => (name.name(), ParamsReader::Unchecked),
        Algorithms::Described(known) => {
            let names: Vec<&str> = known.iter().map(|algorithm| algorithm.name).collect();
            let name = name.one_of(&names, &[]).unwrap_or_default();
            let params = algorithms.find(name).map_or(ParamsReader::Skip, ParamsReader::Of);
            (name.to_owned(), params)
        }
    };
    AlgorithmConfig {
        name,
        evolvable_object: o.required("evolvable_object").name(),
        population_size: o.required("population_size").u32(1..=limits::POPULATION),
        generations: o.required("generations").u64(1..=limits::GENERATIONS),
        evaluation_steps: o.required("evaluation_steps").u32(1..=limits::STEPS),
        num_evaluations: o.required("num_evaluations").u32(1..=limits::TRIALS),
        fitness_function: if has_task {
            o.or("fitness_function", FitnessFunction::Script, fitness_function)
        } else {
            fitness_function(o.required("fitness_function"))
        },
        fitness_params: parameters::inner(o, "fitness_params", Semantics::Thesis, &[]),
        target_fitness: o.optional("target_fitness").map(Node::quantity),
        champion_every: o.or("champion_every", 10, |node| node.u64(1..=limits::GENERATIONS)),
        champion_trials: o.or("champion_trials", 50, |node| node.u32(1..=limits::TRIALS)),
        judgement_trials: o.or("judgement_trials", 200, |node| node.u32(1..=limits::TRIALS)),
        populations: o
            .required("populations")
            .map(1, |_, node| node.object(|o| population(o, params))),
    }
}

fn fitness_function(node: Node<'_>) -> FitnessFunction {
    node.variant(&[]).unwrap_or(FitnessFunction::Grouping)
}
