//! Decodes genes in \[0, 1\] to the network's parameters (section 3.4.2, Eq. 3.17).

mod coverage;
mod select;

use std::ops::Range;

use crate::network::{Network, Phenotype};
use crate::problems::Problems;
use coverage::{ParameterCoverage, defaults};
use experiment_file::{ExperimentConfig, GeneScale};
use select::select;

/// The meaning of each gene.
#[derive(Debug, Clone)]
pub(crate) struct Codec {
    genes: Vec<Gene>,
    /// Range of genes of each population.
    segments: Vec<Range<usize>>,
    /// Values of all parameters that no gene covers.
    defaults: Phenotype,
    /// Neurons with a fixed time constant, and that time constant.
    fixed_tau: Option<(Vec<usize>, f64)>,
    /// Descriptions of the parameters that no gene covers.
    uncovered: Vec<String>,
}

/// One gene: the parameter's value is gene * span + low, on the parameter's scale.
#[derive(Debug, Clone, Copy)]
struct Gene {
    parameter: Parameter,
    low: f64,
    span: f64,
    scale: GeneScale,
}

/// A parameter of the network.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Parameter {
    /// The weight of the synapse of this number.
    Weight(usize),
    /// A parameter of the neuron of this number.
    Neuron {
        /// Index among the neuron model's parameters.
        parameter: usize,
        /// Number of the neuron.
        neuron: usize,
    },
    /// The axonal delay of the neuron of this number; numbers after the last neuron are nodes of
    /// encoders.
    Delay(usize),
    /// A, B, C or D of a group of synapses.
    Coefficient {
        /// Number of the group.
        group: usize,
        /// Index of the coefficient, from 0.
        index: usize,
    },
    /// A weight of a receptive field.
    Encoder {
        /// Number of the encoder.
        encoder: usize,
        /// Number of the weight.
        weight: usize,
    },
    /// A weight of the decoding of an output.
    Decoder {
        /// Number of the output.
        output: usize,
        /// Number of the weight.
        weight: usize,
    },
}

impl Codec {
    /// Resolves the queries of all populations, in their order; notes populations
    /// without genes.
    pub fn compile(config: &ExperimentConfig, network: &Network, problems: &mut Problems) -> Self {
        let mut coverage = ParameterCoverage::new(network);
        let mut genes = Vec::new();
        let mut segments = Vec::new();
        for (name, population) in &config.algorithm.populations {
            let first = genes.len();
            let bounds = population.min_vals.iter().zip(&population.max_vals);
            for (query, (&low, &high)) in population.objects.iter().zip(bounds) {
                let span = high - low;
                let (parameters, scale) = select(query, &config.topology, network);
                for parameter in parameters {
                    *coverage.flag_mut(parameter) = true;
                    genes.push(Gene { parameter, low, span, scale });
                }
            }
            if genes.len() == first {
                // None of the named synapses exists, by chance.
                let path = format!("algorithm.populations.{name}.objects");
                problems.add(path, "nothing to evolve: none of these synapses exist");
            }
            segments.push(first..genes.len());
        }
        let defaults = defaults(&config.topology, network, &coverage, problems);
        let uncovered = coverage.describe(&config.topology, network);
        let motor = network.ensembles.values().filter(|ensemble| ensemble.motor);
        let motor: Vec<usize> = motor.flat_map(|ensemble| ensemble.neurons.clone()).collect();
        let fixed_tau = network.motor_tau.map(|tau| (motor, tau));
        Self { genes, segments, defaults, fixed_tau, uncovered }
    }

    /// Number of genes, d.
    pub fn genotype_len(&self) -> usize {
        self.genes.len()
    }

    /// Range of genes of each population.
    pub fn segments(&self) -> &[Range<usize>] {
        &self.segments
    }

    /// The parameters that no gene covers, one line each.
    pub fn uncovered(&self) -> &[String] {
        &self.uncovered
    }

    /// Decodes d genes in \[0, 1\].
    pub fn decode(&self, genotype: &[f64]) -> Phenotype {
        let mut phenotype = self.defaults.clone();
        for (gene, x) in self.genes.iter().zip(genotype) {
            let value = gene.scale.value(x * gene.span + gene.low);
            match gene.parameter {
                Parameter::Weight(synapse) => phenotype.weights[synapse] = value,
                Parameter::Neuron { parameter, neuron } => {
                    phenotype.neurons[parameter][neuron] = value;
                }
                Parameter::Delay(neuron) => phenotype.delays[neuron] = libm::round(value),
                Parameter::Coefficient { group, index } => phenotype.learning[group][index] = value,
                Parameter::Encoder { encoder, weight } => {
                    phenotype.encoders[encoder][weight] = value;
                }
                Parameter::Decoder { output, weight } => phenotype.decoders[output][weight] = value,
            }
        }
        if let Some((neurons, tau)) = &self.fixed_tau {
            neurons.iter().for_each(|&neuron| phenotype.neurons["tau"][neuron] = *tau);
        }
        phenotype
    }
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;
    use experiment_file::{EnsembleSelector, GenotypeQuery, SynapseSelector};

    use crate::testing::{experiment_a, genotype};

    fn compile(config: &ExperimentConfig) -> (Network, Codec, Problems) {
        let mut problems = Problems::default();
        let network = Network::compile(&config.topology, &mut problems);
        let codec = Codec::compile(config, &network, &mut problems);
        (network, codec, problems)
    }

    fn with_queries(queries: &[GenotypeQuery]) -> ExperimentConfig {
        let mut config = experiment_a();
        let population = &mut config.algorithm.populations[0];
        population.objects = queries.to_vec();
        population.max_vals = vec![3.0; queries.len()];
        population.min_vals = vec![-3.0; queries.len()];
        config
    }

    fn weights(selector: SynapseSelector) -> GenotypeQuery {
        GenotypeQuery::Weights(selector)
    }

    fn named(name: &str) -> GenotypeQuery {
        weights(SynapseSelector::Named(name.into()))
    }

    /// Number of genes of a query.
    fn n_genes(query: GenotypeQuery) -> usize {
        compile(&with_queries(&[query])).1.genotype_len()
    }

    /// Inverse of `decode`.
    fn encode(codec: &Codec, phenotype: &Phenotype) -> Vec<f64> {
        let gene = |gene: &Gene| {
            let value = match gene.parameter {
                Parameter::Weight(synapse) => phenotype.weights[synapse],
                Parameter::Neuron { parameter, neuron } => phenotype.neurons[parameter][neuron],
                Parameter::Delay(neuron) => phenotype.delays[neuron],
                Parameter::Coefficient { group, index } => phenotype.learning[group][index],
                Parameter::Encoder { encoder, weight } => phenotype.encoders[encoder][weight],
                Parameter::Decoder { output, weight } => phenotype.decoders[output][weight],
            };
            let value = match gene.scale {
                GeneScale::Linear => value,
                GeneScale::PowerOfTen { factor } => libm::log10(value / factor),
            };
            (value - gene.low) / gene.span
        };
        codec.genes.iter().map(gene).collect()
    }

    proptest! {
        #[test]
        fn decoding_is_invertible_and_keeps_bounds(seed in 0..1000u64) {
            let (_, codec, _) = compile(&experiment_a());
            let genes = genotype(codec.genotype_len(), seed);
            let phenotype = codec.decode(&genes);
            for (gene, back) in genes.iter().zip(encode(&codec, &phenotype)) {
                prop_assert!((gene - back).abs() < 1e-12);
            }
            prop_assert!(phenotype.weights.iter().all(|w| (-3.0..=3.0).contains(w)));
            for (name, range) in [("tau", 0.2..=11.25), ("gain", 0.05..=5.0), ("bias", -1.5..=1.5)] {
                prop_assert!(phenotype.neurons[name].iter().all(|value| range.contains(value)));
            }
        }
    }

    #[test]
    fn values_match_cases_by_hand() {
        let (network, codec, _) = compile(&experiment_a());
        let n_weights = network.synapses.len();
        let mut genes = vec![0.5; codec.genotype_len()];
        genes[0] = 1.0;
        genes[n_weights] = 0.0;
        genes[n_weights + 24] = 4.0 / 7.0;
        let phenotype = codec.decode(&genes);
        assert_eq!(phenotype.weights[..2], [3.0, 0.0]);
        assert_eq!(phenotype.neurons["bias"][..2], [-1.5, 0.0]);
        assert!((phenotype.neurons["tau"][0] - 2.0).abs() < 1e-12, "2 * 10^0");
        assert!((phenotype.neurons["gain"][0] - 2.525).abs() < 1e-12);
    }

    #[test]
    fn kinds_of_synapses_go_by_their_presynaptic_side() {
        let sensory = n_genes(weights(SynapseSelector::Sensory));
        let hidden = n_genes(weights(SynapseSelector::Hidden));
        let motor = n_genes(weights(SynapseSelector::Motor));
        assert_eq!(sensory, 5 * 10);
        assert_eq!(sensory + hidden + motor, n_genes(weights(SynapseSelector::All)));
        let motor_groups = ["COMM-H1", "LED-H1", "MODE-H1", "COMM-COMM", "COMM-MODE", "MODE-COMM"];
        assert_eq!(motor, motor_groups.iter().map(|group| n_genes(named(group))).sum::<usize>());
    }

    #[test]
    fn names_are_of_ensembles_stimuli_or_groups() {
        assert_eq!(n_genes(named("I1")), 20);
        assert_eq!(n_genes(named("I1-H1")), 20);
        let from_h2 = ["H2-H2", "H2-COMM", "H2-MODE"];
        assert_eq!(
            n_genes(named("H2")),
            from_h2.iter().map(|name| n_genes(named(name))).sum::<usize>()
        );
        let bias = |name: &str| {
            let ensemble = EnsembleSelector::Named(name.into());
            GenotypeQuery::Neurons("bias", ensemble)
        };
        assert_eq!(n_genes(bias("OUT_COMM")), 2);
        for query in [named("H3"), bias("H3"), bias("I1")] {
            assert!(compile(&with_queries(&[query])).2.check().is_err());
        }
    }

    #[test]
    fn populations_without_genes_and_time_constants_that_diverge_are_problems() {
        let mut empty = with_queries(&[named("I1-H1")]);
        empty.topology.synapses[0].trainable = false;
        assert!(compile(&empty).2.check().is_err());
        empty.topology.synapses[0].trainable = true;
        empty.topology.synapses[0].p = 1e-9;
        assert!(compile(&empty).2.check().is_err());
        empty.algorithm.populations[0] = experiment_a().algorithm.populations[0].clone();
        assert!(compile(&empty).2.check().is_ok(), "other synapses exist");
        let mut fast = with_queries(&[named("I1-H1")]);
        fast.topology.ensembles[0].params["tau"] = 0.04;
        assert!(compile(&fast).2.check().is_err());
        let mut covered = experiment_a();
        covered.topology.ensembles[0].params["tau"] = 0.04;
        assert!(compile(&covered).2.check().is_ok());
    }

    #[test]
    fn segments_follow_populations_and_queries() {
        let mut config = with_queries(&[named("H2"), named("I1")]);
        let second = with_queries(&[named("H1")]).algorithm.populations[0].clone();
        config.algorithm.populations.insert("second".into(), second);
        let (network, codec, problems) = compile(&config);
        problems.check().unwrap();
        let first = n_genes(named("H2")) + 20;
        assert_eq!(codec.segments(), [0..first, first..first + n_genes(named("H1"))]);
        let mut genes = vec![0.5; codec.genotype_len()];
        genes[first - 20] = 1.0;
        let weights = codec.decode(&genes).weights;
        assert_eq!(weights[network.groups["I1-H1"].synapses.start], 3.0);
    }

    #[test]
    fn parameters_that_no_query_covers_are_named_and_fixed() {
        let tau = GenotypeQuery::Neurons("tau", EnsembleSelector::Named("H1".into()));
        let mut config = with_queries(&[weights(SynapseSelector::Sensory), tau]);
        config.topology.synapses["H1-H2"].trainable = false;
        let (network, codec, problems) = compile(&config);
        problems.check().unwrap();
        let n = network.groups["H1-H1"].synapses.len();
        assert_eq!(
            codec.uncovered()[0],
            format!("synapses:weights:H1-H1: {n} weights stay random")
        );
        // Bias and gain evolve in no neuron, by choice. tau evolves in one of five ensembles.
        assert_eq!(codec.uncovered().len(), 11 + 4);
        assert!(codec.uncovered().contains(&"neurons:tau:OUT_LED stays 2".to_owned()));
        config.topology.motor_tau = Some(0.5);
        let (_, with_motor_tau, _) = compile(&config);
        assert!(with_motor_tau.uncovered().contains(&"neurons:tau:OUT_LED stays 0.5".to_owned()));
        let low = codec.decode(&vec![0.0; codec.genotype_len()]);
        let high = codec.decode(&vec![1.0; codec.genotype_len()]);
        let fixed = network.groups["H1-H2"].synapses.clone();
        assert_eq!(low.weights[fixed.clone()], high.weights[fixed.clone()]);
        assert!(low.weights[fixed.clone()].iter().all(|w| (-1.0..1.0).contains(w)));
        assert!(low.weights[fixed].iter().any(|&w| w != 0.0));
    }
}
