//! Repertoires: archives given the same behaviours, evidence of many trials, and judgements.

use serde::Deserialize;
use serde_json::{Value, json};

use super::*;
use crate::{Corrected, Operator, Pedigree, Setup};

#[derive(Deserialize)]
struct Fixture {
    start: Algorithm,
    generations: Vec<Step>,
}

/// A generation of one trial, and the elites that must follow.
#[derive(Deserialize)]
struct Step {
    genotypes: Vec<Genotype>,
    descriptors: Vec<Vec<f64>>,
    fitness: Vec<f64>,
    after: After,
}

#[derive(Deserialize)]
struct After {
    cells: Option<Vec<Vec<u32>>>,
    genotypes: Vec<Genotype>,
    fitness: Vec<f64>,
}

/// Lets a repertoire learn the generations of a fixture, and compares its elites after each.
fn assert_follows(fixture: &str) {
    let Fixture { start, generations } = serde_json::from_str(fixture).unwrap();
    let mut evolution = evolution_of(vec![start], 30);
    for (index, Step { genotypes, descriptors, fitness, after }) in (0..).zip(generations) {
        let genotypes: Population = genotypes.into();
        let samples = vec![Sample { genotypes: genotypes.clone(), ..Sample::new(vec![], vec![]) }];
        let fitness: Vec<Vec<f64>> = fitness.iter().map(|fitness| vec![*fitness]).collect();
        let told = Evaluations { fitness: &fitness, descriptors: &descriptors };
        let generation = evolution.generation(genotypes, samples);
        assert_eq!(generation.index, index);
        evolution.tell(generation, told).unwrap();
        let end = End::default();
        let repertoire = evolution.elites(&end).unwrap();
        let mut elites: Vec<&EliteReport<'_>> = repertoire.elites.iter().collect();
        if let Some(cells) = after.cells {
            elites.sort_by(|a, b| a.cell.cmp(&b.cell));
            let found: Vec<Vec<u32>> = elites.iter().map(|elite| elite.cell.clone()).collect();
            assert_eq!(found, cells, "generation {index}");
        }
        let found: Vec<&[f64]> = elites.iter().map(|elite| elite.genotype).collect();
        assert_eq!(found, after.genotypes, "generation {index}");
        let found: Vec<f64> = elites.iter().map(|elite| elite.fitness).collect();
        assert_eq!(found, after.fitness, "generation {index}");
    }
}

#[test]
fn map_elites_keeps_the_archive_of_the_package_ribs() {
    assert_follows(include_str!("../../tests/fixtures/map_elites.json"));
}

#[test]
fn dns_keeps_the_survivors_of_its_paper() {
    assert_follows(include_str!("../../tests/fixtures/dns.json"));
}

#[test]
fn novelty_search_keeps_the_archive_of_its_paper() {
    assert_follows(include_str!("../../tests/fixtures/novelty.json"));
}

const NAMES: [&str; 5] = ["MAP-Elites", "DNS", "novelty", "CMA-MAE", "sep-CMA-MAE"];

fn axes() -> Vec<Axis> {
    vec![Axis { low: 0.0, high: 1.0, n_cells: 4 }, Axis { low: -1.0, high: 1.0, n_cells: 3 }]
}

fn started(name: &str, params: Params) -> Evolution {
    let setup = Setup { population_size: 20, seed: 3, axes: axes(), ..Setup::new(name, 3) };
    Setup { params, ..setup }.start().unwrap()
}

/// Two trials per genotype: the fitness is gene 2, a little different in each trial; the
/// descriptors are gene 0 and the difference of genes 1 and 0.
fn described(genotypes: &[Genotype]) -> Told {
    let row = |genes: &Genotype| {
        let described = [genes[0], genes[1] - genes[0]];
        [&[genes[2]], &described[..], &[genes[2] + 0.25], &described[..]].concat()
    };
    Told::from_values(&genotypes.iter().map(row).collect::<Vec<_>>(), 2)
}

fn advance(evolution: &mut Evolution) -> Told {
    let told = described(&evolution.ask().genotypes);
    evolution.repeat(&told).unwrap();
    told
}

#[test]
fn repertoires_fill_the_grid_with_good_elites_in_the_range_of_genes() {
    for name in NAMES {
        let mut evolution = Evolution { population_size: 100, ..started(name, Params::default()) };
        for _ in 0..60 {
            assert!(evolution.ask().genotypes.iter().flatten().all(|g| (0.0..=1.0).contains(g)));
            advance(&mut evolution);
        }
        let end = End::default();
        let repertoire = evolution.elites(&end).unwrap();
        let best = repertoire.by_cell();
        // Gene 1 is at least 0, so the last cell of the second axis is out of reach with gene 0 in
        // its last cell, and the first cell with gene 0 in its first.
        assert_eq!(best.len(), 10, "{name}");
        // Novelty search does not care for fitness.
        let is_fit = |elite: &&EliteReport<'_>| elite.fitness > 1.0 || name == "novelty";
        assert!(best.iter().all(is_fit), "{name}: {best:?}");
        assert_eq!(repertoire.figures(), None, "{name}: nothing is judged");
    }
}

#[test]
fn checkpoints_and_logs_restore_a_repertoire_to_the_same_bits() {
    for name in NAMES {
        let mut evolution = started(name, Params::default());
        let keyframe = evolution.keyframe();
        let log: Vec<Vec<u8>> = (0..5).map(|_| advance(&mut evolution).to_bytes()).collect();
        let checkpoint = Checkpoint { keyframe, log, n_flat: 0 };
        let restored = Evolution::restore(&checkpoint).unwrap();
        assert_eq!((&restored, restored.keyframe()), (&evolution, evolution.keyframe()), "{name}");
        assert_eq!(restored.ask(), evolution.ask(), "{name}");
        let json = serde_json::to_string(&evolution).unwrap();
        assert_eq!(serde_json::from_str::<Evolution>(&json).unwrap(), evolution, "{name}");
    }
}

#[test]
fn every_bit_of_every_descriptor_enters_the_digest() {
    let digest = |change: fn(&mut f64)| {
        let mut evolution = started("DNS", Params::default());
        let mut told = described(&evolution.ask().genotypes);
        change(&mut told.descriptors[7][3]);
        evolution.repeat(&told).unwrap();
        evolution.digest()
    };
    assert_eq!(digest(|_| ()), digest(|_| ()));
    assert_ne!(digest(|_| ()), digest(|value| *value = value.next_up()));
}

#[test]
fn entries_with_other_descriptors_do_not_fit() {
    let evolution = started("MAP-Elites", Params::default());
    let told = described(&evolution.ask().genotypes);
    assert_eq!(Told::from_bytes(&told.to_bytes()).unwrap(), told);
    assert_eq!(Told::from_values(&told.values(), 2), told);
    let misfits: [fn(&mut Told); 3] = [
        |told| told.descriptors.clear(),
        |told| told.descriptors[0].truncate(3),
        |told| told.descriptors.truncate(3),
    ];
    for change in misfits {
        let mut told = told.clone();
        change(&mut told);
        let refused = evolution.clone().repeat(&told).map(|_| ()).unwrap_err();
        assert!(matches!(refused, CheckpointError::Misfit { generation: 0 }), "{refused}");
    }
    let mut snes = self::evolution(20, &[3]);
    assert!(snes.repeat(&told).is_err(), "an algorithm without descriptors");
}

/// Elites that are evaluated again pool their trials, and a lucky newcomer falls back behind the
/// former elite, which the cell has kept.
#[test]
fn luck_shows_when_elites_meet_more_trials() {
    let params = Params::default().with("reevaluated", 0.5);
    let one_cell = vec![Axis { low: 0.0, high: 1.0, n_cells: 1 }];
    let setup = Setup { population_size: 4, axes: one_cell, params, ..Setup::new("MAP-Elites", 1) };
    let mut evolution = setup.start().unwrap();
    let mut tell = |fitness: [f64; 4]| {
        let row = |fitness: &f64| vec![*fitness, 0.5];
        let told = Told::from_values(&fitness.iter().map(row).collect::<Vec<_>>(), 1);
        evolution.repeat(&told).unwrap();
        let end = End::default();
        let elite = evolution.elites(&end).unwrap().elites.remove(0);
        (elite.generation, elite.individual, elite.n_trials, elite.fitness)
    };
    assert_eq!(tell([1.0, 4.0, 3.0, 2.0]), (0, 1, 1, 4.0));
    // Individuals 0 and 1 are the two that the cell keeps, 4 and 3.
    assert_eq!(tell([4.0, 3.0, 9.0, 0.0]), (1, 2, 1, 9.0), "a lucky newcomer");
    // The newcomer has the fewest trials, and is not worth 9; it meets the next trials first.
    assert_eq!(tell([-5.0, 4.0, 0.0, 0.0]), (0, 1, 3, 4.0), "the former elite is back");
}

#[test]
fn individuals_without_finite_numbers_stay_out_and_leave() {
    for name in NAMES {
        let mut evolution = started(name, Params::default());
        let mut told = described(&evolution.ask().genotypes);
        told.descriptors[0][1] = f64::NAN;
        told.trial_fitness[1][1] = f64::INFINITY;
        evolution.repeat(&told).unwrap();
        let end = End::default();
        let born: Vec<u32> =
            evolution.elites(&end).unwrap().elites.iter().map(|elite| elite.individual).collect();
        assert!(!born.contains(&0) && !born.contains(&1) && !born.is_empty(), "{name}: {born:?}");
        let genotypes = evolution.ask().genotypes;
        let mut told = described(&genotypes);
        // Up to five of twenty are elites again, as many as there are.
        let n_again = born.len().min(5);
        told.descriptors[..n_again].iter_mut().for_each(|row| row[0] = f64::NAN);
        let repertoire = evolution.elites(&end).unwrap();
        let is_again = |elite: &&EliteReport<'_>| {
            genotypes[..n_again].iter().any(|genes| genes == elite.genotype)
        };
        let again: Vec<u32> =
            repertoire.elites.iter().filter(is_again).map(|elite| elite.individual).collect();
        assert_eq!(again.len(), n_again, "{name}");
        evolution.repeat(&told).unwrap();
        let repertoire = evolution.elites(&end).unwrap();
        let mut first = repertoire.elites.iter().filter(|elite| elite.generation == 0);
        assert!(first.all(|elite| !again.contains(&elite.individual)), "{name}");
    }
}

#[test]
fn a_lineage_follows_elites_to_the_generations_of_their_births() {
    let mut evolution = started("MAP-Elites", Params::default());
    let mut pedigree = Pedigree::starting_at(0);
    for _ in 0..12 {
        let [births]: [_; 1] = evolution.births().unwrap().try_into().unwrap();
        let told = described(&evolution.ask().genotypes);
        assert!(evolution.families(&told, &told).is_none());
        pedigree.push(births, &told);
        evolution.repeat(&told).unwrap();
    }
    let lineage = pedigree.trace(19);
    let known: Vec<(u64, u32)> =
        lineage.iter().map(|ancestor| (ancestor.generation, ancestor.individual)).collect();
    let mut n_old = 0;
    for ancestor in &lineage {
        let birth = ancestor.birth.as_ref().unwrap();
        assert_eq!(birth.operator == Operator::First, ancestor.generation == 0);
        assert!(birth.parents.iter().all(|of| known.contains(&(of.generation, of.individual))));
        n_old += birth.parents.iter().filter(|of| of.generation + 1 < ancestor.generation).count();
    }
    assert!(n_old > 0, "no parent is older than the previous generation");
}

#[test]
fn a_judgement_corrects_fitness_and_place_of_every_elite() {
    let mut evolution = started("MAP-Elites", Params::default());
    (0..20).for_each(|_| drop(advance(&mut evolution)));
    let judgement = evolution.judgement().unwrap();
    let n_elites = judgement.genotypes().len() - 1;
    let values = |fitness: f64, first: f64| {
        let genotypes = judgement.genotypes();
        let row = |genes: &Genotype| [fitness, first, genes[1] - genes[0]].repeat(3);
        genotypes.iter().map(row).collect::<Vec<_>>()
    };
    // All move to the first column.
    let end = judgement.end(&values(0.5, 0.0));
    assert_eq!((end.judgement.len(), end.elites.len()), (3, n_elites));
    let repertoire = evolution.elites(&end).unwrap();
    let in_first = repertoire.elites.iter().filter(|elite| elite.cell[0] == 0).count() as f64;
    let n_corrected = repertoire.corrected().len() as f64;
    let expected = Corrected {
        qd_score: 0.5 * n_corrected,
        coverage: n_corrected / 12.0,
        stay: in_first / n_elites as f64,
    };
    assert_eq!(repertoire.figures(), Some(expected));
    assert!(n_corrected <= 3.0 && n_corrected < n_elites as f64);

    // The end of a run repeats to the same bits, and every bit of it enters the digest.
    let told = |end: &End| Told { end: end.clone(), ..Told::default() };
    let digest = |end: &End| evolution.outcome(&told(end)).unwrap().digest;
    assert_eq!(digest(&end), judgement.clone().decide(&values(0.5, 0.0)).1);
    assert_ne!(digest(&end), digest(&judgement.end(&values(0.5, 0.0f64.next_up()))));
    let outcome = told(&end);
    let evaluated = evolution.outcome(&outcome).unwrap().evaluated;
    let sizes = evaluated.iter().map(|one| one.values_per_trial).collect::<Vec<_>>();
    assert_eq!(sizes, [1, 3]);
    let short = End { elites: end.elites[1..].to_vec(), ..end.clone() };
    assert!(evolution.outcome(&told(&short)).is_err());
}

#[test]
fn behaviours_beyond_the_range_belong_to_the_cells_at_its_ends() {
    let [axis, _] = axes()[..] else { panic!("two axes") };
    let cells = [-9.0, 0.0, 0.249, 0.25, 0.99, 1.0, 1e300].map(|value| axis.cell(value));
    assert_eq!(cells, [0, 0, 0, 1, 3, 3, 3]);
}

#[test]
fn a_large_repertoire_fits_into_a_checkpoint() {
    let grid = vec![Axis { low: 0.0, high: 1.0, n_cells: 64 }; 2];
    let setup = Setup { population_size: 1000, axes: grid, ..Setup::new("MAP-Elites", 455) };
    let mut evolution = setup.start().unwrap();
    for round in 0..10 {
        let asked = evolution.ask();
        let row = |i: usize| vec![1.0, (i % 64) as f64 / 64.0, ((i / 64) % 64) as f64 / 64.0];
        let values: Vec<Vec<f64>> = (0..1000).map(|i| row(i + 750 * round)).collect();
        let told = Told::from_values(&values, 2);
        evolution.tell(asked, &told).unwrap();
    }
    assert_eq!(evolution.populations[0].behaviours().unwrap().elites().len(), 4096);
    let keyframe = evolution.keyframe();
    assert!(keyframe.len() < 32 << 20, "{}", keyframe.len());
    let restored = Evolution::restore(&Checkpoint { keyframe, ..Checkpoint::default() }).unwrap();
    assert_eq!(restored, evolution);
}

/// Makes a change to the state of an algorithm, and restores what a stranger would write of it.
fn restored(evolution: &Evolution, change: impl Fn(&mut Value)) -> Result<Evolution, String> {
    let mut state = serde_json::to_value(&evolution.populations[0]).unwrap();
    change(state.as_object_mut().unwrap().values_mut().next().unwrap());
    let populations = vec![serde_json::from_value(state).unwrap()];
    let keyframe = Evolution { populations, ..evolution.clone() }.keyframe();
    let checkpoint = Checkpoint { keyframe, ..Checkpoint::default() };
    Evolution::restore(&checkpoint).map_err(|error| error.to_string())
}

#[test]
fn states_whose_parts_contradict_each_other_are_refused() {
    let aims = vec![Direction::Minimise];
    let front = Setup { population_size: 20, aims, ..Setup::new("NSGA-II", 3) }.start().unwrap();
    let repertoires = ["MAP-Elites", "DNS", "novelty", "CMA-MAE", "sep-CMA-MAE"];
    let repertoires = repertoires.map(|name| started(name, Params::default()));
    for mut evolution in repertoires.into_iter().chain([front]) {
        let told = described(&evolution.ask().genotypes);
        let n = evolution.n_descriptors();
        let values: Vec<Vec<f64>> = told
            .values()
            .iter()
            .map(|row| row.chunks(3).flat_map(|trial| trial[..1 + n].to_vec()).collect())
            .collect();
        evolution.repeat(&Told::from_values(&values, n)).unwrap();
        assert_eq!(restored(&evolution, |_| {}).as_ref(), Ok(&evolution));
        let refused = |what: &str, change: &dyn Fn(&mut Value)| {
            let error = restored(&evolution, change).unwrap_err();
            assert!(error.contains("not the state of a run"), "{what}: {error}");
        };
        let elites: fn(&mut Value) -> &mut Value = |state| match state.get("elites") {
            Some(_) => &mut state["elites"],
            None => state,
        };
        refused("genes", &|state| elites(state)["kept"][0]["genotype"] = json!(vec![0.5; 4]));
        refused("descriptors", &|state| {
            elites(state)["kept"][0]["descriptors"] = json!(vec![0.5; 3])
        });
        refused("trials", &|state| elites(state)["kept"][0]["n_trials"] = json!(0));
        refused("many", &|state| {
            let kept = &mut elites(state)["kept"];
            *kept = vec![kept[0].clone(); 100_001].into();
        });
        if n == 1 {
            refused("aims", &|state| state["aims"] = json!(["minimise", "minimise", "minimise"]));
        } else {
            refused("axes", &|state| elites(state)["axes"] = json!([]));
            refused("cells", &|state| elites(state)["axes"][0]["n_cells"] = json!(u32::MAX));
        }
    }
}

#[test]
fn emitters_fit_their_repertoire() {
    for name in ["CMA-MAE", "sep-CMA-MAE"] {
        let evolution = started(name, Params::default());
        let other = Setup { axes: axes(), ..Setup::new(name, 4) }.start().unwrap();
        let other = serde_json::to_value(&other.populations[0]).unwrap();
        let emitters = other.as_object().unwrap().values().next().unwrap()["emitters"].clone();
        for (what, value) in
            [("emitters", json!([])), ("emitters", emitters), ("thresholds", json!([0.5]))]
        {
            let error = restored(&evolution, |state| state[what] = value.clone()).unwrap_err();
            assert!(error.contains("not the state of a run"), "{what}: {error}");
        }
    }
}
