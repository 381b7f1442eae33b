//! Fronts: the package `pymoo` gives the same ranks, survivors and volumes, luck shows, judgements
//! correct.

use serde::Deserialize;

use super::*;
use crate::{
    FrontFigures, Operator, Parents, Pedigree, Setup, algorithms::Elite, dominance::Standing,
    front::costs,
};

#[derive(Deserialize)]
struct Fixture {
    start: Algorithm,
    generations: Vec<Step>,
}

/// A generation of one trial; what holds for the pool of kept individuals and newcomers; what must
/// follow.
#[derive(Deserialize)]
struct Step {
    genotypes: Vec<Genotype>,
    descriptors: Vec<Vec<f64>>,
    fitness: Vec<f64>,
    pool: Pool,
    after: After,
    reference: Vec<f64>,
    hypervolume: f64,
}

#[derive(Deserialize)]
struct Pool {
    rank: Vec<usize>,
    room: Vec<String>,
}

#[derive(Deserialize)]
struct After {
    kept: Vec<Genotype>,
    elites: Vec<Genotype>,
}

/// Lets a front learn the generations of a fixture, and compares ranks, room, survivors and volume.
fn assert_follows(fixture: &str, aims: &[Direction]) {
    let Fixture { start, generations } = serde_json::from_str(fixture).unwrap();
    let mut evolution = evolution_of(vec![start], 24);
    let mut pool: Vec<(Genotype, Vec<f64>)> = Vec::new();
    for (index, step) in (0..).zip(generations) {
        let newcomers = step.genotypes.iter().zip(&step.fitness).zip(&step.descriptors);
        pool.extend(newcomers.map(|((g, f), d)| (g.clone(), costs(*f, d, aims))));
        let of_pool: Vec<Vec<f64>> = pool.iter().map(|(_, costs)| costs.clone()).collect();
        let standing = Standing::new(&of_pool);
        assert_eq!(standing.rank, step.pool.rank, "generation {index}");
        for (found, expected) in standing.room.iter().zip(&step.pool.room) {
            let expected: f64 = expected.parse().unwrap();
            assert!(*found == expected || (found - expected).abs() < 1e-12, "{found} {expected}");
        }

        let genotypes: Population = step.genotypes.into();
        let samples = vec![Sample { genotypes: genotypes.clone(), ..Sample::new(vec![], vec![]) }];
        let fitness: Vec<Vec<f64>> = step.fitness.iter().map(|fitness| vec![*fitness]).collect();
        let told = Evaluations { fitness: &fitness, descriptors: &step.descriptors };
        let generation = evolution.generation(genotypes, samples);
        assert_eq!(generation.index, index);
        evolution.tell(generation, told).unwrap();
        pool.retain(|(genotype, _)| step.after.kept.contains(genotype));
        let [Algorithm::Nsga2(state)] = &evolution.populations[..] else { panic!("a front") };
        assert_eq!(genotypes_of(state.kept()), step.after.kept, "generation {index}");

        let end = End::default();
        let front = evolution.front(&end).unwrap();
        let found: Vec<&[f64]> = front.elites.iter().map(|elite| elite.genotype).collect();
        assert_eq!(found, step.after.elites, "generation {index}");
        let figures = front.figures(Some(&step.reference)).unwrap();
        assert!((figures.hypervolume - step.hypervolume).abs() < 1e-9, "{figures:?}");
        assert_eq!((figures.reference, figures.stay), (step.reference, None));
    }
}

fn genotypes_of(elites: &[Elite]) -> Vec<Genotype> {
    elites.iter().map(|elite| elite.genotype.clone()).collect()
}

#[test]
fn two_aims_have_the_ranks_survivors_and_volumes_of_the_package_pymoo() {
    let fixture = include_str!("../../tests/fixtures/nsga2_2.json");
    assert_follows(fixture, &[Direction::Minimise]);
}

#[test]
fn three_aims_have_the_ranks_survivors_and_volumes_of_the_package_pymoo() {
    let fixture = include_str!("../../tests/fixtures/nsga2_3.json");
    assert_follows(fixture, &[Direction::Minimise, Direction::Maximise]);
}

fn started(params: Params) -> Evolution {
    let aims = vec![Direction::Minimise];
    let setup = Setup { population_size: 40, seed: 3, aims, ..Setup::new("NSGA-II", 5) };
    Setup { params, ..setup }.start().unwrap()
}

/// Two trials per genotype. Fitness and the aim disagree about gene 0: all compromises have any
/// gene 0 and the other genes at 1/2.
fn told(genotypes: &[Genotype]) -> Told {
    let row = |genes: &Genotype| {
        let off: f64 = genes[1..].iter().map(|gene| (gene - 0.5) * (gene - 0.5)).sum();
        [genes[0] - off, genes[0] * genes[0] + off].repeat(2)
    };
    Told::from_values(&genotypes.iter().map(row).collect::<Vec<_>>(), 1)
}

fn advance(evolution: &mut Evolution) -> Told {
    let told = told(&evolution.ask().genotypes);
    evolution.repeat(&told).unwrap();
    told
}

#[test]
fn a_front_spreads_over_all_compromises() {
    for reevaluated in [0.0, 0.25] {
        let mut evolution = started(Params::default().with("reevaluated", reevaluated));
        for _ in 0..100 {
            let asked = evolution.ask();
            assert_eq!(asked.genotypes.len(), 40);
            assert!(asked.genotypes.iter().flatten().all(|gene| (0.0..=1.0).contains(gene)));
            advance(&mut evolution);
        }
        let end = End::default();
        let front = evolution.front(&end).unwrap();
        assert!(front.elites.len() >= 30, "{}", front.elites.len());
        // The best front between fitness 0 and 1 dominates 2/3 of the square.
        let figures = front.figures(Some(&[0.0, 1.0])).unwrap();
        assert!((0.62..0.667).contains(&figures.hypervolume), "{figures:?}");
        let mut places: Vec<f64> = front.elites.iter().map(|elite| elite.genotype[0]).collect();
        places.sort_by(f64::total_cmp);
        assert!(places[0] < 0.02 && places[places.len() - 1] > 0.98, "{places:?}");
        assert!(places.windows(2).all(|pair| pair[1] - pair[0] < 0.15), "{places:?}");
    }
}

#[test]
fn checkpoints_and_logs_restore_a_front_to_the_same_bits() {
    let mut evolution = started(Params::default());
    let keyframe = evolution.keyframe();
    let log: Vec<Vec<u8>> = (0..5).map(|_| advance(&mut evolution).to_bytes()).collect();
    let restored = Evolution::restore(&Checkpoint { keyframe, log, n_flat: 0 }).unwrap();
    assert_eq!((&restored, restored.keyframe()), (&evolution, evolution.keyframe()));
    assert_eq!(restored.ask(), evolution.ask());
    let json = serde_json::to_string(&evolution).unwrap();
    assert_eq!(serde_json::from_str::<Evolution>(&json).unwrap(), evolution);
}

#[test]
fn a_front_of_nobody_is_a_notice() {
    let mut evolution = started(Params::default());
    let mut notices = Vec::new();
    for _ in 0..11 {
        let asked = evolution.ask();
        let mut told = told(&asked.genotypes);
        told.descriptors.iter_mut().flatten().for_each(|value| *value = f64::NAN);
        notices.extend(evolution.learn(asked, &told, |_| None).unwrap().notices);
    }
    let places: Vec<&str> =
        notices.iter().map(|notice| notice.split(':').next().unwrap()).collect();
    assert_eq!(places, ["generation 0", "generation 9"], "{notices:?}");
    assert!(notices[0].contains("check the measures in `algorithm.aims`"), "{notices:?}");
}

/// These bits come from the first version.
#[test]
fn the_bits_of_a_front_are_fixed() {
    let mut evolution = started(Params::default());
    (0..10).for_each(|_| drop(advance(&mut evolution)));
    assert_eq!(evolution.digest().to_string()[..16], *"516cd99a953f6d89");
}

#[test]
fn individuals_without_finite_numbers_stay_out_and_leave() {
    let mut evolution = started(Params::default());
    let mut first = told(&evolution.ask().genotypes);
    first.descriptors[0][1] = f64::NAN;
    first.trial_fitness[1][1] = f64::INFINITY;
    evolution.repeat(&first).unwrap();
    let [Algorithm::Nsga2(state)] = &evolution.populations[..] else { panic!("a front") };
    assert_eq!(state.kept().len(), 38);
    let mut second = told(&evolution.ask().genotypes);
    // A quarter of the individuals are evaluated again, and have a NaN now.
    second.descriptors[..10].iter_mut().for_each(|row| row[0] = f64::NAN);
    let [births] = &evolution.births().unwrap()[..] else { panic!("one population") };
    let again: Vec<(u64, u32)> = births[..10]
        .iter()
        .map(|birth| match birth.parents {
            Parents::Again(born) => born,
            _ => panic!("{birth:?}"),
        })
        .collect();
    evolution.repeat(&second).unwrap();
    let [Algorithm::Nsga2(state)] = &evolution.populations[..] else { panic!("a front") };
    assert!(state.kept().iter().all(|elite| !again.contains(&elite.born())));
    let mut none = told(&evolution.ask().genotypes);
    none.descriptors.iter_mut().flatten().for_each(|value| *value = f64::NAN);
    evolution.repeat(&none).unwrap();
    assert!(evolution.ask().genotypes.iter().flatten().all(|gene| gene.is_finite()));
}

#[test]
fn zeros_of_both_signs_are_equal() {
    let of = |value: f64| costs(value, &[value], &[Direction::Minimise]);
    assert_eq!(Standing::new(&[of(0.0), of(-0.0), of(0.0)]).rank, [0; 3]);
    assert!(of(-0.0).iter().chain(&of(0.0)).all(|cost| cost.to_bits() == 0));
}

/// Individuals that are evaluated again pool their trials, and a lucky one falls off the front.
#[test]
fn luck_shows_when_members_meet_more_trials() {
    let params = Params::default().with("reevaluated", 0.5);
    let aims = vec![Direction::Maximise];
    let setup = Setup { population_size: 4, aims, params, ..Setup::new("NSGA-II", 1) };
    let mut evolution = setup.start().unwrap();
    let mut tell = |values: [[f64; 2]; 4]| {
        let rows: Vec<Vec<f64>> = values.iter().map(|values| values.to_vec()).collect();
        evolution.repeat(&Told::from_values(&rows, 1)).unwrap();
        let end = End::default();
        let front = evolution.front(&end).unwrap();
        front.elites.iter().map(|elite| (elite.individual, elite.n_trials)).collect::<Vec<_>>()
    };
    // Individual 3 was lucky; individual 2 is the other end of the front.
    assert_eq!(tell([[1.0, 1.0], [2.0, 2.0], [0.0, 5.0], [9.0, 4.0]]), [(2, 1), (3, 1)]);
    // Both meet new trials, as the first of the generation. Children are worse.
    let last = tell([[0.0, 5.0], [-7.0, 0.0], [-9.0, -9.0], [-9.0, -9.0]]);
    assert_eq!(last, [(1, 1), (2, 2)], "individual 3 is worth (1, 2), individual 1 (2, 2)");
}

#[test]
fn a_lineage_follows_crossed_and_mutated_parents_to_their_births() {
    let mut evolution = started(Params::default());
    let mut pedigree = Pedigree::starting_at(0);
    for _ in 0..12 {
        let [births]: [_; 1] = evolution.births().unwrap().try_into().unwrap();
        let told = told(&evolution.ask().genotypes);
        assert!(evolution.families(&told, &told).is_none());
        pedigree.push(births, &told);
        evolution.repeat(&told).unwrap();
    }
    let lineage = pedigree.trace(39);
    let known: Vec<(u64, u32)> =
        lineage.iter().map(|ancestor| (ancestor.generation, ancestor.individual)).collect();
    let mut operators = Vec::new();
    for ancestor in &lineage {
        let birth = ancestor.birth.as_ref().unwrap();
        operators.push(birth.operator);
        assert_eq!(birth.operator == Operator::First, ancestor.generation == 0);
        assert!(birth.parents.iter().all(|of| known.contains(&(of.generation, of.individual))));
        let n_genes: usize = birth.parents.iter().map(|parent| parent.n_genes).sum();
        assert_eq!(n_genes + birth.n_new, 5);
    }
    assert!(operators.contains(&Operator::Crossover) && operators.contains(&Operator::Copy));
}

#[test]
fn a_judgement_corrects_the_front() {
    let mut evolution = started(Params::default());
    (0..20).for_each(|_| drop(advance(&mut evolution)));
    let judgement = evolution.judgement().unwrap();
    let n_elites = judgement.genotypes().len() - 1;
    assert!(n_elites > 10);
    // The first half of the elites is as it seemed, the others are far worse.
    let values = |worst: f64| {
        let judge = |(i, genes): (usize, &Genotype)| match i <= n_elites / 2 {
            true => told(std::slice::from_ref(genes)).values().remove(0),
            false => [-2.0, worst].repeat(2),
        };
        judgement.genotypes().iter().enumerate().map(judge).collect::<Vec<_>>()
    };
    let end = judgement.end(&values(8.0));
    let front = evolution.front(&end).unwrap();
    assert_eq!(front.shown(), (0..n_elites / 2).collect::<Vec<_>>());
    let FrontFigures { hypervolume, reference, stay } = front.figures(None).unwrap();
    assert_eq!(reference, [-2.0, 8.0], "the worst of all elites");
    assert_eq!(stay, Some((n_elites / 2) as f64 / n_elites as f64));
    assert!(hypervolume > 2.0 * 8.0 && hypervolume < 3.0 * 8.0, "{hypervolume}");
    let before = End::default();
    let optimistic = evolution.front(&before).unwrap();
    assert_eq!(optimistic.shown().len(), n_elites);
    assert_eq!(optimistic.figures(None).unwrap().stay, None);

    // The end of a run repeats to the same bits, and every bit of it enters the digest.
    let outcome = |end: &End| Told { end: end.clone(), ..Told::default() };
    let digest = |end: &End| evolution.outcome(&outcome(end)).unwrap().digest;
    assert_eq!(digest(&end), judgement.clone().decide(&values(8.0)).1);
    assert_ne!(digest(&end), digest(&judgement.end(&values(8.0f64.next_up()))));
}

#[test]
fn judged_elites_with_numbers_that_are_not_finite_are_not_on_the_front() {
    let mut evolution = started(Params::default());
    (0..5).for_each(|_| drop(advance(&mut evolution)));
    let judgement = evolution.judgement().unwrap();
    let mut values = told(&judgement.genotypes()).values();
    values[1][1] = f64::NAN;
    let end = judgement.end(&values);
    let front = evolution.front(&end).unwrap();
    assert!(front.elites[0].judged.is_none() && !front.shown().contains(&0));
    assert!(front.figures(None).unwrap().hypervolume.is_finite());
}
