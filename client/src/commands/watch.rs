//! Follows experiments to their end, across interruptions of the coordinator.

pub mod events;
mod follower;
pub mod quiet;
mod situation;

use std::{future::pending, path::Path, sync::Arc, time::Duration};

use clap::Args;
use clap_complete::ArgValueCompleter;
use model::wire::has_ended;
use swarm_proto::v1::{
    Experiment, ExperimentState, ExplainExperimentRequest, ExplainExperimentResponse,
    GetChampionResponse,
};
use swarm_telemetry::parse_duration;
use tokio::{
    sync::{Semaphore, mpsc},
    task::JoinSet,
    time::{interval, timeout},
};

use super::{champion_file, compare};
use crate::{
    complete,
    connection::{Connection, PATIENCE_WHILE_FOLLOWING as PATIENCE},
    error::Error,
    json,
    progress::Progress,
    remote::Remote,
    subject::Subject,
    text,
    waiting::SILENCE_MAX,
};

use self::{
    events::Wanted,
    follower::{Follower, News},
    quiet::WaitFor,
};

/// Maximum number of experiments of a group that are followed at the same time. Each takes a
/// stream of the one connection, and the reports of obstacles take one more. When one ends, the
/// next is followed.
const STREAMS_MAX: usize = 64;
/// How often the command checks whether a program computes the data directory.
const LOOK_EVERY: Duration = Duration::from_secs(1);
/// Capacity of the channel of news.
const NEWS_MAX: usize = 16;

/// An experiment that has ended.
#[derive(Debug)]
pub struct Followed {
    pub experiment: Experiment,
    /// None if the experiment ended before its first generation was complete.
    pub champion: Option<GetChampionResponse>,
    /// Best fitness of the first generation.
    pub first_best: Option<f64>,
}

/// Follow an experiment, or a group of them, from the first generation to the end.
///
/// The command first shows the generations that are already complete. It reports at once any
/// obstacle, such as a pause or a lack of workers, with the next step. If the coordinator becomes
/// unreachable, the command tries for a minute to reconnect. Interrupting this command does not
/// interrupt the experiment.
#[derive(Debug, Args)]
#[command(after_help = HELP)]
pub struct WatchArgs {
    /// Number or name of the experiment, or name of a group of experiments [default with
    /// --events: all, in the order of time]
    #[arg(
        value_name = "ID|NAME",
        required_unless_present = "events",
        add = ArgValueCompleter::new(complete::experiments)
    )]
    subject: Option<Subject>,
    /// Print each event on a line instead: completed generations, changes of state, and notices
    /// such as the re-evaluation of a champion.
    #[arg(long, conflicts_with = "quiet")]
    events: bool,
    /// Start at the event with this sequence number.
    #[arg(
        long = "from",
        value_name = "SEQ",
        default_value_t = 1,
        requires = "events",
        requires = "subject"
    )]
    from_sequence: u64,
    /// Print the events so far, then end.
    #[arg(long, requires = "events")]
    so_far: bool,
    /// Print only the outcome of the experiment. Standard error still reports obstacles.
    #[arg(long)]
    quiet: bool,
    /// Which end counts as success.
    #[arg(
        long = "for",
        value_enum,
        default_value_t = WaitFor::Completed,
        value_name = "END",
        requires = "quiet"
    )]
    end: WaitFor,
    /// Stop waiting after this time: 90s, 15m, 2h [default: no limit]
    #[arg(long, value_name = "TIME", value_parser = parse_duration, requires = "quiet")]
    timeout: Option<Duration>,
}

const HELP: &str = "\
With --output json, the command prints a line per generation (numbered from 0),
then a line for each experiment with state, digest and champion; with --events
a line per event, with kind generation, state or notice.

Exit codes:
  0   the experiment completed, or ended as --for allows; with --events: it ended
  5   the experiment failed
  6   the experiment was cancelled
  10  the experiment has not ended within --timeout

Examples:
  swarmctl watch 3 --output json | jq .best
  swarmctl watch leader_selection_snes
  swarmctl watch 3 --quiet && swarmctl champion 3 > champion.json
  swarmctl watch 3 --quiet --for ended --timeout 2h
  swarmctl watch --events
  swarmctl watch 3 --events --from 120 --output json | jq .kind";

impl Remote for WatchArgs {
    fn ends_with_reader(&self) -> bool {
        !self.quiet
    }

    async fn execute(self, connection: &Connection, progress: &mut Progress) -> Result<(), Error> {
        let Self { subject, from_sequence, end, timeout, .. } = self;
        match subject {
            Some(subject) if self.quiet => {
                quiet::wait(connection, &subject, end, timeout, progress).await
            }
            Some(subject) if !self.events => {
                watch(connection, connection.subject(&subject).await?, progress).await
            }
            subject => {
                let wanted = Wanted { subject, follow: !self.so_far, from_sequence };
                events::print(&wanted, connection, progress).await
            }
        }
    }
}

/// Follows experiments to their end and prints how each ended.
pub async fn watch(
    connection: &Connection,
    experiments: Vec<Experiment>,
    progress: &mut Progress,
) -> Result<(), Error> {
    let all = tokio::select! {
        all = follow(connection, experiments.clone(), progress) => all?,
        error = deserted(connection, &experiments) => return Err(error),
    };
    for Followed { experiment, champion, first_best } in &all {
        let data_dir = connection.data_dir().filter(|_| connection.computes());
        let champion_file = match (data_dir, champion) {
            (Some(data_dir), Some(champion)) => {
                Some(champion_file::write(data_dir, experiment, champion)?)
            }
            _ => None,
        };
        if progress.is_json() {
            let file = champion_file.as_deref().map(Path::to_string_lossy);
            let end = json::EndLine::new(experiment, champion.as_ref());
            progress.print_line(&end.with_champion_file(file.as_deref()))?;
            continue;
        }
        let mut lines =
            vec![text::end(experiment, *first_best, champion.as_ref(), progress.is_verbose())];
        lines.extend(data_dir.map(|directory| text::files(directory, champion_file.as_deref())));
        progress.print(&lines.join("\n"))?;
    }
    compare_group(connection, &all, progress).await?;
    all.iter().try_for_each(|followed| success(&followed.experiment))
}

/// Compares the runs of a group, and suggests further commands about them.
async fn compare_group(
    connection: &Connection,
    all: &[Followed],
    progress: &mut Progress,
) -> Result<(), Error> {
    let has_completed =
        |followed: &&Followed| followed.experiment.state() == ExperimentState::Completed;
    let group = all.first().map_or("", |first| &*first.experiment.group);
    let is_one = all.iter().all(|followed| followed.experiment.group == group);
    let n_completed = all.iter().filter(has_completed).count();
    if progress.is_json() || group.is_empty() || !is_one || n_completed < 2 {
        return Ok(());
    }
    progress.print("")?;
    compare::of_group(connection, group, progress).await?;
    let mut next = String::from("\nnext:");
    for words in [
        &["compare", group, "--to", "comparison.svg"][..],
        &["plot", group, "--to", "fitness.svg"],
        &["list", group],
    ] {
        next += &format!("\n  {}", connection.command(words));
    }
    progress.print(&next)
}

/// Shows the events of experiments until all of them have ended. Returns the experiments in
/// the order of their numbers.
pub async fn follow(
    connection: &Connection,
    experiments: Vec<Experiment>,
    progress: &mut Progress,
) -> Result<Vec<Followed>, Error> {
    connection.set_going(&experiments);
    progress.begin(&experiments);
    let connection = connection.with_patience(PATIENCE);
    let (sender, mut news) = mpsc::channel(NEWS_MAX);
    let streams = Arc::new(Semaphore::new(STREAMS_MAX));
    let ids: Vec<u64> = experiments.iter().map(|experiment| experiment.id).collect();
    let n_followed = ids.len();
    // Ends the tasks when this function ends.
    let mut followers = JoinSet::new();
    for experiment in experiments {
        let follower = Follower {
            connection: connection.clone(),
            experiment_id: experiment.id,
            news: sender.clone(),
        };
        let (sender, streams) = (sender.clone(), streams.clone());
        followers.spawn(async move {
            let _stream = streams.acquire().await;
            let last = match follower.run(1).await {
                Ok(first_best) => News::Ended(follower.experiment_id, first_best),
                Err(error) => News::Failed(error),
            };
            // The receiver is gone only after a failure.
            let _ = sender.send(last).await;
        });
    }
    followers.spawn(situation::tell(connection.clone(), ids, sender));
    let mut ended = Vec::new();
    let mut last_loss = String::new();
    let mut is_hindered = false;
    while ended.len() < n_followed {
        let news = match timeout(SILENCE_MAX, news.recv()).await {
            Ok(Some(news)) => news,
            // One of the tasks runs until the last experiment has ended.
            Ok(None) => break,
            Err(_) => {
                if !is_hindered {
                    show_round(&connection, progress).await;
                }
                continue;
            }
        };
        match news {
            News::Situation(id, finding) => {
                is_hindered = finding.is_some();
                progress.situation(id, finding.as_ref());
            }
            News::Generation(id, summary) => progress.generation(id, &summary)?,
            News::Notice(id, text) => progress.notice(id, &text),
            // All followers of one coordinator lose it together.
            News::Lost(text) if text == last_loss => {}
            News::Lost(text) => {
                progress.remark(&text);
                last_loss = text;
            }
            News::Ended(id, first_best) => {
                progress.ended(id);
                ended.push(final_state(&connection, id, first_best).await?);
            }
            News::Failed(error) => {
                progress.clear();
                return Err(error);
            }
        }
    }
    progress.clear();
    ended.sort_by_key(|followed| followed.experiment.id);
    Ok(ended)
}

/// Shows how far the generation in evaluation is. A lost coordinator is the followers' news.
async fn show_round(connection: &Connection, progress: &mut Progress) {
    let Some(id) = progress.first_unfinished() else { return };
    let explaining = connection.with_patience(Duration::ZERO);
    let request = ExplainExperimentRequest { experiment_id: id };
    let answer = explaining.call(async |client| client.explain_experiment(request).await);
    if let Ok(Ok(ExplainExperimentResponse { round: Some(round), .. })) =
        timeout(SILENCE_MAX, answer).await
    {
        progress.round(id, &round);
    }
}

async fn final_state(
    connection: &Connection,
    experiment_id: u64,
    first_best: Option<f64>,
) -> Result<Followed, Error> {
    let experiment = connection.experiment(experiment_id).await?;
    let champion = match connection.champion(experiment_id).await {
        Ok(champion) => Some(champion),
        Err(Error::NotFound(_) | Error::WrongState(_)) => None,
        Err(error) => return Err(error),
    };
    Ok(Followed { experiment, champion, first_best })
}

/// Waits until an experiment has ended. Reports only obstacles and a lost coordinator, because
/// neither may pass in silence.
pub async fn ended(
    connection: &Connection,
    experiment: Experiment,
    progress: &Progress,
) -> Result<Experiment, Error> {
    if has_ended(experiment.state()) {
        return Ok(experiment);
    }
    let (experiment_id, next) = (experiment.id, experiment.last_sequence + 1);
    let connection = connection.with_patience(PATIENCE);
    let (sender, mut news) = mpsc::channel(NEWS_MAX);
    let follower = Follower { connection: connection.clone(), experiment_id, news: sender.clone() };
    let end = async {
        tokio::select! {
            end = follower.run(next) => end,
            // The followers of the experiment report its end.
            never = async {
                situation::tell(connection.clone(), vec![experiment_id], sender).await;
                pending().await
            } => never,
        }
    };
    let say = async {
        while let Some(news) = news.recv().await {
            match news {
                News::Situation(id, finding) => progress.situation(id, finding.as_ref()),
                News::Lost(text) => progress.remark(&text),
                _ => {}
            }
        }
        pending().await
    };
    tokio::select! {
        end = end => end?,
        never = say => never,
    };
    connection.experiment(experiment_id).await
}

/// Waits until no program computes the unfinished experiments of a data directory, then returns
/// an error. Waits for ever with a coordinator, or if this process computes.
pub async fn deserted(connection: &Connection, experiments: &[Experiment]) -> Error {
    if connection.data_dir().is_none() || connection.computes() {
        return pending().await;
    }
    let mut looks = interval(LOOK_EVERY);
    loop {
        looks.tick().await;
        let Some(data_dir) = connection.idle_data_dir().await else { continue };
        for experiment in experiments {
            match connection.experiment(experiment.id).await {
                Ok(experiment) if has_ended(experiment.state()) => {}
                Ok(experiment) => {
                    let message = text::deserted(&experiment, data_dir);
                    return Error::WrongState(message).about(experiment.id);
                }
                Err(error) => return error,
            }
        }
        // The followers end the command, after they have shown the last events.
        return pending().await;
    }
}

/// Success if the experiment completed; fails if it failed or was cancelled.
pub fn success(experiment: &Experiment) -> Result<(), Error> {
    let (id, reason) = (experiment.id, experiment.reason.clone());
    match experiment.state() {
        ExperimentState::Completed => Ok(()),
        ExperimentState::Cancelled => Err(Error::Cancelled { id, reason }),
        _ => Err(Error::Failed { id, reason }),
    }
}

#[cfg(test)]
mod tests;
