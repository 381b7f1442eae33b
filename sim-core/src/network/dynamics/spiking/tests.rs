//! Compares spiking networks with themselves, on other instruction sets and in other lanes.

use crate::lanes::Lanes;
use crate::network::decoding::Decoder;
use crate::network::dynamics::NetworkState;
use crate::network::{Network, Phenotype};
use crate::problems::Problems;
use crate::testing::{experiment_a_spiking, genotype};
use determinism::Isa;
use determinism::random::{Purpose, Stream};
use experiment_file::{
    EncodingConfig, EncodingScheme, ExperimentConfig, GaussianField, GenotypeQuery, LinearField,
    NeuronModel, Neurotransmitter, ReceptiveField, SlopedField, SynapseModel, SynapseParams,
    SynapseSelector,
};

const MODELS: [NeuronModel; 5] = [
    NeuronModel::Lif,
    NeuronModel::ExpLif,
    NeuronModel::AdEx,
    NeuronModel::Izhikevich,
    NeuronModel::MorrisLecar,
];

/// The network of a configuration, and the phenotype of one of its genotypes.
pub(super) fn compiled(config: &ExperimentConfig) -> (Network, Phenotype) {
    let mut problems = Problems::default();
    let network = Network::compile(&config.topology, &mut problems);
    let codec = crate::genotype::Codec::compile(config, &network, &mut problems);
    problems.check().unwrap();
    let phenotype = codec.decode(&genotype(codec.genotype_len(), 5));
    (network, phenotype)
}

/// Networks of each model, one with dynamic synapses, and one with encoders, with `time_scale`
/// substeps per step.
fn networks(time_scale: u32) -> Vec<(Network, Phenotype)> {
    let networks = MODELS.into_iter().map(|model| {
        let mut config = experiment_a_spiking(model);
        config.topology.time_scale = time_scale;
        compiled(&config)
    });
    let mut config = dynamic(NeuronModel::Lif);
    config.topology.time_scale = time_scale;
    let dynamic = compiled(&config);
    encode(&mut config);
    networks.chain([dynamic, compiled(&config)]).collect()
}

/// An experiment whose synapses are dynamic.
pub(super) fn dynamic(model: NeuronModel) -> ExperimentConfig {
    let mut config = experiment_a_spiking(model);
    config.topology.synapse_model = SynapseModel::Dynamic;
    config.topology.synapse_params = Some(SynapseParams::default());
    for (index, group) in config.topology.synapses.values_mut().enumerate() {
        let transmitters = [Neurotransmitter::AmpaNmda, Neurotransmitter::Gaba];
        group.transmitter = Some(transmitters[index % 2]);
    }
    config
}

/// Networks of each model with receptors that close so fast that they are subnormal after 300
/// substeps of silence.
fn networks_that_fall_silent() -> Vec<(Network, Phenotype)> {
    let networks = MODELS.into_iter().map(|model| {
        let mut config = dynamic(model);
        config.topology.time_scale = 20;
        let mut params = SynapseParams::default();
        (params.ampa.tau, params.gaba.tau) = (2.0, 3.0);
        (params.nmda.tau_rise, params.nmda.tau_decay) = (2.0, 4.0);
        config.topology.synapse_params = Some(params);
        // Spikes need stimuli: neurons hardly excite each other.
        let population = &mut config.algorithm.populations[0];
        let selectors = [SynapseSelector::Sensory, SynapseSelector::Hidden, SynapseSelector::Motor];
        population.objects = selectors.map(GenotypeQuery::Weights).to_vec();
        population.min_vals = vec![0.0, -5.0, -5.0];
        population.max_vals = vec![120.0, 5.0, 5.0];
        compiled(&config)
    });
    networks.collect()
}

/// An encoder of each scheme, with a field of each kind.
fn encode(config: &mut ExperimentConfig) {
    let values = [0.0, 3_000.0];
    let gaussian = GaussianField {
        sigma: 6.0,
        n_neurons: 3,
        min_stim: 0.0,
        max_stim: 1.0,
        min_val: 5.0,
        max_val: 40.0,
        inverted: false,
    };
    let parabolic = SlopedField {
        slope: 2.0,
        n_neurons: 2,
        min_stim: 0.0,
        max_stim: 1.0,
        min_val: values[0],
        max_val: values[1],
        inverted: true,
    };
    let linear = ReceptiveField::Linear(LinearField { n_neurons: 3 });
    for (name, scheme, receptive_field) in [
        ("I1", EncodingScheme::Lif, ReceptiveField::Gaussian(gaussian)),
        ("I2", EncodingScheme::PoissonRate, ReceptiveField::Parabolic(parabolic)),
        ("I3", EncodingScheme::RankOrder, linear),
    ] {
        let encoding = EncodingConfig { scheme, receptive_field };
        config.topology.encoding.insert(name.to_owned(), encoding);
    }
}

/// The state of a network in some lanes, each with a stream of its own.
fn start(
    (network, phenotype): &(Network, Phenotype),
    isa: Isa,
    lanes: std::ops::Range<usize>,
) -> NetworkState {
    let stream = |lane: usize| Stream::new(0, 0, 0, Purpose::Encoding, lane as u64);
    NetworkState::new(isa, network, phenotype, lanes.len())
        .drawing_from(lanes.map(stream).collect())
}

fn stimulus(step: usize, lane: usize, input: usize) -> f64 {
    0.5 + 0.5 * libm::sin((lane + 3 * input + step / 20) as f64)
}

/// Stimuli of one step in some lanes.
fn stimuli(step: usize, lanes: std::ops::Range<usize>) -> Lanes {
    let mut stimuli = Lanes::new(5, lanes.len());
    for (index, lane) in lanes.enumerate() {
        for input in 0..5 {
            stimuli.set(input, index, stimulus(step, lane, input) as f32);
        }
    }
    stimuli
}

/// Activities and voltages of one lane after some steps with the given lanes.
fn bits(
    network: &(Network, Phenotype),
    isa: Isa,
    lanes: std::ops::Range<usize>,
    lane: usize,
) -> Vec<u32> {
    let mut state = start(network, isa, lanes.clone());
    let index = lane - lanes.start;
    let step = |step| {
        state.step(&stimuli(step, lanes.clone()));
        readable(&state, index..index + 1)
    };
    (0..3).flat_map(step).collect()
}

/// The bits of all that can be read of some lanes of a state.
fn readable(state: &NetworkState, lanes: std::ops::Range<usize>) -> Vec<u32> {
    let (activity, voltages) = (state.activity(), state.voltages().unwrap());
    let window = state.window().unwrap();
    let all = [&activity, &voltages, &window.counts, &window.first, &window.filtered];
    let columns = lanes.flat_map(|lane| all.map(|rows| rows.column(lane)));
    columns.flatten().map(f32::to_bits).collect()
}

#[test]
fn instruction_sets_agree_in_every_bit() {
    for network in networks(20) {
        for n_lanes in [1, 15, 50] {
            let expected = bits(&network, Isa::best(), 0..n_lanes, n_lanes / 2);
            for isa in Isa::available() {
                assert_eq!(bits(&network, isa, 0..n_lanes, n_lanes / 2), expected, "{isa}");
            }
        }
    }
}

/// Some lanes fall silent while others spike.
#[test]
fn detours_around_subnormal_numbers_change_no_bit() {
    let stimuli = |step: usize| {
        let mut stimuli = stimuli(step, 0..37);
        for lane in 0..37 {
            if step > 2 && !(step + lane).is_multiple_of(40) {
                (0..5).for_each(|input| stimuli.set(input, lane, 0.0));
            }
        }
        stimuli
    };
    for network in networks_that_fall_silent() {
        let mut late_activity = 0.0;
        for isa in Isa::available() {
            let mut detour = start(&network, isa.avoiding_subnormals(true), 0..37);
            let mut plain = start(&network, isa.avoiding_subnormals(false), 0..37);
            for step in 0..80 {
                for state in [&mut detour, &mut plain] {
                    state.step(&stimuli(step));
                }
                assert!(readable(&detour, 0..37) == readable(&plain, 0..37), "{isa}, step {step}");
                let activity = plain.activity();
                if step > 40 {
                    late_activity += (0..37).flat_map(|lane| activity.column(lane)).sum::<f32>();
                }
            }
        }
        assert!(late_activity > 10.0, "neurons still spike: {late_activity}");
    }
}

#[test]
fn a_lane_does_not_depend_on_its_place_or_its_neighbours() {
    for network in networks(20) {
        let alone = bits(&network, Isa::best(), 70..71, 70);
        for lanes in [69..71, 60..80, 0..71, 37..170] {
            assert_eq!(bits(&network, Isa::best(), lanes.clone(), 70), alone, "{lanes:?}");
        }
    }
}

#[test]
fn a_window_has_the_data_that_the_decoder_of_each_motor_neuron_needs() {
    let mut config = experiment_a_spiking(NeuronModel::Lif);
    config.topology.time_scale = 40;
    let network = compiled(&config);
    config.topology.time_scale = 1;
    let single = compiled(&config);
    let mut window = NetworkState::new(Isa::best(), &network.0, &network.1, 3);
    let mut substeps = NetworkState::new(Isa::best(), &single.0, &single.1, 3);
    let held = stimuli(4, 0..3);
    window.step(&held);
    let mut n_first = 0;
    let mut counts = vec![[0.0; 3]; network.0.n_neurons()];
    let mut first = vec![[40.0; 3]; network.0.n_neurons()];
    let outputs = network.0.outputs.iter();
    let motor: Vec<(usize, Decoder)> = outputs
        .flat_map(|output| output.neurons.clone().map(|neuron| (neuron, output.decoder)))
        .collect();
    for substep in 0..40 {
        substeps.step(&held);
        for &(neuron, _) in &motor {
            for lane in 0..3 {
                if substeps.activity().get(neuron, lane) > 0.0 {
                    counts[neuron][lane] += 1.0;
                    first[neuron][lane] = f32::min(first[neuron][lane], substep as f32);
                    n_first += 1;
                }
            }
        }
    }
    assert!(n_first > 3, "{n_first}");
    let (window, last) = (window.window().unwrap(), substeps.window().unwrap());
    let mut n_timed = 0;
    for &(neuron, decoder) in &motor {
        for lane in 0..3 {
            if decoder == Decoder::FirstToSpike {
                assert_eq!(window.counts.get(neuron, lane), counts[neuron][lane]);
                assert_eq!(window.first.get(neuron, lane), first[neuron][lane]);
                n_timed += 1;
            } else {
                assert_eq!(window.filtered.get(neuron, lane), last.filtered.get(neuron, lane));
            }
        }
    }
    assert!((1..3 * motor.len()).contains(&n_timed), "both kinds: {n_timed}");
}
