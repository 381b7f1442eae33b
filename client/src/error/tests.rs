//! The codes, places and reports of errors.

use super::*;
use crate::experiment_file::{ExperimentFile, Overrides};

const ADDRESS: &str = "http://127.0.0.1:7700";

fn exit_code(status: Status) -> u8 {
    Error::from_status(&status, ADDRESS).exit_code()
}

#[test]
fn exit_codes_follow_status_codes() {
    assert_eq!(exit_code(Status::internal("a bug")), 1);
    assert_eq!(exit_code(Status::unimplemented("")), 9);
    assert_eq!(exit_code(Status::invalid_argument("no")), 2);
    assert_eq!(exit_code(Status::not_found("no experiment 3")), 3);
    assert_eq!(exit_code(Status::failed_precondition("no champion yet")), 3);
    assert_eq!(exit_code(Status::resource_exhausted("no memory")), 2);
    assert_eq!(exit_code(Status::out_of_range("too large")), 2);
    assert_eq!(exit_code(Status::unavailable("")), 4);
    assert_eq!(exit_code(Status::unauthenticated("no token")), 7);
    assert_eq!(exit_code(Status::permission_denied("wrong token")), 7);
    assert_eq!(exit_code(Status::from_error("broken".into())), 4);
    let json = "protocol error: received message with invalid compression flag: 123";
    assert_eq!(exit_code(Status::internal(json)), 9);
    let missing = "grpc-status header missing, mapped from HTTP status code 503";
    assert_eq!(exit_code(Status::unavailable(missing)), 9);
}

#[test]
fn a_limit_is_no_bug_wherever_it_is_reached() {
    let status = Status::resource_exhausted("1000 experiments are unfinished");
    for error in [Error::from_status(&status, ADDRESS), Error::from_status_here(&status, "data")] {
        assert_eq!(error.code(), Code::LimitReached);
        assert_eq!(error.report(), "error: 1000 experiments are unfinished");
    }
}

#[test]
fn exit_codes_of_errors_in_this_process() {
    let failed = Error::Failed { id: 3, reason: "item 7".into() };
    assert_eq!(failed.exit_code(), 5);
    assert_eq!(failed.report(), "error: experiment 3 failed: item 7");
    let cancelled = Error::Cancelled { id: 3, reason: String::new() };
    assert_eq!(cancelled.exit_code(), 6);
    assert_eq!(cancelled.report(), "error: experiment 3 was cancelled");
    assert_eq!(Error::TimedOut { id: 3, explain: "x".into() }.exit_code(), 10);
    assert_eq!(Error::Damaged("x".into()).exit_code(), 11);
    assert_eq!(Error::Flawed("x".into()).exit_code(), 12);
    assert_eq!(Error::Interrupted("x".into()).exit_code(), 130);
    assert_eq!(Error::Input("x".into()).exit_code(), 2);
}

#[test]
fn an_unreachable_coordinator_is_named_with_cause_and_remedy() {
    let status = Status::from_error(Box::new(io::Error::other("connection refused")));
    let report = Error::from_status(&status, ADDRESS).report();
    for part in [ADDRESS, "connection refused", "--coordinator"] {
        assert!(report.contains(part), "{report}");
    }
}

#[test]
fn every_problem_of_a_file_has_its_line() {
    let file = PathBuf::from("a.json");
    let problems = ["line 3: x", "world: y"].map(Problem::parse).into();
    let error = Error::Config { code: Code::InvalidExperiment, file, problems };
    assert_eq!(error.report(), "a.json: line 3: x\na.json: world: y");
    assert_eq!(error.exit_code(), 2);
}

#[test]
fn programs_can_tell_a_file_that_cannot_be_read_from_one_with_mistakes() {
    let directory = tempfile::tempdir().unwrap();
    let code = |name: &str| {
        let path = directory.path().join(name);
        let read = ExperimentFile::read(&path).and_then(|file| {
            file.check(&Overrides::default()).map_err(|error| file.invalid(&error))
        });
        read.err().unwrap().code()
    };
    assert_eq!(code("missing.json"), Code::UnreadableFile);
    std::fs::write(directory.path().join("bundle.zip"), b"PK\x03\x04").unwrap();
    assert_eq!(code("bundle.zip"), Code::UnreadableFile);
    std::fs::write(directory.path().join("empty.json"), "{}").unwrap();
    assert_eq!(code("empty.json"), Code::InvalidExperiment);
}

#[test]
fn errors_fit_a_terminal_but_places_in_files_stay_whole() {
    let error = Error::Input("a.csv exists already; choose another name or --force".into());
    let narrow = error.report_within(Some(40));
    assert!(narrow.lines().count() > 1 && narrow.lines().all(|line| line.len() <= 40), "{narrow}");
    assert_eq!(error.report_within(None), error.report());
    let problems = vec![Problem::parse("line 3: this is longer than forty characters are")];
    let error = Error::Config { code: Code::InvalidExperiment, file: "a.json".into(), problems };
    assert_eq!(error.report_within(Some(40)), error.report());
}

#[test]
fn a_command_ended_by_a_closed_pipe_says_so() {
    let error = Error::from_stdout(io::ErrorKind::BrokenPipe.into());
    assert_eq!(error.exit_code(), 141);
    assert!(error.report().starts_with("standard output is closed"), "{error}");
    assert_eq!(Error::from_stdout(io::ErrorKind::StorageFull.into()).exit_code(), 1);
}
