//! Verification finds every change of a bundle.

use std::{fs, io::Write as _, sync::OnceLock};

use evolution::{ALGORITHMS, Evolution, Fork, Told};
use experiment_file::{
    AimConfig, DescriptorConfig, Direction, ExperimentConfig, Params, Summarises,
};
use sim_core::{FINGERPRINT, Simulation};
use zip::{CompressionMethod, ZipWriter, write::SimpleFileOptions};

use super::{archive::UNPACKED_LEN_MAX, *};

const N_GENERATIONS: u64 = 4;

fn config() -> ExperimentConfig {
    let path = concat!(env!("CARGO_MANIFEST_DIR"), "/../../configs/quickstart.json");
    let text = fs::read_to_string(path).unwrap();
    let (mut config, _) = ExperimentConfig::from_json(&text, "", ALGORITHMS).unwrap();
    let algorithm = &mut config.algorithm;
    algorithm.generations = N_GENERATIONS;
    algorithm.population_size = 4;
    algorithm.num_evaluations = 2;
    algorithm.evaluation_steps = 20;
    algorithm.champion_every = 2;
    algorithm.champion_trials = 3;
    algorithm.judgement_trials = 4;
    config
}

fn simulated(simulation: &Simulation, batch: &Batch) -> Vec<Vec<f64>> {
    let (set, trials) = (batch.trial_set, 0..batch.n_trials());
    let values = |genes: &Vec<f64>| match batch.values_per_trial {
        1 => simulation.evaluate(genes, set, trials.clone()).unwrap(),
        _ => simulation.describe_while(genes, set, trials.clone(), &|| true).unwrap().unwrap(),
    };
    batch.genotypes.iter().map(values).collect()
}

/// A complete run; `change`: replaces the fitness of a generation.
fn evolved(
    config: &ExperimentConfig,
    mut evolution: Evolution,
    fork: Option<ForkOf>,
    mut history: Vec<GenerationRow>,
    change: impl Fn(u64, &mut Vec<Vec<f64>>),
) -> Bundle {
    let simulation = Simulation::compile(config).unwrap();
    let algorithm = &config.algorithm;
    let mut keyframes = vec![(evolution.n_generations(), evolution.keyframe())];
    let mut log = Vec::new();
    let mut digest = evolution.digest();
    let mut champion = None;
    while evolution.n_generations() < algorithm.generations {
        let generation = evolution.n_generations();
        let evaluate = |set: sim_core::TrialSet, genotypes: &[Vec<f64>], n_trials| {
            let fitness = |genes: &Vec<f64>| simulation.evaluate(genes, set, 0..n_trials).unwrap();
            genotypes.iter().map(fitness).collect::<Vec<_>>()
        };
        let describe = |set: sim_core::TrialSet, genotypes: &[Vec<f64>], n_trials| {
            let values =
                |genes: &Vec<f64>| simulation.describe_while(genes, set, 0..n_trials, &|| true);
            genotypes.iter().map(|genes| values(genes).unwrap().unwrap()).collect::<Vec<_>>()
        };
        let asked = evolution.ask();
        let mut values = describe(generation.into(), &asked.genotypes, algorithm.num_evaluations);
        change(generation, &mut values);
        let mut told = Told::from_values(&values, simulation.n_descriptors());
        let summary = evolution.tell(asked, &told).unwrap();
        if evolution.n_generations().is_multiple_of(algorithm.champion_every) {
            let mut round = evolution.reevaluation().unwrap();
            while !round.is_over() {
                let trials = algorithm.champion_trials;
                round.learn(&evaluate(round.trial_set(), &round.genotypes(), trials));
            }
            evolution.set_champion(&round);
            told.blocks = round.blocks().to_vec();
        }
        if evolution.n_generations() == algorithm.generations {
            let judgement = evolution.judgement().unwrap();
            let trials = algorithm.judgement_trials;
            let values = describe(judgement.trial_set(), &judgement.genotypes(), trials);
            told.end = judgement.end(&values);
            let judged = judgement.decide(&values);
            (champion, digest) = (Some(judged.0), judged.1);
        }
        log.push(told.to_bytes());
        keyframes.push((evolution.n_generations(), evolution.keyframe()));
        let Statistics { best, mean, min, standard_deviation } = summary.statistics;
        history.push(GenerationRow {
            generation,
            best,
            mean,
            min,
            standard_deviation,
            episodes: told.trial_fitness.iter().map(|trials| trials.len() as u64).sum(),
            duration_ms: 7,
            completed_at_ms: 1_700_000_000_000 + generation,
            workers: 2,
            idle_share: 0.25,
            digest: summary.digest,
        });
    }
    Bundle {
        manifest: Manifest {
            format: FORMAT,
            program: "swarmevo test".to_owned(),
            simulation: FINGERPRINT.to_owned(),
            config_digest: Digest::of_config(config, FINGERPRINT),
            digest,
            state: "completed".to_owned(),
            reason: String::new(),
            submitted_at_ms: 1_699_999_999_000,
            fork,
        },
        config_json: config.to_canonical_json(),
        history,
        log,
        keyframes,
        champion_json: champion_json(&champion.unwrap()),
    }
}

fn started(config: &ExperimentConfig) -> Evolution {
    let simulation = Simulation::compile(config).unwrap();
    Evolution::new(config, simulation.population_segments(), FINGERPRINT)
}

pub fn bundle() -> &'static Bundle {
    static BUNDLE: OnceLock<Bundle> = OnceLock::new();
    BUNDLE.get_or_init(|| evolved(&config(), started(&config()), None, Vec::new(), |_, _| ()))
}

/// Verifies a bundle, and simulates the sampled generations.
fn verify(bundle: &Bundle, sample: Sample) -> Result<Proof, Flaw> {
    let mut verification = Verification::begin(bundle, sample)?;
    while let Some(batches) = verification.advance()? {
        for batch in batches {
            batch.compare(&simulated(verification.simulation(), &batch))?;
        }
    }
    Ok(verification.finish())
}

/// Verifies a bundle without simulations.
fn links(bundle: &Bundle) -> Result<(), Flaw> {
    let mut verification = Verification::begin(bundle, Sample::Drawn(0))?;
    while verification.advance()?.is_some() {}
    Ok(())
}

/// An archive of arbitrary files.
fn archive<'a>(files: impl IntoIterator<Item = (&'a str, Vec<u8>)>) -> Vec<u8> {
    packed(files, CompressionMethod::Stored)
}

fn packed<'a>(
    files: impl IntoIterator<Item = (&'a str, Vec<u8>)>,
    method: CompressionMethod,
) -> Vec<u8> {
    let mut archive = ZipWriter::new(std::io::Cursor::new(Vec::new()));
    let options = SimpleFileOptions::default().compression_method(method);
    for (name, content) in files {
        archive.start_file(name, options).unwrap();
        archive.write_all(&content).unwrap();
    }
    archive.finish().unwrap().into_inner()
}

/// The files of a bundle with their names, the description first.
pub fn contents(bundle: &Bundle) -> Vec<(&'static str, Vec<u8>)> {
    let files = bundle.to_files();
    let description = description::describe(bundle, &files).into_bytes();
    let files = files.into_iter().map(|file| (file.name, file.content));
    [(description::DESCRIPTION, description)].into_iter().chain(files).collect()
}

/// The experiment with a repertoire of two descriptors.
fn with_repertoire() -> ExperimentConfig {
    let mut config = config();
    config.algorithm.name = "MAP-Elites".to_owned();
    let [leaders, turns] = [Summarises::Mean, Summarises::End].map(|summarises| DescriptorConfig {
        measure: "leaders".to_owned(),
        summarises,
        range: [0.0, 5.0],
        cells: 3,
    });
    config.algorithm.descriptors = vec![leaders, turns];
    config.algorithm.populations[0].params = Params::default();
    ExperimentConfig::from_json(&config.to_canonical_json(), "", ALGORITHMS).unwrap().0
}

/// The experiment with a front of two aims beside fitness.
fn with_front() -> ExperimentConfig {
    let mut config = config();
    config.algorithm.name = "NSGA-II".to_owned();
    let [leaders, turns] = [Summarises::Mean, Summarises::End].map(|summarises| AimConfig {
        measure: "leaders".to_owned(),
        summarises,
        direction: Direction::Minimise,
    });
    config.algorithm.aims = vec![leaders, turns];
    config.algorithm.populations[0].params = Params::default();
    ExperimentConfig::from_json(&config.to_canonical_json(), "", ALGORITHMS).unwrap().0
}

#[test]
fn a_repertoire_is_proven_and_a_lie_in_one_descriptor_is_found() {
    assert_proven(&with_repertoire());
}

#[test]
fn a_front_is_proven_and_a_lie_in_one_aim_is_found() {
    assert_proven(&with_front());
}

fn assert_proven(config: &ExperimentConfig) {
    let honest = evolved(config, started(config), None, Vec::new(), |_, _| ());
    let read = Bundle::read(&honest.to_bytes().unwrap()).unwrap();
    verify(&read, Sample::All).unwrap();
    // The last number of a trial is its second descriptor or aim.
    let lie = |generation: u64, values: &mut Vec<Vec<f64>>| {
        if generation == 2 {
            let last = values[1].last_mut().unwrap();
            *last = f64::from_bits(last.to_bits() ^ 1);
        }
    };
    let lying = evolved(config, started(config), None, Vec::new(), lie);
    links(&lying).unwrap();
    let flaw = verify(&lying, Sample::All).unwrap_err();
    assert_eq!(flaw.claim, Claim::Simulation, "{flaw}");
    assert!(flaw.what.contains("descriptors"), "{flaw}");
    // The judgement of elites is simulated again in any case.
    let mut lying = honest;
    let last = lying.log.last_mut().unwrap();
    let mut told = Told::from_bytes(last).unwrap();
    *told.end.elites[0].last_mut().unwrap() += 1.0;
    *last = told.to_bytes();
    assert_eq!(links(&lying).unwrap_err().claim, Claim::Champion);
}

#[test]
fn a_bundle_reads_back_and_everything_in_it_is_proven() {
    let bytes = bundle().to_bytes().unwrap();
    assert_eq!(bytes, bundle().to_bytes().unwrap());
    let read = Bundle::read(&bytes).unwrap();
    assert_eq!(read, *bundle());
    let proof = verify(&read, Sample::All).unwrap();
    assert_eq!(champion_json(&proof.champion.unwrap()), bundle().champion_json);
    let (claim, last) = proof.proven.last().unwrap();
    assert_eq!(*claim, Claim::Simulation);
    // Re-evaluations of candidates follow the episodes of generations.
    let (_, simulated_again) = last.split_once("simulated again: ").unwrap();
    let n_episodes: usize = simulated_again.split(' ').next().unwrap().parse().unwrap();
    assert!(n_episodes > 4 * 4 * 2 + 4, "{last}");
    let links_only = verify(&read, Sample::Drawn(0)).unwrap();
    assert!(links_only.proven.last().unwrap().1.contains("no generation and the end of the run"));
}

#[test]
fn flipped_bits_of_every_file_are_found() {
    let contents = contents(bundle());
    let mut n_flips = 0;
    for (place, (name, content)) in contents.iter().enumerate().skip(1) {
        let n_bits = content.len() * 8;
        // The step is odd, so it reaches every bit of a byte.
        for bit in (0..n_bits).step_by((n_bits / 600) | 1) {
            let mut flipped = contents.clone();
            flipped[place].1[bit / 8] ^= 1 << (bit % 8);
            let read = Bundle::read(&archive(flipped));
            assert!(read.is_err(), "{name}: bit {bit}");
            n_flips += 1;
        }
    }
    assert!(n_flips > 3000, "{n_flips}");
}

#[test]
fn flipped_bits_are_found_even_if_the_description_is_updated() {
    // An attacker who changes a file can update its description.
    let contents = contents(bundle());
    for (name, n_flips) in [("fitness-log.bin", 80), ("keyframes.bin", 40), ("champion.json", 20)] {
        let place = contents.iter().position(|(found, _)| *found == name).unwrap();
        let n_bits = contents[place].1.len() * 8;
        for flip in 0..n_flips {
            let bit = (flip * (n_bits / n_flips)) | (flip % 8);
            let mut files = bundle().to_files();
            files[place - 1].content[bit / 8] ^= 1 << (bit % 8);
            let described = description::describe(bundle(), &files).into_bytes();
            let files = files.into_iter().map(|file| (file.name, file.content));
            let bytes = archive([(description::DESCRIPTION, described)].into_iter().chain(files));
            let is_found = Bundle::read(&bytes).map_or(true, |read| links(&read).is_err());
            assert!(is_found, "{name}: bit {bit}");
        }
    }
}

#[test]
fn flipped_bits_of_the_archive_itself_are_found_or_change_nothing() {
    let bytes = bundle().to_bytes().unwrap();
    let n_bits = bytes.len() * 8;
    let mut n_found = 0;
    for bit in (0..n_bits).step_by(n_bits / 1500) {
        let mut flipped = bytes.clone();
        flipped[bit / 8] ^= 1 << (bit % 8);
        match Bundle::read(&flipped) {
            Err(_) => n_found += 1,
            Ok(read) => assert_eq!(read, *bundle(), "bit {bit}"),
        }
    }
    assert!(n_found > 1400, "{n_found}");
}

#[test]
fn fitness_that_nobody_simulated_is_found_by_simulating() {
    let better = |generation, fitness: &mut Vec<Vec<f64>>| {
        if generation == 2 {
            fitness[3][1] = fitness[3][1].next_up();
        }
    };
    let forged = evolved(&config(), started(&config()), None, Vec::new(), better);
    links(&forged).unwrap();
    let flaw = verify(&forged, Sample::All).unwrap_err();
    assert_eq!(flaw.claim, Claim::Simulation);
    assert!(flaw.what.starts_with("generation 2: genotype 3 has"), "{flaw}");
}

#[test]
fn invalid_bundles_are_refused_in_one_line() {
    let refused = |bytes: &[u8], expected: &str| {
        let error = Bundle::read(bytes).unwrap_err().to_string();
        assert!(error.contains(expected) && error.lines().count() == 1, "{error}");
    };
    let bytes = bundle().to_bytes().unwrap();
    for len in [0, 1, 100, bytes.len() / 2, bytes.len() - 1] {
        refused(&bytes[..len], "cut off");
    }
    let with = |name: &'static str| {
        let more = [(name, b"x".to_vec())];
        archive(contents(bundle()).into_iter().chain(more))
    };
    // The length is checked first.
    refused(&vec![0; LEN_MAX as usize + 1], "but a bundle has at most 201326592");
    // The second file of the same name has the same length, so that no offset changes.
    let mut twice = with("champion.jsom");
    while let Some(at) = twice.windows(13).position(|name| name == b"champion.jsom") {
        twice[at + 12] = b'n';
    }
    refused(&twice, "it contains a file twice");
    let mut followed = bytes.clone();
    followed.extend(b"more");
    refused(&followed, "something follows it");
    refused(&with("notes.txt"), "it has the file `notes.txt`");
    refused(&with("../etc/passwd"), "it has the file `../etc/passwd`");
    refused(&with("a\nb"), "it has the file `a\\nb`");
    let without = contents(bundle()).into_iter().filter(|(name, _)| *name != "champion.json");
    refused(&archive(without), "it lacks the file `champion.json`");
    let changed = |from: &str, to: &str| {
        let mut files = contents(bundle());
        let text = String::from_utf8(files[1].1.clone()).unwrap();
        files[1].1 = text.replace(from, to).into();
        archive(files)
    };
    refused(&changed("\"format\": 1", "\"format\": 2"), "a bundle of format 2");
    let other = changed(FINGERPRINT, "sim-core 9.9.9 format 9");
    refused(
        &other,
        "computed by the simulation \"sim-core 9.9.9 format 9\" and written by swarmevo",
    );
}

#[test]
fn a_bomb_is_not_unpacked() {
    let bomb = packed([("champion.json", vec![0; 4 << 20])], CompressionMethod::Deflated);
    assert!(bomb.len() < 8 << 10);
    let unpacked = archive::unpack(&bomb, 1 << 20);
    assert_eq!(unpacked, Err(BundleError::UnpackedTooLong));
    assert_eq!(archive::unpack(&bomb, UNPACKED_LEN_MAX).unwrap()[0].1.len(), 4 << 20);
    let long = packed([("experiment.json", vec![0; 4 << 20])], CompressionMethod::Deflated);
    let error = archive::unpack(&long, UNPACKED_LEN_MAX).unwrap_err().to_string();
    assert!(error.contains("`experiment.json` has more than 1048576 bytes"), "{error}");
}

/// A fork of the run, with more robots and generations.
pub fn forked() -> Bundle {
    let parent = config();
    let mut child = parent.clone();
    child.seed += 1;
    child.algorithm.generations = 5;
    let mut evolution = started(&parent);
    for entry in &bundle().log[..2] {
        evolution.repeat(&Told::from_bytes(entry).unwrap()).unwrap();
    }
    let simulation = Simulation::compile(&child).unwrap();
    let fork = Fork {
        parent: &parent,
        parent_simulation: FINGERPRINT,
        child: &child,
        segments: simulation.population_segments(),
        simulation: FINGERPRINT,
    };
    let evolution = evolution.fork(&fork).unwrap();
    let link = evolution.digest();
    let fork = ForkOf { generation: 1, link, changes: vec!["seed: 1 -> 2".to_owned()] };
    let shared = bundle().history[..2].to_vec();
    evolved(&child, evolution, Some(fork), shared, |_, _| ())
}

#[test]
fn a_fork_is_proven_from_its_first_own_generation() {
    let fork = forked();
    assert_eq!(Bundle::read(&fork.to_bytes().unwrap()).unwrap(), fork);
    let proof = verify(&fork, Sample::All).unwrap();
    let link = bundle().history[1].digest.to_string();
    assert!(proof.unproven[1].contains(&link), "{:?}", proof.unproven);

    let mut elsewhere = fork.clone();
    elsewhere.history[1].digest = bundle().history[0].digest;
    assert_eq!(links(&elsewhere).unwrap_err().claim, Claim::Chain);
    let mut other_state = fork.clone();
    other_state.keyframes[0].1 = bundle().keyframes[2].1.clone();
    assert_eq!(links(&other_state).unwrap_err().claim, Claim::Keyframes);
    let mut of_nothing = fork;
    of_nothing.manifest.fork.as_mut().unwrap().generation = u64::MAX - 1;
    links(&of_nothing).unwrap_err();
}

#[test]
fn the_run_draws_the_generations_that_are_simulated_again() {
    let digest = Digest::of_config(&config(), FINGERPRINT);
    let drawn = Sample::Drawn(5).generations(digest, 100, 1100);
    assert_eq!(drawn, Sample::Drawn(5).generations(digest, 100, 1100));
    assert_eq!(drawn.len(), 5);
    assert!(drawn.iter().all(|generation| (100..1100).contains(generation)));
    assert_ne!(drawn, Sample::Drawn(5).generations(Digest::default(), 100, 1100));
    let more = Sample::Drawn(50).generations(digest, 100, 1100);
    assert!(drawn.is_subset(&more) && more.len() == 50);
    for sample in [Sample::All, Sample::Drawn(1000), Sample::Drawn(u64::MAX)] {
        assert_eq!(sample.generations(digest, 100, 1100), (100..1100).collect());
    }
}
