//! Networks that break or fall silent, for longer and for shorter than the lease.

use harness::{
    CoordinatorProcess,
    Direction::{ToCoordinator, ToWorker},
    Proxy, WorkerProcess,
};

use super::{SMALL, n_lost, wait_for_assignment, wait_for_loss};

/// A coordinator and its only worker, which compute the experiment, with a network between them.
struct Scene {
    coordinator: CoordinatorProcess,
    network: Proxy,
    _worker: WorkerProcess,
    id: u64,
}

impl Scene {
    fn start(args: &[&str]) -> Self {
        let coordinator = CoordinatorProcess::start_with(args);
        let network = Proxy::start(coordinator.address());
        let worker = WorkerProcess::start_with(&network.url(), "remote", &[]);
        let id = SMALL.submit(&coordinator);
        wait_for_assignment(&coordinator, 1);
        Self { coordinator, network, _worker: worker, id }
    }

    fn assert_undisturbed(&self) {
        SMALL.assert_undisturbed(self.coordinator.watch(self.id));
    }
}

#[test]
fn a_broken_connection_is_made_again() {
    let scene = Scene::start(&[]);
    scene.network.cut();
    assert_eq!(scene.network.traffic().n_reset, 1);
    let lost = wait_for_loss(&scene.coordinator);
    assert!(lost["items_requeued"].as_u64().unwrap() > 0, "{lost}");
    scene.network.wait_for("attempt to connect", |traffic| traffic.n_refused > 0);
    scene.network.heal();
    scene.assert_undisturbed();
    assert_eq!(scene.network.traffic().n_connections, 2);
}

#[test]
fn a_worker_that_cannot_be_heard_for_longer_than_its_lease_is_dropped_and_comes_back() {
    let scene = Scene::start(&["--lease", "1"]);
    scene.network.hold(ToCoordinator);
    assert_eq!(wait_for_loss(&scene.coordinator)["reason"], "silent for 1 s");
    assert!(scene.network.traffic().n_held[ToCoordinator as usize] > 0, "it did speak");
    scene.network.heal();
    scene.assert_undisturbed();
    assert!(scene.network.traffic().n_connections > 1);
}

#[test]
fn a_network_that_is_dead_for_longer_than_the_lease_is_survived() {
    let scene = Scene::start(&["--lease", "1"]);
    scene.network.hold(ToWorker);
    scene.network.hold(ToCoordinator);
    assert_eq!(wait_for_loss(&scene.coordinator)["reason"], "silent for 1 s");
    // The worker learns that it was dropped when the network is back.
    scene.network.wait_for("withheld word", |traffic| traffic.n_held.iter().all(|&n| n > 0));
    assert_eq!(scene.network.traffic().n_connections, 1);
    scene.network.heal();
    scene.assert_undisturbed();
    assert!(scene.network.traffic().n_connections > 1);
}

#[test]
fn a_worker_that_hears_nothing_for_longer_than_its_lease_keeps_its_place() {
    let scene = Scene::start(&["--lease", "1"]);
    scene.network.hold(ToWorker);
    let before = scene.network.traffic().n_delivered[ToCoordinator as usize];
    // The worker sends five heartbeats per lease, and a few remaining results. So this number of
    // messages takes longer than a lease.
    scene.network.wait_for("heartbeats", |traffic| {
        traffic.n_delivered[ToCoordinator as usize] > before + 12
    });
    assert!(scene.network.traffic().n_held[ToWorker as usize] > 0, "items were withheld");
    scene.network.heal();
    scene.assert_undisturbed();
}

#[test]
fn a_network_that_is_dead_for_shorter_than_the_lease_goes_unnoticed() {
    let scene = Scene::start(&[]);
    scene.network.hold(ToWorker);
    scene.network.wait_for("withheld items", |traffic| traffic.n_held[ToWorker as usize] > 0);
    scene.network.hold(ToCoordinator);
    scene.network.wait_for("withheld heartbeat or result", |traffic| {
        traffic.n_held[ToCoordinator as usize] > 0
    });
    scene.network.heal();
    scene.assert_undisturbed();
    assert_eq!(n_lost(&scene.coordinator), 0);
    assert_eq!(scene.network.traffic().n_connections, 1);
}
