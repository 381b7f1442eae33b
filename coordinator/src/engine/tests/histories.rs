//! Whatever happens to its workers, the engine evaluates the same.

use proptest::prelude::*;

use super::{super::*, EXPERIMENT, LEASE, fleet::Fleet};

#[derive(Debug, Clone)]
enum Happening {
    Join(usize),
    Kill(usize),
    Compute(usize),
    Drain(usize),
    FallSilent,
}

fn happening() -> impl Strategy<Value = Happening> {
    prop_oneof![
        2 => (1..4usize).prop_map(Happening::Join),
        1 => any::<usize>().prop_map(Happening::Kill),
        12 => any::<usize>().prop_map(Happening::Compute),
        1 => any::<usize>().prop_map(Happening::Drain),
        1 => Just(Happening::FallSilent),
    ]
}

proptest! {
    /// Whatever happens to the workers, no work is lost, none is accepted
    /// twice, and the fitness is that of an undisturbed fleet, unless an item
    /// was blamed too often.
    #[test]
    fn any_history_evaluates_the_same_fitness(
        history in prop::collection::vec(happening(), 0..200),
        n_individuals in 1..40usize,
        n_trials in 1..4u32,
    ) {
        let mut fleet = Fleet::new();
        fleet.start(EXPERIMENT, n_individuals, n_trials);
        for happening in history {
            let ids: Vec<WorkerId> = fleet.workers.keys().copied().collect();
            let pick = |i: usize| (!ids.is_empty()).then(|| ids[i % ids.len()]);
            match happening {
                Happening::Join(n_slots) => { fleet.join(n_slots); }
                Happening::Kill(i) => if let Some(id) = pick(i) { fleet.kill(id) },
                Happening::Compute(i) => if let Some(id) = pick(i) { fleet.step(id); },
                Happening::Drain(i) => if let Some(id) = pick(i) {
                    fleet.engine.on_draining(fleet.now, id);
                    fleet.carry_out();
                },
                Happening::FallSilent => {
                    for _ in 0..4 {
                        fleet.now += LEASE / 4;
                        fleet.engine.on_tick(fleet.now);
                        fleet.carry_out();
                    }
                    prop_assert!(fleet.workers.is_empty());
                }
            }
        }
        fleet.join(2);
        fleet.run();
        if fleet.failed.is_empty() {
            fleet.assert_evaluated(n_individuals, n_trials);
        } else {
            prop_assert!(fleet.evaluated.is_empty());
        }
    }
}
