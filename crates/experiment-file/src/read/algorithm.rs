//! Reads `algorithm`.

use super::Algorithms;
use super::node::Object;
use super::population::{ParamsReader, population};
use crate::semantics::Semantics;
use crate::{AlgorithmConfig, FitnessFunction, parameters};

/// `has_task`: whether the file has a task of its own, which computes the fitness unless the file
/// names a function.
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
    let mut given = vec![("name", name.into())];
    if has_task {
        given.push(("fitness_function", FitnessFunction::Script.into()));
    } else if !o.has("fitness_function") {
        o.required("fitness_function");
        given.push(("fitness_function", FitnessFunction::Grouping.into()));
    }
    let algorithm: AlgorithmConfig = parameters::read(o, Semantics::Thesis, &given);
    let populations =
        o.required("populations").map(1, |_, node| node.object(|o| population(o, params)));
    AlgorithmConfig { populations, ..algorithm }
}
