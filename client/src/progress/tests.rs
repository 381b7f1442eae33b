//! The printed output, and the text beside the bar.

use std::sync::{Arc, Mutex};

use std::collections::VecDeque;

use swarm_proto::v1::{Experiment, GenerationSummary};

use super::{followed::*, *};

/// Standard output that a test can read.
#[derive(Debug, Clone, Default)]
pub struct Captured(Arc<Mutex<Vec<u8>>>);

impl Captured {
    pub fn progress(&self, format: OutputFormat) -> Progress {
        Progress::to(format, Box::new(self.clone()))
    }

    /// Output as on a terminal of this width.
    pub fn progress_on(&self, format: OutputFormat, width: usize) -> Progress {
        let screen = Screen { width: Some(width), has_colours: false };
        Progress { screen, ..self.progress(format) }
    }

    pub fn lines(&self) -> Vec<String> {
        let text = String::from_utf8(self.0.lock().unwrap().clone()).unwrap();
        text.lines().map(str::to_owned).collect()
    }
}

impl Write for Captured {
    fn write(&mut self, bytes: &[u8]) -> io::Result<usize> {
        self.0.lock().unwrap().write(bytes)
    }

    fn flush(&mut self) -> io::Result<()> {
        Ok(())
    }
}

/// Standard output that fails: its reader has gone, as with `| head`, or the disk is
/// full.
struct Takes(io::ErrorKind);

impl Write for Takes {
    fn write(&mut self, _: &[u8]) -> io::Result<usize> {
        Err(self.0.into())
    }

    fn flush(&mut self) -> io::Result<()> {
        Ok(())
    }
}

#[test]
fn without_a_terminal_each_generation_is_a_line() {
    let captured = Captured::default();
    let mut progress = captured.progress(OutputFormat::Table);
    progress.begin(&[Experiment { id: 1, generations: 2, ..Experiment::default() }]);
    for generation in 0..2 {
        let summary = GenerationSummary { generation, ..Default::default() };
        progress.generation(1, &summary).unwrap();
    }
    let lines = captured.lines();
    assert_eq!(lines.len(), 2);
    assert!(lines[1].starts_with("2/2  generation 1  "), "{lines:?}");
}

#[test]
fn generations_of_a_group_name_their_run() {
    let captured = Captured::default();
    let mut progress = captured.progress(OutputFormat::Table);
    let run = |id, seed, variant: &str| Experiment {
        id,
        seed,
        variant: variant.into(),
        generations: 9,
        ..Experiment::default()
    };
    progress.begin(&[run(4, 0, ""), run(5, 1, "algorithm.x=2")]);
    progress.generation(5, &GenerationSummary::default()).unwrap();
    progress.generation(4, &GenerationSummary::default()).unwrap();
    let lines = captured.lines();
    assert!(lines[0].starts_with("5 seed 1 algorithm.x=2  1/9  generation 0  "), "{lines:?}");
    assert!(lines[1].starts_with("4 seed 0  1/9  generation 0  "), "{lines:?}");
}

#[test]
fn the_remaining_time_follows_the_latest_generations() {
    assert_eq!(remaining(&[1500, 2500].into(), 10), Duration::from_secs(20));
    assert_eq!(remaining(&VecDeque::new(), 10), Duration::ZERO);
    let mut progress = Captured::default().progress(OutputFormat::Json);
    let run = |id| Experiment { id, generations: 1000, ..Experiment::default() };
    progress.begin(&[run(1), run(2)]);
    for duration_ms in 0..100 {
        let summary = GenerationSummary { duration_ms, ..Default::default() };
        progress.generation(1, &summary).unwrap();
    }
    assert_eq!(progress.followed[&1].durations_ms.len(), ETA_WINDOW);
    assert_eq!(progress.followed[&1].durations_ms.front(), Some(&99));
    // Among several experiments, the last one to end counts.
    let slow = GenerationSummary { duration_ms: 60_000, ..Default::default() };
    progress.generation(2, &slow).unwrap();
    assert_eq!(progress.remaining(), Duration::from_secs(999 * 60));
}

#[test]
fn digests_and_optimistic_fitness_are_printed_on_request() {
    let summary = GenerationSummary { digest: "ab".repeat(32), ..Default::default() };
    for (is_verbose, n_digests) in [(false, 0), (true, 1)] {
        let captured = Captured::default();
        let mut progress = captured.progress(OutputFormat::Table).with_details(is_verbose);
        progress.begin(&[Experiment { id: 1, generations: 1, ..Experiment::default() }]);
        progress.generation(1, &summary).unwrap();
        let lines = captured.lines();
        let with_digest = lines.iter().filter(|line| line.contains("digest abab"));
        assert_eq!(with_digest.count(), n_digests, "{lines:?}");
    }
}

#[test]
fn a_long_remaining_time_is_printed_without_a_bar() {
    let captured = Captured::default();
    let mut progress = captured.progress(OutputFormat::Table);
    progress.begin(&[Experiment { id: 1, generations: 61, ..Experiment::default() }]);
    let summary = GenerationSummary { duration_ms: 1000, ..Default::default() };
    progress.generation(1, &summary).unwrap();
    assert!(captured.lines()[0].ends_with("ETA 00:01:00"), "{:?}", captured.lines());
}

#[test]
fn beside_the_bar_nothing_is_cut_in_the_middle() {
    let parts = ["ETA 46s", "best 1.500  mean 0.333"].map(str::to_owned);
    assert_eq!(fitting(&parts, 31), "ETA 46s  best 1.500  mean 0.333");
    assert_eq!(fitting(&parts, 30), "ETA 46s");
    assert_eq!(fitting(&parts, 6), "");
}

#[test]
fn a_closed_pipe_ends_the_output_and_not_the_work() {
    let closed = || {
        let stdout = Box::new(Takes(io::ErrorKind::BrokenPipe));
        Progress::to(OutputFormat::Table, stdout)
    };
    let mut progress = closed();
    assert!(progress.print("x").is_ok());
    assert!(progress.print("y").is_ok());
    assert!(progress.unwritten().end().is_ok());
    let mut progress = closed();
    progress.end_with_reader();
    assert!(matches!(progress.print("x"), Err(Error::OutputClosed)));
}

#[test]
fn a_full_disk_ends_the_output_and_not_the_work_and_is_reported_at_the_end() {
    let full = Box::new(Takes(io::ErrorKind::StorageFull));
    let mut progress = Progress::to(OutputFormat::Table, full);
    let unwritten = progress.unwritten();
    assert!(progress.print("x").is_ok());
    assert!(progress.print("y").is_ok());
    let error = unwritten.end().unwrap_err();
    assert_eq!(error.exit_code(), 1);
    assert!(error.report().contains("standard output"), "{}", error.report());
}

#[test]
fn without_a_terminal_long_work_reports_its_progress_now_and_then() {
    let mut progress = Captured::default().progress(OutputFormat::Json);
    let start = clock::now();
    let mut words = |first: u64, seconds: u64| {
        let word = |second| {
            let now = start + Duration::from_secs(second);
            Some((second, progress.word(now, second - first, 99, "experiments")?))
        };
        (first..first + seconds).filter_map(word).collect::<Vec<_>>()
    };
    let word = |second, n_done| (second, format!("{n_done}/99 experiments"));
    assert_eq!(words(0, 25), [word(2, 2), word(12, 12), word(22, 22)]);
    assert_eq!(words(50, 4), [word(52, 2)], "something else that is long");
}
