//! Progress of experiments that are followed: a bar for all of them on a terminal, lines elsewhere.

use std::{collections::VecDeque, time::Duration};

use indicatif::FormattedDuration;
use swarm_proto::v1::{Experiment, GenerationSummary, Round};
use swarm_telemetry::escape;

use crate::{clock, error::Error, finding::Finding, json, output_format::OutputFormat, text};

use super::{Progress, STEP_PAUSE};

/// The end of a notice about fitness on trials that selected the champion.
const OPTIMISTIC: &str = ", optimistic";
/// Generations over which the estimate of the remaining time averages.
pub(super) const ETA_WINDOW: usize = 20;
/// Without a bar, a shorter remaining time is not reported.
const ETA_MIN: Duration = Duration::from_secs(10);
/// Names before the bar are cut to this width.
const NAME_WIDTH_MAX: usize = 24;

/// The shown state of a followed experiment.
pub(super) struct Followed {
    /// Number of generations to do.
    generations: u64,
    done: u64,
    /// The name that distinguishes it from the others.
    label: String,
    has_ended: bool,
    /// The latest generations' durations.
    pub(super) durations_ms: VecDeque<u64>,
}

impl Followed {
    /// Remaining time if generations stay as fast as the latest ones.
    fn remaining(&self) -> Duration {
        let n_left = if self.has_ended { 0 } else { self.generations.saturating_sub(self.done) };
        remaining(&self.durations_ms, n_left)
    }
}

impl Progress {
    /// Shows the bar of experiments, if there is a terminal.
    pub fn begin(&mut self, experiments: &[Experiment]) {
        let followed = |experiment: &Experiment| Followed {
            generations: experiment.generations,
            done: 0,
            label: text::run_label(experiment),
            has_ended: false,
            durations_ms: VecDeque::new(),
        };
        self.followed =
            experiments.iter().map(|experiment| (experiment.id, followed(experiment))).collect();
        if self.has_terminal && !self.is_json() {
            let name = experiments.first().map_or("", |first| match experiments.len() {
                1 => &first.name,
                _ => &first.group,
            });
            let name = text::cut(&escape(name), NAME_WIDTH_MAX);
            let length = experiments.iter().map(|experiment| experiment.generations).sum();
            self.show_bar(name, length, "waiting for the first generation");
        }
    }

    /// Shows a generation of a followed experiment.
    pub fn generation(
        &mut self,
        experiment_id: u64,
        summary: &GenerationSummary,
    ) -> Result<(), Error> {
        let is_alone = self.followed.len() == 1;
        let (mut generations, mut label) = (0, String::new());
        if let Some(followed) = self.followed.get_mut(&experiment_id) {
            followed.done = summary.generation + 1;
            followed.durations_ms.truncate(ETA_WINDOW - 1);
            followed.durations_ms.push_front(summary.duration_ms);
            generations = followed.generations;
            label.clone_from(&followed.label);
        }
        match self.format {
            OutputFormat::Json => {
                self.print_line(&json::GenerationLine::new(experiment_id, summary))
            }
            _ if self.has_terminal => {
                let done = self.followed.values().map(|followed| followed.done).sum();
                let fitness = text::fitness(summary);
                self.bar.set_position(done);
                let eta = format!("ETA {}", FormattedDuration(self.remaining()));
                let parts = if is_alone {
                    [eta, fitness, String::new(), String::new()]
                } else {
                    let n_ended = self.followed.values().filter(|run| run.has_ended).count();
                    let ended = format!("{n_ended} of {} runs ended", self.followed.len());
                    [eta, ended, label, fitness]
                };
                self.set_message(&parts);
                Ok(())
            }
            _ => {
                let mut line = text::generation(summary, generations);
                if !is_alone {
                    line = format!("{label}  {line}");
                }
                let eta = self.remaining();
                if eta >= ETA_MIN {
                    line += &format!("  ETA {}", FormattedDuration(eta));
                }
                if self.is_verbose {
                    line += &format!("  digest {}", text::short(&summary.digest));
                }
                self.print(&line)
            }
        }
    }

    /// The first followed experiment that has not ended.
    pub fn first_unfinished(&self) -> Option<u64> {
        self.followed.iter().find(|(_, run)| !run.has_ended).map(|(&id, _)| id)
    }

    /// Shows how far a long round is: beside the bar, or in occasional lines.
    pub fn round(&mut self, experiment_id: u64, round: &Round) {
        let line = text::round(round);
        if self.has_terminal && !self.is_json() {
            let label = match self.followed.get(&experiment_id) {
                Some(run) if self.followed.len() > 1 => run.label.clone(),
                _ => String::new(),
            };
            return self.set_message(&[label, line]);
        }
        let now = clock::now();
        if self.next_word.is_none_or(|(next, _)| now >= next) {
            self.next_word = Some((now + STEP_PAUSE, 0));
            self.notice(experiment_id, &line);
        }
    }

    /// Time until all followed experiments have ended: they are computed side by side.
    pub(super) fn remaining(&self) -> Duration {
        self.followed.values().map(Followed::remaining).max().unwrap_or_default()
    }

    /// A remark about a followed experiment.
    pub fn notice(&self, experiment_id: u64, text: &str) {
        if !self.is_verbose && text.ends_with(OPTIMISTIC) {
            return;
        }
        match self.followed.get(&experiment_id) {
            Some(followed) if self.followed.len() > 1 => {
                self.remark(&format!("{}  {text}", followed.label));
            }
            _ => self.remark(text),
        }
    }

    /// Reports the obstacle of an experiment; none: it has passed.
    pub fn situation(&self, experiment_id: u64, finding: Option<&Finding>) {
        let what = match finding {
            Some(finding) => format!("waiting: {finding}"),
            None => "workers compute it again".to_owned(),
        };
        let first_line = what.lines().next().unwrap_or_default();
        self.set_message(&[text::cut(first_line, self.message_room())]);
        self.notice(experiment_id, &what);
    }

    /// Counts a followed experiment as ended.
    pub fn ended(&mut self, experiment_id: u64) {
        if let Some(followed) = self.followed.get_mut(&experiment_id) {
            followed.has_ended = true;
        }
    }
}

/// Time of `generations` more generations if they are as fast as the latest ones.
pub(super) fn remaining(durations_ms: &VecDeque<u64>, generations: u64) -> Duration {
    let mean_ms = durations_ms.iter().sum::<u64>() as f64 / durations_ms.len().max(1) as f64;
    Duration::from_secs((mean_ms * generations as f64 / 1000.0).round() as u64)
}
