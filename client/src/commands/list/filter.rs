//! The experiments of a list, and their order.

use std::cmp::{Ordering, Reverse};

use clap::{Args, ValueEnum};
use clap_complete::ArgValueCompleter;
use swarm_proto::v1::{Experiment, ExperimentState, ListExperimentsRequest};

use crate::{complete, text};

/// The experiments to list, and their order.
#[derive(Debug, Default, Args)]
pub struct Filter {
    /// List only experiments in this state, or in one of several.
    #[arg(long, value_enum, value_delimiter = ',', value_name = "STATE")]
    state: Vec<State>,
    /// List only experiments with this label, with any value or with this one. If repeated,
    /// an experiment must have all of them.
    #[arg(long, value_name = "KEY[=VALUE]", add = ArgValueCompleter::new(complete::labels))]
    label: Vec<String>,
    /// Include archived experiments.
    #[arg(long)]
    all: bool,
    /// Order: best puts the largest fitness first, age the newest experiment, eta the next
    /// to end.
    #[arg(long, value_enum, default_value_t, value_name = "COLUMN")]
    sort: Sort,
}

/// A state, as written on the command line.
#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
enum State {
    Running,
    Paused,
    Completed,
    Failed,
    Cancelled,
}

/// The sort key of a list; ties are ordered by number.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq, ValueEnum)]
enum Sort {
    #[default]
    Id,
    Name,
    State,
    Best,
    Age,
    Eta,
}

impl From<State> for ExperimentState {
    fn from(state: State) -> Self {
        match state {
            State::Running => Self::Running,
            State::Paused => Self::Paused,
            State::Completed => Self::Completed,
            State::Failed => Self::Failed,
            State::Cancelled => Self::Cancelled,
        }
    }
}

impl Filter {
    /// The experiments to list; `named`: the name of a group, or of an experiment.
    pub fn wanted(&self, named: Option<String>) -> ListExperimentsRequest {
        ListExperimentsRequest {
            named: named.unwrap_or_default(),
            states: self.state.iter().map(|&state| ExperimentState::from(state).into()).collect(),
            labels: self.label.clone(),
            without_archived: !self.all,
            ..Default::default()
        }
    }

    /// The same with archived experiments.
    pub fn with_archived(&self, named: Option<String>) -> ListExperimentsRequest {
        ListExperimentsRequest { without_archived: false, ..self.wanted(named) }
    }

    /// Sorts experiments, which arrive in the order of their numbers.
    pub fn sort(&self, experiments: &mut [Experiment]) {
        experiments.sort_by(|a, b| self.sort.compare(a, b));
    }
}

impl Sort {
    fn compare(self, a: &Experiment, b: &Experiment) -> Ordering {
        match self {
            Self::Id => Ordering::Equal,
            Self::Name => a.name.cmp(&b.name),
            Self::State => a.state.cmp(&b.state),
            // Unknown values come last.
            Self::Best => descending(best(a), best(b)),
            Self::Age => Reverse(a.submitted_at_ms).cmp(&Reverse(b.submitted_at_ms)),
            Self::Eta => {
                let eta = |experiment| text::eta_ms(experiment).unwrap_or(u64::MAX);
                eta(a).cmp(&eta(b))
            }
        }
    }
}

/// The champion's judged fitness, or else the fitness that selected it.
fn best(experiment: &Experiment) -> Option<f64> {
    experiment.champion_fitness.or(experiment.champion_selection_fitness)
}

fn descending(a: Option<f64>, b: Option<f64>) -> Ordering {
    let or_last = |fitness: Option<f64>| fitness.unwrap_or(f64::NEG_INFINITY);
    or_last(b).total_cmp(&or_last(a))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn experiments() -> Vec<Experiment> {
        let labels = |user: &str| [("user".to_owned(), user.to_owned())].into();
        vec![
            Experiment {
                id: 1,
                state: ExperimentState::Completed.into(),
                champion_fitness: Some(1.0),
                labels: labels("ada"),
                submitted_at_ms: 5,
                ..Experiment::default()
            },
            Experiment {
                id: 2,
                state: ExperimentState::Running.into(),
                champion_selection_fitness: Some(2.0),
                labels: labels("grace"),
                generations: 9,
                recent_generation_ms: Some(1.0),
                submitted_at_ms: 6,
                ..Experiment::default()
            },
            Experiment { id: 3, archived: true, ..Experiment::default() },
        ]
    }

    fn ids(filter: Filter) -> Vec<u64> {
        let mut experiments = experiments();
        filter.sort(&mut experiments);
        experiments.iter().map(|experiment| experiment.id).collect()
    }

    #[test]
    fn unknown_values_come_last() {
        let sorted = |sort| ids(Filter { sort, ..Filter::default() });
        assert_eq!(sorted(Sort::Best), [2, 1, 3]);
        assert_eq!(sorted(Sort::Age), [2, 1, 3]);
        assert_eq!(sorted(Sort::Eta), [2, 1, 3]);
        assert_eq!(sorted(Sort::Name), [1, 2, 3]);
    }
}
