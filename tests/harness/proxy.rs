//! A network between a worker and its coordinator that tests can cut.
//!
//! A *held* direction accepts bytes and delivers them when it is healed, like TCP across a
//! network that drops packets for a while. A *cut* network resets its connections and refuses
//! others.

use std::{
    io::{Read as _, Write as _},
    net::{Shutdown, SocketAddr, TcpListener, TcpStream},
    sync::{Arc, Condvar, Mutex, MutexGuard},
    thread,
};

use crate::process::DEADLINE;

/// Why the lock of the state cannot be poisoned.
const POISONED: &str = "nothing panics while it holds the state";

/// A direction through the network.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Direction {
    /// Messages of workers.
    ToCoordinator,
    /// Messages to workers.
    ToWorker,
}

/// Counts of events so far; pairs are indexed by [`Direction`].
#[derive(Debug, Clone, Copy, Default)]
pub struct Traffic {
    /// Connections that were made.
    pub n_connections: u64,
    /// Connections that were refused.
    pub n_refused: u64,
    /// Connections that were reset by a cut.
    pub n_reset: u64,
    /// Pieces of a stream that were delivered.
    pub n_delivered: [u64; 2],
    /// Pieces of a stream that arrived while their direction was held.
    pub n_held: [u64; 2],
}

/// The network; gone when dropped.
#[derive(Debug)]
pub struct Proxy {
    address: SocketAddr,
    shared: Arc<Shared>,
}

#[derive(Debug)]
struct Shared {
    target: String,
    state: Mutex<State>,
    changed: Condvar,
}

#[derive(Debug, Default)]
struct State {
    is_held: [bool; 2],
    is_cut: bool,
    is_over: bool,
    traffic: Traffic,
    connections: Vec<TcpStream>,
}

impl Proxy {
    /// A network, whole at first, to a coordinator's `host:port`.
    pub fn start(target: &str) -> Self {
        let listener = TcpListener::bind("127.0.0.1:0").expect("loopback has free ports");
        let address = listener.local_addr().expect("it is bound");
        let shared = Arc::new(Shared {
            target: target.to_owned(),
            state: Mutex::default(),
            changed: Condvar::new(),
        });
        let accepting = Arc::clone(&shared);
        thread::spawn(move || {
            for connection in listener.incoming().map_while(Result::ok) {
                if accepting.lock().is_over {
                    return;
                }
                accepting.connect(connection);
            }
        });
        Self { address, shared }
    }

    /// The coordinator's URL through this network.
    pub fn url(&self) -> String {
        format!("http://{}", self.address)
    }

    /// Delivers nothing more in a direction.
    pub fn hold(&self, direction: Direction) {
        self.shared.change(|state| state.is_held[direction as usize] = true);
    }

    /// Resets all connections and refuses new ones.
    pub fn cut(&self) {
        self.shared.change(|state| {
            state.is_cut = true;
            state.traffic.n_reset += state.reset_all();
        });
    }

    /// Heals the network, and delivers the held bytes.
    pub fn heal(&self) {
        self.shared.change(|state| (state.is_held, state.is_cut) = ([false; 2], false));
    }

    /// The counts of events so far.
    pub fn traffic(&self) -> Traffic {
        self.shared.lock().traffic
    }

    /// Waits until a condition on the counts holds.
    pub fn wait_for(&self, what: &str, has_happened: impl Fn(&Traffic) -> bool) -> Traffic {
        let (state, timeout) = self
            .shared
            .changed
            .wait_timeout_while(self.shared.lock(), DEADLINE, |s| !has_happened(&s.traffic))
            .expect(POISONED);
        let traffic = state.traffic;
        drop(state);
        assert!(!timeout.timed_out(), "no {what}: {traffic:?}");
        traffic
    }
}

impl Drop for Proxy {
    fn drop(&mut self) {
        self.shared.change(|state| {
            state.is_over = true;
            state.reset_all();
        });
        // Wakes the thread that accepts connections.
        let _ = TcpStream::connect(self.address);
    }
}

impl State {
    /// Ends all connections; returns the number of those that had not ended.
    fn reset_all(&mut self) -> u64 {
        let resets = self.connections.drain(..).map(|c| c.shutdown(Shutdown::Both));
        resets.filter(Result::is_ok).count() as u64
    }
}

impl Shared {
    fn lock(&self) -> MutexGuard<'_, State> {
        self.state.lock().expect(POISONED)
    }

    fn change(&self, change: impl FnOnce(&mut State)) {
        change(&mut self.lock());
        self.changed.notify_all();
    }

    /// Connects a worker with the coordinator, if the network is whole and a coordinator listens.
    fn connect(self: &Arc<Self>, worker: TcpStream) {
        let is_cut = self.lock().is_cut;
        let coordinator = if is_cut { None } else { TcpStream::connect(&self.target).ok() };
        let Some(coordinator) = coordinator else {
            self.change(|state| state.traffic.n_refused += 1);
            return;
        };
        let _ = (worker.set_nodelay(true), coordinator.set_nodelay(true));
        let clone = |stream: &TcpStream| stream.try_clone().expect("descriptors are left");
        self.change(|state| {
            state.traffic.n_connections += 1;
            // Shutting down one side ends both: see `pump`.
            state.connections.push(clone(&worker));
        });
        for (direction, from, to) in [
            (Direction::ToCoordinator, clone(&worker), clone(&coordinator)),
            (Direction::ToWorker, coordinator, worker),
        ] {
            let shared = Arc::clone(self);
            thread::spawn(move || shared.pump(direction, from, to));
        }
    }

    fn pump(&self, direction: Direction, mut from: TcpStream, mut to: TcpStream) {
        let mut buffer = [0; 1 << 14];
        while let Ok(n @ 1..) = from.read(&mut buffer) {
            let mut state = self.lock();
            if state.is_held[direction as usize] {
                state.traffic.n_held[direction as usize] += 1;
                self.changed.notify_all();
                state = self
                    .changed
                    .wait_while(state, |state| state.is_held[direction as usize] && !state.is_over)
                    .expect(POISONED);
            }
            drop(state);
            if to.write_all(&buffer[..n]).is_err() {
                break;
            }
            self.change(|state| state.traffic.n_delivered[direction as usize] += 1);
        }
        let _ = (from.shutdown(Shutdown::Both), to.shutdown(Shutdown::Both));
    }
}
