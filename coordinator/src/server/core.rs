//! A coordinator without listeners: store, driver, and the services on them.

use std::sync::{Arc, Mutex};

use model::queries::Reader;
use tokio::{sync::Semaphore, task::JoinSet, time::timeout};
use tokio_util::sync::CancellationToken;
use tracing::error;

use super::{
    CoordinatorConfig, StartError,
    door::Door,
    gate::Gate,
    services::{self, Room, Services},
};
use engine::EngineConfig;

use crate::{
    control::Control,
    driver::{self, Driver, DriverConfig, EventSender},
    limits::{BUNDLES_MAX, RECONSTRUCTIONS_MAX, REFEREE_IDLE_TIME, SHUTDOWN_GRACE},
    metrics::{Instruments, Source},
    referee::Referee,
    rpc::{Evaluations, Experiments, Fleet, WelcomeTimes, Workers},
    shared_store::SharedStore,
    store::Store,
};

/// A driver on a store, and the handle through which clients use it.
#[derive(Debug)]
pub struct Core {
    pub store: SharedStore,
    pub control: Control,
    /// Ends the driver and all streams.
    pub shutdown: CancellationToken,
    pub instruments: Instruments,
    /// One task; empty once its end is known.
    pub driver: JoinSet<()>,
    /// The tasks that serve the doors.
    doors: JoinSet<Result<(), tonic::transport::Error>>,
    events: EventSender,
    room: Room,
    times: WelcomeTimes,
    referee: Referee,
}

impl Core {
    /// Starts a driver without experiments.
    pub async fn start(store: SharedStore, config: &CoordinatorConfig) -> Result<Self, StartError> {
        let shutdown = CancellationToken::new();
        let (events, event_queue) = driver::channel();
        let instruments = Instruments::default();
        let engine = EngineConfig {
            audit_fraction: config.audit_fraction,
            ..EngineConfig::new(config.lease)
        };
        let referee = Referee::new(config.referee.clone(), REFEREE_IDLE_TIME);
        let loop_ = Driver::new(
            store.clone(),
            event_queue,
            DriverConfig {
                engine,
                memory_budget: config.memory_budget,
                referee: referee.clone(),
                quarantine: store.read(Store::quarantined).await?,
                commit_duration: instruments.commit_duration.clone(),
            },
            shutdown.clone(),
        );
        let mut driver = JoinSet::new();
        driver.spawn(loop_.run());
        let control =
            Control::new(events.clone(), store.clone(), config.memory_budget, shutdown.clone());
        let times =
            WelcomeTimes { heartbeat_interval: config.heartbeat_interval, lease: config.lease };
        let doors = JoinSet::new();
        let room = Room::default();
        Ok(Self {
            store,
            control,
            shutdown,
            instruments,
            driver,
            doors,
            events,
            room,
            times,
            referee,
        })
    }

    /// The sources of the metrics.
    pub fn metrics(&self) -> Source {
        Source {
            events: self.events.clone(),
            store: self.store.clone(),
            referee: self.referee.clone(),
            instruments: self.instruments.clone(),
        }
    }

    pub fn experiments(&self) -> Experiments {
        Experiments {
            control: self.control.clone(),
            store: self.store.clone(),
            shutdown: self.shutdown.clone(),
            reader: Reader::new(self.store.clone(), RECONSTRUCTIONS_MAX),
            bundles: Arc::new(Semaphore::new(BUNDLES_MAX)),
        }
    }

    /// All services.
    pub fn services(&self) -> Services {
        Services {
            workers: Workers {
                events: self.events.clone(),
                outflow: self.room.to_workers.clone(),
                times: self.times,
                shutdown: self.shutdown.clone(),
                refusals: Mutex::default(),
            },
            fleet: Fleet { control: self.control.clone() },
            evaluations: Evaluations {
                control: self.control.clone(),
                shutdown: self.shutdown.clone(),
            },
            experiments: self.experiments(),
            room: self.room.clone(),
        }
    }

    /// Opens a connection to the services for this process only, until the coordinator stops. It
    /// needs no port and no token.
    pub fn open_door(&mut self) -> Door {
        let (door, visitors) = Door::new();
        let (calls, shutdown) = (self.instruments.calls.clone(), self.shutdown.clone());
        let services = self.services();
        let (builder, gate) = (services::builder(), Gate::new(None));
        self.doors.spawn(services.serve(builder, visitors, calls, gate, shutdown));
        door
    }

    /// Ends the driver, after writes in progress.
    pub async fn stop(&mut self) {
        self.shutdown.cancel();
        if let Some(Err(error)) = self.driver.join_next().await {
            error!("the driver panicked: {error}; please report this");
        }
        // If the driver takes too long, dropping the task ends it.
        let closing = async { while self.doors.join_next().await.is_some() {} };
        let _ = timeout(SHUTDOWN_GRACE, closing).await;
    }
}
