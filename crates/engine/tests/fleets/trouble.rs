//! Workers that hang, lie, fail, babble, crash and flap, in any mixture up to 49 % of the slots:
//! the batch has the same values, in a time that the honest slots can achieve.

use std::time::Duration;

use engine::EngineConfig;
use model::ids::WorkerId;
use proptest::prelude::*;

use super::numbers::{Ask as _, SimulatedFleet, simulated};
use super::{EXPERIMENT, LEASE, MODEL, SECOND, assert_right, fleet};
use simulated_fleet::{Conduct, FleetModel};

/// A worker's fault.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Trouble {
    /// It computes wrongly.
    Of(Conduct),
    /// It is killed and restarted at this interval.
    Crashes(Duration),
    /// Its stream breaks at this interval.
    Flaps(Duration),
}

fn trouble() -> impl Strategy<Value = Trouble> {
    let every = (50..3000_u64).prop_map(Duration::from_millis);
    prop_oneof![
        2 => Just(Trouble::Of(Conduct::Hangs)),
        2 => Just(Trouble::Of(Conduct::Lies)),
        1 => Just(Trouble::Of(Conduct::LiesAtTheEnd)),
        2 => Just(Trouble::Of(Conduct::Fails)),
        1 => Just(Trouble::Of(Conduct::Babbles)),
        2 => every.clone().prop_map(Trouble::Crashes),
        2 => every.prop_map(Trouble::Flaps),
    ]
}

/// A troublesome worker; `id` is that of its latest connection.
struct Nuisance {
    trouble: Trouble,
    id: WorkerId,
    next: Duration,
}

impl Nuisance {
    fn join(fleet: &mut SimulatedFleet, trouble: Trouble, n_slots: usize) -> Self {
        let id = match trouble {
            Trouble::Of(conduct) => fleet.join_with(n_slots, 1.0, conduct),
            Trouble::Crashes(_) | Trouble::Flaps(_) => fleet.join(n_slots, 1.0),
        };
        Self { trouble, id, next: fleet.now() }
    }

    fn act(&mut self, fleet: &mut SimulatedFleet) {
        if fleet.now() < self.next {
            return;
        }
        let (every, again) = match self.trouble {
            Trouble::Of(_) => return,
            Trouble::Crashes(every) => (every, fleet.restart(self.id)),
            Trouble::Flaps(every) => (every, fleet.flap(self.id)),
        };
        self.id = again.unwrap_or(self.id);
        self.next = fleet.now() + every;
    }
}

/// The duration of three generations. The referee is unavailable before `referee_from`.
fn time(
    honest: &[usize],
    troubles: &[(Trouble, usize)],
    referee_from: Duration,
    n_individuals: usize,
    n_trials: u32,
) -> Result<Duration, TestCaseError> {
    let config = EngineConfig { audit_fraction: 1.0, ..EngineConfig::new(LEASE) };
    let mut fleet = simulated(FleetModel { checks: true, ..MODEL }, config);
    fleet.submit(EXPERIMENT, 100);
    fleet.ask(EXPERIMENT, 0, n_individuals, n_trials);
    let mut nuisances: Vec<Nuisance> = troubles
        .iter()
        .map(|&(trouble, n_slots)| Nuisance::join(&mut fleet, trouble, n_slots))
        .collect();
    for &n_slots in honest {
        fleet.join(n_slots, 1.0);
    }
    for generation in 0..3_u64 {
        if generation > 0 {
            fleet.ask(EXPERIMENT, generation, n_individuals, n_trials);
        }
        while fleet.evaluated.len() as u64 == generation {
            prop_assert!(fleet.failed.is_empty(), "{:?}", fleet.failed);
            prop_assert!(fleet.now() < 1000 * SECOND, "generation {generation} does not end");
            fleet.work.has_referee = fleet.now() >= referee_from;
            nuisances.iter_mut().for_each(|nuisance| nuisance.act(&mut fleet));
            fleet.run_for(SECOND / 20);
        }
        assert_right(&fleet, n_individuals, n_trials);
    }
    // No honest worker was called faulty.
    for (name, reason) in &fleet.quarantined {
        let index: usize = name["worker-".len()..].parse().unwrap();
        let trouble = troubles.get(index - 1).map(|(trouble, _)| trouble);
        prop_assert!(matches!(trouble, Some(Trouble::Of(_))), "{name}: {reason}");
    }
    Ok(fleet.now())
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(60))]

    #[test]
    fn no_mixture_of_troubles_changes_a_bit_or_takes_for_ever(
        honest in prop::collection::vec(1..5usize, 2..5),
        troubles in prop::collection::vec((trouble(), 1..5usize), 1..6),
        n_individuals in 1..40usize,
        n_trials in 1..4u32,
        referee_from in prop_oneof![3 => Just(0_u32), 1 => 0..5_u32],
    ) {
        let n_honest: usize = honest.iter().sum();
        let mut n_left = n_honest * 49 / 51;
        let troubles: Vec<(Trouble, usize)> = troubles
            .into_iter()
            .map_while(|(trouble, n_slots)| {
                let n_slots = n_slots.min(n_left);
                n_left -= n_slots;
                (n_slots > 0).then_some((trouble, n_slots))
            })
            .collect();
        let referee_from = referee_from * SECOND;
        let undisturbed = time(&honest, &[], referee_from, n_individuals, n_trials)?;
        let disturbed = time(&honest, &troubles, referee_from, n_individuals, n_trials)?;
        let bound = 4 * undisturbed + 20 * SECOND;
        prop_assert!(disturbed < bound, "{disturbed:?} instead of {undisturbed:?}");
    }
}

#[test]
fn hung_workers_with_most_of_the_slots_do_not_hold_up_two_honest_ones() {
    let mut fleet = fleet();
    for _ in 0..2 {
        fleet.join_with(64, 1.0, Conduct::Hangs);
    }
    fleet.submit(EXPERIMENT, 100);
    fleet.ask(EXPERIMENT, 0, 20, 1);
    for _ in 0..2 {
        fleet.join(1, 1.0);
    }
    for generation in 0..5 {
        if generation > 0 {
            fleet.ask(EXPERIMENT, generation, 20, 1);
        }
        assert!(fleet.run_until(60 * SECOND, |fleet| fleet.evaluated.len() as u64 > generation));
        assert_right(&fleet, 20, 1);
    }
    assert!(fleet.now() < 60 * SECOND, "{:?}", fleet.now());
}

#[test]
fn hung_workers_that_get_all_copies_of_a_first_item_do_not_hold_it_up_one_after_the_other() {
    let mut fleet = fleet();
    for _ in 0..6 {
        fleet.join_with(1, 1.0, Conduct::Hangs);
    }
    fleet.join(1, 1.0);
    fleet.submit(EXPERIMENT, 100);
    fleet.ask(EXPERIMENT, 0, 1, 1);
    assert!(fleet.run_until(12 * SECOND, |fleet| !fleet.evaluated.is_empty()));
}

#[test]
fn a_poisonous_item_that_takes_its_time_is_found_too() {
    let mut fleet = fleet();
    fleet.work.poisonous.insert(3);
    fleet.work.poison_takes = 30;
    for _ in 0..4 {
        fleet.join(2, 1.0);
    }
    fleet.submit(EXPERIMENT, 100);
    fleet.ask(EXPERIMENT, 0, 40, 1);
    assert!(fleet.run_until(600 * SECOND, |fleet| !fleet.failed.is_empty()));
    assert!(fleet.failed[0].1.contains("individual 3 of generation 0"), "{:?}", fleet.failed);
}

#[test]
fn a_failing_worker_beside_an_honest_one_fails_no_experiment() {
    let mut fleet = fleet();
    fleet.join_with(4, 1.0, Conduct::Fails);
    fleet.join(1, 1.0);
    for id in 1..=5 {
        let job = model::ids::JobId::Experiment(model::ids::ExperimentId(id));
        fleet.submit(job, 100);
        fleet.ask(job, 0, 10, 1);
    }
    assert!(fleet.run_until(600 * SECOND, |fleet| fleet.evaluated.len() == 5));
    assert!(fleet.failed.is_empty() && fleet.quarantined.len() == 1);
}

#[test]
fn a_worker_that_is_killed_before_most_items_end_finishes_a_batch() {
    let model = FleetModel { trial: 2 * SECOND, ..MODEL };
    let mut fleet = simulated(model, EngineConfig::new(LEASE));
    let mut id = fleet.join(2, 1.0);
    fleet.submit(EXPERIMENT, 100);
    fleet.ask(EXPERIMENT, 0, 6, 1);
    while fleet.evaluated.is_empty() {
        fleet.run_for(3 * SECOND / 2);
        id = fleet.restart(id).unwrap();
        assert!(fleet.failed.is_empty(), "{:?}", fleet.failed);
        assert!(fleet.now() < 120 * SECOND, "the batch does not end");
    }
    assert_right(&fleet, 6, 1);
}

#[test]
fn a_poisonous_item_among_many_takes_few_workers_down_and_fails_by_name() {
    let mut fleet = fleet();
    fleet.work.poisonous.insert(13);
    for _ in 0..4 {
        fleet.join(8, 1.0);
    }
    fleet.submit(EXPERIMENT, 100);
    fleet.ask(EXPERIMENT, 0, 100, 1);
    assert!(fleet.run_until(120 * SECOND, |fleet| !fleet.failed.is_empty()));
    assert!(fleet.failed[0].1.contains("individual 13 of generation 0"), "{:?}", fleet.failed);
    assert!(fleet.quarantined.is_empty());
    let counters = fleet.engine.fleet_stats(fleet.instant()).counters;
    assert!(counters.n_workers_lost <= 6, "{counters:?}");
}
