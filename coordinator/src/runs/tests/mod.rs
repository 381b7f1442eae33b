//! Runs with late and simultaneous events.

mod flat;
mod histories;
mod world;

use super::*;
use engine::Batch;
use world::World;

/// A world with one run that commits generation 0 and evaluates generation 1.
fn committing() -> (World, ExperimentId) {
    let mut world = World::new();
    let id = world.submit(4);
    world.finish_load(0);
    world.finish_batch(id);
    world.finish_conclusion(0);
    assert_eq!(world.commits.len(), 1);
    (world, id)
}

/// Evaluates and concludes `n_rounds` rounds.
fn finish_rounds(world: &mut World, id: ExperimentId, n_rounds: usize) {
    for _ in 0..n_rounds {
        world.finish_batch(id);
        world.finish_conclusion(0);
    }
}

#[test]
fn the_champion_is_judged_after_the_last_generation_and_before_its_commit() {
    let mut world = World::new();
    let id = world.submit(2);
    world.finish_load(0);
    finish_rounds(&mut world, id, 1);
    let judged = |world: &World| world.commits[0].ready.champion.clone().unwrap().judged;
    assert_eq!(judged(&world), None);
    world.write_commit(0);
    world.report_commit(0);
    // Generation 1 and the re-evaluation of candidates.
    finish_rounds(&mut world, id, 2);
    assert!(world.commits.is_empty());
    assert_eq!(
        world.jobs[&id].batch.as_ref().map(|(genotypes, n)| (genotypes.len(), *n)),
        Some((1, 3))
    );
    finish_rounds(&mut world, id, 1);
    assert_eq!(judged(&world).map(|judged| (judged.n_trials, judged.generation)), Some((3, 1)));
    let ready = &world.commits[0].ready;
    assert_ne!(
        ready.digest,
        ready.evolution.champion_digest().to_string(),
        "the judgement has a link"
    );
    assert_eq!(
        ready.evolution.champion().unwrap().judged,
        None,
        "evolution does not know the judgement"
    );
    world.settle();
    world.check_settled();
}

#[test]
fn a_run_that_is_cancelled_while_its_champion_is_judged_has_no_judgement() {
    let mut world = World::new();
    let id = world.submit(1);
    world.finish_load(0);
    finish_rounds(&mut world, id, 2);
    let request = world.request(id, Request::Cancel);
    world.settle();
    world.check_settled();
    assert_eq!(world.answers[&request], Some(true));
    assert_eq!(world.store[&id].state, ExperimentState::Cancelled);
    assert_eq!(world.store[&id].n_done(), 0, "the generation was not complete");
}

#[test]
fn a_run_is_completed_and_forgotten() {
    let mut world = World::new();
    let id = world.submit(4);
    world.settle();
    world.check_settled();
    assert_eq!(world.store[&id].state, ExperimentState::Completed);
    assert_eq!(world.store[&id].n_done(), 4);
}

#[test]
fn a_generation_is_evaluated_while_the_one_before_is_stored() {
    let (mut world, id) = committing();
    assert!(world.finish_batch(id).is_some(), "before generation 0 is known to be stored");
    world.finish_conclusion(0);
    // Generation 1 comes with a re-evaluation.
    assert!(world.finish_batch(id).is_some());
    world.finish_conclusion(0);
    assert_eq!(world.commits.len(), 1, "generation 1 waits for generation 0");
    assert!(world.finish_batch(id).is_none(), "and generation 2 for the commit of 1");
    world.write_commit(0);
    world.report_commit(0);
    assert_eq!(world.commits.len(), 1);
    assert_eq!(world.commits[0].ready.generation.generation, 1);
    assert!(world.finish_batch(id).is_some());
}

#[test]
fn a_commit_in_progress_comes_before_the_end_of_a_cancelled_run() {
    let (mut world, id) = committing();
    let request = world.request(id, Request::Cancel);
    assert!(world.jobs.is_empty(), "the fleet drops it at once");
    assert!(world.changes.is_empty(), "its end waits");
    world.write_commit(0);
    world.report_commit(0);
    assert_eq!(world.answers[&request], None, "the end is not stored yet");
    world.settle();
    world.check_settled();
    assert_eq!(world.answers[&request], Some(true));
    assert_eq!(world.store[&id].state, ExperimentState::Cancelled);
    assert_eq!(world.store[&id].n_done(), 1);
}

#[test]
fn conclusions_after_the_end_are_ignored() {
    let (mut world, id) = committing();
    world.finish_batch(id);
    world.request(id, Request::Cancel);
    world.finish_conclusion(0);
    assert!(world.jobs.is_empty() && world.commits.len() == 1);
    world.settle();
    world.check_settled();
}

#[test]
fn a_run_waits_for_memory_and_is_loaded_when_another_ends() {
    let mut world = World::new();
    let [first, _, third] = [2, 2, 2].map(|generations| world.submit(generations));
    assert_eq!(world.loads.len(), 2, "there is memory for two");
    let notices: Vec<_> =
        world.changes.iter().map(|task| (task.experiment, &task.change)).collect();
    let [(experiment, Change::Notice(text))] = &notices[..] else { panic!("{notices:?}") };
    assert_eq!(*experiment, third);
    assert!(text.contains("waits for memory") && text.contains("--memory-budget"), "{text}");
    world.request(third, Request::Pause(String::new()));
    world.request(third, Request::Resume);
    world.request(first, Request::Cancel);
    assert_eq!(world.loads.last().map(|run| run.experiment), Some(third));
    world.settle();
    world.check_settled();
    assert_eq!(world.store[&third].state, ExperimentState::Completed);
}

#[test]
fn a_run_that_ends_while_it_is_loaded_or_waits_is_not_evaluated() {
    let mut world = World::new();
    let ids = [2, 2, 2].map(|generations| world.submit(generations));
    world.request(ids[2], Request::Cancel);
    world.request(ids[0], Request::Cancel);
    assert_eq!(world.loads.len(), 2, "the one that waited has ended");
    world.finish_load(0);
    assert!(!world.jobs.contains_key(&ids[0]));
    world.settle();
    world.check_settled();
}

#[test]
fn a_run_that_cannot_be_loaded_is_paused_until_it_can() {
    let mut world = World::new();
    let id = world.submit(2);
    let run = world.loads.remove(0);
    world.runs.on_loaded(run, Err("damaged".to_owned()));
    world.settle_after_commands();
    assert_eq!(world.store[&id].state, ExperimentState::Paused);
    assert!(world.loads.is_empty());
    world.request(id, Request::Resume);
    world.settle();
    world.check_settled();
    assert_eq!(world.store[&id].state, ExperimentState::Completed);
}

#[test]
fn two_clients_cancel_and_both_are_answered() {
    let (mut world, id) = committing();
    let requests = [world.request(id, Request::Cancel), world.request(id, Request::Cancel)];
    world.settle();
    for request in requests {
        assert_eq!(world.answers[&request], Some(true));
    }
}

/// A world whose only run has stored its last generation, but has not heard of it.
fn completed_unnoticed() -> (World, ExperimentId) {
    let mut world = World::new();
    let id = world.submit(1);
    world.finish_load(0);
    finish_rounds(&mut world, id, 3);
    world.write_commit(0);
    assert_eq!(world.store[&id].state, ExperimentState::Completed);
    (world, id)
}

#[test]
fn the_stale_end_of_a_reopened_run_does_not_end_it() {
    let (mut world, id) = completed_unnoticed();
    world.reopen(id);
    world.report_commit(0);
    world.finish_load(0);
    assert!(world.jobs[&id].batch.is_some(), "it runs");
    world.settle();
    world.check_settled();
    assert_eq!(world.store[&id].n_done(), 3);
}

#[test]
fn a_client_that_cancels_a_run_while_another_reopens_it_is_answered() {
    let (mut world, id) = completed_unnoticed();
    let request = world.request(id, Request::Cancel);
    world.reopen(id);
    world.settle();
    world.check_settled();
    assert_eq!(world.answers[&request], Some(true));
    assert_eq!(world.store[&id].state, ExperimentState::Cancelled);
}

#[test]
fn a_change_that_is_on_its_way_holds_for_a_reopened_run() {
    let (mut world, id) = completed_unnoticed();
    world.request(id, Request::Cancel);
    world.report_commit(0);
    assert!(world.runs.runs.is_empty());
    // The database is slow.
    world.reopen(id);
    assert!(world.jobs.is_empty(), "nothing is evaluated in vain");
    world.settle();
    world.check_settled();
    assert_eq!(world.store[&id].state, ExperimentState::Cancelled);
}

#[test]
fn a_cancelled_experiment_goes_on_once_its_end_is_settled() {
    let (mut world, id) = committing();
    world.request(id, Request::Cancel);
    world.write_commit(0);
    world.report_commit(0);
    world.write_change(0);
    assert_eq!(world.store[&id].state, ExperimentState::Cancelled);
    let settled = world.request(id, Request::Settle);
    assert_eq!(world.answers[&settled], None, "the end is not reported");
    world.report_change(0);
    assert_eq!(world.answers[&settled], Some(true));
    world.reopen(id);
    world.settle();
    world.check_settled();
    assert_eq!(world.store[&id].state, ExperimentState::Completed);
    assert_eq!(world.store[&id].n_done(), world.store[&id].config.algorithm.generations);
    let at_once = world.request(id, Request::Settle);
    assert_eq!(world.answers[&at_once], Some(true));
}

#[test]
fn an_experiment_whose_generation_cannot_be_stored_fails() {
    let (mut world, id) = committing();
    world.fail_commit(0, CommitOutcome::Failed("a bad page".to_owned()));
    world.report_commit(0);
    assert!(world.jobs.is_empty());
    world.settle();
    world.check_settled();
    assert_eq!(world.store[&id].state, ExperimentState::Failed);
}

#[test]
fn at_shutdown_a_cancelled_run_is_stored_and_then_its_end() {
    let (mut world, id) = committing();
    let request = world.request(id, Request::Cancel);
    world.stop(true);
    assert_eq!(world.answers[&request], Some(true));
    assert_eq!(world.store[&id].state, ExperimentState::Cancelled);
    assert_eq!(world.store[&id].n_done(), 1);
}

#[test]
fn changes_are_written_one_after_the_other() {
    let (mut world, id) = committing();
    let pause = world.request(id, Request::Pause("lunch".to_owned()));
    let resume = world.request(id, Request::Resume);
    assert_eq!(world.changes.len(), 1);
    world.write_change(0);
    world.report_change(0);
    assert_eq!((world.answers[&pause], world.answers[&resume]), (Some(true), None));
    assert_eq!(world.store[&id].state, ExperimentState::Paused);
    world.settle();
    world.check_settled();
    assert_eq!(world.store[&id].state, ExperimentState::Completed);
}

#[test]
fn an_abandoned_evaluation_is_dropped_and_a_finished_one_answered() {
    let mut runs = Runs::new(u64::MAX);
    let evaluation = || Evaluation {
        name: "quickstart".into(),
        spec: "{}".into(),
        batch: Batch::measures(vec![0.5], 1, 2),
        priority: crate::priority::Priority::default(),
    };
    let abandoned = runs.on_evaluation_requested(evaluation());
    let finished = runs.on_evaluation_requested(evaluation());
    while runs.poll_command().is_some() {}
    runs.on_evaluation_abandoned(abandoned);
    assert!(
        matches!(runs.poll_command(), Some(Command::EndJob { job }) if job == abandoned.into())
    );
    runs.on_evaluation_finished(abandoned, Ok(vec![vec![1.0, 2.0]]));
    assert!(runs.poll_command().is_none());
    runs.on_evaluation_finished(finished, Ok(vec![vec![1.0, 2.0]]));
    assert!(matches!(runs.poll_command(), Some(Command::EndJob { job }) if job == finished.into()));
    assert!(matches!(runs.poll_command(), Some(Command::AnswerEvaluation { result: Ok(_), .. })));
}
