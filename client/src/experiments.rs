//! The experiments of a place: all, filtered, or by name.

use experiment_file::suggestion;
use swarm_proto::v1::{Experiment, ExperimentState, ListExperimentsRequest};

use crate::{
    connection::Connection,
    error::{Code, Error},
    file_kind,
    subject::Subject,
};

/// Number of experiments in one answer: far below the limit of a message.
const PAGE_LEN: u32 = 2_000;

impl Connection {
    /// The requested experiments, oldest first.
    pub async fn list(&self, wanted: ListExperimentsRequest) -> Result<Vec<Experiment>, Error> {
        let mut request = ListExperimentsRequest { page_size: PAGE_LEN, ..wanted };
        let mut all: Vec<Experiment> = Vec::new();
        loop {
            let page = request.clone();
            let answer = self.call(async |client| client.list_experiments(page.clone()).await);
            let page = answer.await?.experiments;
            // A coordinator of an earlier version ignores pages, and always sends everything.
            if page.first().is_some_and(|first| first.id <= request.after) {
                return Ok(all);
            }
            let is_last = page.len() != PAGE_LEN as usize;
            request.after = page.last().map_or(0, |last| last.id);
            all.extend(page);
            if is_last {
                return Ok(all);
            }
        }
    }

    /// All experiments, oldest first.
    pub async fn experiments(&self) -> Result<Vec<Experiment>, Error> {
        self.list(ListExperimentsRequest::default()).await
    }

    /// The running experiments, oldest first.
    pub async fn running(&self) -> Result<Vec<Experiment>, Error> {
        let states = vec![ExperimentState::Running.into()];
        self.list(ListExperimentsRequest { states, ..Default::default() }).await
    }

    /// One experiment, or all of a group.
    pub async fn subject(&self, subject: &Subject) -> Result<Vec<Experiment>, Error> {
        match subject {
            Subject::Experiment(id) => Ok(vec![self.experiment(*id).await?]),
            Subject::Group(name) => self.group(name).await,
        }
    }

    /// The one experiment of a number or a name; fails if the name is a group of several.
    pub async fn one(&self, subject: &Subject) -> Result<Experiment, Error> {
        let mut found = self.subject(subject).await?;
        match found.len() {
            1 => Ok(found.remove(0)),
            _ => Err(several(&subject.to_string(), &found)),
        }
    }

    /// The experiments of a group, oldest first; or the one experiment of that name.
    pub async fn group(&self, name: &str) -> Result<Vec<Experiment>, Error> {
        let wanted = ListExperimentsRequest { named: name.to_owned(), ..Default::default() };
        // A coordinator of an earlier version ignores names, too. Check the name, because a
        // command may cancel these experiments.
        let (members, others): (Vec<Experiment>, Vec<Experiment>) =
            self.list(wanted).await?.into_iter().partition(|experiment| experiment.group == name);
        if !members.is_empty() {
            return Ok(members);
        }
        let named: Vec<Experiment> =
            others.into_iter().filter(|experiment| experiment.name == name).collect();
        match named.len() {
            0 => Err(unknown(name, &self.experiments().await?)),
            1 => Ok(named),
            _ => Err(several(name, &named)),
        }
    }
}

/// The error that a name is unknown.
fn unknown(name: &str, all: &[Experiment]) -> Error {
    let names = all.iter().flat_map(|experiment| [&*experiment.group, &*experiment.name]);
    let mut names: Vec<&str> = names.filter(|name| !name.is_empty()).collect();
    names.sort_unstable();
    names.dedup();
    let what = format!("no group or experiment is named `{name}`");
    let message = match file_kind::of_word(name) {
        Some(file) => format!("{what}, and {file}"),
        None if names.is_empty() => format!("{what}: no experiment exists"),
        None => format!("{what}; {}", suggestion(name, &names)),
    };
    Error::at(Code::NotFound, name, message)
}

/// The error that a name is ambiguous.
fn several(name: &str, experiments: &[Experiment]) -> Error {
    let ids: Vec<String> =
        experiments.iter().take(10).map(|experiment| experiment.id.to_string()).collect();
    let more = if experiments.len() > ids.len() { ", ..." } else { "" };
    let ids = ids.join(", ");
    let message =
        format!("`{name}` is the name of several experiments: {ids}{more}; give a number");
    Error::at(Code::AmbiguousName, name, message)
}
