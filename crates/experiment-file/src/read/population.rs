//! Reads one entry of `algorithm.populations`.

use super::node::{Node, Object};
use crate::algorithm::GENETIC_KEYS;
use crate::parameters::{self, Keys};
use crate::semantics::Semantics;
use crate::{
    AlgorithmDescription, GenotypeQuery, Params, PopulationConfig, SynapseSelector, limits,
};

/// How the parameters of a population are read.
#[derive(Clone, Copy)]
pub(super) enum ParamsReader {
    /// By the algorithm's description.
    Of(&'static AlgorithmDescription),
    /// They are kept unchanged, because they were checked before.
    Unchecked,
    /// They are skipped, because they depend on the algorithm, whose name is unreadable.
    Skip,
}

pub(super) fn population(o: &mut Object<'_>, params: ParamsReader) -> PopulationConfig {
    let objects = o.required("objects").list(1..=limits::ENTRIES);
    let objects: Vec<_> = objects.into_iter().map(query).collect();
    PopulationConfig {
        max_vals: bounds(o.required("max_vals"), objects.len()),
        min_vals: bounds(o.required("min_vals"), objects.len()),
        params: match params {
            ParamsReader::Of(algorithm) => described(o, algorithm),
            ParamsReader::Unchecked => unchecked(o.required("params")),
            ParamsReader::Skip => {
                o.accept_rest();
                Params::default()
            }
        },
        objects,
    }
}

fn query(node: Node<'_>) -> GenotypeQuery {
    node.parsed().unwrap_or(GenotypeQuery::Weights(SynapseSelector::All))
}

/// One bound per query; a single one serves all.
fn bounds(node: Node<'_>, n_queries: usize) -> Vec<f64> {
    if node.is_list() {
        let lengths = if n_queries == 0 { 0..=limits::ENTRIES } else { n_queries..=n_queries };
        node.list(lengths).into_iter().map(Node::quantity).collect()
    } else {
        vec![node.quantity(); n_queries]
    }
}

fn unchecked(node: Node<'_>) -> Params {
    let mut params = Params::default();
    for (key, value) in node.map(0, |_, node| node.parameter()) {
        params.set(&key, value);
    }
    params
}

fn described(o: &mut Object<'_>, algorithm: &'static AlgorithmDescription) -> Params {
    match o.optional("params") {
        None => params_of(&mut Places { inner: None, outer: o }, algorithm),
        Some(node) => {
            node.object(|inner| params_of(&mut Places { inner: Some(inner), outer: o }, algorithm))
        }
    }
}

fn params_of(o: &mut Places<'_, '_>, algorithm: &'static AlgorithmDescription) -> Params {
    if let Some(encoding) = o.optional("encoding") {
        encoding.one_of(&["real"], &[]);
    }
    // SpikeSwarmSim fills these in for every algorithm.
    for key in GENETIC_KEYS.into_iter().filter(|key| !algorithm.has(key)) {
        o.ignored(key, "only the genetic algorithm has it");
    }
    let read = parameters::params(o, algorithm.parameters, Semantics::Thesis, &[]);
    // The canonical form omits values that the algorithm computes, and defaults of recent keys.
    let values = algorithm.parameters.iter().filter_map(|key| Some((key, read.get(key)?)));
    values.fold(Params::default(), |params, (key, value)| params.with_canonical(key, value))
}

/// The two places of an algorithm's parameters: `params`, or the population
/// itself (section 4.3).
struct Places<'o, 'a> {
    inner: Option<&'o mut Object<'a>>,
    outer: &'o mut Object<'a>,
}

impl<'a> Keys<'a> for Places<'_, 'a> {
    fn optional(&mut self, key: &'static str) -> Option<Node<'a>> {
        let inner = self.inner.as_mut().and_then(|inner| inner.optional(key));
        let outer = self.outer.optional(key);
        if let (Some(_), Some(outer)) = (&inner, &outer) {
            outer.problem("`params` has the same key");
        }
        inner.or(outer)
    }

    fn required(&mut self, key: &'static str) -> Node<'a> {
        self.optional(key).unwrap_or_else(|| match &mut self.inner {
            Some(inner) => inner.required(key),
            None => self.outer.required(key),
        })
    }

    fn problem(&self, key: &str, message: String) {
        self.inner.as_deref().unwrap_or(self.outer).problem(key, message);
    }
}

impl Places<'_, '_> {
    fn ignored(&mut self, key: &'static str, why: &str) {
        if let Some(inner) = &mut self.inner {
            inner.ignored(key, why);
        }
        self.outer.ignored(key, why);
    }
}
