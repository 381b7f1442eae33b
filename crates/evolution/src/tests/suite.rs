//! Properties of every algorithm with every operator.

use serde_json::Value;

use super::*;

/// The genetic algorithm's parameters in these tests.
pub fn ga() -> Params {
    Params::default().with("mutation_sigma", 0.1)
}

/// Parameters that differ from the defaults by these numbers.
pub fn params(numbers: &[(&str, f64)]) -> Params {
    let with = |params: Params, &(key, value): &(&str, f64)| params.with(key, value);
    numbers.iter().fold(Params::default(), with)
}

/// An algorithm's name and parameters.
pub type Variant = (&'static str, Params);

pub fn evolution_strategies() -> Vec<Variant> {
    ["SNES", "xNES", "CMA-ES", "sep-CMA-ES", "openaiES", "PGPE"]
        .map(|name| (name, params(&[])))
        .to_vec()
}

/// The genetic algorithm with every combination of operators whose selection `has_selection`
/// accepts.
pub fn genetic_algorithms(has_selection: impl Fn(&str) -> bool) -> Vec<Variant> {
    let names = |key: &str| -> &'static [&'static str] {
        let description = AlgorithmDescription::find(ALGORITHMS, "GA").unwrap();
        let parameter = description.parameters.iter().find(|parameter| parameter.key == key);
        match parameter.unwrap().domain {
            Domain::OneOf { names, .. } => names,
            other => panic!("{key} is {other:?}"),
        }
    };
    let mut variants = Vec::new();
    for selection in names("selection_operator").iter().filter(|name| has_selection(name)) {
        for crossover in names("crossover_operator") {
            for mutation in names("mutation_operator") {
                let params = ga()
                    .with("selection_operator", *selection)
                    .with("crossover_operator", *crossover)
                    .with("mutation_operator", *mutation);
                variants.push(("GA", params));
            }
        }
    }
    variants
}

/// Every algorithm with its defaults, the genetic one with all its operators, and restarts.
fn all() -> Vec<Variant> {
    let others = by_fitness().map(|algorithm| algorithm.name).filter(|name| *name != "GA");
    let restarts =
        ["ipop", "bipop"].map(|name| ("CMA-ES", Params::default().with("restarts", name)));
    let with_defaults = others.map(|name| (name, params(&[])));
    with_defaults.chain(restarts).chain(genetic_algorithms(|_| true)).collect()
}

pub fn start(
    (name, params): &Variant,
    segment_lens: &[usize],
    population_size: usize,
) -> Evolution {
    let algorithm =
        |&d: &usize| Algorithm::new(name, params, d, &BesideFitness::default()).unwrap();
    evolution_of(segment_lens.iter().map(algorithm).collect(), population_size)
}

fn assert_genes_are_sound(genotypes: &[Genotype], what: &impl std::fmt::Debug) {
    let mut genes = genotypes.iter().flatten();
    assert!(genes.all(|gene| (0.0..=1.0).contains(gene)), "{what:?} {genotypes:?}");
}

/// Numbers that JSON lacks are written as null.
fn has_null(value: &Value) -> bool {
    match value {
        Value::Null => true,
        Value::Array(items) => items.iter().any(has_null),
        Value::Object(items) => items.values().any(has_null),
        _ => false,
    }
}

fn assert_state_is_finite(evolution: &Evolution, what: &impl std::fmt::Debug) {
    let state = serde_json::to_value(&evolution.populations).unwrap();
    assert!(!has_null(&state), "{what:?} {state}");
}

/// The states of an evolution before and after each of ten generations with re-evaluations, and
/// its fitness log.
fn recorded(variant: &Variant) -> (Vec<Evolution>, Vec<Told>) {
    let mut states = vec![start(variant, &[14, 13], 5)];
    let mut log = Vec::new();
    for g in 0..10 {
        let mut evolution = states[g].clone();
        let generation = evolution.ask();
        let mut told = Told::from_fitness(evaluate(&generation.genotypes));
        evolution.tell(generation, &told.trial_fitness).unwrap();
        if evolution.n_generations().is_multiple_of(3) {
            let mut round = evolution.reevaluation().unwrap();
            while !round.is_over() {
                let noisy = |trials: &Vec<f64>| vec![trials[0] - 0.1, trials[0] + 0.1];
                round.learn(&evaluate(&round.genotypes()).iter().map(noisy).collect::<Vec<_>>());
            }
            evolution.set_champion(&round);
            told.blocks = round.blocks().to_vec();
        }
        states.push(evolution);
        log.push(told);
    }
    (states, log)
}

#[test]
fn every_generation_comes_back_from_every_keyframe_before_it() {
    let mut n_blocks_max = 0;
    for variant in all() {
        let (states, log) = recorded(&variant);
        n_blocks_max = log.iter().map(|told| told.blocks.len()).fold(n_blocks_max, usize::max);
        // Evaluations at the end of a run are stored, and do not change evolution.
        let end = End { blocks: vec![vec![vec![7.0]]], judgement: vec![8.0], ..End::default() };
        let bytes = |told: &Told| Told { end: end.clone(), ..told.clone() }.to_bytes();
        let log: Vec<Vec<u8>> = log.iter().map(bytes).collect();
        for (g, state) in states.iter().enumerate() {
            for (k, earlier) in states[..=g].iter().enumerate() {
                let keyframe = earlier.keyframe();
                let restored = Evolution::restore(&Checkpoint {
                    keyframe,
                    log: log[k..g].to_vec(),
                    n_flat: 0,
                });
                // Compares genotypes, champions, digests, and everything that follows from them.
                assert_eq!(restored.unwrap(), *state, "{variant:?} generation {g} from {k}");
            }
        }
    }
    assert!(n_blocks_max > 1, "some candidates are close");
}

#[test]
fn an_individual_drawn_alone_has_the_bits_of_its_generation() {
    let mut n_drawn = 0;
    for variant in all() {
        for population_size in [6, 7] {
            let mut evolution = start(&variant, &[9, 40], population_size);
            step(&mut evolution);
            let Some(bytes) = evolution.distribution() else { continue };
            n_drawn += 1;
            let distribution = Distribution::from_bytes(&bytes).unwrap();
            let generation = evolution.ask();
            assert_eq!(distribution.generation(), generation.index);
            // Draws in an arbitrary order.
            for i in (0..population_size).rev() {
                let bits = |genes: &[f64]| genes.iter().map(|gene| gene.to_bits()).collect();
                let (drawn, asked): (Vec<u64>, Vec<u64>) =
                    (bits(&distribution.genotype(i).unwrap()), bits(&generation.genotypes[i]));
                assert_eq!(drawn, asked, "{variant:?} individual {i} of {population_size}");
            }
            assert_eq!(distribution.genotype(population_size), None);
        }
    }
    assert_eq!(n_drawn, 8, "SNES, sep-CMA-ES, OpenAI-ES and PGPE draw individuals one by one");
}

#[test]
fn every_generation_is_complete_and_new() {
    for variant in all() {
        for population_size in [4, 11] {
            let mut evolution = start(&variant, &[5], population_size);
            let mut previous = Population::default();
            for _ in 0..4 {
                let generation = evolution.ask();
                assert_eq!(generation.genotypes.len(), population_size);
                assert!(generation.genotypes.iter().all(|genotype| genotype.len() == 5));
                assert_genes_are_sound(&generation.genotypes, &variant);
                assert_ne!(generation.genotypes, previous, "{variant:?}");
                previous = generation.genotypes;
                step(&mut evolution);
            }
        }
    }
}

#[test]
fn populations_draw_independently_and_meet_by_index() {
    for variant in all() {
        let mut evolution = start(&variant, &[6, 6], 8);
        for _ in 0..3 {
            let generation = evolution.ask();
            for (i, genotype) in generation.genotypes.iter().enumerate() {
                let parts = generation.samples.iter().map(|sample| sample.genotypes[i].clone());
                assert_eq!(*genotype, parts.collect::<Vec<_>>().concat());
            }
            // Two populations may share only the centre individual of an odd population of pairs.
            assert_ne!(
                generation.samples[0].genotypes, generation.samples[1].genotypes,
                "{variant:?}"
            );
            step(&mut evolution);
        }
    }
}

#[test]
fn populations_find_a_joint_optimum() {
    for variant in [evolution_strategies(), vec![("GA", ga())]].concat() {
        let mut evolution = start(&variant, &[3, 4], 30);
        let first = step(&mut evolution);
        for _ in 0..150 {
            step(&mut evolution);
        }
        let last = step(&mut evolution);
        let best = evolution.champion().unwrap().fitness().unwrap();
        assert!(best > -5e-3, "{variant:?}: {best}");
        assert!(
            last.statistics.mean.get() > 0.4 * first.statistics.mean.get(),
            "{variant:?} {first:?} {last:?}"
        );
    }
}

#[test]
fn only_ranks_count_unless_selection_is_proportional_to_fitness() {
    let proportional = ["roulette", "stochastic_universal"];
    let by_rank = genetic_algorithms(|selection| !proportional.contains(&selection));
    for variant in [evolution_strategies(), by_rank].concat() {
        let mut plain = start(&variant, &[4], 10);
        let mut scaled = plain.clone();
        for _ in 0..5 {
            let generation = plain.ask();
            assert_eq!(generation.genotypes, scaled.ask().genotypes, "{variant:?}");
            let fitness = evaluate(&generation.genotypes);
            let other: Vec<Vec<f64>> =
                fitness.iter().map(|t| t.iter().map(|f| 4.0 * f - 2.0).collect()).collect();
            scaled.tell(generation.clone(), &other).unwrap();
            plain.tell(generation, &fitness).unwrap();
            assert_ne!(plain.digest(), scaled.digest());
        }
    }
}

#[test]
fn proportional_selection_ignores_the_scale_but_not_the_shift_of_fitness() {
    let proportional = ["roulette", "stochastic_universal"];
    for variant in genetic_algorithms(|selection| proportional.contains(&selection)) {
        let mut plain = start(&variant, &[4], 10);
        let (mut scaled, mut shifted) = (plain.clone(), plain.clone());
        let generation = plain.ask();
        let told = |map: fn(f64) -> f64| {
            let fitness = evaluate(&generation.genotypes).into_iter();
            fitness.map(|t| t.into_iter().map(|f| map(f + 4.0)).collect()).collect::<Vec<_>>()
        };
        plain.tell(generation.clone(), &told(|f| f)).unwrap();
        scaled.tell(generation.clone(), &told(|f| 8.0 * f)).unwrap();
        shifted.tell(generation.clone(), &told(|f| 1e3 + f)).unwrap();
        assert_eq!(plain.ask().genotypes, scaled.ask().genotypes, "{variant:?}");
        assert_ne!(plain.ask().genotypes, shifted.ask().genotypes, "{variant:?}");
    }
}

#[test]
fn fitness_that_is_not_finite_never_enters_the_state() {
    for variant in all() {
        let mut evolution = start(&variant, &[3, 2], 7);
        let mut with_nan = evolution.clone();
        for g in 0..6 {
            let generation = evolution.ask();
            let mut fitness = evaluate(&generation.genotypes);
            fitness[g][0] = f64::NEG_INFINITY;
            fitness[(g + 3) % 7][1] = f64::NEG_INFINITY;
            let mut other = fitness.clone();
            other[g][0] = f64::NAN;
            other[(g + 3) % 7][1] = f64::INFINITY;
            evolution.tell(generation.clone(), &fitness).unwrap();
            with_nan.tell(generation, &other).unwrap();
            assert_state_is_finite(&with_nan, &variant);
            assert_eq!(with_nan.populations, evolution.populations, "{variant:?}");
        }
    }
}

#[test]
fn a_single_individual_with_finite_fitness_is_enough() {
    for variant in all() {
        let mut evolution = start(&variant, &[3], 6);
        for g in 0..5 {
            let mut fitness = vec![vec![f64::NAN]; 6];
            fitness[g] = vec![1.0];
            evolution.tell(evolution.ask(), &fitness).unwrap();
            assert_state_is_finite(&evolution, &variant);
            assert_genes_are_sound(&evolution.ask().genotypes, &variant);
        }
    }
}

/// An optimum in a corner of the cube, and then a plateau without anything to learn.
#[test]
fn long_runs_into_a_corner_and_on_a_plateau_stay_sound() {
    for variant in all() {
        for d in [1, 2, 5] {
            let is_quick = variant.0 == "GA";
            let mut evolution = start(&variant, &[d], 8);
            for g in 0..if is_quick { 40 } else { 1000 } {
                let generation = evolution.ask();
                let height = |genes: &Genotype| if g < 600 { genes.iter().sum() } else { 0.0 };
                let fitness: Vec<Vec<f64>> =
                    generation.genotypes.iter().map(|genes| vec![height(genes)]).collect();
                evolution.tell(generation, &fitness).unwrap();
                if g % 20 == 0 {
                    assert_state_is_finite(&evolution, &variant);
                }
            }
            assert_genes_are_sound(&evolution.ask().genotypes, &variant);
            let best = evolution.champion().unwrap().fitness().unwrap() / d as f64;
            assert!(is_quick || best > 0.999, "{variant:?} {d}: {best}");
        }
    }
}

/// The domains are those of the reader of experiment files.
#[test]
fn parameters_at_the_ends_of_their_domains_stay_sound() {
    let (tiny, huge) = (1e-9, 1e9);
    let mut variants = Vec::new();
    for eta in [tiny, huge] {
        for sigma in [tiny, 1.0] {
            let snes =
                [("eta_mu", eta), ("eta_sigma", eta), ("mu_init", 0.0), ("sigma_init", sigma)];
            let xnes = [
                ("eta_mu", eta),
                ("eta_sigma", eta),
                ("eta_B", eta),
                ("mu_init", 1.0),
                ("sigma_init", sigma),
            ];
            let cma_es = [("mu_init", 0.0), ("sigma_init", sigma)];
            let openai_es = [
                ("mu_init", 0.0),
                ("sigma", sigma),
                ("learning_rate", eta),
                ("beta1", 1.0 - f64::EPSILON),
                ("beta2", 0.0),
                ("weight_decay", 1.0),
            ];
            let pgpe = [
                ("mu_init", 0.0),
                ("sigma_init", sigma),
                ("max_speed", eta),
                ("step_size", eta),
                ("momentum", 1.0),
                ("eta_sigma", eta),
                ("sigma_max_change", 1.0),
            ];
            variants.extend([
                ("SNES", params(&snes)),
                ("xNES", params(&xnes)),
                ("CMA-ES", params(&cma_es)),
                ("sep-CMA-ES", params(&cma_es)),
                ("openaiES", params(&openai_es)),
                ("PGPE", params(&pgpe)),
            ]);
        }
        let ga =
            params(&[("alpha", eta), ("mutation_sigma", eta)]).with("tournament_size", 1000_u32);
        variants.push(("GA", ga));
    }
    for variant in variants {
        for d in [1, 3] {
            let mut evolution = start(&variant, &[d], 6);
            for _ in 0..60 {
                let generation = evolution.ask();
                assert_genes_are_sound(&generation.genotypes, &variant);
                let fitness = evaluate(&generation.genotypes);
                evolution.tell(generation, &fitness).unwrap();
                assert_state_is_finite(&evolution, &variant);
            }
        }
    }
}

#[test]
fn the_smallest_allowed_populations_evolve() {
    for variant in evolution_strategies() {
        let description = AlgorithmDescription::find(ALGORITHMS, variant.0).unwrap();
        let mut evolution = start(&variant, &[2, 1], description.individuals_min as usize);
        for _ in 0..20 {
            step(&mut evolution);
            assert_state_is_finite(&evolution, &variant);
        }
    }
}

/// Mean and covariance of a state's distribution.
fn moments(state: &Value) -> (Vec<f64>, Vec<Vec<f64>>) {
    let (name, state) = state.as_object().unwrap().iter().next().unwrap();
    let numbers = |value: &Value| -> Vec<f64> { serde_json::from_value(value.clone()).unwrap() };
    let mean = numbers(state.get("mu").unwrap_or(&state["mean"]));
    let d = mean.len();
    // A, row by row, and a factor of A A^T.
    let diagonal = |deviations: &[f64]| -> Vec<Vec<f64>> {
        (0..d).map(|i| (0..d).map(|j| if i == j { deviations[i] } else { 0.0 }).collect()).collect()
    };
    let square = |a: Vec<Vec<f64>>, factor: f64| -> Vec<Vec<f64>> {
        let dot = |x: &[f64], y: &[f64]| factor * x.iter().zip(y).map(|(x, y)| x * y).sum::<f64>();
        (0..d).map(|i| (0..d).map(|j| dot(&a[i], &a[j])).collect()).collect()
    };
    let square_of = |x: f64| x * x;
    let sigma = |state: &Value| square_of(state["sigma"].as_f64().unwrap());
    let covariance = match name.as_str() {
        "Snes" | "Pgpe" => square(diagonal(&numbers(&state["sigma"])), 1.0),
        "Xnes" => {
            let columns = numbers(&state["shape"]);
            let rows = (0..d).map(|i| columns.iter().skip(i).step_by(d).copied().collect());
            square(rows.collect(), sigma(state))
        }
        "CmaEs" => {
            let lower: Vec<Vec<f64>> = serde_json::from_value(state["covariance"].clone()).unwrap();
            let factor = sigma(&state["cumulation"]);
            (0..d).map(|i| (0..d).map(|j| factor * lower[i.max(j)][i.min(j)]).collect()).collect()
        }
        "SepCmaEs" => {
            let deviations: Vec<f64> =
                numbers(&state["variances"]).iter().map(|c| c.sqrt()).collect();
            square(diagonal(&deviations), sigma(&state["cumulation"]))
        }
        "OpenAiEs" => square(diagonal(&vec![1.0; d]), sigma(state)),
        _ => panic!("{name} has no distribution"),
    };
    (mean, covariance)
}

#[test]
fn individuals_have_the_mean_and_covariance_of_the_state() {
    let narrow = |(name, params): Variant| {
        let sigma = if name == "openaiES" { "sigma" } else { "sigma_init" };
        (name, params.with(sigma, 0.03))
    };
    let valley = |genes: &Genotype| {
        let (x, y, z) = (genes[0], genes[1], genes[2]);
        let [a, b, c] = [x + y - 1.0, x - y, y + z - 1.0];
        -(a * a) - 20.0 * (b * b) - 5.0 * (c * c)
    };
    for variant in evolution_strategies().into_iter().map(narrow) {
        let mut evolution = start(&variant, &[3], 10);
        for _ in 0..25 {
            let generation = evolution.ask();
            let fitness: Vec<Vec<f64>> =
                generation.genotypes.iter().map(|genes| vec![valley(genes)]).collect();
            evolution.tell(generation, &fitness).unwrap();
        }
        let n = 40_000;
        evolution.population_size = n;
        let genotypes = evolution.ask().genotypes;
        let state = serde_json::to_value(&evolution.populations[0]).unwrap();
        let (mean, covariance) = moments(&state);
        let average =
            |f: &dyn Fn(&Genotype) -> f64| genotypes.iter().map(f).sum::<f64>() / n as f64;
        for i in 0..3 {
            let deviation = covariance[i][i].sqrt();
            assert!((average(&|g| g[i]) - mean[i]).abs() < 0.02 * deviation, "{variant:?}");
            for j in 0..3 {
                let actual = average(&|g| (g[i] - mean[i]) * (g[j] - mean[j]));
                let scale = deviation * covariance[j][j].sqrt();
                let error = (actual - covariance[i][j]).abs() / scale;
                assert!(error < 0.03, "{variant:?} {i} {j}: {actual} {covariance:?}");
            }
        }
    }
}
