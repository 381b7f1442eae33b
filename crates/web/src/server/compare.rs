//! The comparison of samples of runs, like that of `swarmctl compare`.

use axum::{Json, extract::State};
use serde::{Deserialize, Serialize};
use statistics::{
    Interval, interquartile_mean, interval, interval_of_two, mann_whitney, mean, median,
    probability_of_improvement,
};
use swarm_proto::v1::{Experiment, ListGenerationsRequest};

use super::{
    Shared,
    problem::{Problem, Query},
};

/// Number of last generations of a run to average.
const LAST: u64 = 50;
/// Limits of samples and runs of one request: an interval costs ten thousand draws.
const SAMPLES_MAX: usize = 12;
const RUNS_MAX: usize = 300;

/// Numbers of experiments, `2,3,4;5,6,7`: semicolons separate samples, commas the runs of
/// one.
#[derive(Debug, Deserialize)]
pub struct Wanted {
    samples: String,
}

/// The result for each quantity of the runs.
#[derive(Debug, Serialize)]
pub struct Comparison {
    quantities: Vec<Quantity>,
}

#[derive(Debug, Serialize)]
struct Quantity {
    title: String,
    /// None for a sample without such a number.
    samples: Vec<Option<Summary>>,
    pairs: Vec<Pair>,
}

#[derive(Debug, Serialize)]
struct Summary {
    n: usize,
    median: Interval,
    iqm: Interval,
}

/// Two samples, by their places.
#[derive(Debug, Serialize)]
struct Pair {
    first: usize,
    second: usize,
    /// Probability that a run of the first is better than one of the second.
    probability: Interval,
    /// Two-sided, of the Mann-Whitney test.
    p: Option<f64>,
}

/// Compares samples of runs.
pub async fn compare(
    State(shared): State<Shared>,
    Query(Wanted { samples }): Query<Wanted>,
) -> Result<Json<Comparison>, Problem> {
    let bad = |_| Problem::bad("samples are numbers of experiments, such as 2,3;4,5");
    let ids = |sample: &str| sample.split(',').map(|id| id.trim().parse::<u64>()).collect();
    let samples: Vec<Vec<u64>> =
        samples.split(';').map(ids).collect::<Result<_, _>>().map_err(bad)?;
    if samples.len() > SAMPLES_MAX || samples.iter().map(Vec::len).sum::<usize>() > RUNS_MAX {
        let why = format!("at most {SAMPLES_MAX} samples with {RUNS_MAX} runs are compared here");
        return Err(Problem::bad(why));
    }
    let known = shared.experiments().await?;
    let mut judged = Vec::new();
    let mut means = Vec::new();
    for sample in &samples {
        let runs: Vec<&Experiment> = known.iter().filter(|run| sample.contains(&run.id)).collect();
        judged.push(runs.iter().filter_map(|run| run.champion_fitness).collect());
        let mut last = Vec::new();
        for run in runs {
            last.extend(mean_of_last(&shared, run).await?);
        }
        means.push(last);
    }
    let compared = tokio::task::spawn_blocking(move || {
        let title = "worth of the champion, on trials that selected nothing".to_owned();
        let last =
            format!("mean fitness of the last {LAST} generations, or of all if they are fewer");
        vec![Quantity::new(title, &judged), Quantity::new(last, &means)]
    });
    let quantities = compared.await.map_err(|_| Problem::bad("comparing panicked"))?;
    Ok(Json(Comparison { quantities }))
}

async fn mean_of_last(shared: &Shared, run: &Experiment) -> Result<Option<f64>, Problem> {
    let request = ListGenerationsRequest {
        experiment_id: run.id,
        from_generation: run.generations_done.saturating_sub(LAST),
        page_size: LAST as u32,
    };
    let page = shared.reader.list_generations(request).await?;
    let means = page
        .generations
        .iter()
        .filter_map(|completed| completed.summary.as_ref())
        .map(|summary| summary.mean);
    let means: Vec<f64> = means.collect();
    Ok((!means.is_empty()).then(|| mean(&means)))
}

impl Quantity {
    fn new(title: String, samples: &[Vec<f64>]) -> Self {
        let summary = |values: &Vec<f64>| {
            (!values.is_empty()).then(|| Summary {
                n: values.len(),
                median: interval(values, median),
                iqm: interval(values, interquartile_mean),
            })
        };
        let filled = || samples.iter().enumerate().filter(|(_, values)| !values.is_empty());
        let pairs = filled().flat_map(|first| {
            filled().filter(move |second| second.0 > first.0).map(move |second| (first, second))
        });
        let pairs = pairs.map(|((first, a), (second, b))| Pair {
            first,
            second,
            probability: interval_of_two(a, b, |a, b| probability_of_improvement(a, b)),
            p: mann_whitney(a, b),
        });
        let pairs = pairs.collect();
        Self { title, samples: samples.iter().map(summary).collect(), pairs }
    }
}
