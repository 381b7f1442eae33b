//! The result of a comparison, as numbers and as text.

use schemars::JsonSchema;
use serde::Serialize;
use statistics::{
    Interval, interquartile_mean, interval, interval_of_two, mann_whitney, mean, median,
    probability_of_improvement,
};

use crate::{
    progress::Part,
    table::{Column, Table},
    text,
};

use super::samples::{RecordedRun, Sample};

/// All quantities that are compared.
#[derive(Debug, Serialize, JsonSchema)]
#[schemars(rename = "Comparison")]
pub struct Report {
    /// What is compared.
    quantities: Vec<Quantity>,
}

/// A number of each run, in all samples.
#[derive(Debug, Serialize, JsonSchema)]
struct Quantity {
    /// `judged`, `mean`, `best`, `generations_to_target` or `episodes_to_target`.
    name: &'static str,
    /// For people.
    #[serde(skip)]
    title: String,
    /// Whether smaller values are better.
    less_is_better: bool,
    /// Smallest and largest number of averaged generations of a run; absent if none are averaged.
    #[serde(skip_serializing_if = "Option::is_none")]
    averaged: Option<[u64; 2]>,
    /// The samples that have the quantity.
    samples: Vec<Summary>,
    /// Each sample with each that comes after it.
    pairs: Vec<Pair>,
}

/// A number of each run of a sample.
#[derive(Debug, Serialize, JsonSchema)]
#[schemars(rename = "Sample")]
struct Summary {
    /// Name of the sample.
    sample: String,
    /// In the order of the seeds; infinite numbers are null.
    #[schemars(with = "Vec<Option<f64>>")]
    values: Vec<f64>,
    median: Interval,
    /// The interquartile mean.
    iqm: Interval,
}

/// Two samples.
#[derive(Debug, Serialize, JsonSchema)]
struct Pair {
    /// Name of a sample.
    first: String,
    /// Name of another sample.
    second: String,
    /// The probability that a run of the first is better than one of the second.
    probability_of_improvement: Interval,
    /// Two-sided p-value of the Mann-Whitney test, from 0 to 1.
    p: f64,
}

impl Report {
    pub fn new(samples: &[Sample], last: u64, target: Option<f64>) -> Self {
        let averaged = averaged(samples, last);
        let of_last = |what: &str| format!("{what} fitness of a generation, {}", spoken(averaged));
        let mut quantities = vec![
            Quantity::new(
                "judged",
                "fitness of the champion, on trials that selected nothing".into(),
                false,
                samples,
                |run| run.judged,
            ),
            Quantity::new("mean", of_last("mean"), false, samples, |run| {
                average(run, last, |generation| generation.mean)
            })
            .averaged(averaged),
            Quantity::new("best", of_last("best"), false, samples, |run| {
                average(run, last, |generation| generation.best)
            })
            .averaged(averaged),
        ];
        if let Some(target) = target {
            quantities.push(Quantity::new(
                "generations_to_target",
                format!("generations until the mean reaches {target}"),
                true,
                samples,
                |run| generations_to(run, target),
            ));
            quantities.push(Quantity::new(
                "episodes_to_target",
                format!("episodes until the mean reaches {target}"),
                true,
                samples,
                |run| episodes_to(run, target),
            ));
        }
        quantities.retain(|quantity| !quantity.samples.is_empty());
        Self { quantities }
    }

    /// For people: a heading and tables for each quantity.
    pub fn to_parts(&self) -> Vec<Part> {
        let sections: Vec<Vec<Part>> = self.quantities.iter().map(Quantity::to_parts).collect();
        sections.join(&Part::text(""))
    }
}

impl Quantity {
    fn new(
        name: &'static str,
        title: String,
        less_is_better: bool,
        samples: &[Sample],
        value: impl Fn(&RecordedRun) -> Option<f64>,
    ) -> Self {
        let summaries = samples.iter().filter_map(|sample| {
            let values: Vec<f64> = sample.runs.values().filter_map(&value).collect();
            (!values.is_empty()).then(|| Summary {
                sample: sample.name.clone(),
                median: interval(&values, median),
                iqm: interval(&values, interquartile_mean),
                values,
            })
        });
        let samples: Vec<Summary> = summaries.collect();
        let pairs = samples
            .iter()
            .enumerate()
            .flat_map(|(i, first)| samples[i + 1..].iter().map(move |second| (first, second)));
        let pairs = pairs.map(|(first, second)| Pair::new(first, second, less_is_better)).collect();
        Self { name, title, less_is_better, averaged: None, samples, pairs }
    }

    fn averaged(self, averaged: Option<[u64; 2]>) -> Self {
        Self { averaged, ..self }
    }

    fn to_parts(&self) -> Vec<Part> {
        let digits = if self.less_is_better { 0 } else { 3 };
        let mut table = Table::new([
            Column::name(self.name),
            Column::number("runs").dropped(1),
            Column::number("median"),
            Column::number("95 %"),
            // A narrow table drops the interval before the IQM: alone, it would seem to belong to
            // another number.
            Column::number("IQM").dropped(2),
            Column::number("95 %").dropped(3),
            Column::number("least").dropped(4),
            Column::number("most").dropped(5),
        ]);
        for Summary { sample, values, median, iqm } in &self.samples {
            let fold =
                |start: f64, pick: fn(f64, f64) -> f64| values.iter().copied().fold(start, pick);
            table.push([
                sample.clone(),
                values.len().to_string(),
                number(median.value, digits),
                span(median, digits),
                number(iqm.value, digits),
                span(iqm, digits),
                number(fold(f64::INFINITY, f64::min), digits),
                number(fold(f64::NEG_INFINITY, f64::max), digits),
            ]);
        }
        let heading = format!("{}: {}\n", self.name, self.title);
        let mut parts = vec![Part::Text(heading), Part::Table(table)];
        if !self.pairs.is_empty() {
            let mut table = Table::new([
                Column::name("better"),
                Column::name("than"),
                Column::number("probability"),
                Column::number("95 %").dropped(1),
                Column::number("p"),
            ]);
            for pair in &self.pairs {
                let probability = &pair.probability_of_improvement;
                table.push([
                    pair.first.clone(),
                    pair.second.clone(),
                    format!("{:.2}", probability.value),
                    span(probability, 2),
                    format!("{:.4}", pair.p),
                ]);
            }
            parts.extend([Part::text(""), Part::Table(table)]);
        }
        parts
    }
}

impl Pair {
    fn new(first: &Summary, second: &Summary, less_is_better: bool) -> Self {
        let (better, worse) = match less_is_better {
            true => (&second.values, &first.values),
            false => (&first.values, &second.values),
        };
        Self {
            first: first.sample.clone(),
            second: second.sample.clone(),
            probability_of_improvement: interval_of_two(better, worse, |better, worse| {
                probability_of_improvement(better, worse)
            }),
            p: mann_whitney(&first.values, &second.values).expect("both have values"),
        }
    }
}

/// A number, or a word if it is infinite.
fn number(value: f64, digits: usize) -> String {
    if value == f64::INFINITY { "never".into() } else { text::number(value, digits) }
}

fn span(interval: &Interval, digits: usize) -> String {
    let ends = interval.ci95.map(|ends| ends.map(|end| number(end, digits)));
    ends.map_or_else(|| "-".into(), |[low, high]| format!("{low} to {high}"))
}

/// Smallest and largest number of averaged generations of a run if `last` are requested; none
/// without a history.
fn averaged(samples: &[Sample], last: u64) -> Option<[u64; 2]> {
    let lengths = samples.iter().flat_map(Sample::histories).map(|history| history.len() as u64);
    let numbers: Vec<u64> = lengths.map(|length| length.min(last)).collect();
    Some([*numbers.iter().min()?, *numbers.iter().max()?])
}

/// "average of the last 50", or of all if there are fewer.
fn spoken(averaged: Option<[u64; 2]>) -> String {
    match averaged {
        Some([1, 1]) => "the last one".into(),
        Some([fewest, most]) if fewest == most => format!("average of the last {most}"),
        Some([fewest, most]) => format!("average of the last {fewest} to {most}"),
        None => String::new(),
    }
}

fn average(
    run: &RecordedRun,
    last: u64,
    value: impl Fn(&crate::recorded::GenerationFitness) -> f64,
) -> Option<f64> {
    let history = run.history.as_ref()?;
    let first = history.len().saturating_sub(usize::try_from(last).unwrap_or(usize::MAX));
    let values: Vec<f64> = history[first..].iter().map(value).collect();
    (!values.is_empty()).then(|| mean(&values))
}

/// Number of generations until the mean first reaches the target; infinite if it does not.
fn generations_to(run: &RecordedRun, target: f64) -> Option<f64> {
    let history = run.history.as_ref()?;
    let reached = history.iter().find(|generation| generation.mean >= target);
    Some(reached.map_or(f64::INFINITY, |generation| (generation.generation + 1) as f64))
}

/// Like [`generations_to`], in episodes; none if the history lacks them.
fn episodes_to(run: &RecordedRun, target: f64) -> Option<f64> {
    let mut episodes = 0;
    for generation in run.history.as_ref()? {
        episodes += generation.episodes?;
        if generation.mean >= target {
            return Some(episodes as f64);
        }
    }
    Some(f64::INFINITY)
}
