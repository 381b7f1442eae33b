//! Tests of requests and answers; the page's own are in `crates/web/tests/proofs.py`.

use std::fs;

use serde_json::{Value, json};

use crate::{
    Session,
    message::{self, bytes_of, numbers_of},
};

fn bundle() -> Vec<u8> {
    fs::read("../../results/bundles/transport-0.zip").unwrap()
}

fn call(session: &mut Session, header: &Value, bytes: &[u8]) -> (Value, Vec<u8>) {
    let answer = session.answer(&message::write(header, bytes));
    let (header, bytes) = message::read::<Value>(&answer).unwrap();
    (header, bytes.to_vec())
}

/// Proves the bundle. `change` changes the simulated fitness of a batch.
fn prove(change: impl Fn(&mut Vec<f64>)) -> Value {
    let [mut proving, mut simulating] = [(); 2].map(|()| Session::default());
    let open = json!({"call": "open", "file": "transport-0.zip", "generations": 0});
    let (opened, _) = call(&mut proving, &open, &bundle());
    let compile = json!({"call": "compile", "config": opened["config"]});
    let (compiled, _) = call(&mut simulating, &compile, &[]);
    let len = compiled["genes"].as_u64().unwrap() as usize * size_of::<f64>();
    loop {
        let (answer, genes) = call(&mut proving, &json!({"call": "repeat"}), &[]);
        if answer["is_over"] == true {
            return call(&mut proving, &json!({"call": "finish"}), &[]).0;
        }
        let batch = &answer["batch"];
        if batch.is_null() {
            continue;
        }
        let evaluate = json!({"call": "evaluate", "trials": batch["trials"], "n_trials": batch["n_trials"], "values_per_trial": batch["values_per_trial"]});
        let fitness = genes.chunks(len).flat_map(|genes| {
            let (_, fitness) = call(&mut simulating, &evaluate, genes);
            numbers_of(&fitness).unwrap()
        });
        let mut fitness: Vec<f64> = fitness.collect();
        change(&mut fitness);
        let (compared, _) = call(&mut proving, &json!({"call": "compare"}), &bytes_of(fitness));
        if compared.get("error").is_some() {
            return compared;
        }
    }
}

#[test]
fn a_bundle_is_proven_in_the_words_of_the_other_programs() {
    let proof = prove(|_| ());
    let text = proof["proof"].as_str().unwrap();
    let sha256 = bundle::sha256(&bundle());
    assert!(
        text.starts_with(&format!("transport-0.zip, SHA-256 {sha256}\nproven    experiment: "))
    );
    assert_eq!(text.lines().count(), 8, "{text}");
}

#[test]
fn other_fitness_is_a_flaw() {
    let next = |fitness: &mut Vec<f64>| fitness[0] = fitness[0].next_up();
    for found in [prove(next), prove(|fitness| fitness.truncate(1))] {
        let error = found["error"].as_str().unwrap();
        assert!(error.starts_with("simulation: "), "{error}");
    }
}

#[test]
fn a_proof_ends_only_when_all_is_repeated() {
    let mut session = Session::default();
    let open = json!({"call": "open", "file": "a.zip", "generations": 5});
    call(&mut session, &open, &bundle());
    let (answer, _) = call(&mut session, &json!({"call": "finish"}), &[]);
    assert_eq!(answer, json!({"error": "the proof is not complete"}));
}

#[test]
fn senseless_messages_are_refused() {
    let mut session = Session::default();
    for message in [&b""[..], b"\x01\0", b"\xff\xff\xff\xff{}", b"\x02\0\0\0{}"] {
        let answer = session.answer(message);
        let (header, _) = message::read::<Value>(&answer).unwrap();
        assert!(header["error"].is_string(), "{header}");
    }
    let requests = [
        json!({"call": "repeat"}),
        json!({"call": "compare"}),
        json!({"call": "finish"}),
        json!({"call": "compile", "config": "{}"}),
        json!({"call": "evaluate", "trials": "evaluation", "n_trials": 1, "values_per_trial": 1}),
        json!({"call": "open", "file": "a.zip", "generations": 5}),
    ];
    for request in requests {
        let (answer, _) = call(&mut session, &request, b"123");
        assert!(answer["error"].is_string(), "{request}: {answer}");
    }
    assert!(numbers_of(b"123").is_err(), "a part of a number");
}
