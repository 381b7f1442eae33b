//! Reads one entry of `algorithm.populations`.

use super::node::{Node, Object};
use crate::algorithm::GENETIC_KEYS;
use crate::schema::split;
use crate::{
    AlgorithmName, AlgorithmParams, CmaEsParams, CrossoverOperator, EnsembleSelector, GaParams,
    GenotypeQuery, MatingOperator, MutationOperator, NeuronParameter, OpenAiEsParams,
    PopulationConfig, SelectionOperator, SnesParams, XnesParams, limits,
};

/// `algorithm`: none if it is unreadable; then nobody can tell which parameters
/// are right.
pub(super) fn population(o: &mut Object<'_>, algorithm: Option<AlgorithmName>) -> PopulationConfig {
    let objects = o.required("objects").list(1..=limits::ENTRIES);
    let objects: Vec<_> = objects.into_iter().map(query).collect();
    PopulationConfig {
        max_vals: bounds(o.required("max_vals"), objects.len()),
        min_vals: bounds(o.required("min_vals"), objects.len()),
        params: match algorithm {
            Some(algorithm) => params(o, algorithm),
            None => {
                o.accept_rest();
                AlgorithmParams::Ga(GaParams::default())
            }
        },
        objects,
    }
}

fn query(node: Node<'_>) -> GenotypeQuery {
    node.parsed().unwrap_or(GenotypeQuery::Neurons(NeuronParameter::Bias, EnsembleSelector::All))
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

fn params(o: &mut Object<'_>, algorithm: AlgorithmName) -> AlgorithmParams {
    match o.optional("params") {
        None => params_of(&mut Places { inner: None, outer: o }, algorithm),
        Some(node) => {
            node.object(|inner| params_of(&mut Places { inner: Some(inner), outer: o }, algorithm))
        }
    }
}

fn params_of(o: &mut Places<'_, '_>, algorithm: AlgorithmName) -> AlgorithmParams {
    if let Some(encoding) = o.optional("encoding") {
        encoding.one_of(&["real"], &[]);
    }
    if algorithm != AlgorithmName::Ga {
        // The original fills these in for every algorithm.
        for key in split(GENETIC_KEYS) {
            o.ignored(key, "only the genetic algorithm has it");
        }
    }
    match algorithm {
        AlgorithmName::Ga => AlgorithmParams::Ga(ga(o)),
        AlgorithmName::Snes => AlgorithmParams::Snes(snes(o)),
        AlgorithmName::Xnes => AlgorithmParams::Xnes(xnes(o)),
        AlgorithmName::CmaEs | AlgorithmName::SepCmaEs => AlgorithmParams::CmaEs(cma_es(o)),
        AlgorithmName::OpenAiEs => AlgorithmParams::OpenAiEs(openai_es(o)),
    }
}

fn ga(o: &mut Places<'_, '_>) -> GaParams {
    let default = GaParams::default();
    GaParams {
        selection_operator: o.or("selection_operator", default.selection_operator, |node| {
            node.variant(&[]).unwrap_or(SelectionOperator::Tournament)
        }),
        tournament_size: o.or("tournament_size", default.tournament_size, |node| {
            node.u32(1..=limits::POPULATION)
        }),
        mating_operator: o.or("mating_operator", default.mating_operator, |node| {
            node.variant(&[]).unwrap_or(MatingOperator::Random)
        }),
        crossover_operator: o.or("crossover_operator", default.crossover_operator, |node| {
            node.variant(&["combination", "pcx"]).unwrap_or(CrossoverOperator::BlxAlpha)
        }),
        alpha: o.or("alpha", default.alpha, Node::amount),
        crossover_prob: o.or("crossover_prob", default.crossover_prob, Node::probability),
        mutation_operator: o.or("mutation_operator", default.mutation_operator, |node| {
            node.variant(&["bitflip", "categorical"]).unwrap_or(MutationOperator::Gaussian)
        }),
        mutation_prob: o.or("mutation_prob", default.mutation_prob, Node::probability),
        mutation_sigma: o.or("mutation_sigma", default.mutation_sigma, Node::amount),
        num_elite: o.or("num_elite", default.num_elite, |node| node.u32(0..=limits::POPULATION)),
    }
}

fn snes(o: &mut Places<'_, '_>) -> SnesParams {
    let default = SnesParams::default();
    SnesParams {
        eta_mu: o.or("eta_mu", default.eta_mu, Node::positive),
        eta_sigma: o.optional("eta_sigma").map(Node::positive),
        mu_init: o.or("mu_init", default.mu_init, Node::probability),
        sigma_init: o.or("sigma_init", default.sigma_init, sigma),
    }
}

fn xnes(o: &mut Places<'_, '_>) -> XnesParams {
    let default = XnesParams::default();
    XnesParams {
        eta_mu: o.or("eta_mu", default.eta_mu, Node::positive),
        eta_sigma: o.optional("eta_sigma").map(Node::positive),
        eta_b: o.optional("eta_B").map(Node::positive),
        mu_init: o.or("mu_init", default.mu_init, Node::probability),
        sigma_init: o.or("sigma_init", default.sigma_init, sigma),
    }
}

fn cma_es(o: &mut Places<'_, '_>) -> CmaEsParams {
    let default = CmaEsParams::default();
    CmaEsParams {
        mu_init: o.or("mu_init", default.mu_init, Node::probability),
        sigma_init: o.or("sigma_init", default.sigma_init, sigma),
    }
}

fn openai_es(o: &mut Places<'_, '_>) -> OpenAiEsParams {
    /// A decay of 1 would never forget, and its correction divides by zero.
    const DECAY_MAX: f64 = 1.0 - f64::EPSILON;
    let default = OpenAiEsParams::default();
    OpenAiEsParams {
        mu_init: o.or("mu_init", default.mu_init, Node::probability),
        sigma: o.or("sigma", default.sigma, sigma),
        learning_rate: o.or("learning_rate", default.learning_rate, Node::positive),
        beta1: o.or("beta1", default.beta1, |node| node.number(0.0..=DECAY_MAX)),
        beta2: o.or("beta2", default.beta2, |node| node.number(0.0..=DECAY_MAX)),
        weight_decay: o.or("weight_decay", default.weight_decay, Node::probability),
    }
}

/// A standard deviation in the unit cube of genotypes.
fn sigma(node: Node<'_>) -> f64 {
    node.number(limits::MAGNITUDE.recip()..=1.0)
}

/// The two places of an algorithm's parameters: `params`, or the population
/// itself (section 4.3).
struct Places<'o, 'a> {
    inner: Option<&'o mut Object<'a>>,
    outer: &'o mut Object<'a>,
}

impl<'a> Places<'_, 'a> {
    fn optional(&mut self, key: &'static str) -> Option<Node<'a>> {
        let inner = self.inner.as_mut().and_then(|inner| inner.optional(key));
        let outer = self.outer.optional(key);
        if let (Some(_), Some(outer)) = (&inner, &outer) {
            outer.problem("`params` has this key, too");
        }
        inner.or(outer)
    }

    fn or<T>(&mut self, key: &'static str, default: T, read: impl FnOnce(Node<'a>) -> T) -> T {
        self.optional(key).map_or(default, read)
    }

    fn ignored(&mut self, key: &'static str, why: &str) {
        if let Some(inner) = &mut self.inner {
            inner.ignored(key, why);
        }
        self.outer.ignored(key, why);
    }
}
