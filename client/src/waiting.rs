//! Waiting aloud: after two seconds, and again from time to time, a command prints on
//! standard error what it waits for or computes.

use std::{
    pin::pin,
    sync::mpsc::{self, RecvTimeoutError},
    thread,
    time::Duration,
};

use swarm_proto::v1::ListWorkersRequest;
use swarm_telemetry::report;
use tokio::time::timeout;

use crate::{connection::Connection, text};

/// The longest silent wait.
pub const SILENCE_MAX: Duration = Duration::from_secs(2);
/// The time until the message is repeated.
pub const REMINDER: Duration = Duration::from_secs(30);
/// Time limit for a coordinator's own explanation.
const ANSWER_TIME: Duration = Duration::from_secs(1);

/// Waits, and prints the reason: `what` follows "waiting for "; none if the wait is
/// short.
pub async fn aloud<T>(what: impl AsyncFn() -> Option<String>, wait: impl Future<Output = T>) -> T {
    aloud_to(|line| report(&line), what, wait).await
}

async fn aloud_to<T>(
    mut say: impl FnMut(String),
    what: impl AsyncFn() -> Option<String>,
    wait: impl Future<Output = T>,
) -> T {
    let mut wait = pin!(wait);
    let mut silence = SILENCE_MAX;
    loop {
        match timeout(silence, wait.as_mut()).await {
            Ok(done) => return done,
            Err(_) => what().await.into_iter().for_each(|what| say(format!("waiting for {what}"))),
        }
        silence = REMINDER;
    }
}

/// Does work that keeps this thread busy, and prints its name, such as "reading it".
pub fn busy<T>(what: &str, work: impl FnOnce() -> T) -> T {
    busy_to(&report, SILENCE_MAX, what, work)
}

fn busy_to<T>(
    say: &(impl Fn(&str) + Sync),
    mut silence: Duration,
    what: &str,
    work: impl FnOnce() -> T,
) -> T {
    thread::scope(|scope| {
        let (end, ended) = mpsc::channel::<()>();
        let speaker = thread::Builder::new().spawn_scoped(scope, move || {
            while ended.recv_timeout(silence) == Err(RecvTimeoutError::Timeout) {
                say(what);
                silence = REMINDER;
            }
        });
        // Without a free thread, the work is silent.
        drop(speaker);
        let done = work();
        drop(end);
        done
    })
}

/// The reason why work of a coordinator's fleet waits, in the words of [`aloud`]. `otherwise`:
/// the alternative without a fleet.
pub async fn fleet(connection: &Connection, otherwise: &str) -> String {
    let address = connection.address();
    let impatient = connection.with_patience(Duration::ZERO);
    let request = ListWorkersRequest {};
    let listing = impatient.call_fleet(async |client| client.list_workers(request).await);
    match timeout(ANSWER_TIME, listing)
        .await
        .map(|answer| answer.map(|response| response.workers.len()))
    {
        Ok(Ok(0)) => format!(
            "a worker: the coordinator at {address} has none; start one with \
             `worker --coordinator {address}`; {otherwise}"
        ),
        Ok(Ok(n)) => {
            let workers = text::counted(n as u64, "worker");
            format!("{workers} of the coordinator at {address}")
        }
        Ok(Err(error)) => format!("an answer: {error}; {otherwise}"),
        Err(_) => format!("an answer: the coordinator at {address} gives none; {otherwise}"),
    }
}

#[cfg(test)]
mod tests {
    use std::sync::Mutex;

    use tokio::time::{Instant, sleep};

    use super::*;

    /// The messages of a wait, and their times.
    async fn said(seconds: u64) -> Vec<(u64, String)> {
        let start = Instant::now();
        let mut said = Vec::new();
        let say = |line| said.push((start.elapsed().as_secs(), line));
        let done = aloud_to(say, async || Some("it".to_owned()), async {
            sleep(Duration::from_secs(seconds)).await;
            7
        });
        assert_eq!(done.await, 7);
        said
    }

    #[tokio::test(start_paused = true)]
    async fn a_long_wait_is_reported_after_two_seconds_and_again() {
        assert_eq!(said(1).await, []);
        let line = || "waiting for it".to_owned();
        assert_eq!(said(40).await, [(2, line()), (32, line())]);
    }

    #[test]
    fn only_long_work_is_reported() {
        let (heard, hear) = mpsc::channel();
        let heard = Mutex::new(heard);
        let say = |line: &str| heard.lock().unwrap().send(line.to_owned()).unwrap();
        // The work ends after its first message.
        let long = busy_to(&say, Duration::ZERO, "reading it", || hear.recv().unwrap());
        assert_eq!(long, "reading it");
        assert_eq!(busy_to(&say, Duration::MAX, "reading it", || 7), 7);
        assert!(hear.try_recv().is_err());
    }
}
