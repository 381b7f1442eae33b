//! Random histories: submissions, requests, failures, crashes and a slow disk, in any order.

use proptest::{collection::vec, prelude::*, sample::Index};

use super::{super::*, world::World};
use crate::priority::Priority;

/// An event; the index chooses among the possible targets.
#[derive(Debug, Clone)]
enum Step {
    Submit(u64),
    Reopen(Index),
    Request(Index, Request),
    Load(Index),
    Batch(Index),
    Conclusion(Index),
    CommitWritten(Index),
    CommitFails(Index),
    CommitReported(Index),
    ChangeWritten(Index),
    ChangeReported(Index),
    JobFails(Index),
    JobSuspended(Index),
    StaleReports(Index),
    Crash,
    Stop(bool),
}

fn request() -> impl Strategy<Value = Request> {
    prop_oneof![
        1 => Just(Request::Cancel),
        2 => Just(Request::Pause("by a test".to_owned())),
        3 => Just(Request::Resume),
        1 => Just(Request::SetPriority(Priority::new(7).unwrap())),
        1 => Just(Request::Settle),
    ]
}

fn step() -> impl Strategy<Value = Step> {
    let index = any::<Index>;
    prop_oneof![
        2 => (1..5_u64).prop_map(Step::Submit),
        2 => index().prop_map(Step::Reopen),
        3 => (index(), request()).prop_map(|(index, request)| Step::Request(index, request)),
        6 => index().prop_map(Step::Load),
        8 => index().prop_map(Step::Batch),
        8 => index().prop_map(Step::Conclusion),
        6 => index().prop_map(Step::CommitWritten),
        1 => index().prop_map(Step::CommitFails),
        6 => index().prop_map(Step::CommitReported),
        3 => index().prop_map(Step::ChangeWritten),
        3 => index().prop_map(Step::ChangeReported),
        1 => index().prop_map(Step::JobFails),
        1 => index().prop_map(Step::JobSuspended),
        2 => index().prop_map(Step::StaleReports),
        1 => Just(Step::Crash),
        1 => any::<bool>().prop_map(Step::Stop),
    ]
}

/// Chooses one of the ids.
fn pick(index: &Index, ids: impl Iterator<Item = ExperimentId>) -> Option<ExperimentId> {
    let ids: Vec<_> = ids.collect();
    (!ids.is_empty()).then(|| *index.get(&ids))
}

fn take(world: &mut World, step: Step) {
    let at = |index: &Index, len: usize| (len > 0).then(|| index.index(len));
    match step {
        Step::Submit(generations) if world.store.len() < 3 => drop(world.submit(generations)),
        Step::Submit(_) => {}
        Step::Reopen(index) => {
            let ids = world.store.keys().copied().filter(|&id| world.can_be_reopened(id));
            if let Some(id) = pick(&index, ids) {
                world.reopen(id);
            }
        }
        // Requests for ended experiments are refused earlier, unless the experiment ends
        // meanwhile.
        Step::Request(index, request) => {
            if let Some(id) = pick(&index, world.store.keys().copied()) {
                world.request(id, request);
            }
        }
        Step::Load(index) => {
            if let Some(i) = at(&index, world.loads.len()) {
                world.finish_load(i);
            }
        }
        Step::Batch(index) => {
            let jobs = world.jobs.iter().filter(|(_, job)| !job.is_paused);
            if let Some(id) = pick(&index, jobs.map(|(&id, _)| id)) {
                world.finish_batch(id);
            }
        }
        Step::Conclusion(index) => {
            if let Some(i) = at(&index, world.conclusions.len()) {
                world.finish_conclusion(i);
            }
        }
        Step::CommitWritten(index) => {
            if let Some(i) = at(&index, world.commits.len()) {
                world.write_commit(i);
            }
        }
        Step::CommitFails(index) => {
            if let Some(i) = at(&index, world.commits.len()) {
                world.fail_commit(i, CommitOutcome::Failed("a bad page".to_owned()));
            }
        }
        Step::CommitReported(index) => {
            if let Some(i) = at(&index, world.commits.len()) {
                world.report_commit(i);
            }
        }
        Step::ChangeWritten(index) => {
            if let Some(i) = at(&index, world.changes.len()) {
                world.write_change(i);
            }
        }
        Step::ChangeReported(index) => {
            if let Some(i) = at(&index, world.changes.len()) {
                world.report_change(i);
            }
        }
        Step::JobFails(index) => {
            if let Some(id) = pick(&index, world.jobs.keys().copied()) {
                world.fail_job(id);
            }
        }
        Step::JobSuspended(index) => {
            if let Some(id) = pick(&index, world.jobs.keys().copied()) {
                world.suspend_job(id);
            }
        }
        Step::StaleReports(index) => {
            if let Some(experiment) = pick(&index, world.store.keys().copied()) {
                let stale = RunId { experiment, run_epoch: 0 };
                world.runs.on_committed(stale, CommitOutcome::NotWanted);
                world.runs.on_concluded(stale, Err("of another run".to_owned()));
                world.runs.on_loaded(stale, Err("of another run".to_owned()));
                assert!(world.runs.poll_command().is_none(), "a stale report changes nothing");
            }
        }
        Step::Crash => world.crash(),
        Step::Stop(is_disk_good) => world.stop(is_disk_good),
    }
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 256, ..ProptestConfig::default() })]

    #[test]
    fn whatever_happens_the_store_is_right_and_every_client_is_answered(
        steps in vec(step(), 0..120),
    ) {
        let mut world = World::new();
        world.submit(3);
        for step in steps {
            take(&mut world, step);
        }
        world.settle();
        world.check_settled();
        // Paused experiments, and those that wait for them, can still be completed.
        for id in world.store.keys().copied().collect::<Vec<_>>() {
            world.request(id, Request::Resume);
        }
        world.settle();
        world.check_settled();
        prop_assert!(world.store.values().all(|stored| !stored.state.is_unfinished()));
    }
}
