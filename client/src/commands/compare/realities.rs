//! Ranks champions by what `swarmctl evaluate --pseudo-realities` found, beside their nominal
//! ranking.

use std::path::Path;

use indexmap::IndexMap;
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};
use serde_json::Value;
use statistics::{Kendall, kendall};

use crate::{
    error::Error,
    input::{TABLE_BYTES, read_text},
    progress::Part,
    table::{Column, Table},
    text,
};

/// The file of an evaluation.
const FILE: &str = "summary.json";

/// Whether an argument is the directory of an evaluation.
pub fn is_evaluation(text: &str) -> bool {
    Path::new(text).join(FILE).is_file()
}

/// The compared part of `summary.json`.
#[derive(Debug, Deserialize)]
struct Evaluation {
    seed: Value,
    steps: u32,
    conditions: Vec<Condition>,
    pseudo_realities: Option<Robustness>,
}

#[derive(Debug, Deserialize)]
struct Condition {
    config_digest: String,
    fitness: Fitness,
}

#[derive(Debug, Deserialize)]
struct Fitness {
    n: usize,
}

#[derive(Debug, Deserialize)]
struct Robustness {
    ranges: IndexMap<String, Value>,
    nominal: f64,
    mean: f64,
    worst_tenth: WorstTenth,
    drop: Drop,
    realities: Vec<Reality>,
}

#[derive(Debug, Deserialize)]
struct WorstTenth {
    mean: f64,
}

/// The nominal fitness minus that in the realities.
#[derive(Debug, Clone, Copy, Deserialize, Serialize, JsonSchema)]
struct Drop {
    /// The difference of the means.
    #[schemars(with = "Option<f64>")]
    value: f64,
    /// Lower and upper end of the 95 % interval; null if there are too few realities.
    #[schemars(with = "Option<[Option<f64>; 2]>")]
    ci95: Option<[f64; 2]>,
}

#[derive(Debug, PartialEq, Deserialize)]
struct Reality {
    numbers: IndexMap<String, Value>,
}

/// Champions in the order of the command line, and how far their rankings agree.
#[derive(Debug, Serialize, JsonSchema)]
pub struct Ranking {
    /// In the order of the command line.
    champions: Vec<Champion>,
    /// Null if all champions are equally good in one of the two rankings.
    kendall: Option<Kendall>,
}

#[derive(Debug, Serialize, JsonSchema)]
struct Champion {
    /// The directory of the evaluation.
    evaluation: String,
    /// Mean fitness without pseudo-reality.
    #[schemars(with = "Option<f64>")]
    nominal: f64,
    /// From 1, the best; equally good champions share the smallest rank.
    nominal_rank: usize,
    /// Mean fitness over the realities.
    #[schemars(with = "Option<f64>")]
    mean: f64,
    /// Its rank by that mean, from 1.
    rank: usize,
    /// Mean fitness in the worst tenth of the realities.
    #[schemars(with = "Option<f64>")]
    worst_tenth: f64,
    drop: Drop,
}

impl Ranking {
    /// Reads evaluations of one task in the same trials and realities.
    pub fn read(directories: &[String]) -> Result<Self, Error> {
        if directories.len() < 2 {
            let problem = "there is nothing to compare; name two evaluations or more".to_owned();
            return Err(Error::Input(problem).about(directories.join(", ")));
        }
        let read = directories.iter().map(|name| read_evaluation(name).map(|read| (name, read)));
        let evaluations = read.collect::<Result<Vec<_>, Error>>()?;
        let (first_name, (first, first_realities)) = &evaluations[0];
        for (name, (evaluation, realities)) in &evaluations[1..] {
            if let Some(reason) = difference((first, first_realities), (evaluation, realities)) {
                let problem = format!("{first_name} and {name} cannot be compared: {reason}");
                return Err(Error::Input(problem).about(name));
            }
        }
        let column = |value: fn(&Robustness) -> f64| -> Vec<f64> {
            evaluations.iter().map(|(_, (_, found))| value(found)).collect()
        };
        let (nominal, mean) = (column(|found| found.nominal), column(|found| found.mean));
        let rank =
            |values: &[f64], own: f64| 1 + values.iter().filter(|value| **value > own).count();
        let champions = evaluations.iter().map(|(name, (_, found))| Champion {
            evaluation: (*name).clone(),
            nominal: found.nominal,
            nominal_rank: rank(&nominal, found.nominal),
            mean: found.mean,
            rank: rank(&mean, found.mean),
            worst_tenth: found.worst_tenth.mean,
            drop: found.drop,
        });
        Ok(Self { champions: champions.collect(), kendall: kendall(&nominal, &mean) })
    }

    /// For people: a table, the best in the realities first, and tau.
    pub fn to_parts(&self) -> Vec<Part> {
        let mut table = Table::new([
            Column::name("evaluation"),
            Column::number("nominal"),
            Column::number("rank"),
            Column::number("realities"),
            Column::number("rank"),
            Column::number("worst tenth").dropped(1),
            Column::number("drop").dropped(2),
            Column::number("95 %").dropped(3),
        ]);
        let mut champions: Vec<&Champion> = self.champions.iter().collect();
        champions.sort_by_key(|champion| champion.rank);
        for champion in champions {
            let ends = champion.drop.ci95.map(|ends| ends.map(|end| text::number(end, 3)));
            table.push([
                champion.evaluation.clone(),
                text::number(champion.nominal, 3),
                champion.nominal_rank.to_string(),
                text::number(champion.mean, 3),
                champion.rank.to_string(),
                text::number(champion.worst_tenth, 3),
                text::number(champion.drop.value, 3),
                ends.map_or_else(|| "-".into(), |[low, high]| format!("{low} to {high}")),
            ]);
        }
        let agreement = match self.kendall {
            Some(Kendall { tau, p }) => {
                format!("Kendall's tau between the two rankings: {tau:.2}, p = {p:.4}")
            }
            None => "no ranking: all champions are equally good".into(),
        };
        vec![Part::Table(table), Part::text(""), Part::Text(agreement)]
    }
}

fn read_evaluation(directory: &str) -> Result<(Evaluation, Robustness), Error> {
    let path = Path::new(directory).join(FILE);
    let input = |problem: String| Error::of_file(&path, problem);
    let text = read_text(&path, TABLE_BYTES).map_err(|error| input(error.to_string()))?;
    let mut evaluation: Evaluation = serde_json::from_str(&text)
        .map_err(|error| input(format!("{error}; expected a file of `swarmctl evaluate`")))?;
    let realities = evaluation.pseudo_realities.take().ok_or_else(|| {
        input("has no pseudo-realities; evaluate with `--pseudo-realities 30`".into())
    })?;
    if evaluation.conditions.is_empty() {
        return Err(input("has no conditions".into()));
    }
    Ok((evaluation, realities))
}

/// Why two evaluations do not belong to one ranking.
fn difference(
    (a, of_a): (&Evaluation, &Robustness),
    (b, of_b): (&Evaluation, &Robustness),
) -> Option<String> {
    let ([nominal_a, ..], [nominal_b, ..]) = (&a.conditions[..], &b.conditions[..]) else {
        return Some("one has no conditions".into());
    };
    if a.seed != b.seed {
        return Some(format!(
            "their trials have the seeds {} and {}; evaluate all champions with one seed, as by \
             `--base seed=0`",
            a.seed, b.seed
        ));
    }
    let (trials_a, trials_b) = (nominal_a.fitness.n, nominal_b.fitness.n);
    if trials_a != trials_b {
        return Some(format!("they have {trials_a} and {trials_b} trials"));
    }
    if a.steps != b.steps || nominal_a.config_digest != nominal_b.config_digest {
        return Some(
            "their nominal experiments differ; evaluate all champions with one experiment file, as \
             by `--config FILE --genotype CHAMPION --changed-conditions`"
                .into(),
        );
    }
    if of_a.ranges != of_b.ranges || of_a.realities != of_b.realities {
        return Some(
            "their pseudo-realities differ; use the same ranges and the same number".into(),
        );
    }
    None
}

#[cfg(test)]
mod tests {
    use std::fs;

    use serde_json::json;

    use super::*;

    /// Writes an evaluation; `edit` is a pointer and a value there.
    fn evaluation(path: &Path, [nominal, mean]: [f64; 2], edit: (&str, Value)) -> String {
        let mut summary = json!({
            "seed": 1, "steps": 10,
            "conditions": [{"config_digest": "ab", "fitness": {"n": 50}}],
            "pseudo_realities": {
                "ranges": {"radio_loss": [0, 0.5]}, "nominal": nominal, "mean": mean,
                "worst_tenth": {"mean": 0.1}, "drop": {"value": nominal - mean, "ci95": [0.0, 1.0]},
                "realities": [{"numbers": {"radio_loss": 0.25}}],
            },
        });
        if let Some(place) = summary.pointer_mut(edit.0) {
            *place = edit.1;
        }
        fs::create_dir_all(path).unwrap();
        fs::write(path.join(FILE), summary.to_string()).unwrap();
        path.display().to_string()
    }

    const AS_IT_IS: (&str, Value) = ("/none", Value::Null);

    #[test]
    fn champions_have_two_ranks_and_tau() {
        let dir = tempfile::tempdir().unwrap();
        let values = [[3.0, 1.0], [2.0, 2.0], [1.0, 0.5], [1.0, 0.25]];
        let names = values.iter().enumerate().map(|(index, values)| {
            evaluation(&dir.path().join(index.to_string()), *values, AS_IT_IS)
        });
        let names: Vec<String> = names.collect();
        assert!(names.iter().all(|name| is_evaluation(name)));
        let ranking = Ranking::read(&names).unwrap();
        let ranks: Vec<_> = ranking
            .champions
            .iter()
            .map(|champion| (champion.nominal_rank, champion.rank))
            .collect();
        assert_eq!(ranks, [(1, 2), (2, 1), (3, 3), (3, 4)]);
        let tau = ranking.kendall.unwrap().tau;
        assert!((tau - 3.0 / 30.0_f64.sqrt()).abs() < 1e-12, "{tau}");
    }

    #[test]
    fn what_does_not_belong_together_is_refused_with_the_reason() {
        let dir = tempfile::tempdir().unwrap();
        let first = evaluation(&dir.path().join("a"), [1.0, 0.5], AS_IT_IS);
        for (edit, reason) in [
            (("/seed", json!(2)), "their trials have the seeds 1 and 2"),
            (("/conditions/0/fitness/n", json!(20)), "they have 50 and 20 trials"),
            (("/conditions/0/config_digest", json!("cd")), "their nominal experiments differ"),
            (("/pseudo_realities/ranges/radio_loss", json!(1)), "their pseudo-realities differ"),
            (("/pseudo_realities", Value::Null), "has no pseudo-realities"),
            (("/conditions", json!([])), "has no conditions"),
            (("/steps", json!("ten")), "expected a file of `swarmctl evaluate`"),
        ] {
            let other = evaluation(&dir.path().join("b"), [1.0, 0.5], edit);
            let error = Ranking::read(&[first.clone(), other]).unwrap_err().to_string();
            assert!(error.contains(reason), "{error}");
        }
        assert!(Ranking::read(&[first]).unwrap_err().to_string().contains("two evaluations"));
    }
}
