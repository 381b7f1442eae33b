//! Evolution, and every algorithm, from outside.

mod adversity;
mod canonical;
mod convergence;
mod fork;
mod front;
mod golden;
mod honesty;
mod lineage;
mod reference;
mod repertoire;
mod suite;

use experiment_file::{
    AlgorithmConfig, AlgorithmDescription, Boundary, Domain, FitnessFunction, InitialRates, Keeps,
    NamedMap, NeuronModel, Params, PopulationConfig, SynapseModel, TopologyConfig, WorldConfig,
};

use super::*;

/// The algorithms that learn from fitness alone.
pub(crate) fn by_fitness() -> impl Iterator<Item = &'static AlgorithmDescription> {
    ALGORITHMS.iter().filter(|algorithm| algorithm.keeps != Keeps::Repertoire)
}

/// An evolution by SNES.
fn evolution(population_size: usize, segment_lens: &[usize]) -> Evolution {
    let params = Params::default();
    let algorithm =
        |&d: &usize| Algorithm::new("SNES", &params, d, &BesideFitness::default()).unwrap();
    evolution_of(segment_lens.iter().map(algorithm).collect(), population_size)
}

/// Largest distance between the values' distribution and `cdf` (Kolmogorov, Smirnov), times
/// sqrt(n). If they agree, it exceeds 1.95 once in 1000 times.
pub(crate) fn ks_statistic(mut values: Vec<f64>, cdf: impl Fn(f64) -> f64) -> f64 {
    values.sort_by(f64::total_cmp);
    let n = values.len() as f64;
    let distance = values.iter().enumerate().map(|(i, &value)| {
        let expected = cdf(value);
        (expected - i as f64 / n).abs().max((expected - (i + 1) as f64 / n).abs())
    });
    distance.fold(0.0, f64::max) * n.sqrt()
}

fn evolution_of(populations: Vec<Algorithm>, population_size: usize) -> Evolution {
    Evolution::from_parts(11, population_size, populations, "00".repeat(32).parse().unwrap())
}

/// A noisy sphere: two trials that differ.
fn evaluate(genotypes: &[Genotype]) -> Vec<Vec<f64>> {
    let sphere = |genes: &[f64]| -genes.iter().map(|g| (g - 0.3) * (g - 0.3)).sum::<f64>();
    genotypes.iter().map(|genes| vec![sphere(genes) + genes[0] * 1e-3, sphere(genes)]).collect()
}

fn step(evolution: &mut Evolution) -> GenerationSummary {
    let generation = evolution.ask();
    let trial_fitness = evaluate(&generation.genotypes);
    evolution.tell(generation, &trial_fitness).unwrap()
}

#[test]
fn genes_stay_within_bounds_and_follow_the_distribution() {
    let generation = evolution(500, &[4]).ask();
    let genes: Vec<f64> = generation.genotypes.concat();
    assert!(genes.iter().all(|gene| (0.0..=1.0).contains(gene)));
    let mean = mean(&genes);
    let variance = genes.iter().map(|g| (g - mean) * (g - mean)).sum::<f64>() / genes.len() as f64;
    assert!((mean - 0.5).abs() < 0.02 && (variance.sqrt() - 0.2).abs() < 0.02);
}

#[test]
fn asking_twice_gives_the_same() {
    let evolution = evolution(7, &[3, 2]);
    assert_eq!(evolution.ask(), evolution.ask());
}

#[test]
fn hashing_genes_ahead_changes_no_digest() {
    let mut usual = evolution(7, &[3, 2]);
    let mut ahead = usual.clone();
    let generation = ahead.ask();
    generation.link().hash_genes();
    let fitness: Vec<Vec<f64>> = (0..7).map(|i| vec![f64::from(i)]).collect();
    let digest = ahead.tell(generation, &fitness).unwrap().digest;
    assert_eq!(digest, usual.tell(usual.ask(), &fitness).unwrap().digest);
}

#[test]
fn each_evolution_continues_its_own_chain() {
    let mut ours = evolution(7, &[3]);
    let theirs = Evolution { digest: ours.digest.forked(ours.digest), ..ours.clone() };
    let fitness = vec![vec![1.0]; 7];
    let expected = ours.clone().tell(ours.ask(), &fitness).unwrap().digest;
    assert_eq!(ours.tell(theirs.ask(), &fitness).unwrap().digest, expected);
}

#[test]
fn several_populations_join_their_segments_in_order() {
    let generation = evolution(5, &[3, 4]).ask();
    for (i, genotype) in generation.genotypes.iter().enumerate() {
        let joined =
            [&generation.samples[0].genotypes[i][..], &generation.samples[1].genotypes[i][..]];
        assert_eq!(*genotype, joined.concat());
    }
    assert_ne!(generation.samples[0].normals[0][..3], generation.samples[1].normals[0][..3]);
}

#[test]
fn the_champion_is_the_best_mean_so_far_and_the_first_of_equals() {
    let mut evolution = evolution(3, &[2]);
    let generation = evolution.ask();
    let genotypes = generation.genotypes.clone();
    evolution.tell(generation, &[vec![0.0, 2.0], vec![3.0, 1.0], vec![2.0, 2.0]]).unwrap();
    let champion = evolution.champion().unwrap().clone();
    assert_eq!((champion.generation, champion.source), (0, ChampionSource::Individual(1)));
    assert_eq!(champion.fitness(), Some(2.0));
    assert_eq!(champion.genotype, genotypes[1]);
    let generation = evolution.ask();
    evolution.tell(generation, &[vec![2.0, 2.0], vec![0.0, 0.0], vec![1.0, 1.0]]).unwrap();
    assert_eq!(evolution.champion(), Some(&champion));
}

/// Lets the candidates meet blocks until one of them is the champion; `fitness[i]`: mean fitness
/// of candidate i, alternately a little more and a little less in its trials.
fn choose(evolution: &mut Evolution, fitness: &[f64]) {
    let mut round = evolution.reevaluation().unwrap();
    while !round.is_over() {
        let trial_fitness = |genotype: &Genotype| {
            let genotypes = round.candidates().iter().map(|candidate| &candidate.genotype);
            let i = genotypes.into_iter().position(|other| other == genotype).unwrap();
            vec![fitness[i] - 0.1, fitness[i] + 0.1]
        };
        let block: Vec<Vec<f64>> = round.genotypes().iter().map(trial_fitness).collect();
        round.learn(&block);
    }
    evolution.set_champion(&round);
}

#[test]
fn champions_are_kept_by_their_held_out_fitness() {
    let mut evolution = evolution(3, &[2]);
    assert_eq!(
        evolution.reevaluation(),
        None,
        "there are no individuals before the first generation"
    );
    let tell = |evolution: &mut Evolution, best: f64| {
        let generation = evolution.ask();
        evolution.tell(generation, &[vec![0.0], vec![best], vec![-1.0]]).unwrap();
    };
    tell(&mut evolution, 9.0);
    tell(&mut evolution, 5.0);

    let first = evolution.reevaluation().unwrap();
    let sources: Vec<ChampionSource> = first.candidates().iter().map(|c| c.source).collect();
    assert_eq!(sources, [ChampionSource::Individual(1), ChampionSource::Mean]);
    assert_eq!(first.candidates()[0].generation, 0);
    let digest = evolution.digest();
    choose(&mut evolution, &[5.0, 1.0]);
    let champion = evolution.champion().unwrap().clone();
    assert_eq!(champion.held_out.unwrap().mean, 5.0);
    assert_eq!(evolution.digest(), digest, "the generations' chain stays");

    // From now on, a better estimate alone makes no champion.
    tell(&mut evolution, 99.0);
    assert_eq!(evolution.champion(), Some(&champion));
    let second = evolution.reevaluation().unwrap();
    assert_eq!(second.candidates()[0], champion);
    assert_eq!(second.candidates()[1].fitness(), Some(99.0));
    let mut other = evolution.clone();
    choose(&mut evolution, &[3.0, 2.0, 7.0]);
    assert_eq!(evolution.champion().unwrap().source, ChampionSource::Mean);
    choose(&mut other, &[3.0, 2.0, f64::NAN]);
    let kept = other.champion().unwrap().held_out.unwrap();
    assert_eq!((kept.mean.get(), kept.n_trials), (4.0, 4), "5 and 3, of two trials each");
    assert_ne!(other.champion_digest(), evolution.champion_digest());

    // A candidate that has lost once does not return: the next challenger is from a later
    // generation.
    tell(&mut evolution, 1.0);
    let third = evolution.reevaluation().unwrap();
    let challenger = &third.candidates()[1];
    assert_eq!((challenger.fitness(), challenger.generation), (Some(1.0), 3));
}

#[test]
fn a_judgement_does_not_change_evolution_and_has_its_own_link() {
    let mut evolution = evolution(3, &[2]);
    assert_eq!(evolution.judgement(), None, "there are no individuals before the first generation");
    step(&mut evolution);
    choose(&mut evolution, &[5.0, 1.0]);
    let judgement = evolution.judgement().unwrap();
    assert_eq!(judgement.trial_set(), determinism::random::TrialSet::Judgement(0));
    let champion = evolution.champion().unwrap();
    assert_eq!(judgement.genotypes()[0], champion.genotype);

    let (judged, digest) = judgement.clone().decide(&[vec![1.0, 2.0, 6.0]]);
    let Judged { mean, low, high, n_trials, generation } = judged.judged.unwrap();
    assert_eq!((mean.get(), n_trials, generation), (3.0, 3, 0));
    assert!(1.0 <= low.get() && low < mean && mean < high && high.get() <= 6.0, "{low} {high}");
    assert_eq!(Champion { judged: None, ..judged }, *champion);
    assert_ne!(digest, evolution.champion_digest());
    assert_ne!(digest, judgement.clone().decide(&[vec![1.0, 2.0, 6.0f64.next_up()]]).1);

    let unjudged = judgement.decide(&[vec![1.0, f64::NAN, 6.0]]).0;
    assert_eq!(unjudged.judged, None, "no mean without a finite fitness in every trial");
}

#[test]
fn fitness_that_is_not_finite_ranks_last_and_is_counted() {
    let mut evolution = evolution(4, &[2]);
    let generation = evolution.ask();
    let fitness = [vec![f64::NAN, 9.0], vec![1.0, 1.0], vec![f64::INFINITY, 0.0], vec![2.0, 4.0]];
    let record = evolution.tell(generation, &fitness).unwrap();
    assert_eq!(record.n_non_finite, 2);
    let [best, mean, min] = [3.0, 2.0, 1.0].map(|value| Real::new(value).unwrap());
    let expected = Statistics { best, mean, min, standard_deviation: min };
    assert_eq!(record.statistics, expected);
    assert_eq!(evolution.champion().unwrap().source, ChampionSource::Individual(3));
}

#[test]
fn a_generation_without_finite_fitness_is_an_error() {
    let mut evolution = evolution(2, &[2]);
    let generation = evolution.ask();
    let error = evolution.tell(generation, &[vec![f64::NAN], vec![f64::INFINITY]]).unwrap_err();
    assert_eq!(error, EvolutionError::NoFiniteFitness { generation: 0 });
}

/// The value comes from Python's hashlib over the documented bytes.
#[test]
fn a_link_of_the_digest_chain_hashes_the_documented_bytes() {
    let start: Digest = "00".repeat(32).parse().unwrap();
    let link = start.next(3, &[vec![0.25, 0.5], vec![1.0, -0.0]], &[vec![1.5], vec![2.5]]);
    assert_eq!(
        link.to_string(),
        "75b0d81921a9901588735d1f9e03c7e0159bcb1100065319a224f08fea9fa2e3"
    );
}

#[test]
fn every_bit_of_genotypes_and_fitness_enters_the_digest() {
    let start: Digest = "00".repeat(32).parse().unwrap();
    let digest = |gene: f64, fitness: f64| start.next(0, &[vec![gene]], &[vec![fitness]]);
    assert_ne!(digest(0.5, 1.0), digest(0.5f64.next_up(), 1.0));
    assert_ne!(digest(0.5, 1.0), digest(0.5, 1.0f64.next_down()));
    assert_ne!(digest(0.0, 1.0), digest(-0.0, 1.0));
    assert_ne!(start.next(0, &[], &[]), start.next(1, &[], &[]));
}

/// A configuration with the parts that evolution reads.
fn config(name: &str, population_size: u32, populations: &[&str]) -> ExperimentConfig {
    let population = || PopulationConfig {
        objects: Vec::new(),
        max_vals: Vec::new(),
        min_vals: Vec::new(),
        params: Params::default(),
    };
    ExperimentConfig {
        name: "test".to_owned(),
        seed: 5,
        topology: TopologyConfig {
            dt: 0.1,
            time_scale: 20,
            seed: 821,
            neuron_model: NeuronModel::Rate,
            bias_in_gain: true,
            initial_rates: InitialRates::default(),
            motor_tau: None,
            synapse_model: SynapseModel::Static,
            synapse_params: None,
            encoding: NamedMap::new(),
            learning: None,
            stimuli: NamedMap::new(),
            ensembles: NamedMap::new(),
            outputs: NamedMap::new(),
            synapses: NamedMap::new(),
            decoding: NamedMap::new(),
        },
        algorithm: AlgorithmConfig {
            descriptors: Vec::new(),
            aims: Vec::new(),
            name: name.to_owned(),
            evolvable_object: "robot".to_owned(),
            population_size,
            generations: 10,
            evaluation_steps: 10,
            num_evaluations: 1,
            fitness_function: FitnessFunction::Grouping,
            fitness_params: experiment_file::FitnessParams::default(),
            target_fitness: None,
            champion_every: 10,
            champion_trials: 50,
            judgement_trials: 200,
            populations: populations
                .iter()
                .map(|name| ((*name).to_owned(), population()))
                .collect(),
        },
        world: WorldConfig {
            height: 1000.0,
            width: 1000.0,
            boundary: Boundary::Torus,
            bodies: None,
            objects: NamedMap::new(),
        },
        task: None,
    }
}

/// Segments of the given lengths, one after the other.
fn segments(lens: &[usize]) -> Vec<Range<usize>> {
    let mut end = 0;
    let segment = |&len: &usize| {
        end += len;
        end - len..end
    };
    lens.iter().map(segment).collect()
}

#[test]
fn the_name_in_the_configuration_chooses_the_algorithm() {
    for (name, expected) in [
        ("GA", "Ga"),
        ("SNES", "Snes"),
        ("xNES", "Xnes"),
        ("CMA-ES", "CmaEs"),
        ("sep-CMA-ES", "SepCmaEs"),
        ("openaiES", "OpenAiEs"),
        ("PGPE", "Pgpe"),
    ] {
        let evolution = Evolution::new(&config(name, 6, &["a", "b"]), &segments(&[2, 3]), "test");
        assert_eq!(evolution.ask().genotypes[0].len(), 5);
        for algorithm in &evolution.populations {
            let state = serde_json::to_value(algorithm).unwrap();
            assert_eq!(state.as_object().unwrap().keys().collect::<Vec<_>>(), [expected]);
        }
    }
}

/// Databases have keyframes and logs of this format. A change needs a new version, and code that
/// reads the previous version.
#[test]
fn the_formats_of_keyframes_and_of_the_log_stay() {
    let hex = |bytes: &[u8]| bytes.iter().map(|byte| format!("{byte:02x}")).collect::<String>();
    let told = Told::from_fitness(vec![vec![0.0], vec![2.0], vec![1.0]]);
    assert_eq!(
        hex(&told.to_bytes()),
        "020301000000000000000001000000000000004001000000000000f03f000000",
        "version, individuals, trials and their fitness, re-evaluations; those at the end, judgement"
    );
    let without_end = [&[1], &told.to_bytes()[1..30]].concat();
    assert_eq!(Told::from_bytes(&without_end).unwrap(), told);

    let mut evolution = evolution(3, &[2]);
    evolution.repeat(&told).unwrap();
    // Lengths, and everything that does not depend on draws.
    let keyframe = evolution.keyframe();
    assert_eq!(keyframe.len(), 248);
    assert_eq!(
        hex(&keyframe[..6]),
        "010b03010101",
        "version, seed, P, generations, populations, SNES"
    );
    let place = |algorithm: &str, params: &Params| {
        evolution_of(
            vec![Algorithm::new(algorithm, params, 2, &BesideFitness::default()).unwrap()],
            3,
        )
        .keyframe()[5]
    };
    let names = ["GA", "SNES", "xNES", "CMA-ES", "sep-CMA-ES", "openaiES", "PGPE"];
    assert_eq!(names.map(|name| place(name, &Params::default())), [0, 1, 2, 3, 4, 5, 6]);
    assert_eq!(place("CMA-ES", &Params::default().with("restarts", "ipop")), 9);
    assert_eq!(place("NSGA-II", &Params::default()), 13);
}

/// Older versions wrote NaN as an interval where sums overflowed.
#[test]
fn older_states_with_a_nan_interval_open() {
    let mut evolution = evolution(3, &[2]);
    step(&mut evolution);
    let mut round = evolution.reevaluation().unwrap();
    while !round.is_over() {
        round.learn(&evaluate(&round.genotypes()));
    }
    evolution.set_champion(&round);
    let HeldOut { mean, ci95, .. } = evolution.champion().unwrap().held_out.unwrap();
    let bytes = |mean: f64, ci95: f64| [mean.to_le_bytes(), ci95.to_le_bytes()].concat();
    let replaced = |old: &[u8], new: &[u8]| {
        let mut keyframe = evolution.keyframe();
        let places = keyframe.windows(old.len()).enumerate().filter(|(_, window)| *window == old);
        let places: Vec<usize> = places.map(|(at, _)| at).collect();
        for &at in &places {
            keyframe[at..at + old.len()].copy_from_slice(new);
        }
        assert_eq!(places.len(), 1);
        Evolution::restore(&Checkpoint { keyframe, ..Checkpoint::default() })
    };
    let known = bytes(mean.get(), ci95.get());
    let old = replaced(&known, &bytes(mean.get(), f64::NAN)).unwrap();
    let found = old.champion().unwrap().held_out.unwrap();
    assert_eq!((found.mean, found.ci95.get()), (mean, f64::INFINITY));
    assert!(
        Evolution::restore(&Checkpoint { keyframe: old.keyframe(), ..Checkpoint::default() })
            .is_ok()
    );
    assert!(replaced(&known, &bytes(f64::NAN, 0.5)).is_err(), "no version kept such a mean");
}

#[test]
fn invalid_checkpoints_are_errors() {
    let mut evolution = evolution(3, &[2]);
    let keyframe = evolution.keyframe();
    let told = Told::from_fitness(evaluate(&evolution.ask().genotypes));
    evolution.repeat(&told).unwrap();
    let entry = told.to_bytes();
    let restore = |keyframe: &[u8], log: &[&[u8]]| {
        let log = log.iter().map(|entry| entry.to_vec()).collect();
        Evolution::restore(&Checkpoint { keyframe: keyframe.to_vec(), log, n_flat: 0 })
    };
    assert_eq!(restore(&keyframe, &[&entry]).unwrap(), evolution);
    assert!(matches!(restore(b"", &[]), Err(CheckpointError::Malformed(_))));
    assert!(matches!(restore(b"{}", &[]), Err(CheckpointError::Version { found: b'{', .. })));
    assert!(matches!(restore(&keyframe[..9], &[]), Err(CheckpointError::Malformed(_))));
    assert!(matches!(restore(&keyframe, &[&entry[..9]]), Err(CheckpointError::Malformed(_))));
    assert!(matches!(restore(&keyframe, &[&[9]]), Err(CheckpointError::Version { found: 9, .. })));
    // Entries with two individuals, and without finite fitness.
    let misfit = restore(&keyframe, &[&[1, 2, 0, 0, 0]]);
    assert!(matches!(misfit, Err(CheckpointError::Misfit { generation: 0 })), "{misfit:?}");
    let hopeless = restore(&keyframe, &[&[1, 3, 0, 0, 0, 0]]);
    assert!(matches!(hopeless, Err(CheckpointError::Evolution(_))), "{hopeless:?}");
}

/// At the size of experiment A; `docs/notebook/2026-11-storage.md` has these numbers.
#[test]
fn keyframes_are_as_far_apart_as_time_and_room_allow() {
    let interval = |algorithm: &str, population_size: usize, d: usize, n_trials: usize| {
        let population =
            Algorithm::new(algorithm, &Params::default(), d, &BesideFitness::default()).unwrap();
        let mut evolution = evolution_of(vec![population], population_size);
        let entry_len = population_size * (1 + 8 * n_trials);
        let is_due = |evolution: &Evolution| evolution.is_keyframe_due(entry_len);
        while !{
            evolution.n_generations += 1;
            is_due(&evolution)
        } {}
        evolution.n_generations
    };
    for (algorithm, expected) in [
        ("GA", 150),
        ("SNES", 150),
        ("openaiES", 150),
        ("sep-CMA-ES", 150),
        ("CMA-ES", 12),
        ("xNES", 12),
    ] {
        assert_eq!(interval(algorithm, 100, 455, 5), expected, "{algorithm}");
    }
    assert_eq!(interval("GA", 10_000, 455, 5), 88, "keyframes take as much room as the log");
    assert_eq!(interval("CMA-ES", 100, 1000, 5), 61, "keyframes take 128 KiB per generation");
    assert_eq!(interval("NSGA-II", 16_384, 2, 1), 6, "sorting takes longer than drawing");
}
