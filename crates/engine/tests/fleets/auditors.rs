//! Audits wait for workers that may do them, and for no others.

use model::ids::WorkerId;

use super::by_hand::{assert_evaluated, start};
use super::numbers::SimulatedFleet;
use super::{EXPERIMENT, SECOND, auditing_fleet, is_finished};

/// Every second for five minutes, a worker is lost and another one takes its place; the worker that
/// computes is another one. Asserts that the batch ends.
#[track_caller]
fn assert_ends(mut replace: impl FnMut(&mut SimulatedFleet, WorkerId) -> WorkerId) {
    let mut fleet = auditing_fleet(1.0);
    fleet.join(1, 1.0);
    let mut lost = fleet.join_by_hand(1);
    start(&mut fleet, EXPERIMENT, 5, 1);
    for _ in 0..300 {
        fleet.run_for(SECOND);
        if is_finished(&fleet) {
            break;
        }
        lost = replace(&mut fleet, lost);
    }
    assert_evaluated(&fleet, 5, 1);
    assert_eq!(fleet.evaluated[0].1.n_unaudited, 5, "they are waived and counted");
}

#[test]
fn a_worker_that_is_lost_before_it_gets_an_item_holds_up_no_audit() {
    assert_ends(|fleet, lost| fleet.restart(lost).unwrap());
}

#[test]
fn a_worker_that_every_item_takes_down_holds_up_no_audit() {
    assert_ends(|fleet, lost| match fleet.assigned(lost).is_empty() {
        true => lost,
        false => fleet.restart(lost).unwrap(),
    });
}

#[test]
fn workers_of_new_names_that_every_item_takes_down_hold_up_no_audit() {
    assert_ends(|fleet, lost| {
        if fleet.assigned(lost).is_empty() {
            return lost;
        }
        fleet.kill(lost);
        fleet.join_by_hand(1)
    });
}

#[test]
fn a_failure_that_the_referee_cannot_check_holds_up_no_audit() {
    let mut fleet = auditing_fleet(1.0);
    fleet.work.has_referee = false;
    let reporter = fleet.join_by_hand(1);
    let others = [fleet.join_by_hand(1), fleet.join_by_hand(1)];
    start(&mut fleet, EXPERIMENT, 6, 1);
    fleet.step(reporter);
    let assignment = fleet.assigned(reporter)[0].id;
    fleet.answer(reporter, assignment, Err("I cannot".to_owned()));
    fleet.run_for(SECOND);
    fleet.kill(reporter);
    for _ in 0..60 {
        fleet.run_for(SECOND);
        for id in others {
            fleet.step(id);
        }
    }
    assert_evaluated(&fleet, 6, 1);
    let evaluated = &fleet.evaluated[0].1;
    assert_eq!((evaluated.n_audited, evaluated.n_unaudited), (6, 0));
}
