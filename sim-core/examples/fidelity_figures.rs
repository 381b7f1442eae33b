//! Prints the effects of different interpretations of the thesis on random networks: the figures
//! of docs/notebook/2026-11-thesis.md.
//!
//! ```sh
//! cargo run --release -p sim-core --example fidelity_figures              # a minute
//! cargo run --release -p sim-core --example fidelity_figures -- evolve    # a quarter of an hour
//! ```
//!
//! Each figure is the mean over 200 uniformly random genotypes, on the trials of generation 0. With
//! `evolve`, the example prints the results of SNES under the interpretations of Eq. 5.5 that no
//! key of an experiment file selects. For the others, use `swarmctl run --set` and `swarmctl
//! compare`.

use std::{env, error::Error, f64::consts::PI, fs};

use determinism::random::{Purpose, Stream};
use evolution::{Evolution, Population};
use experiment_file::ExperimentConfig;
use sim_core::Simulation;

const N_GENOTYPES: u64 = 200;

/// The term that Eq. 5.5 subtracts from 1, as a function of the number of robots and the mean
/// absolute action.
type Wheels = fn(f64, f64) -> f64;

const READINGS: [(&str, Wheels); 3] = [
    ("mean of the absolute actions", |_, turning| turning),
    ("L1 norm over the swarm, as printed", |n, turning| n * turning),
    ("the same, the factor clipped at 0", |n, turning| (n * turning).min(1.0)),
];

fn main() -> Result<(), Box<dyn Error>> {
    let file = read("orientation_consensus_snes")?;
    if env::args().nth(1).is_some_and(|arg| arg == "evolve") {
        println!("C, wheels in Eq. 5.5: mean fitness of SNES in generations 40 to 59");
        for (name, wheels) in READINGS {
            for seed in [0, 1] {
                println!("  {name}, seed {seed}: {:.4}", evolved(&file, seed, wheels)?);
            }
        }
        return Ok(());
    }
    println!("C, wheels in Eq. 5.5, by orientation_consensus_snes");
    for (name, wheels) in READINGS {
        let (config, simulation) = compile(&file)?;
        let mut all = Vec::new();
        for genotype in random_genotypes(simulation.genotype_len()) {
            all.extend(eq_5_5(&config, &simulation, &genotype, 0, wheels)?);
        }
        println!("  {name}: {:.4}", mean(&all));
    }

    println!("C, sending direction of a relayed frame, by orientation_consensus_snes");
    let emitter = r#""sending_direction": "emitter""#;
    println!("  emitter: {:.4}", fitness(&file)?);
    let originator = with(&file, emitter, r#""sending_direction": "originator""#)?;
    println!("  originator: {:.4}", fitness(&originator)?);

    println!("B, LED, by borderline_snes");
    let file = read("borderline_snes")?;
    println!("  drawn: {:.4}", fitness(&file)?);
    println!("  thresholded: {:.4}", fitness(&with(&file, DRAWN_LED, THRESHOLDED_LED)?)?);

    println!("D, orbit of the light, by light_follower_snes");
    let file = read("light_follower_snes")?;
    println!("  the thesis's: {:.4}", fitness(&file)?);
    println!("  the original's: {:.4}", fitness(&with(&file, ORBIT, ORIGINAL_ORBIT)?)?);
    Ok(())
}

const DRAWN_LED: &str =
    r#""outB": {"scheme": "ThresholdDecoding", "params": {"is_cat": true, "stochastic": true}}"#;
const THRESHOLDED_LED: &str =
    r#""outB": {"scheme": "ThresholdDecoding", "params": {"is_cat": true, "stochastic": false}}"#;
const ORBIT: &str = r#""controller": "light_orbit_controller""#;
const ORIGINAL_ORBIT: &str = r#""controller": {
    "name": "light_orbit_controller", "params": {"angle_step": 0.013, "radius_step": 1}
}"#;

/// The text of a shipped experiment file.
fn read(name: &str) -> Result<String, Box<dyn Error>> {
    Ok(fs::read_to_string(format!("{}/../configs/{name}.json", env!("CARGO_MANIFEST_DIR")))?)
}

/// Replaces a text that occurs once in a file. This keeps the order of the keys, which is the order
/// of the genes.
fn with(file: &str, from: &str, to: &str) -> Result<String, Box<dyn Error>> {
    match file.matches(from).count() {
        1 => Ok(file.replace(from, to)),
        n => Err(format!("{n} times in the file: {from}").into()),
    }
}

fn compile(file: &str) -> Result<(ExperimentConfig, Simulation), Box<dyn Error>> {
    let (config, _) = ExperimentConfig::from_json(file, "example", evolution::ALGORITHMS)?;
    let simulation = Simulation::compile(&config)?;
    Ok((config, simulation))
}

fn random_genotypes(length: usize) -> impl Iterator<Item = Vec<f64>> {
    (0..N_GENOTYPES).map(move |seed| {
        let mut stream = Stream::new(seed, 0_u64, 0, Purpose::Evolution, 0);
        (0..length).map(|_| stream.uniform()).collect()
    })
}

/// Mean fitness.
fn fitness(file: &str) -> Result<f64, Box<dyn Error>> {
    let (config, simulation) = compile(file)?;
    let mut all = Vec::new();
    for genotype in random_genotypes(simulation.genotype_len()) {
        all.extend(simulation.evaluate(&genotype, 0_u64, 0..config.algorithm.num_evaluations)?);
    }
    Ok(mean(&all))
}

/// The mean of (1 - misalignment / pi) (1 - wheels) in each trial of a generation.
fn eq_5_5(
    config: &ExperimentConfig,
    simulation: &Simulation,
    genotype: &[f64],
    generation: u64,
    wheels: Wheels,
) -> Result<Vec<f64>, Box<dyn Error>> {
    assert_eq!(simulation.measure_names(), ["misalignment", "turning"]);
    let n_robots = config.robots().map(|(_, robot)| f64::from(robot.num_instances)).sum();
    let trials = 0..config.algorithm.num_evaluations;
    let values = simulation.measure_while(genotype, generation, trials, &|| true)?;
    let of_step = |step: &[f64]| (1.0 - step[0] / PI) * (1.0 - wheels(n_robots, step[1]));
    let of_trial = |trial: &[f64]| {
        let steps: Vec<f64> = trial[1..].chunks_exact(2).map(of_step).collect();
        mean(&steps)
    };
    let values = values.expect("nothing stopped the simulation");
    Ok(values.chunks(simulation.values_per_trial()).map(of_trial).collect())
}

/// Mean fitness of the generations 40 to 59 of a run.
fn evolved(file: &str, seed: u64, wheels: Wheels) -> Result<f64, Box<dyn Error>> {
    let (config, simulation) =
        compile(&with(file, "\"seed\": 0,", &format!("\"seed\": {seed},"))?)?;
    let segments = simulation.population_segments();
    let mut evolution = Evolution::new(&config, segments, sim_core::FINGERPRINT);
    let mut means = Vec::new();
    for number in 0..60 {
        let generation = evolution.ask();
        let genotypes = Population::clone(&generation.genotypes);
        let mut fitness = Vec::new();
        for genotype in genotypes.iter() {
            fitness.push(eq_5_5(&config, &simulation, genotype, number, wheels)?);
        }
        means.push(evolution.tell(generation, &fitness)?.statistics.mean.get());
    }
    Ok(mean(&means[40..]))
}

fn mean(values: &[f64]) -> f64 {
    values.iter().sum::<f64>() / values.len() as f64
}
