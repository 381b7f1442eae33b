//! Compares updates, step by step, with independent implementations; `tests/fixtures` has the
//! fixtures and the script that made them.

use serde::Deserialize;
use serde_json::Value;

use super::super::{
    Evaluations,
    algorithms::{Algorithm, Lesson, Sample},
    ranking::ranking,
};

#[derive(Deserialize)]
struct Fixture {
    start: Algorithm,
    generations: Vec<Generation>,
}

#[derive(Deserialize)]
struct Generation {
    #[serde(default)]
    points: Vec<Vec<f64>>,
    #[serde(default)]
    normals: Vec<Vec<f64>>,
    fitness: Vec<f64>,
    after: Value,
}

/// Compares the parts of the state that the fixture has.
fn assert_close(actual: &Value, expected: &Value, tolerance: f64, place: &str) {
    match (actual, expected) {
        (Value::Object(actual), Value::Object(expected)) => {
            for (key, expected) in expected {
                assert_close(&actual[key], expected, tolerance, &format!("{place}.{key}"));
            }
        }
        (Value::Array(actual), Value::Array(expected)) => {
            assert_eq!(actual.len(), expected.len(), "{place}");
            for (i, (actual, expected)) in actual.iter().zip(expected).enumerate() {
                assert_close(actual, expected, tolerance, &format!("{place}[{i}]"));
            }
        }
        _ => {
            let (actual, expected) = (actual.as_f64().unwrap(), expected.as_f64().unwrap());
            let error = (actual - expected).abs();
            assert!(error <= tolerance * expected.abs().max(1.0), "{place}: {actual} {expected}");
        }
    }
}

fn assert_follows(fixture: &str, tolerance: f64) {
    let fixture: Fixture = serde_json::from_str(fixture).unwrap();
    let mut algorithm = fixture.start;
    assert!(fixture.generations.len() >= 5);
    for (g, generation) in fixture.generations.into_iter().enumerate() {
        let sample = match &algorithm {
            Algorithm::CmaEs(cma_es) => cma_es.sample_of(&generation.points),
            Algorithm::SepCmaEs(sep_cma_es) => sep_cma_es.sample_of(&generation.points),
            _ => Sample::new(Vec::new(), generation.normals),
        };
        let fitness = &generation.fitness[..];
        algorithm.learn(&Lesson {
            generation: g as u64,
            sample: &sample,
            ranking: &ranking(fitness),
            fitness,
            told: Evaluations { fitness: &[], descriptors: &[] },
        });
        let state = serde_json::to_value(&algorithm).unwrap();
        assert_close(&state, &generation.after, tolerance, &format!("generation {g}: "));
    }
}

#[test]
fn snes_follows_its_paper() {
    assert_follows(include_str!("../../tests/fixtures/snes.json"), 1e-14);
}

#[test]
fn xnes_follows_its_paper() {
    assert_follows(include_str!("../../tests/fixtures/xnes.json"), 1e-13);
}

#[test]
fn openai_es_follows_its_paper() {
    assert_follows(include_str!("../../tests/fixtures/openai_es.json"), 1e-13);
}

#[test]
fn pgpe_follows_its_paper() {
    assert_follows(include_str!("../../tests/fixtures/pgpe.json"), 1e-13);
}

/// The package `cma` adds 1e-9 to the length by which it divides negative weights.
#[test]
fn cma_es_follows_the_package_cma() {
    assert_follows(include_str!("../../tests/fixtures/cma_es.json"), 1e-8);
}

#[test]
fn sep_cma_es_follows_the_package_cmaes() {
    assert_follows(include_str!("../../tests/fixtures/sep_cma_es.json"), 1e-12);
}
