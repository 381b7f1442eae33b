//! Networks of spiking neurons.

use experiment_file::{
    ActuatorQuery, DecodingConfig, EncodingConfig, EncodingScheme, EnsembleSelector,
    ExperimentConfig, FitnessFunction, GaussianField, GenotypeQuery, LinearField, NeuronModel,
    Neurotransmitter, OutputSelector, ReceptiveField, SlopedField, StimulusSelector, SynapseModel,
    SynapseParams, SynapseSelector,
};

use crate::configs::{experiment_a, experiment_c};
use crate::{assert_agreement, random_genotype, spread};

/// An experiment with neurons of a model; weights of synapses and decoders evolve.
pub(super) fn spiking(mut config: ExperimentConfig, model: NeuronModel) -> ExperimentConfig {
    let topology = &mut config.topology;
    (topology.neuron_model, topology.dt) = (model, 1.0);
    for ensemble in topology.ensembles.values_mut() {
        ensemble.activation = None;
        ensemble.params = model.default_params();
    }
    for (name, output) in &topology.outputs {
        topology.ensembles[&output.ensemble].n = 3;
        let num_outputs = if output.actuator == ActuatorQuery::Message { 2 } else { 1 };
        topology.decoding[name] = match output.actuator {
            ActuatorQuery::Wheels => DecodingConfig::RankOrderDecoding { num_outputs },
            ActuatorQuery::Mode => {
                topology.ensembles[&output.ensemble].n = 2;
                DecodingConfig::FirstToSpike {}
            }
            _ => DecodingConfig::LinearPopulationDecoding { num_outputs, rest_value: 0.5 },
        };
    }
    let population = &mut config.algorithm.populations[0];
    population.objects = vec![
        GenotypeQuery::Weights(SynapseSelector::All),
        GenotypeQuery::Decoders(OutputSelector::All),
    ];
    population.min_vals = vec![-100.0, -1.0];
    population.max_vals = vec![250.0, 1.0];
    config
}

/// Episodes are short, because trajectories part once a number crosses a threshold in different
/// substeps in f32 and f64.
#[test]
fn swarms_of_every_model_agree() {
    for model in NeuronModel::ALL.into_iter().filter(|model| model.is_spiking()) {
        let mut fitness = Vec::new();
        for (base, task) in [
            (experiment_a(), FitnessFunction::IdentifyBorderline),
            (experiment_c(), FitnessFunction::OrientationConsensus),
        ] {
            let mut config = spiking(base, model);
            config.algorithm.fitness_function = task;
            config.algorithm.evaluation_steps = 12;
            for seed in 0..4 {
                let genotype = random_genotype(&config, seed);
                let episodes = assert_agreement(&config, &genotype, 0, 0..1);
                fitness.extend(episodes.iter().map(|episode| episode.fitness));
            }
        }
        assert!(spread(fitness.iter().copied()) > 0.01, "{model:?}: {fitness:?}");
    }
}

/// All receptors, with and without reversal potentials; delays of one ensemble evolve.
#[test]
fn swarms_with_dynamic_synapses_agree() {
    for has_reversal in [true, false] {
        let mut config = spiking(experiment_c(), NeuronModel::Lif);
        config.algorithm.fitness_function = FitnessFunction::OrientationConsensus;
        config.algorithm.evaluation_steps = 12;
        let topology = &mut config.topology;
        topology.synapse_model = SynapseModel::Dynamic;
        let mut params = SynapseParams::default();
        if !has_reversal {
            params.ampa.reversal = None;
            params.gaba.reversal = None;
            params.nmda.reversal = None;
        }
        topology.synapse_params = Some(params);
        let transmitters =
            [Neurotransmitter::Gaba, Neurotransmitter::AmpaNmda, Neurotransmitter::Ampa];
        for (group, transmitter) in
            topology.synapses.values_mut().zip(transmitters.into_iter().cycle())
        {
            group.transmitter = Some(transmitter);
        }
        let population = &mut config.algorithm.populations[0];
        population.objects = vec![
            GenotypeQuery::Weights(SynapseSelector::Sensory),
            GenotypeQuery::Weights(SynapseSelector::Hidden),
            GenotypeQuery::Weights(SynapseSelector::Motor),
            GenotypeQuery::Delays(EnsembleSelector::Named("H1".into())),
            GenotypeQuery::Decoders(OutputSelector::All),
        ];
        let strength = if has_reversal { 3.0 } else { 80.0 };
        population.min_vals = vec![-20.0, 0.0, 0.0, 1.0, -1.0];
        population.max_vals = vec![80.0, strength, strength, 9.0, 1.0];
        let mut fitness = Vec::new();
        for seed in 0..5 {
            let genotype = random_genotype(&config, seed);
            let episodes = assert_agreement(&config, &genotype, 0, 0..1);
            fitness.extend(episodes.iter().map(|episode| episode.fitness));
        }
        assert!(spread(fitness.iter().copied()) > 0.001, "{fitness:?}");
    }
}

/// A triangular, conic or parabolic field with centres from -1 to 1.
fn sloped(slope: f64, n_neurons: u32, values: [f64; 2], inverted: bool) -> SlopedField {
    let [min_val, max_val] = values;
    SlopedField { slope, n_neurons, min_stim: -1.0, max_stim: 1.0, min_val, max_val, inverted }
}

/// Encodes the stimuli of experiment C, which have 2, 1, 2 and 2 values. Each encoded stimulus has
/// a different encoder; the last stimulus has none.
pub(super) fn encode(config: &mut ExperimentConfig) {
    let gaussian = GaussianField {
        sigma: 2.0,
        n_neurons: 3,
        min_stim: -1.0,
        max_stim: 1.0,
        min_val: 0.0,
        max_val: 40.0,
        inverted: false,
    };
    let encoding = &mut config.topology.encoding;
    for (name, scheme, receptive_field) in [
        ("I1", EncodingScheme::Lif, ReceptiveField::Gaussian(gaussian)),
        (
            "I2",
            EncodingScheme::PoissonRate,
            ReceptiveField::Parabolic(sloped(0.7, 2, [50.0, 2_000.0], true)),
        ),
        (
            "I3",
            EncodingScheme::RankOrder,
            ReceptiveField::Conic(sloped(0.8, 4, [1.0, 20.0], false)),
        ),
    ] {
        assert!(config.topology.stimuli.contains_key(name), "{name}");
        encoding.insert(name.to_owned(), EncodingConfig { scheme, receptive_field });
    }
}

#[test]
fn swarms_with_encoders_agree() {
    for synapses in [SynapseModel::Static, SynapseModel::Dynamic] {
        let mut config = spiking(experiment_c(), NeuronModel::Lif);
        config.algorithm.fitness_function = FitnessFunction::OrientationConsensus;
        config.algorithm.evaluation_steps = 12;
        encode(&mut config);
        let population = &mut config.algorithm.populations[0];
        if synapses == SynapseModel::Dynamic {
            config.topology.synapse_model = synapses;
            config.topology.synapse_params = Some(SynapseParams::default());
            for group in config.topology.synapses.values_mut() {
                group.transmitter = Some(Neurotransmitter::AmpaNmda);
            }
            population.objects.push(GenotypeQuery::Delays(EnsembleSelector::Named("I3".into())));
            population.min_vals = vec![-1.0, -1.0, 1.0];
            population.max_vals = vec![3.0, 1.0, 9.0];
        }
        let mut fitness = Vec::new();
        for seed in 0..5 {
            let genotype = random_genotype(&config, seed);
            let episodes = assert_agreement(&config, &genotype, 0, 0..1);
            fitness.extend(episodes.iter().map(|episode| episode.fitness));
        }
        assert!(spread(fitness.iter().copied()) > 0.001, "{synapses:?}: {fitness:?}");
    }
}

/// Some weights of receptive fields evolve; the others are exp(-|i - c|).
#[test]
fn swarms_with_linear_and_identity_fields_agree() {
    for selector in [StimulusSelector::All, StimulusSelector::Named("I3".into())] {
        let mut config = spiking(experiment_c(), NeuronModel::Izhikevich);
        config.algorithm.fitness_function = FitnessFunction::OrientationConsensus;
        config.algorithm.evaluation_steps = 12;
        let linear = ReceptiveField::Linear(LinearField { n_neurons: 3 });
        for (name, scheme, receptive_field) in [
            ("I1", EncodingScheme::RankOrder, linear),
            ("I2", EncodingScheme::RankOrder, ReceptiveField::Identity {}),
            ("I3", EncodingScheme::PoissonRate, linear),
        ] {
            let encoding = EncodingConfig { scheme, receptive_field };
            config.topology.encoding.insert(name.to_owned(), encoding);
        }
        let population = &mut config.algorithm.populations[0];
        population.objects.push(GenotypeQuery::Encoders(selector));
        population.min_vals.push(-20.0);
        population.max_vals.push(900.0);
        let mut fitness = Vec::new();
        for seed in 0..5 {
            let genotype = random_genotype(&config, seed);
            let episodes = assert_agreement(&config, &genotype, 0, 0..1);
            fitness.extend(episodes.iter().map(|episode| episode.fitness));
        }
        assert!(spread(fitness.iter().copied()) > 0.001, "{fitness:?}");
    }
}
