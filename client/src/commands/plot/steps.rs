//! Curves of an evaluation: a measure over the steps, per condition.

use std::path::Path;

use indexmap::{IndexMap, IndexSet};
use serde::Deserialize;

use crate::recorded::plain;
use crate::{
    error::Error,
    figure::{Curve, Figure, Point},
    file_kind::{self, Kind},
};

/// The drawn columns of `steps.csv`.
#[derive(Debug, Deserialize)]
struct Row {
    condition: String,
    step: u64,
    metric: String,
    median: f64,
    q1: f64,
    q3: f64,
}

/// The median of a measure between its quartiles, per condition of the evaluation in a
/// directory. The measure may be omitted if there is only one. An empty list of
/// conditions means all.
pub fn figure(dir: &Path, metric: Option<&str>, conditions: &[String]) -> Result<Figure, Error> {
    file_kind::expect(dir, &[Kind::EvaluationDirectory], "the directory of an evaluation")
        .map_err(|what| Error::of_file(dir, what))?;
    let path = dir.join("steps.csv");
    let problem = |problem: String| Error::of_file(&path, problem);
    let mut reader = csv::Reader::from_path(&path).map_err(|error| problem(plain(&error)))?;
    let rows: Vec<Row> = reader.deserialize().collect::<Result<_, _>>().map_err(|error| {
        problem(format!("{}; expected a file of `swarmctl evaluate`", plain(&error)))
    })?;
    let metrics: IndexSet<&str> = rows.iter().map(|row| row.metric.as_str()).collect();
    let known = || metrics.iter().copied().collect::<Vec<_>>().join(", ");
    let metric = match metric {
        Some(name) if metrics.contains(name) => name,
        Some(name) => return Err(problem(format!("no measure `{name}`; there are: {}", known()))),
        None if metrics.len() == 1 => metrics[0],
        None => return Err(problem(format!("choose a measure with --metric: {}", known()))),
    };
    let mut curves: IndexMap<&str, Vec<Point>> = IndexMap::new();
    for row in rows.iter().filter(|row| row.metric == metric) {
        let Row { q1: low, median: middle, q3: high, .. } = *row;
        if [low, middle, high].iter().all(|value| value.is_finite()) {
            let point = Point { x: row.step as f64, low, middle, high };
            curves.entry(&row.condition).or_default().push(point);
        }
    }
    let names: Vec<&str> = match conditions {
        [] => curves.keys().copied().collect(),
        some => some.iter().map(String::as_str).collect(),
    };
    let curve = |name: &&str| match curves.get(name) {
        Some(points) => Ok(Curve { name: (*name).to_owned(), points: points.clone() }),
        None => {
            let known = curves.keys().copied().collect::<Vec<_>>().join(", ");
            Err(problem(format!("no condition `{name}` with that measure; there are: {known}")))
        }
    };
    let measure = metric.replace('_', " ");
    Ok(Figure {
        title: format!("{measure} in each step"),
        caption: "line: median of the trials; band: first to third quartile".into(),
        x_label: "step".into(),
        y_label: measure,
        curves: names.iter().map(curve).collect::<Result<_, _>>()?,
    })
}

#[cfg(test)]
mod tests {
    use std::fs;

    use super::*;

    const STEPS: &str = "\
condition,step,metric,n,median,q1,q3,mean
nominal,0,leaders,50,3,2,4,3
nominal,0,one_leader,50,0,0,1,0.25
nominal,5,leaders,50,1,1,2,1.5
\"robots=5, faulty\",0,leaders,50,2,1,2,2
";

    fn drawn(text: &str, metric: Option<&str>) -> Result<Figure, Error> {
        let dir = tempfile::tempdir().unwrap();
        fs::write(dir.path().join("steps.csv"), text).unwrap();
        figure(dir.path(), metric, &[])
    }

    #[test]
    fn a_curve_per_condition_goes_from_quartile_to_quartile() {
        let figure = drawn(STEPS, Some("leaders")).unwrap();
        assert_eq!((&*figure.x_label, &*figure.y_label), ("step", "leaders"));
        let names: Vec<&str> = figure.curves.iter().map(|curve| &*curve.name).collect();
        assert_eq!(names, ["nominal", "robots=5, faulty"]);
        let last = figure.curves[0].points[1];
        assert_eq!(last, Point { x: 5.0, low: 1.0, middle: 1.0, high: 2.0 });
    }

    #[test]
    fn conditions_are_drawn_in_the_order_in_which_they_are_named() {
        let dir = tempfile::tempdir().unwrap();
        fs::write(dir.path().join("steps.csv"), STEPS).unwrap();
        let named = |metric, names: &[&str]| {
            let names: Vec<String> = names.iter().map(|&name| name.to_owned()).collect();
            figure(dir.path(), Some(metric), &names)
        };
        let figure = named("leaders", &["robots=5, faulty", "nominal"]).unwrap();
        let names: Vec<&str> = figure.curves.iter().map(|curve| &*curve.name).collect();
        assert_eq!(names, ["robots=5, faulty", "nominal"]);
        let error = named("one_leader", &["robots=5, faulty"]).unwrap_err().to_string();
        assert!(error.ends_with("there are: nominal"), "{error}");
    }

    #[test]
    fn the_measure_is_chosen_by_name_unless_it_is_alone() {
        for metric in [None, Some("leader")] {
            let error = drawn(STEPS, metric).unwrap_err().to_string();
            assert!(error.ends_with(": leaders, one_leader"), "{error}");
        }
        let one: String = STEPS.lines().take(2).map(|line| format!("{line}\n")).collect();
        assert_eq!(drawn(&one, None).unwrap().curves.len(), 1);
    }

    #[test]
    fn a_directory_without_an_evaluation_is_refused_in_one_line() {
        for text in ["a,b\n1,2\n", "", "condition,step,metric,n,median,q1,q3,mean\na,b,c\n"] {
            let error = drawn(text, None).unwrap_err();
            assert_eq!((error.exit_code(), error.to_string().lines().count()), (2, 1), "{error}");
        }
        let error = figure(Path::new("missing"), None, &[]).unwrap_err();
        assert!(error.to_string().starts_with("missing/steps.csv: No such file"), "{error}");
    }
}
