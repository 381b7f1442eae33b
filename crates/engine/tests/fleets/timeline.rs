//! The timeline of the workers' recent work.

use std::collections::BTreeMap;

use engine::{EngineConfig, Fate, TimelineEntry};

use super::numbers::{Ask as _, SimulatedFleet, simulated};
use super::{EXPERIMENT, LEASE, MODEL, SECOND, fleet};
use simulated_fleet::{Conduct, FleetModel};

fn fates(fleet: &SimulatedFleet) -> BTreeMap<&'static str, usize> {
    let mut counts = BTreeMap::new();
    for entry in fleet.timeline() {
        let name = match entry.fate {
            Fate::Unanswered => "unanswered",
            Fate::Computed => "computed",
            Fate::TakenBack => "taken back",
            Fate::Failed => "failed",
            Fate::Lost => "lost",
        };
        *counts.entry(name).or_default() += 1;
    }
    counts
}

#[test]
fn it_names_the_worker_and_the_duration_of_every_item() {
    let mut fleet = fleet();
    let id = fleet.join(1, 1.0);
    fleet.submit(EXPERIMENT, 100);
    fleet.ask(EXPERIMENT, 7, 4, 3);
    assert!(fleet.run_until(60 * SECOND, |fleet| !fleet.evaluated.is_empty()));
    fleet.run_for(5 * SECOND);
    let timeline = fleet.timeline();
    let mut computed = BTreeMap::new();
    for TimelineEntry { worker, individual, trials, busy, ended_for, assigned_for, .. } in &timeline
    {
        assert_eq!(*worker, id);
        *computed.entry(*individual).or_default() += trials.len();
        assert!(*busy >= MODEL.trial / 2 * trials.len() as u32, "{busy:?}");
        assert!(*ended_for >= 5 * SECOND && *ended_for + *busy <= *assigned_for);
    }
    assert_eq!(computed, (0..4).map(|individual| (individual, 3)).collect());
    assert_eq!(timeline[0].batch(), "experiment 1, generation 7");
    assert!(timeline.iter().all(|entry| entry.fate == Fate::Computed));
}

#[test]
fn every_assignment_has_one_fate_whatever_happens_to_its_worker() {
    let mut fleet = fleet();
    let honest = fleet.join(2, 1.0);
    let lost = fleet.join(2, 1.0);
    let stalled = fleet.join(2, 1.0);
    fleet.join_with(1, 1.0, Conduct::Fails);
    fleet.submit(EXPERIMENT, 100);
    fleet.ask(EXPERIMENT, 0, 60, 2);
    fleet.run_for(SECOND);
    assert!(fates(&fleet)["unanswered"] > 0);
    fleet.kill(lost);
    fleet.stall(stalled, 3 * LEASE);
    assert!(fleet.run_until(600 * SECOND, |fleet| !fleet.evaluated.is_empty()));
    fleet.ask(EXPERIMENT, 1, 60, 2);
    fleet.run_for(SECOND);
    fleet.tell(|engine, now| engine.on_job_paused(now, EXPERIMENT));
    let counts = fates(&fleet);
    assert_eq!(counts.values().sum::<usize>(), fleet.n_items_sent, "{counts:?}");
    for fate in ["computed", "taken back", "failed", "lost"] {
        assert!(counts.contains_key(fate), "{fate}: {counts:?}");
    }
    assert!(fleet.worker_ids().contains(&honest));
}

#[test]
fn it_does_not_grow_and_keeps_losses_for_longest() {
    let model = FleetModel { checks: false, ..MODEL };
    let mut fleet = simulated(model, EngineConfig::new(LEASE));
    let lost = fleet.join(4, 1.0);
    for _ in 0..20 {
        fleet.join(50, 1.0);
    }
    fleet.submit(EXPERIMENT, 100);
    for generation in 0..3 {
        fleet.ask(EXPERIMENT, generation, 4000, 1);
        fleet.run_for(SECOND / 2);
        if generation == 0 {
            fleet.kill(lost);
        }
        let n_evaluated = fleet.evaluated.len();
        assert!(fleet.run_until(600 * SECOND, |fleet| fleet.evaluated.len() > n_evaluated));
    }
    let counts = fates(&fleet);
    assert!(counts["lost"] > 0, "{counts:?}");
    assert_eq!(counts["computed"] + counts.get("taken back").unwrap_or(&0), 2048, "{counts:?}");
}
