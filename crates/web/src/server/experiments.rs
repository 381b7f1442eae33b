//! The stored data of experiments.

use std::num::{NonZeroU64, NonZeroUsize};

use axum::{
    Json,
    extract::State,
    http::header::CONTENT_TYPE,
    response::{IntoResponse, Response},
};
use evolution::{ALGORITHMS, Operator};
use experiment_file::{AlgorithmDescription, Keeps, LearnsFrom};
use model::queries::Families;
use serde::Deserialize;
use serde_json::{Value, json};
use swarm_proto::v1::{
    GetFrontRequest, GetRepertoireRequest, ListDynamicsRequest, ListEventsRequest,
    ListGenerationsRequest,
};

use super::{
    Shared,
    answers::{self, ExperimentAnswer},
    problem::{Path, Problem, Query},
};

/// Number of latest events to search.
const EVENTS: u64 = 1000;
/// Maximum number of generations in one answer with the fitness of every individual.
const FITNESS_MAX: u32 = 500;

/// The beginning of a page.
#[derive(Debug, Deserialize)]
pub struct From {
    #[serde(default)]
    from: u64,
}

/// One experiment, its file, its champion if any, and whether its individuals have parents in the
/// generation before, or are a repertoire or a front.
pub async fn one(
    State(shared): State<Shared>,
    Path(id): Path<u64>,
) -> Result<Json<Value>, Problem> {
    let found = shared.experiment(id).await?;
    let champion = shared.reader.individual(&id.to_string()).await.ok();
    let champion = champion.map(|champion| {
        let judged = champion.judged.map(|judgement| {
            json!([judgement.mean, judgement.low, judgement.high, judgement.trials])
        });
        json!({
            "generation": champion.generation,
            "individual": champion.individual,
            "judged": judged,
            "selection": champion.held_out.map(|selection| selection.mean),
        })
    });
    let algorithm = found
        .experiment
        .as_ref()
        .and_then(|experiment| AlgorithmDescription::find(ALGORITHMS, &experiment.algorithm));
    let learns_from = |what| algorithm.is_some_and(|algorithm| algorithm.learns_from == what);
    Ok(Json(json!({
        "has_parents": algorithm.is_some_and(|algorithm| algorithm.keeps == Keeps::Population),
        "has_repertoire": learns_from(LearnsFrom::Descriptors),
        "has_front": learns_from(LearnsFrom::Aims),
        "experiment": found.experiment.map(|experiment| {
            ExperimentAnswer::new(experiment, shared.control.is_some())
        }),
        "config": serde_json::from_str::<Value>(&found.config_json).unwrap_or_default(),
        "champion": champion,
    })))
}

/// A page of generations, and the beginning of the next one.
pub async fn generations(
    State(shared): State<Shared>,
    Path(id): Path<u64>,
    Query(From { from }): Query<From>,
) -> Result<Json<Value>, Problem> {
    let request = ListGenerationsRequest { experiment_id: id, from_generation: from, page_size: 0 };
    let page = shared.reader.list_generations(request).await?;
    let rows: Vec<_> = page.generations.iter().filter_map(answers::generation_row).collect();
    Ok(Json(json!({ "generations": rows, "next": page.next_generation })))
}

/// The movement of the distribution in a page of generations, and the beginning of the next
/// page. A row is a generation, the length of the step of the mean, least, quartiles and
/// largest of the genes' standard deviations (or none), and the rank correlation of trials.
pub async fn dynamics(
    State(shared): State<Shared>,
    Path(id): Path<u64>,
    Query(From { from }): Query<From>,
) -> Result<Json<Value>, Problem> {
    let request = ListDynamicsRequest { experiment_id: id, from_generation: from };
    let page = shared.reader.list_dynamics(request).await?;
    let rows = page.generations.iter();
    let rows = rows.map(|generation| {
        json!([
            generation.generation,
            generation.mean_step,
            generation.deviations,
            generation.rank_correlation
        ])
    });
    Ok(Json(json!({ "generations": rows.collect::<Vec<_>>(), "next": page.next_generation })))
}

/// The latest repertoire: its axes, its figures once the elites are judged, and for each cell that
/// has an elite its indices, fitness, descriptors, and the generation, index and experiment of its
/// birth. Fitness, descriptors and cells are judged ones, if there are any.
pub async fn repertoire(
    State(shared): State<Shared>,
    Path(id): Path<u64>,
) -> Result<Json<Value>, Problem> {
    let request = GetRepertoireRequest { experiment_id: id, generation: None };
    let found = shared.reader.get_repertoire(request).await?;
    let shown = found.shown.iter().filter_map(|&place| found.elites.get(place as usize));
    let shown = shown.map(|elite| {
        let judged = elite.judged.as_ref().filter(|_| found.corrected.is_some());
        let (cell, fitness, descriptors) = match judged {
            Some(judged) => (&judged.cell, judged.fitness, &judged.descriptors),
            None => (&elite.cell, elite.fitness, &elite.descriptors),
        };
        json!([cell, fitness, descriptors, elite.generation, elite.individual, elite.experiment_id])
    });
    let axes = found.axes.iter().map(|axis| {
        json!({
            "measure": axis.measure, "of": axis.of,
            "low": axis.low, "high": axis.high, "cells": axis.cells,
        })
    });
    let corrected = found
        .corrected
        .map(|of| json!({"qd_score": of.qd_score, "coverage": of.coverage, "stay": of.stay}));
    Ok(Json(json!({
        "generation": found.generation,
        "axes": axes.collect::<Vec<_>>(),
        "n_elites": found.elites.len(),
        "corrected": corrected,
        "shown": shown.collect::<Vec<_>>(),
    })))
}

/// The latest front: its aims, its figures, and for each elite on it fitness, aims, and the
/// generation, index and experiment of its birth. Fitness and aims are judged ones, if there are
/// any.
pub async fn front(
    State(shared): State<Shared>,
    Path(id): Path<u64>,
) -> Result<Json<Value>, Problem> {
    let request = GetFrontRequest { experiment_id: id, generation: None, reference: Vec::new() };
    let found = shared.reader.get_front(request).await?;
    let shown = found.shown.iter().filter_map(|&place| found.elites.get(place as usize));
    let shown = shown.map(|elite| {
        let (fitness, aims) = match &elite.judged {
            Some(judged) => (judged.fitness, &judged.descriptors),
            None => (elite.fitness, &elite.descriptors),
        };
        json!([fitness, aims, elite.generation, elite.individual, elite.experiment_id])
    });
    let aims = found
        .aims
        .iter()
        .map(|aim| json!({"measure": aim.measure, "of": aim.of, "direction": aim.direction}));
    let figures = found.figures.as_ref().map(
        |of| json!({"hypervolume": of.hypervolume, "reference": of.reference, "stay": of.stay}),
    );
    Ok(Json(json!({
        "generation": found.generation,
        "aims": aims.collect::<Vec<_>>(),
        "n_elites": found.elites.len(),
        "figures": figures,
        "shown": shown.collect::<Vec<_>>(),
    })))
}

/// The first generation of the requested children, and the stride.
#[derive(Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct WantedFamilies {
    #[serde(default)]
    from: u64,
    /// The stride: the answer has the generations whose numbers it divides.
    #[serde(default = "all")]
    every: NonZeroU64,
}

fn all() -> NonZeroU64 {
    NonZeroU64::MIN
}

/// Children of a page of generations with their parents, the names of the populations, and the
/// beginning of the next page. A row is a child in one population: generation, individual,
/// population, operator, fitness, and for each parent its individual and its fitness; null
/// stands for a fitness that is not finite.
pub async fn families(
    State(shared): State<Shared>,
    Path(id): Path<u64>,
    Query(WantedFamilies { from, every }): Query<WantedFamilies>,
) -> Result<Json<Value>, Problem> {
    Ok(Json(children(&shared.reader.families(id, from, every).await?)))
}

/// Children beside their parents.
pub fn children(page: &Families) -> Value {
    let mut rows = Vec::new();
    for (generation, families) in &page.generations {
        for (population, births) in families.births.iter().enumerate() {
            for (individual, birth) in births.iter().enumerate() {
                let mut row = vec![
                    json!(generation),
                    json!(individual),
                    json!(population),
                    json!(operator(birth.operator)),
                    json!(families.children[individual]),
                ];
                row.extend(birth.parents.iter().flat_map(|parent| {
                    let individual = parent.individual;
                    [json!(individual), json!(families.parents[individual as usize])]
                }));
                rows.push(Value::Array(row));
            }
        }
    }
    json!({ "populations": page.populations, "children": rows, "next": page.next })
}

/// The name of an operator, as in `swarmctl lineage`.
fn operator(operator: Operator) -> &'static str {
    match operator {
        Operator::First => "first",
        Operator::Elite => "elite",
        Operator::Copy => "copy",
        Operator::Crossover => "crossover",
        Operator::Line => "line",
    }
}

/// The latest events other than generations.
pub async fn events(
    State(shared): State<Shared>,
    Path(id): Path<u64>,
) -> Result<Json<Value>, Problem> {
    let found = shared.experiment(id).await?.experiment.unwrap_or_default();
    let request = ListEventsRequest {
        experiment_id: id,
        from_sequence: (found.last_sequence + 1).saturating_sub(EVENTS),
        page_size: 0,
    };
    let events = shared.reader.list_events(request).await?.events;
    let events: Vec<_> = events.into_iter().filter_map(answers::event).collect();
    Ok(Json(json!({ "events": events })))
}

/// The generations of the requested fitness.
#[derive(Debug, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct Wanted {
    from: u64,
    /// The number of generations, at most [`FITNESS_MAX`].
    n: u32,
    /// The stride.
    every: NonZeroUsize,
}

impl Default for Wanted {
    fn default() -> Self {
        Self { from: 0, n: FITNESS_MAX, every: NonZeroUsize::MIN }
    }
}

/// The fitness of every individual of some generations: the first generation (u32), the
/// number of generations (u32), of individuals (u32), and then `[generation][individual]` as
/// f32, NaN for missing values; all little-endian.
pub async fn fitness(
    State(shared): State<Shared>,
    Path(id): Path<u64>,
    Query(Wanted { from, n, every }): Query<Wanted>,
) -> Result<Response, Problem> {
    let (first, fitness) = shared.reader.fitness(id, from, n.min(FITNESS_MAX)).await?;
    let fitness: Vec<Vec<f32>> = fitness.into_iter().step_by(every.get()).collect();
    Ok(([(CONTENT_TYPE, "application/octet-stream")], packed(first, &fitness)).into_response())
}

/// Fitness in the byte format of pages.
pub fn packed(first: u64, fitness: &[Vec<f32>]) -> Vec<u8> {
    let n_individuals = fitness.iter().map(Vec::len).max().unwrap_or_default();
    let head = [first as u32, fitness.len() as u32, n_individuals as u32];
    let mut body: Vec<u8> = head.iter().flat_map(|number| number.to_le_bytes()).collect();
    for generation in fitness {
        let padding = std::iter::repeat_n(&f32::NAN, n_individuals - generation.len());
        body.extend(generation.iter().chain(padding).flat_map(|value| value.to_le_bytes()));
    }
    body
}
