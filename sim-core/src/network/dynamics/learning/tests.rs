//! Compares learning networks with themselves under other conditions, and with networks that do not
//! learn.

use std::ops::Range;

use crate::genotype::Codec;
use crate::lanes::Lanes;
use crate::network::dynamics::NetworkState;
use crate::network::{Network, Phenotype};
use crate::problems::Problems;
use crate::testing::{experiment_a, experiment_a_spiking, genotype};
use determinism::Isa;
use experiment_file::{
    EncodingConfig, EncodingScheme, ExperimentConfig, LearningConfig, LinearField, NeuronModel,
    Neurotransmitter, ReceptiveField, RewardConfig, SynapseModel, SynapseParams,
};

/// The compared bits: all neurons, step by step.
type Bits = Vec<u32>;

/// Rate neurons, and LIF neurons with static and with dynamic synapses and an encoder.
fn experiments() -> [ExperimentConfig; 3] {
    let lif = experiment_a_spiking(NeuronModel::Lif);
    let mut dynamic = lif.clone();
    dynamic.topology.synapse_model = SynapseModel::Dynamic;
    dynamic.topology.synapse_params = Some(SynapseParams::default());
    for group in dynamic.topology.synapses.values_mut() {
        group.transmitter = Some(Neurotransmitter::AmpaNmda);
    }
    // With reversal potentials, weights of 1 would be strong.
    let population = &mut dynamic.algorithm.populations[0];
    (population.min_vals, population.max_vals) = (vec![-1.0], vec![3.0]);
    let receptive_field = ReceptiveField::Linear(LinearField { n_neurons: 4 });
    let encoding = EncodingConfig { scheme: EncodingScheme::RankOrder, receptive_field };
    dynamic.topology.encoding.insert("I1".to_owned(), encoding);
    [experiment_a(), lif, dynamic]
}

/// The network of an experiment in which some groups learn.
fn plastic(config: &ExperimentConfig, learning_rate: f64, delay: Option<u32>) -> ExperimentConfig {
    let mut config = config.clone();
    let [max_weight, a] = match (config.topology.neuron_model, config.topology.synapse_model) {
        (NeuronModel::Rate, _) => [4.0, 2.0],
        (_, SynapseModel::Static) => [300.0, 400.0],
        (_, SynapseModel::Dynamic) => [6.0, 20.0],
    };
    let groups = config.topology.synapses.keys().step_by(2).cloned();
    config.topology.learning = Some(LearningConfig {
        learning_rate,
        max_weight,
        a,
        b: -1.0,
        c: 0.5,
        d: 0.1,
        synapses: groups.collect(),
        reward: delay.map(|delay| RewardConfig { delay, discount: 0.5 }),
    });
    config
}

fn compiled(config: &ExperimentConfig) -> (Network, Phenotype) {
    let mut problems = Problems::default();
    let network = Network::compile(&config.topology, &mut problems);
    let codec = Codec::compile(config, &network, &mut problems);
    problems.check().unwrap();
    let phenotype = codec.decode(&genotype(codec.genotype_len(), 5));
    (network, phenotype)
}

/// Activities of one lane, among other lanes, after each of some steps.
fn activities(
    (network, phenotype): &(Network, Phenotype),
    isa: Isa,
    lanes: Range<usize>,
    lane: usize,
) -> Vec<f32> {
    let mut state = NetworkState::new(isa, network, phenotype, lanes.len());
    let mut shown = Vec::new();
    for step in 0..9 {
        let mut stimuli = Lanes::new(5, lanes.len());
        for (index, lane) in lanes.clone().enumerate() {
            for input in 0..5 {
                let value = 0.5 + 0.5 * libm::sin((lane + 3 * input + step / 3) as f64);
                stimuli.set(input, index, value as f32);
            }
            state.reward(index, libm::cos((lane + step) as f64) as f32);
        }
        state.step(&stimuli);
        shown.extend(state.activity().column(lane - lanes.start));
    }
    shown
}

fn bits(values: Vec<f32>) -> Bits {
    values.into_iter().map(f32::to_bits).collect()
}

#[test]
fn a_learning_rate_of_zero_gives_the_same_activities_as_rigid_weights() {
    for config in experiments() {
        let rigid = activities(&compiled(&config), Isa::best(), 0..3, 1);
        let still = compiled(&plastic(&config, 0.0, None));
        let still = activities(&still, Isa::best(), 0..3, 1);
        let learned = compiled(&plastic(&config, 1.0, None));
        let learned = activities(&learned, Isa::best(), 0..3, 1);
        assert_ne!(learned, still);
        if config.topology.neuron_model.is_spiking() {
            assert_eq!(bits(still), bits(rigid));
        } else {
            // Plastic networks of rate neurons add up in another order.
            for (still, rigid) in still.into_iter().zip(rigid) {
                assert!((still - rigid).abs() < 1e-5, "{still}, {rigid}");
            }
        }
    }
}

#[test]
fn nothing_is_learned_before_the_reward_is_complete() {
    for config in experiments() {
        let n_neurons = compiled(&config).0.n_neurons();
        for delay in [1, 4] {
            let still = compiled(&plastic(&config, 0.0, Some(delay)));
            let still = activities(&still, Isa::best(), 0..2, 0);
            let learned = compiled(&plastic(&config, 1.0, Some(delay)));
            let learned = activities(&learned, Isa::best(), 0..2, 0);
            let differs = still.iter().zip(&learned).position(|(a, b)| a != b);
            let first = differs.expect("something is learned") / n_neurons;
            assert!(first >= delay as usize, "step {first}, delay {delay}");
        }
    }
}

#[test]
fn instruction_sets_and_neighbours_change_no_bit() {
    for config in experiments() {
        for delay in [None, Some(3)] {
            let network = compiled(&plastic(&config, 1.0, delay));
            let alone = bits(activities(&network, Isa::best(), 20..21, 20));
            for isa in Isa::available() {
                for lanes in [20..21, 18..22, 3..40, 20..90] {
                    let beside = bits(activities(&network, isa, lanes.clone(), 20));
                    assert_eq!(beside, alone, "{isa}, {lanes:?}");
                }
            }
        }
    }
}
