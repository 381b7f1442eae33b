//! Measures the speed of the simulation, against a naive scalar f64 transcription of the same
//! equations (the reference of the tests), and against the processor's peak of multiply-adds.
//!
//! The two sides of a ratio take turns, so that a machine that slows down slows
//! both; figures are medians. `SWARM_ISA` chooses the vector instructions, and an
//! argument the sections: `cargo bench -p sim-core -- kernel`.
#![allow(clippy::disallowed_methods, reason = "a benchmark reads the clock")]

#[allow(dead_code, unused_imports, reason = "the tests need more of it")]
#[path = "../tests/configs/mod.rs"]
mod configs;
#[allow(dead_code, unused_imports, reason = "the tests need more of it")]
#[path = "../tests/reference/mod.rs"]
mod reference;

use std::hint::black_box;
use std::time::{Duration, Instant};

use determinism::random::{Purpose, Stream};
use experiment_file::{
    DecodingConfig, EncodingConfig, EncodingScheme, ExperimentConfig, FitnessFunction,
    GaussianField, GenotypeQuery, Initializer, LearningConfig, NeuronModel, Neurotransmitter,
    OutputSelector, ReceptiveField, ScriptConfig, SynapseModel, SynapseParams, SynapseSelector,
    TaskConfig,
};
use sim_core::bench::{NetworkLoad, multiply_adds, network_size};
use sim_core::{Isa, Simulation};

use configs::{experiment_a, experiment_b, experiment_c, experiment_d, swarm_mut};

/// Number of rounds; the result is their median.
const N_ROUNDS: usize = 9;
/// Approximate duration of one measurement.
const MEASUREMENT: Duration = Duration::from_millis(100);
/// Trials of a genotype, side by side as in the experiments.
const N_TRIALS: u32 = 5;
/// Approximate robot-steps of a reference episode, enough to make its setup negligible.
const REFERENCE_ROBOT_STEPS: u32 = 3_000;

fn main() {
    let sections: Vec<String> = std::env::args().skip(1).filter(|a| !a.starts_with('-')).collect();
    let wants = |name: &str| sections.is_empty() || sections.iter().any(|s| name.contains(s));
    let isas = match std::env::var("SWARM_ISA") {
        Ok(name) => vec![name.parse::<Isa>().unwrap_or_else(|error| panic!("SWARM_ISA: {error}"))],
        Err(_) => Isa::available(),
    };
    let best = *isas.last().expect("every processor has the portable level");
    if wants("kernel") {
        kernel(&isas);
    }
    if wants("spiking") {
        spiking(&isas);
    }
    if wants("lanes") {
        lanes(best);
    }
    if wants("episodes") {
        episodes(best);
    }
    if wants("sizes") {
        sizes(best);
    }
    if wants("items") {
        items(best);
    }
    if wants("scripts") {
        scripts(best);
    }
}

/// The network alone.
fn kernel(isas: &[Isa]) {
    println!("kernel: network of experiment A, 50 lanes");
    println!(
        "{:10} {:>16} {:>16} {:>10} {:>24}",
        "", "ns/lane-substep", "reference", "ratio", "share of peak mul-adds"
    );
    let config = experiment_a();
    let genotype = genotype(&config, 1);
    for &isa in isas {
        let simulation = compile(&config, isa);
        let (n_synapses, n_substeps) = network_size(&simulation);
        let n_lanes = 50;
        let mut load = NetworkLoad::new(&simulation, &genotype, n_lanes).expect("a valid genotype");
        let [step, reference, peak] = medians([
            &mut || seconds_per(|| load.step()),
            &mut || reference_step(&config, &genotype),
            &mut || {
                const N: usize = 1_000;
                seconds_per(|| multiply_adds(isa, N)) / multiply_adds(isa, N) as f64
            },
        ]);
        let per_lane_substep = step / (n_lanes as f64 * f64::from(n_substeps));
        let reference = reference / f64::from(n_substeps);
        println!(
            "{:10} {:16.2} {:16.1} {:9.1}x {:23.0}%",
            isa.name(),
            per_lane_substep * 1e9,
            reference * 1e9,
            reference / per_lane_substep,
            100.0 * n_synapses as f64 * peak / per_lane_substep,
        );
    }
}

/// Networks of spiking neurons and, for comparison, of rate neurons in the same task, with random
/// genotypes, without and with detours around subnormal numbers.
fn spiking(isas: &[Isa]) {
    println!("\nspiking: networks of experiment A, 50 lanes, us per lane and environment step");
    print!("{:15}", "");
    let mut configs = vec![("rate_model".to_owned(), experiment_a())];
    for model in NeuronModel::ALL.into_iter().filter(|model| model.is_spiking()) {
        configs.push((model.name().to_owned(), spiking_a(model, SynapseModel::Static)));
    }
    configs.push(("lif, dynamic".to_owned(), spiking_a(NeuronModel::Lif, SynapseModel::Dynamic)));
    let lif = spiking_a(NeuronModel::Lif, SynapseModel::Static);
    configs.push(("lif, Poisson".to_owned(), encoded(&lif)));
    configs.push(("lif, learns".to_owned(), plastic(&lif)));
    configs.push(("rate, learns".to_owned(), plastic(&experiment_a())));
    println!("{}", configs.iter().map(|(name, _)| format!(" {name:>13}")).collect::<String>());
    let plain = isas.iter().map(|isa| (isa.name().to_owned(), isa.avoiding_subnormals(false)));
    let fused = isas.iter().filter(|isa| isa.is_fused());
    let detours = fused.map(|isa| (format!("{isa}, detours"), isa.avoiding_subnormals(true)));
    for (name, isa) in plain.chain(detours) {
        print!("{name:15}");
        for (_, config) in &configs {
            let simulation = compile(config, isa);
            let n_lanes = 50;
            let genotype = genotype(config, 1);
            let mut load = NetworkLoad::new(&simulation, &genotype, n_lanes).expect("it is valid");
            let [step] = medians([&mut || seconds_per(|| load.step())]);
            print!(" {:13.3}", step / n_lanes as f64 * 1e6);
        }
        println!();
    }
}

/// The same experiment with all weights plastic.
fn plastic(config: &ExperimentConfig) -> ExperimentConfig {
    let mut config = config.clone();
    config.topology.learning = Some(LearningConfig {
        learning_rate: 1e-4,
        max_weight: 300.0,
        a: 1.0,
        b: 0.0,
        c: 0.0,
        d: 0.0,
        synapses: config.topology.synapses.keys().cloned().collect(),
        reward: None,
    });
    config
}

/// The same experiment with Poisson nodes for each of the five inputs, three per value.
fn encoded(config: &ExperimentConfig) -> ExperimentConfig {
    let mut config = config.clone();
    let field = GaussianField {
        sigma: 6.0,
        n_neurons: 3,
        min_stim: 0.0,
        max_stim: 1.0,
        min_val: 0.0,
        max_val: 1_000.0,
        inverted: false,
    };
    let encoding = EncodingConfig {
        scheme: EncodingScheme::PoissonRate,
        receptive_field: ReceptiveField::Gaussian(field),
    };
    let names = config.topology.stimuli.keys().cloned();
    config.topology.encoding = names.map(|name| (name, encoding)).collect();
    config
}

/// Experiment A with spiking neurons, whose weights and decoders evolve.
fn spiking_a(model: NeuronModel, synapses: SynapseModel) -> ExperimentConfig {
    let mut config = experiment_a();
    let topology = &mut config.topology;
    (topology.neuron_model, topology.dt) = (model, 1.0);
    for ensemble in topology.ensembles.values_mut() {
        (ensemble.activation, ensemble.params) = (None, model.default_params());
    }
    for (name, output) in &topology.outputs {
        let num_outputs = topology.ensembles[&output.ensemble].n;
        topology.decoding[name] =
            DecodingConfig::LinearPopulationDecoding { num_outputs, rest_value: 0.5 };
    }
    // The reversal potential of dynamic synapses gives a current of some tens per unit of weight.
    let mut strength = 150.0;
    if synapses == SynapseModel::Dynamic {
        strength = 5.0;
        topology.synapse_model = synapses;
        topology.synapse_params = Some(SynapseParams::default());
        for group in topology.synapses.values_mut() {
            group.transmitter = Some(Neurotransmitter::AmpaNmda);
        }
    }
    let population = &mut config.algorithm.populations[0];
    population.objects = vec![
        GenotypeQuery::Weights(SynapseSelector::Sensory),
        GenotypeQuery::Weights(SynapseSelector::Hidden),
        GenotypeQuery::Weights(SynapseSelector::Motor),
        GenotypeQuery::Decoders(OutputSelector::All),
    ];
    population.min_vals = vec![-60.0, -strength, -strength, -2.0];
    population.max_vals = vec![60.0, strength, strength, 2.0];
    config
}

/// The network in whole vectors of lanes, and in numbers of lanes that do not fill a vector.
fn lanes(isa: Isa) {
    println!("\nlanes ({isa}): network of experiment A, ns per substep");
    let config = experiment_a();
    let simulation = compile(&config, isa);
    let genotype = genotype(&config, 1);
    let (_, n_substeps) = network_size(&simulation);
    for n_lanes in [1, 2, 4, 10, 16, 32, 48, 50, 64] {
        let mut load = NetworkLoad::new(&simulation, &genotype, n_lanes).expect("a valid genotype");
        let [step] = medians([&mut || seconds_per(|| load.step())]);
        println!("{n_lanes:4} {:8.1}", step / f64::from(n_substeps) * 1e9);
    }
}

/// Whole episodes of the four experiments.
fn episodes(isa: Isa) {
    println!("\nepisodes ({isa}): all {N_TRIALS} trials of a genotype, per robot and step");
    header();
    for config in [experiment_a(), experiment_b(), experiment_c(), experiment_d()] {
        let name = format!("{} ({} robots)", config.name, n_robots(&config));
        compare(&name, &config, isa);
    }
    compare("A with LIF neurons", &spiking_a(NeuronModel::Lif, SynapseModel::Static), isa);
}

/// Swarms of different sizes and equal density, relative to ten robots.
fn sizes(isa: Isa) {
    const SIZES: [u32; 6] = [10, 20, 50, 200, 1_000, 10_000];
    println!("\nsizes ({isa}), us/robot-step: robots that stand (A) and robots that move (D)");
    println!("{:25} {}", "robots", SIZES.map(|n| format!("{n:>8}")).concat());
    for mut config in [experiment_a(), experiment_d()] {
        config.algorithm.evaluation_steps = 100;
        let mut swarms = SIZES.map(|n| {
            resize(&mut config, n);
            Evaluations::new(&config, isa)
        });
        let mut measurements =
            swarms.each_mut().map(|swarm| move || swarm.seconds_per_robot_step());
        let times = medians(
            measurements.each_mut().map(|measurement| measurement as &mut dyn FnMut() -> f64),
        );
        println!("{:25} {}", config.name, times.map(|time| format!("{:8.3}", time * 1e6)).concat());
        println!("{:25} {}", "", times.map(|time| format!("{:7.2}x", time / times[0])).concat());
    }
}

/// The cost of a trial in an item with fewer than five trials, whose lanes do not fill the vectors.
fn items(isa: Isa) {
    println!("\nitems ({isa}): time per trial, relative to that in an item of {N_TRIALS}");
    println!("{:20} {:>10} {:>10} {:>10} {:>10}", "trials of the item", 1, 2, 3, 4);
    for config in [experiment_a(), experiment_b(), experiment_c(), experiment_d()] {
        let simulation = compile(&config, isa);
        let genotype = genotype(&config, 1);
        let per_trial = |n_trials: u32| {
            let evaluate = || simulation.evaluate(&genotype, 0, 0..n_trials).expect("it is valid");
            seconds_per(evaluate) / f64::from(n_trials)
        };
        let [one, two, three, four, all] = medians([
            &mut || per_trial(1),
            &mut || per_trial(2),
            &mut || per_trial(3),
            &mut || per_trial(4),
            &mut || per_trial(N_TRIALS),
        ]);
        print!("{:20}", format!("{} ({} robots)", config.name, n_robots(&config)));
        println!(
            "{}",
            [one, two, three, four].map(|time| format!(" {:9.2}x", time / all)).concat()
        );
    }
}

/// Fitness as a script, compared with the same function in Rust.
fn scripts(isa: Isa) {
    println!("\nscripts ({isa}): whole episodes of experiment A, us per step of a trial");
    println!("{:20} {:>10} {:>10} {:>10}", "", "Rust", "script", "ratio");
    let text = include_str!("../../configs/tasks/thesis/identify_leader.star");
    for n in [10, 100] {
        let mut config = experiment_a();
        resize(&mut config, n);
        let steps = f64::from(config.algorithm.evaluation_steps * N_TRIALS);
        let rust = compile(&config, isa);
        config.algorithm.fitness_function = FitnessFunction::Script;
        let script = ScriptConfig { name: "identify_leader.star".into(), text: text.into() };
        config.task = Some(TaskConfig { script });
        let script = compile(&config, isa);
        let genotype = genotype(&config, 1);
        let seconds = |simulation: &Simulation| {
            seconds_per(|| simulation.evaluate(&genotype, 0, 0..N_TRIALS).expect("it is valid"))
        };
        let [rust, script] = medians([&mut || seconds(&rust), &mut || seconds(&script)]);
        let [rust_us, script_us] = [rust, script].map(|seconds| seconds / steps * 1e6);
        let name = format!("{n} robots");
        println!("{name:20} {rust_us:10.2} {script_us:10.2} {:9.2}x", script / rust);
    }
}

/// `n` robots in a square with the density of experiment D's 10 robots.
fn resize(config: &mut ExperimentConfig, n: u32) {
    let scale = f64::from(n).sqrt() / 10_f64.sqrt();
    let center = 500.0 * scale.max(1.0);
    (config.world.width, config.world.height) = (2.0 * center, 2.0 * center);
    let swarm = swarm_mut(config);
    swarm.num_instances = n;
    let (low, high) = (center - 100.0 * scale, center + 100.0 * scale);
    swarm.initializers.positions = Initializer::RandomUniform { low, high, size: 2 };
}

fn header() {
    println!("{:20} {:>16} {:>16} {:>10}", "", "us/robot-step", "reference", "ratio");
}

fn compare(name: &str, config: &ExperimentConfig, isa: Isa) {
    let mut evaluations = Evaluations::new(config, isa);
    let reference_genotype = genotype(config, 0);
    let n_robots = n_robots(config);
    let mut short = config.clone();
    short.algorithm.evaluation_steps =
        (REFERENCE_ROBOT_STEPS / n_robots).clamp(3, config.algorithm.evaluation_steps);
    let [simulation, reference] =
        medians([&mut || evaluations.seconds_per_robot_step(), &mut || {
            let start = Instant::now();
            black_box(reference::run(&short, &reference_genotype, 0, 0));
            let steps = n_robots * short.algorithm.evaluation_steps;
            start.elapsed().as_secs_f64() / f64::from(steps)
        }]);
    println!(
        "{name:20} {:16.3} {:16.1} {:9.1}x",
        simulation * 1e6,
        reference * 1e6,
        reference / simulation,
    );
}

/// Evaluations of several random genotypes, one after the other.
struct Evaluations {
    simulation: Simulation,
    genotypes: Vec<Vec<f64>>,
    robot_steps: f64,
    turn: usize,
}

impl Evaluations {
    fn new(config: &ExperimentConfig, isa: Isa) -> Self {
        let robot_steps =
            f64::from(n_robots(config) * config.algorithm.evaluation_steps * N_TRIALS);
        let genotypes = (0..8).map(|seed| genotype(config, seed)).collect();
        Self { simulation: compile(config, isa), genotypes, robot_steps, turn: 0 }
    }

    fn seconds_per_robot_step(&mut self) -> f64 {
        let Self { simulation, genotypes, robot_steps, turn } = self;
        seconds_per(|| {
            *turn += 1;
            let genotype = &genotypes[*turn % genotypes.len()];
            black_box(simulation.evaluate(genotype, 0, 0..N_TRIALS).expect("it is valid"))
        }) / *robot_steps
    }
}

/// The reference's network of one robot, in the reference's world, whose cost is negligible.
fn reference_step(config: &ExperimentConfig, genotype: &[f64]) -> f64 {
    let mut short = config.clone();
    short.algorithm.evaluation_steps = REFERENCE_ROBOT_STEPS / n_robots(config);
    let start = Instant::now();
    black_box(reference::run(&short, genotype, 0, 0));
    start.elapsed().as_secs_f64() / f64::from(REFERENCE_ROBOT_STEPS)
}

/// Seconds per call, over about the duration of a measurement.
fn seconds_per<T>(mut work: impl FnMut() -> T) -> f64 {
    let start = Instant::now();
    let mut n = 0;
    while start.elapsed() < MEASUREMENT {
        black_box(work());
        n += 1;
    }
    start.elapsed().as_secs_f64() / f64::from(n)
}

/// The median of each measurement. The measurements take turns.
fn medians<const N: usize>(mut measurements: [&mut dyn FnMut() -> f64; N]) -> [f64; N] {
    let mut samples = [const { Vec::new() }; N];
    for _ in 0..N_ROUNDS {
        for (samples, measure) in samples.iter_mut().zip(&mut measurements) {
            samples.push(measure());
        }
    }
    samples.map(|mut samples| {
        samples.sort_by(f64::total_cmp);
        samples[samples.len() / 2]
    })
}

fn compile(config: &ExperimentConfig, isa: Isa) -> Simulation {
    Simulation::compile(config).expect("the configuration is valid").with_isa(isa)
}

fn n_robots(config: &ExperimentConfig) -> u32 {
    config.robots().map(|(_, robot)| robot.num_instances).sum()
}

/// Genes from U(0, 1).
fn genotype(config: &ExperimentConfig, seed: u64) -> Vec<f64> {
    let mut stream = Stream::new(seed, 0, 0, Purpose::Evolution, 0);
    reference::genes(config).iter().map(|_| stream.uniform()).collect()
}
