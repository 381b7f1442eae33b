//! The queue of questions for the referee, which answers one at a time.

use std::{collections::VecDeque, future::pending};

use tokio::{task::JoinSet, time::timeout};

use engine::{RefereeRequest, Verdict};

use crate::{ids::QuestionId, limits::REFEREE_TIMEOUT, referee::Referee, text::printable};

/// The waiting questions, and the one that the referee computes.
#[derive(Debug)]
pub struct Questions {
    referee: Referee,
    waiting: VecDeque<(QuestionId, RefereeRequest)>,
    asked: Option<QuestionId>,
    task: JoinSet<(QuestionId, Verdict)>,
}

impl Questions {
    /// No questions.
    pub fn new(referee: Referee) -> Self {
        Self { referee, waiting: VecDeque::new(), asked: None, task: JoinSet::new() }
    }

    /// Queues a question.
    pub fn ask(&mut self, id: QuestionId, request: RefereeRequest) {
        self.waiting.push_back((id, request));
        self.go_on();
    }

    /// Forgets a question.
    pub fn withdraw(&mut self, id: QuestionId) {
        self.waiting.retain(|(waiting, _)| *waiting != id);
        if self.asked == Some(id) {
            self.task.abort_all();
            self.asked = None;
            self.go_on();
        }
    }

    /// The next answer; pending for ever without questions.
    pub async fn answer(&mut self) -> (QuestionId, Verdict) {
        loop {
            let (id, verdict) = match self.task.join_next().await {
                Some(Ok((id, _))) if self.asked != Some(id) => continue,
                Some(Ok((id, verdict))) => (id, verdict.map_text(|text| printable(&text))),
                // The question was withdrawn.
                Some(Err(error)) if error.is_cancelled() => continue,
                Some(Err(error)) => match self.asked {
                    Some(id) => (id, Verdict::Unavailable(format!("{error}; please report this"))),
                    None => continue,
                },
                None => pending().await,
            };
            self.asked = None;
            self.go_on();
            return (id, verdict);
        }
    }

    /// Forgets all.
    pub async fn shutdown(&mut self) {
        self.waiting.clear();
        self.task.shutdown().await;
    }

    fn go_on(&mut self) {
        if self.asked.is_some() {
            return;
        }
        let Some((id, request)) = self.waiting.pop_front() else { return };
        let referee = self.referee.clone();
        self.asked = Some(id);
        self.task.spawn(async move {
            let verdict = timeout(REFEREE_TIMEOUT, referee.evaluate(&request)).await;
            let late = || format!("it has not answered for {} min", REFEREE_TIMEOUT.as_secs() / 60);
            (id, verdict.unwrap_or_else(|_| Verdict::Unavailable(late())))
        });
    }
}
