//! The meaning of genotypes: queries, segments, connections, defaults.

use experiment_file::{
    EnsembleSelector, ExperimentConfig, FitnessFunction, GenotypeQuery, NamedMap,
    SynapseGroupConfig, SynapseSelector,
};
use sim_core::Simulation;

use crate::configs::{experiment_a, experiment_c, experiment_d};
use crate::{assert_agreement, random_genotype, reference, spread};

fn weights(of: &str) -> GenotypeQuery {
    GenotypeQuery::Weights(match of {
        "all" => SynapseSelector::All,
        "sensory" => SynapseSelector::Sensory,
        "hidden" => SynapseSelector::Hidden,
        "motor" => SynapseSelector::Motor,
        name => SynapseSelector::Named(name.into()),
    })
}

fn neurons(parameter: &'static str, of: &str) -> GenotypeQuery {
    let selector = match of {
        "all" => EnsembleSelector::All,
        name => EnsembleSelector::Named(name.into()),
    };
    GenotypeQuery::Neurons(parameter, selector)
}

/// The `params` of an ensemble.
fn params(tau: f64, gain: f64, bias: f64) -> NamedMap<f64> {
    [("tau", tau), ("gain", gain), ("bias", bias)].map(|(name, x)| (name.to_owned(), x)).into()
}

/// Replaces the populations: their queries with lower and upper bounds.
fn set_populations(config: &mut ExperimentConfig, populations: &[&[(GenotypeQuery, f64, f64)]]) {
    let template = config.algorithm.populations[0].clone();
    config.algorithm.populations.clear();
    for (i, queries) in populations.iter().enumerate() {
        let mut population = template.clone();
        population.objects = queries.iter().map(|(query, ..)| query.clone()).collect();
        population.min_vals = queries.iter().map(|&(_, min, _)| min).collect();
        population.max_vals = queries.iter().map(|&(.., max)| max).collect();
        config.algorithm.populations.insert(format!("p{i}"), population);
    }
}

fn connect_all(config: &mut ExperimentConfig) {
    for group in config.topology.synapses.values_mut() {
        group.p = 1.0;
    }
}

/// The length of the genotype; asserts that both implementations agree.
fn genotype_len(config: &ExperimentConfig) -> usize {
    let len = reference::genes(config).len();
    let simulation = Simulation::compile(config).expect("the configuration is valid");
    assert_eq!(simulation.genotype_len(), len);
    len
}

#[test]
fn lengths_match_counts_by_hand() {
    // Counts of synapses: from inputs to H1; within and between H1 and H2; to the third motor,
    // message and mode; back to H1; among the motors. Then bias, tau and gain.
    for (mut config, expected) in [
        (experiment_a(), 50 + 300 + (10 + 20 + 10) + (20 + 10 + 10) + (4 + 2 + 2) + 3 * 24),
        (experiment_c(), 70 + 300 + (10 + 20 + 10) + (20 + 10 + 10) + (4 + 2 + 2 + 1) + 3 * 24),
        (experiment_d(), 120 + 300 + (20 + 20 + 10) + (20 + 20 + 10) + (4 + 2 + 2 + 4) + 3 * 25),
    ] {
        let sparse = genotype_len(&config);
        connect_all(&mut config);
        assert_eq!(genotype_len(&config), expected);
        // 200 synapses exist with probability 0.7, and 40 or 50 with 0.85.
        let absent = expected - sparse;
        assert!((45..90).contains(&absent), "{absent}");
    }
}

#[test]
fn queries_cover_the_parameters_that_they_name() {
    let mut config = experiment_a();
    connect_all(&mut config);
    config.topology.synapses["H2-OUT_ST"].trainable = false;
    for (query, expected) in [
        (weights("all"), 428),
        (weights("sensory"), 50),
        (weights("hidden"), 330),
        (weights("motor"), 48),
        (weights("H1"), 210),
        (weights("H2"), 120),
        (weights("OUT_COMM"), 26),
        (weights("I3"), 20),
        (weights("OUT_LED-H1"), 10),
        (neurons("bias", "all"), 24),
        (neurons("tau", "OUT_COMM"), 2),
        (neurons("gain", "H2"), 10),
    ] {
        set_populations(&mut config, &[&[(query.clone(), -1.0, 0.0)]]);
        assert_eq!(genotype_len(&config), expected, "{query}");
    }
}

#[test]
fn every_population_has_its_segment() {
    let mut config = experiment_a();
    connect_all(&mut config);
    set_populations(
        &mut config,
        &[
            &[(weights("sensory"), -3.0, 3.0), (neurons("bias", "all"), -1.0, 1.0)],
            &[(neurons("tau", "H1"), -1.0, 0.0)],
            &[(weights("motor"), -3.0, 3.0), (neurons("gain", "OUT_LED"), 0.0, 1.0)],
        ],
    );
    let simulation = Simulation::compile(&config).expect("the configuration is valid");
    assert_eq!(simulation.population_segments(), [0..74, 74..84, 84..133]);
    assert_eq!(genotype_len(&config), 133);
}

#[test]
fn decoded_networks_agree() {
    let full = experiment_a();

    let mut reordered = experiment_a();
    set_populations(
        &mut reordered,
        &[
            &[(neurons("gain", "H2"), 0.5, 2.0), (weights("motor"), -1.0, 2.0)],
            &[
                (neurons("tau", "all"), -0.9, 0.5),
                (weights("sensory"), -2.0, 2.0),
                (neurons("bias", "OUT_LED"), -3.0, 0.0),
                (weights("H1-OUT_LED"), -5.0, 5.0),
                (weights("H2"), -3.0, 1.0),
            ],
        ],
    );

    // This network has fixed weights, defaults of neurons, and groups with several ends.
    let mut partly_fixed = experiment_a();
    let topology = &mut partly_fixed.topology;
    topology.seed = 5;
    for group in ["H1-H1", "OUT_COMM-OUT_ST", "I1-H1", "H2-H2", "H1-H2"] {
        topology.synapses.shift_remove(group);
    }
    let group = |pre: &[&str], post: &[&str], trainable| SynapseGroupConfig {
        pre: pre.iter().map(|&name| name.to_owned()).collect(),
        post: post.iter().map(|&name| name.to_owned()).collect(),
        trainable,
        p: 0.5,
        transmitter: None,
    };
    topology.synapses.insert("mixed".into(), group(&["H2", "I1", "H1"], &["H2", "H1"], true));
    topology.synapses.insert("motors".into(), group(&["OUT_COMM"], &["OUT_ST", "OUT_LED"], false));
    topology.ensembles["H1"].params = params(0.5, 2.0, -0.3);
    topology.ensembles["OUT_ST"].params = params(0.3, 4.0, 0.2);
    set_populations(
        &mut partly_fixed,
        &[&[
            (weights("H1"), -3.0, 3.0),
            (weights("I2"), -3.0, 3.0),
            (neurons("bias", "OUT_LED"), -2.0, 1.0),
            (neurons("gain", "H2"), 0.1, 5.0),
        ]],
    );

    let mut slow = experiment_a();
    slow.topology.dt = 0.05;
    slow.topology.time_scale = 7;
    slow.topology.seed = u64::MAX;

    for mut config in [full, reordered, partly_fixed, slow] {
        config.algorithm.fitness_function = FitnessFunction::IdentifyBorderline;
        config.algorithm.evaluation_steps = 60;
        let mut fitness = Vec::new();
        for seed in 0..8 {
            let genotype = random_genotype(&config, seed);
            fitness.extend(assert_agreement(&config, &genotype, 0, 0..1).iter().map(|e| e.fitness));
        }
        assert!(spread(fitness.iter().copied()) > 0.1, "{fitness:?}");
    }
}
