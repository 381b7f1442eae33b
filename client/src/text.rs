//! Output for people.

use std::path::Path;

use model::wire::state_name;
use swarm_proto::v1::{
    Event, Experiment, ExperimentState, ForkOrigin, GenerationSummary, GetChampionResponse,
    HeldOutFitness, JudgedFitness, Round, event::Kind,
};

use console::truncate_str;
use model::store::Holder;
use swarm_telemetry::escape;
pub use swarm_telemetry::number;

use crate::{clock, defaults::DEFAULT_COORDINATOR};

/// Number of hexadecimal digits of a digest that are shown.
const DIGEST_DIGITS: usize = 12;

/// One generation on one line: the number of completed generations, then the number of
/// this one, from 0.
pub fn generation(summary: &GenerationSummary, generations: u64) -> String {
    let done = summary.generation + 1;
    let width = generations.to_string().len();
    format!(
        "{done:>width$}/{generations}  generation {:>width$}  {}  min {}  {:.0} episodes/s",
        summary.generation,
        fitness(summary),
        number(summary.min, 3),
        episodes_per_s(summary),
    )
}

/// Best and mean fitness of a generation.
pub fn fitness(summary: &GenerationSummary) -> String {
    format!("best {}  mean {}", number(summary.best, 3), number(summary.mean, 3))
}

/// Speed of a generation, in episodes per second.
pub fn episodes_per_s(summary: &GenerationSummary) -> f64 {
    summary.episodes as f64 * 1000.0 / summary.duration_ms.max(1) as f64
}

/// The first digits of a digest.
pub fn short(digest: &str) -> &str {
    digest.get(..DIGEST_DIGITS).unwrap_or(digest)
}

/// "1 item", "2 items".
pub fn counted(number: u64, noun: &str) -> String {
    format!("{number} {noun}{}", if number == 1 { "" } else { "s" })
}

/// The line about unfinished evaluations beside experiments.
pub fn evaluations(number: usize) -> Option<String> {
    let what = match number {
        0 => return None,
        1 => "1 evaluation is not done".to_owned(),
        n => format!("{n} evaluations are not done"),
    };
    Some(format!("{what}; see why: swarmctl explain"))
}

/// How far a round is, such as "generation 3: 120 of 500 episodes".
pub fn round(round: &Round) -> String {
    let generation = round.generation;
    let what = match round {
        Round { judgement: true, .. } => "judging the champion".to_owned(),
        Round { held_out: true, .. } => format!("candidates of generation {generation}"),
        _ => format!("generation {generation}"),
    };
    let n_done = round.episodes.saturating_sub(round.episodes_left);
    format!("{what}: {n_done} of {} episodes", round.episodes)
}

/// A count that may be large, to three digits, such as "1.50 billion".
pub fn large_number(number: f64) -> String {
    let units = [(1e12, "trillion"), (1e9, "billion"), (1e6, "million"), (1e3, "thousand")];
    match units.into_iter().find(|(unit, _)| number >= *unit) {
        Some((unit, name)) => format!("{:.2} {name}", number / unit),
        None => format!("{number:.0}"),
    }
}

/// A share of 1, in percent.
pub fn percent(share: f64) -> String {
    format!("{:.0} %", 100.0 * share)
}

/// An event on one line: its time, its experiment and its text.
pub fn log_line(experiment: &Experiment, event: &Event) -> String {
    let what = match &event.kind {
        Some(Kind::GenerationCompleted(summary)) => format!(
            "generation {}: {}  min {}  {:.0} episodes/s  digest {}",
            summary.generation,
            fitness(summary),
            number(summary.min, 3),
            episodes_per_s(summary),
            short(&summary.digest),
        ),
        Some(Kind::StateChanged(change)) => with_reason(state_name(change.state()), &change.reason),
        Some(Kind::Notice(notice)) => escape(&notice.message).into_owned(),
        None => "an event of a kind that this version of swarmctl does not know".into(),
    };
    format!("{}  {}  {what}", clock::utc(event.at_ms), title(experiment))
}

/// "failed: REASON", or "failed" without a reason.
pub fn with_reason(what: &str, reason: &str) -> String {
    if reason.is_empty() { what.into() } else { format!("{what}: {}", escape(reason)) }
}

/// "experiment 3 (leader)".
pub fn title(experiment: &Experiment) -> String {
    format!("experiment {} ({})", experiment.id, escape(&experiment.name))
}

/// The name of a run within its group: "3 seed 7 algorithm.population_size=50".
pub fn run_label(experiment: &Experiment) -> String {
    let separator = if experiment.variant.is_empty() { "" } else { " " };
    let variant = escape(&experiment.variant);
    format!("{} seed {}{separator}{variant}", experiment.id, experiment.seed)
}

/// The runs of a group that has been submitted, one line each.
pub fn submitted_group(name: &str, runs: &[Experiment]) -> String {
    let mut lines = vec![format!("group {name}: {}", counted(runs.len() as u64, "run"))];
    lines.extend(runs.iter().map(|run| {
        let done = match run.generations_done {
            0 => String::new(),
            done => format!(", {} after {done}", state_name(run.state())),
        };
        format!("  {}: {} generations{done}", run_label(run), run.generations)
    }));
    lines.join("\n")
}

/// The remark that an experiment was computed under another name than the file's.
pub fn under_another_name(old: &str, name: &str) -> Option<String> {
    (old != name).then(|| format!("it was computed under the name `{}`", escape(old)))
}

/// The remark about a submission that is identical to an experiment. `identical`: the number of
/// that experiment, 0 for none; `names`: its name and the name in the file, if both are known.
pub fn identical(
    submitted: &Experiment,
    identical: u64,
    reuse: bool,
    names: Option<(&str, &str)>,
) -> Option<String> {
    let old = names.and_then(|(old, name)| under_another_name(old, name));
    match identical {
        0 => None,
        id if id == submitted.id => reuse.then(|| {
            let remark =
                format!("experiment {id} has the same file, seed and version, and is used again");
            match (old, names) {
                (Some(old), Some((_, name))) => format!(
                    "{remark}; {old}, and without `--reuse` it is computed under `{}`",
                    escape(name)
                ),
                _ => remark,
            }
        }),
        id => Some(format!(
            "experiment {id} has the same file, seed and version as experiment {}, so it has the \
             same results; `--reuse` returns that one once it has completed{}",
            submitted.id,
            old.map(|old| format!("; {old}")).unwrap_or_default()
        )),
    }
}

/// A submitted experiment, on one line.
pub fn submitted(experiment: &Experiment) -> String {
    format!(
        "{}: {} of {} by {}, {} genes, seed {}",
        title(experiment),
        counted(experiment.generations, "generation"),
        experiment.population_size,
        experiment.algorithm,
        experiment.genotype_len,
        experiment.seed,
    )
}

/// An experiment's state, completed generations and reason, on one line.
pub fn state_line(experiment: &Experiment) -> String {
    let text = format!(
        "{} {} after {} of {} generations",
        title(experiment),
        state_name(experiment.state()),
        experiment.generations_done,
        experiment.generations,
    );
    with_reason(&text, &experiment.reason)
}

/// The labels of an experiment, separated by spaces.
pub fn labels(experiment: &Experiment) -> String {
    let labels = experiment.labels.iter().map(|(key, value)| format!("{key}={value}"));
    labels.collect::<Vec<_>>().join(" ")
}

/// Remaining time of a running experiment, in ms, if generations stay as fast as the latest
/// ones; none before the first.
pub fn eta_ms(experiment: &Experiment) -> Option<u64> {
    let is_running = experiment.state() == ExperimentState::Running;
    let n_left = experiment.generations.saturating_sub(experiment.generations_done);
    let generation_ms = experiment.recent_generation_ms.filter(|_| is_running)?;
    Some((generation_ms * n_left as f64).round() as u64)
}

/// The remaining time of a running experiment, on one line.
pub fn eta_line(experiment: &Experiment) -> Option<String> {
    let generation_ms = experiment.recent_generation_ms?;
    let left = clock::duration_ms(eta_ms(experiment)?);
    let each = match generation_ms {
        ..10_000.0 => format!("{:.2} s", generation_ms / 1000.0),
        _ => clock::duration_ms(generation_ms.round() as u64),
    };
    Some(format!("about {left} left, if generations keep taking {each}"))
}

/// The parent and the changes of an experiment, if it is a fork.
pub fn origin(experiment: &Experiment) -> Option<String> {
    let origin = experiment.forked_from.as_ref()?;
    let mut lines = vec![format!("forked from {}", origin_address(origin))];
    lines.extend(origin.changes.iter().map(|change| format!("  {}", escape(change))));
    Some(lines.join("\n"))
}

/// "3@499".
pub fn origin_address(origin: &ForkOrigin) -> String {
    format!("{}@{}", origin.experiment_id, origin.generation)
}

/// The outcome of an experiment: its state, fitness, champion and digest.
pub fn end(
    experiment: &Experiment,
    first_best: Option<f64>,
    champion: Option<&GetChampionResponse>,
    is_verbose: bool,
) -> String {
    let mut lines = vec![state_line(experiment)];
    if let Some(best) = first_best {
        lines.push(row("best of the first generation", &number(best, 6)));
    }
    if let Some(latest) = &experiment.latest {
        lines.push(row("mean of the last generation", &number(latest.mean, 6)));
    }
    if let Some(champion) = champion {
        lines.push(row("champion", &champion_line(champion)));
        // Without a judgement, this is the only estimate of its fitness.
        if is_verbose || champion.judged.is_none() {
            lines.extend(selection_line(champion).map(|line| row("champion, optimistic", &line)));
        }
    }
    if !experiment.digest.is_empty() {
        lines.push(row("digest", &experiment.digest));
    }
    lines.join("\n")
}

fn champion_line(champion: &GetChampionResponse) -> String {
    let generation = champion.generation;
    let source = match champion.individual {
        Some(individual) => format!("individual {individual} of generation {generation}"),
        None => format!("mean after generation {generation}"),
    };
    match &champion.judged {
        // A single trial has no interval.
        Some(JudgedFitness { mean, trials: 1, .. }) => {
            format!("{}, on 1 new trial ({source})", number(*mean, 6))
        }
        Some(JudgedFitness { mean, low, high, trials, .. }) => {
            let [mean, low, high] = [mean, low, high].map(|value| number(*value, 6));
            format!("{mean}, 95 % {low} to {high}, on {trials} new trials ({source})")
        }
        None => format!("not judged ({source})"),
    }
}

/// The fitness that selected a champion, which is optimistic.
fn selection_line(champion: &GetChampionResponse) -> Option<String> {
    match (&champion.held_out, champion.fitness) {
        (Some(HeldOutFitness { mean, trials, .. }), _) => {
            Some(format!("{} on the {trials} trials that selected it", number(*mean, 6)))
        }
        (None, Some(fitness)) => Some(format!("{} in its generation", number(fitness, 6))),
        (None, None) => None,
    }
}

/// The places of the files that `run` wrote.
pub fn files(data_dir: &Path, champion_file: Option<&Path>) -> String {
    let mut lines = vec![row("data", &data_dir.display().to_string())];
    if let Some(file) = champion_file {
        lines.push(row("champion file", &file.display().to_string()));
    }
    lines.join("\n")
}

fn row(name: &str, value: &str) -> String {
    format!("  {name:<30}{value}")
}

/// The outcome of a request to cancel.
pub fn cancelled(experiment: &Experiment) -> String {
    match experiment.state() {
        ExperimentState::Cancelled => state_line(experiment),
        _ => format!("{}; nothing to cancel", state_line(experiment)),
    }
}

/// Text wrapped to the screen between words. Lines with advice stay whole, so that users
/// can copy the command.
pub fn wrapped(text: &str, width: usize) -> String {
    let wrap = |line: &str| {
        if line.trim_start().starts_with("-> ") {
            return line.to_owned();
        }
        let indent = " ".repeat(line.len() - line.trim_start().len() + 2);
        let options = textwrap::Options::new(width)
            .subsequent_indent(&indent)
            .break_words(false)
            .word_splitter(textwrap::WordSplitter::NoHyphenation);
        textwrap::wrap(line, options).join("\n")
    };
    text.split('\n').map(wrap).collect::<Vec<_>>().join("\n")
}

/// [`wrapped`], where there is a screen.
pub fn fitting(text: &str, width: Option<usize>) -> String {
    width.map_or_else(|| text.to_owned(), |width| wrapped(text, width))
}

/// The message that a data directory has no workers, with the program that uses it.
pub fn no_fleet(data_dir: &Path, holder: Option<&Holder>) -> String {
    let start = ["coordinator", "--data-dir", &data_dir.to_string_lossy()].map(str::to_owned);
    let data_dir = data_dir.display();
    match holder {
        Some(Holder { address: Some(address), .. }) => {
            format!("{data_dir} is a data directory; ask its coordinator: --coordinator {address}")
        }
        Some(holder) => {
            format!("{data_dir} is a data directory, in which {holder} computes; it has no fleet")
        }
        None => format!(
            "{data_dir} is a data directory, in which no program computes\n  -> for a fleet, \
             start: {}",
            shell_command(start)
        ),
    }
}

/// The message that no program computes an experiment of a data directory, with the next
/// step.
pub fn deserted(experiment: &Experiment, data_dir: &Path) -> String {
    format!(
        "{}, and no program computes it; continue it with: {}",
        state_line(experiment),
        command_in("resume", experiment.id, data_dir)
    )
}

/// The answer that no event of these experiments has this sequence number or a later one.
pub fn no_events(experiments: &[Experiment], from_sequence: u64) -> String {
    match experiments {
        [] => "there are no experiments yet, and so no events".into(),
        [one] if from_sequence > one.last_sequence && one.last_sequence > 0 => format!(
            "experiment {} has no event {from_sequence} yet; its last one is {}",
            one.id, one.last_sequence
        ),
        _ if from_sequence > 1 => format!("no experiment has an event {from_sequence} yet"),
        _ => "there are no events yet".into(),
    }
}

/// A command about an experiment of a data directory.
pub fn command_in(command: &str, id: u64, data_dir: &Path) -> String {
    let id = id.to_string();
    let words = ["swarmctl", command, &id, "--data-dir", &data_dir.to_string_lossy()];
    shell_command(words.map(str::to_owned))
}

/// The remark that a command uses a data directory that the user has not named.
pub fn found(data_dir: &Path) -> String {
    format!("working on {}: nothing listens at {DEFAULT_COORDINATOR}", data_dir.display())
}

/// Text cut to a width.
pub fn cut(text: &str, width: usize) -> String {
    truncate_str(text, width, "…").into_owned()
}

/// A text whose commands of `swarmctl` have the options that name their place, unless they name one.
/// Commands are in backticks, or they are the rest of a line after a colon, separated by semicolons.
pub fn in_place(text: &str, options: &str) -> String {
    if options.is_empty() {
        return text.to_owned();
    }
    let with_options = |command: &str| match command {
        _ if ["--data-dir", "--coordinator"].iter().any(|named| command.contains(named)) => {
            command.to_owned()
        }
        _ => format!("{command} {options}"),
    };
    let line = |line: &str| {
        let mut parts: Vec<String> = line.split('`').map(str::to_owned).collect();
        // A backtick that nothing closes quotes nothing.
        let n_quoted = (parts.len() - 1) / 2;
        for quoted in parts.iter_mut().skip(1).step_by(2).take(n_quoted) {
            if quoted.starts_with("swarmctl ") {
                *quoted = with_options(quoted);
            }
        }
        if let Some(last) = parts.last_mut()
            && let Some((before, commands)) = last.split_once(": swarmctl ")
        {
            let commands = commands.split("; swarmctl ").map(with_options);
            *last =
                format!("{before}: swarmctl {}", commands.collect::<Vec<_>>().join("; swarmctl "));
        }
        parts.join("`")
    };
    text.split('\n').map(line).collect::<Vec<_>>().join("\n")
}

/// A command line that a shell reads back to the same arguments.
pub fn shell_command(args: impl IntoIterator<Item = String>) -> String {
    let quoted: Vec<String> = args
        .into_iter()
        .map(|arg| {
            let is_plain = |c: char| c.is_ascii_alphanumeric() || "-_./=:,@%+".contains(c);
            if !arg.is_empty() && arg.chars().all(is_plain) {
                arg
            } else {
                format!("'{}'", arg.replace('\'', r"'\''"))
            }
        })
        .collect();
    quoted.join(" ")
}

#[cfg(test)]
mod tests;
