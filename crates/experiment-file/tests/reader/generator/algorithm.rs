//! Algorithms and their populations.

use serde_json::{Value, json};

use super::network::Network;
use super::world::Robot;
use super::{Dice, insert, object};

pub(super) fn algorithm(dice: &mut Dice, robot: &Robot, network: &Network) -> Value {
    let name = dice.pick(&[
        "GA",
        "SNES",
        "xNES",
        "CMA-ES",
        "sep-CMA-ES",
        "openaiES",
        "PGPE",
        "MAP-Elites",
        "DNS",
        "novelty",
        "CMA-MAE",
        "sep-CMA-MAE",
        "NSGA-II",
    ]);
    let mut tasks = vec!["grouping"];
    if network.has_led {
        tasks.extend(["identify_leader", "identify_borderline"]);
    }
    if network.has_wheels {
        tasks.extend(["orientation_consensus", "alignment"]);
    }
    if robot.has_light {
        tasks.push("goto_light");
    }
    let queries = network.queries(dice);
    // Coefficients of learning and parameters of spiking neurons may be too many genes for
    // algorithms with a full matrix.
    let learns = queries.iter().any(|(query, _)| query.starts_with("learning:"));
    let has_many_genes = learns || network.is_spiking();
    let name = match name {
        "xNES" | "CMA-ES" if has_many_genes => "sep-CMA-ES",
        "CMA-MAE" if has_many_genes => "sep-CMA-MAE",
        _ => name,
    };
    let repertoires = ["MAP-Elites", "DNS", "novelty", "CMA-MAE", "sep-CMA-MAE"];
    let has_repertoire = repertoires.contains(&name);
    let has_front = name == "NSGA-II";
    let n_populations =
        if has_repertoire || has_front { 1 } else { dice.die(queries.len().min(3)) };
    let mut populations = json!({});
    for i in 0..n_populations {
        let queries: Vec<_> = queries.iter().skip(i).step_by(n_populations).collect();
        insert(&mut populations, &format!("p{i}"), population(dice, name, &queries));
    }
    let task = dice.pick(&tasks);
    let target = dice.number(0.0, 2.0);
    let mut algorithm = object(dice, [("target_fitness", target)]);
    for (key, value) in [
        ("name", json!(name)),
        ("evolvable_object", json!("swarm")),
        ("population_size", json!(10 + 2 * dice.below(50))),
        ("generations", json!(dice.die(1000))),
        ("evaluation_steps", json!(100 + dice.die(500))),
        ("num_evaluations", json!(dice.die(5))),
        ("fitness_function", json!(task)),
        ("populations", populations),
    ] {
        insert(&mut algorithm, key, value);
    }
    if has_repertoire {
        insert(&mut algorithm, "descriptors", descriptors(dice, task));
    }
    if has_front {
        insert(&mut algorithm, "aims", aims(dice, task));
    }
    algorithm
}

/// Two measures of a task; the only one twice.
fn measures(task: &str) -> [&'static str; 2] {
    match task {
        "identify_leader" => ["leaders", "one_leader"],
        "identify_borderline" => ["accuracy", "precision"],
        "goto_light" => ["light_distance_others", "near_light_others"],
        "grouping" => ["center_distance"; 2],
        _ => ["misalignment", "turning"],
    }
}

fn aims(dice: &mut Dice, task: &str) -> Value {
    let mut aim = |measure: &str| {
        let summary = json!(dice.pick(&["mean", "end"]));
        let mut aim = object(dice, [("of", summary)]);
        insert(&mut aim, "measure", json!(measure));
        insert(&mut aim, "direction", json!(dice.pick(&["maximise", "minimise"])));
        aim
    };
    let [one, other] = measures(task);
    let [first, second] = [one, other].map(&mut aim);
    if one != other && dice.chance(0.5) { json!([first, second]) } else { first }
}

fn descriptors(dice: &mut Dice, task: &str) -> Value {
    let measures = measures(task);
    let mut descriptor = |measure: &str| {
        let summary = json!(dice.pick(&["mean", "end"]));
        let [low, width] = [dice.number(-9.0, 9.0), dice.number(0.1, 9.0)];
        let high = low.as_f64().unwrap() + width.as_f64().unwrap();
        let cells = json!(dice.die(20));
        let mut descriptor = object(dice, [("of", summary), ("cells", cells)]);
        insert(&mut descriptor, "measure", json!(measure));
        insert(&mut descriptor, "range", json!([low, high]));
        descriptor
    };
    let [first, second] = measures.map(&mut descriptor);
    if measures[0] != measures[1] && dice.chance(0.5) { json!([first, second]) } else { first }
}

fn population(dice: &mut Dice, algorithm: &str, queries: &[&(String, [f64; 2])]) -> Value {
    let names: Vec<&str> = queries.iter().map(|(name, _)| name.as_str()).collect();
    let mut population = params(dice, algorithm);
    if dice.chance(0.5) {
        population = json!({"params": population});
    }
    let [mut low, mut high] =
        [0, 1].map(|i| queries.iter().map(|(_, bounds)| json!(bounds[i])).collect::<Value>());
    let is_symmetric = queries.iter().all(|(_, [low, _])| *low <= -0.5);
    if is_symmetric && (queries.len() == 1 || dice.chance(0.2)) {
        [low, high] = [json!(-0.5), json!(0.5)];
    }
    insert(&mut population, "objects", json!(names));
    insert(&mut population, "min_vals", low);
    insert(&mut population, "max_vals", high);
    population
}

fn params(dice: &mut Dice, algorithm: &str) -> Value {
    let mut rate = || dice.number(0.01, 1.0);
    let [eta_mu, eta_sigma, eta_b, mu_init, sigma, decay] = [(); 6].map(|()| rate());
    match algorithm {
        "GA" => {
            let selection = json!(dice.pick(&[
                "tournament",
                "roulette",
                "lin_rank",
                "nonlin_rank",
                "stochastic_universal"
            ]));
            let crossover = json!(dice.pick(&[
                "blxalpha",
                "uniform",
                "onepoint",
                "multipoint",
                "simulated_binary"
            ]));
            let mutation = json!(dice.pick(&["gaussian", "uniform"]));
            object(
                dice,
                [
                    ("encoding", json!("real")),
                    ("selection_operator", selection),
                    ("tournament_size", json!(5)),
                    ("mating_operator", json!("random")),
                    ("crossover_operator", crossover),
                    ("alpha", eta_mu),
                    ("crossover_prob", mu_init),
                    ("mutation_operator", mutation),
                    ("mutation_prob", eta_b),
                    ("mutation_sigma", sigma),
                    ("num_elite", json!(1)),
                ],
            )
        }
        "MAP-Elites" => object(
            dice,
            [
                ("reevaluated", json!(0.5)),
                ("iso_sigma", sigma),
                ("line_sigma", decay),
                ("depth", json!(3)),
            ],
        ),
        "DNS" => {
            object(dice, [("reevaluated", json!(0)), ("elites", json!(100)), ("nearest", json!(5))])
        }
        "novelty" => object(
            dice,
            [
                ("reevaluated", json!(0.125)),
                ("elites", json!(200)),
                ("neighbours", json!(10)),
                ("added", eta_mu),
                ("threshold", sigma),
            ],
        ),
        "CMA-MAE" | "sep-CMA-MAE" => object(
            dice,
            [
                ("mu_init", mu_init),
                ("sigma_init", sigma),
                ("emitters", json!(3)),
                ("archive_rate", eta_mu),
                ("threshold_min", json!(-1.5)),
                ("depth", json!(1)),
            ],
        ),
        "NSGA-II" => object(
            dice,
            [
                ("reevaluated", json!(0.5)),
                ("crossover_prob", mu_init),
                ("eta_c", json!(15)),
                ("mutation_prob", decay),
                ("eta_m", json!(7.5)),
            ],
        ),
        "SNES" => object(
            dice,
            [
                ("eta_mu", eta_mu),
                ("eta_sigma", eta_sigma),
                ("mu_init", mu_init),
                ("sigma_init", sigma),
                ("mutation_prob", decay),
            ],
        ),
        "xNES" => object(
            dice,
            [
                ("eta_mu", eta_mu),
                ("eta_sigma", eta_sigma),
                ("eta_B", eta_b),
                ("mu_init", mu_init),
                ("sigma_init", sigma),
            ],
        ),
        "openaiES" => object(
            dice,
            [
                ("mu_init", mu_init),
                ("sigma", sigma),
                ("learning_rate", eta_mu),
                ("beta1", json!(0.5)),
                ("beta2", json!(0.25)),
                ("weight_decay", decay),
                ("encoding", json!("real")),
            ],
        ),
        "PGPE" => object(
            dice,
            [
                ("mu_init", mu_init),
                ("sigma_init", sigma),
                ("max_speed", eta_b),
                ("step_size", eta_mu),
                ("momentum", decay),
                ("eta_sigma", eta_sigma),
                ("sigma_max_change", json!(0.25)),
            ],
        ),
        "CMA-ES" => {
            let restarts = json!(dice.pick(&["none", "ipop", "bipop"]));
            object(dice, [("mu_init", mu_init), ("sigma_init", sigma), ("restarts", restarts)])
        }
        _ => object(dice, [("mu_init", mu_init), ("sigma_init", sigma)]),
    }
}
