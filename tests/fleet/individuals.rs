//! Every individual can be recovered.

use std::{fs, path::Path};

use harness::{CoordinatorProcess, Experiment, WorkerProcess, swarmctl, workspace_file};
use serde_json::{Value, json};
use swarm_proto::v1::{GetIndividualsRequest, experiment_service_client::ExperimentServiceClient};

/// Two populations, as in cooperative coevolution.
fn coevolution() -> Experiment {
    Experiment::tiny(5).edit(|file| {
        let populations = file["algorithm"]["populations"].as_object_mut().unwrap();
        let (name, whole) = populations.iter().next().map(|(k, v)| (k.clone(), v.clone())).unwrap();
        let part = |keep: &dyn Fn(&str) -> bool| {
            let mut part = whole.clone();
            let objects: Vec<String> = serde_json::from_value(whole["objects"].clone()).unwrap();
            for key in ["objects", "max_vals", "min_vals"] {
                let values = whole[key].as_array().unwrap().iter().zip(&objects);
                part[key] =
                    values.filter(|(_, object)| keep(object)).map(|(v, _)| v).cloned().collect();
            }
            part
        };
        let weights = part(&|object| object.starts_with("synapses"));
        let neurons = part(&|object| object.starts_with("neurons"));
        populations.remove(&name);
        populations.insert("weights".to_owned(), weights);
        populations.insert("neurons".to_owned(), neurons);
    })
}

fn bits(values: &Value) -> Vec<u64> {
    values.as_array().unwrap().iter().map(|value| value.as_f64().unwrap().to_bits()).collect()
}

/// Simulates an individual again; only its exact genes give its fitness.
fn simulated_again(address: &str, data_dir: &Path) -> Vec<u64> {
    let args = ["simulate", address, "--data-dir", data_dir.to_str().unwrap()];
    let simulation = swarmctl(args).expect_success().json();
    let trials = simulation["trials"].as_array().unwrap().iter();
    trials.map(|trial| trial["fitness"].as_f64().unwrap().to_bits()).collect()
}

#[test]
fn individuals_come_back_bit_for_bit_across_kills_from_a_coordinator_and_without_one() {
    let mut coordinator = CoordinatorProcess::start();
    let _workers = WorkerProcess::start_many(&coordinator, 2);
    let ga = Experiment::tiny(5).edit(|file| {
        file["algorithm"]["name"] = json!("GA");
        file["algorithm"]["champion_every"] = json!(2);
        let populations = file["algorithm"]["populations"].as_object_mut().unwrap();
        populations.values_mut().for_each(|population| population["params"] = json!({}));
    });
    let ids = [ga, coevolution()].map(|experiment| coordinator.submit(&experiment.path()));
    coordinator.wait_for_generation(1);
    coordinator.process.kill();
    coordinator.restart();
    for id in ids {
        coordinator.watch(id).finish();
    }
    let data_dir = coordinator.data_dir().to_owned();
    let directory = data_dir.to_str().unwrap();
    for id in ids {
        for generation in [0, 3] {
            let whole = format!("{id}@{generation}");
            // While the coordinator runs, both the coordinator and its file give the genotypes.
            let population = coordinator.swarmctl(&["individual", &whole]).expect_success().json();
            let read = swarmctl(["individual", &whole, "--data-dir", directory]);
            assert_eq!(read.expect_success().json(), population);
            let individuals = population["individuals"].as_array().unwrap();
            assert_eq!(individuals.len(), 10);
            let address = format!("{whole}/7");
            let alone = coordinator.swarmctl(&["individual", &address]).expect_success().json();
            assert_eq!(alone["genotype"], individuals[7]["genotype"]);
            assert_eq!(alone["individual"], 7);
            assert!(alone["network"]["neurons"].is_array());
            assert_eq!(simulated_again(&address, &data_dir), bits(&alone["trial_fitness"]));
        }
    }
    // The mean of SNES is a candidate for the champion; a GA has none.
    let mean = format!("{}@4/mean", ids[1]);
    let mean = coordinator.swarmctl(&["individual", &mean]).expect_success().json();
    assert_eq!((&mean["individual"], &mean["fitness"]), (&Value::Null, &Value::Null));
    let champion = coordinator.swarmctl(&["champion", &ids[1].to_string()]).expect_success().json();
    let source = match champion["individual"].as_u64() {
        Some(i) => format!("{}@{}/{i}", ids[1], champion["generation"]),
        None => format!("{}@{}/mean", ids[1], champion["generation"]),
    };
    let again = coordinator.swarmctl(&["individual", &source]).expect_success().json();
    assert_eq!(again["genotype"], champion["genotype"]);

    refusals(&coordinator, ids[0]);
    prune(&coordinator, ids[0]);
}

/// Missing individuals are refused in one line.
fn refusals(coordinator: &CoordinatorProcess, ga: u64) {
    let data_dir = coordinator.data_dir().to_str().unwrap();
    for (place, code, what) in [
        ("@5/0", 3, "generation 5 of experiment 1 is not complete; the latest complete one is 4"),
        ("@4/10", 2, "no individual 10: they are 0 to 9"),
        ("@4/mean", 2, "has no mean"),
        ("@x", 2, "is not ID"),
    ] {
        let address = format!("{ga}{place}");
        for args in
            [vec!["individual", &address], vec!["individual", &address, "--data-dir", data_dir]]
        {
            let refused = match args.len() {
                2 => coordinator.swarmctl(&args),
                _ => swarmctl(&args),
            };
            assert_eq!(refused.code, Some(code), "{refused:#?}");
            assert!(refused.stderr.contains(what), "{}", refused.stderr);
            assert_eq!(refused.stdout, "");
        }
    }
    let foreign = tempfile::tempdir().unwrap();
    let text = fs::read(workspace_file("configs/quickstart.json")).unwrap();
    fs::write(foreign.path().join("swarmevo.sqlite3"), text).unwrap();
    let nothing = tempfile::tempdir().unwrap();
    for (directory, code) in [(foreign, 11), (nothing, 2)] {
        let directory = directory.path().to_str().unwrap();
        let refused = swarmctl(["individual", "1@0/0", "--data-dir", directory]);
        assert_eq!(refused.code, Some(code), "{refused:#?}");
        assert_eq!(refused.stderr.lines().count(), 1, "{}", refused.stderr);
    }
}

/// Without its log, an experiment keeps its results and can be extended.
fn prune(coordinator: &CoordinatorProcess, id: u64) {
    let number = id.to_string();
    let champion = coordinator.swarmctl(&["individual", &number]).expect_success().stdout;
    let pruned = coordinator.swarmctl(&["prune", &number]).expect_success().json();
    assert_eq!(pruned["id"], id);
    let refused = coordinator.swarmctl(&["individual", &format!("{id}@3/0")]);
    assert_eq!(refused.code, Some(3), "{refused:#?}");
    let why = "its fitness log was pruned before generation 5";
    assert!(refused.stderr.contains(why), "{}", refused.stderr);
    assert_eq!(coordinator.swarmctl(&["individual", &number]).expect_success().stdout, champion);
    let history = coordinator.swarmctl(&["history", &number]).expect_success().json();
    assert_eq!(history.as_array().unwrap().len(), 5);
    let data_dir = coordinator.data_dir().to_str().unwrap();
    swarmctl(["doctor", "--data-dir", data_dir]).expect_success();
}

#[tokio::test(flavor = "multi_thread")]
async fn fitness_alone_comes_page_by_page_without_genes() {
    let coordinator = CoordinatorProcess::start();
    let _worker = WorkerProcess::start(&coordinator, "worker");
    let id = coordinator.submit(&Experiment::tiny(2).path());
    coordinator.watch(id).finish();
    let mut client = ExperimentServiceClient::connect(coordinator.url()).await.unwrap();
    let mut ask = async |fitness_only, from_individual, page_size| {
        let address = format!("{id}@1");
        let request = GetIndividualsRequest { address, from_individual, page_size, fitness_only };
        client.get_individuals(request).await.unwrap().into_inner()
    };
    let whole = ask(false, 0, 0).await;
    let page = ask(true, 3, 4).await;
    assert_eq!(page.next_individual, Some(7));
    assert_eq!(page.individuals.len(), 4);
    for (alone, with_genes) in page.individuals.iter().zip(&whole.individuals[3..]) {
        assert!(alone.genotype.is_empty() && !with_genes.genotype.is_empty());
        assert_eq!(alone.trial_fitness, with_genes.trial_fitness);
        assert_eq!((alone.individual, alone.fitness), (with_genes.individual, with_genes.fitness));
    }
    assert_eq!(ask(true, 0, 0).await.individuals.len(), whole.individuals.len());
}
