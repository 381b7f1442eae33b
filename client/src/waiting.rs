//! Waiting aloud: whatever a command waits for is said on standard error after two seconds,
//! and again from time to time; and whatever it computes, likewise.

use std::{
    io::{self, Write as _},
    panic::resume_unwind,
    pin::pin,
    sync::mpsc::{self, RecvTimeoutError},
    thread,
    time::Duration,
};

use swarm_telemetry::escape_lines;
use tokio::time::timeout;

/// Nothing waits for longer without a word.
pub const SILENCE_MAX: Duration = Duration::from_secs(2);
/// After which it is said again.
pub const REMINDER: Duration = Duration::from_secs(30);

/// Waits, and says for what: `what` follows "waiting for "; none if it ends soon.
pub async fn aloud<T>(what: impl Fn() -> Option<String>, wait: impl Future<Output = T>) -> T {
    aloud_to(|line| say(&line), what, wait).await
}

async fn aloud_to<T>(
    mut say: impl FnMut(String),
    what: impl Fn() -> Option<String>,
    wait: impl Future<Output = T>,
) -> T {
    let mut wait = pin!(wait);
    let mut silence = SILENCE_MAX;
    loop {
        match timeout(silence, wait.as_mut()).await {
            Ok(done) => return done,
            Err(_) => what().into_iter().for_each(|what| say(format!("waiting for {what}"))),
        }
        silence = REMINDER;
    }
}

/// Computes, and says so if that takes long.
pub fn computing<T: Send>(what: &str, work: impl FnOnce() -> T + Send) -> T {
    computing_to(|| say(&format!("computing {what}")), SILENCE_MAX, work)
}

fn computing_to<T: Send>(
    mut say: impl FnMut(),
    mut silence: Duration,
    work: impl FnOnce() -> T + Send,
) -> T {
    thread::scope(|scope| {
        // Closed when the work is done, or has panicked.
        let (working, done) = mpsc::channel::<()>();
        let work = scope.spawn(move || {
            let _working = working;
            work()
        });
        while done.recv_timeout(silence) == Err(RecvTimeoutError::Timeout) {
            say();
            silence = REMINDER;
        }
        work.join().unwrap_or_else(|panic| resume_unwind(panic))
    })
}

/// A line on standard error.
fn say(line: &str) {
    // If standard error is closed there is no place left to report to.
    let _ = writeln!(io::stderr(), "{}", escape_lines(line));
}

#[cfg(test)]
mod tests {
    use tokio::time::{Instant, sleep};

    use super::*;

    /// What is said, and when, while something takes so long.
    async fn said(seconds: u64) -> Vec<(u64, String)> {
        let start = Instant::now();
        let mut said = Vec::new();
        let say = |line| said.push((start.elapsed().as_secs(), line));
        let done = aloud_to(say, || Some("it".to_owned()), async {
            sleep(Duration::from_secs(seconds)).await;
            7
        });
        assert_eq!(done.await, 7);
        said
    }

    #[test]
    fn a_long_computation_is_said_and_a_short_one_is_not() {
        let (say, heard) = mpsc::channel();
        let until_said = move || heard.recv().unwrap();
        let value = computing_to(|| say.send(7).unwrap(), Duration::from_millis(1), until_said);
        assert_eq!(value, 7);
        computing_to(|| panic!("it took no time"), Duration::from_secs(600), || ());
    }

    #[tokio::test(start_paused = true)]
    async fn a_long_wait_is_said_after_two_seconds_and_again() {
        assert_eq!(said(1).await, []);
        let line = || "waiting for it".to_owned();
        assert_eq!(said(40).await, [(2, line()), (32, line())]);
    }
}
