//! The champion and the network that it encodes.

use evolution::{ALGORITHMS, Champion};
use experiment_file::ExperimentConfig;
use sim_core::Simulation;

use crate::{
    ids::ExperimentId,
    store::{ExperimentRecord, Store},
};

use super::{QueryError, experiment};

/// A champion as the store has it.
#[derive(Debug)]
pub struct StoredChampion {
    experiment: ExperimentRecord,
    champion: Champion,
}

/// A champion and what it is.
#[derive(Debug)]
pub struct ChampionReport {
    /// Its experiment.
    pub experiment: ExperimentId,
    /// Genotype and fitness.
    pub champion: Champion,
    /// The network that the genotype encodes, as JSON.
    pub network_json: String,
}

impl StoredChampion {
    /// Reads an experiment's champion: of those re-evaluated on held-out trials, the
    /// best; before the first re-evaluation, the best individual.
    pub fn read(store: &Store, id: ExperimentId) -> Result<Self, QueryError> {
        let experiment = experiment(store, id)?;
        let champion = store.champion(id)?.ok_or(QueryError::NoChampion(id))?;
        Ok(Self { experiment, champion })
    }

    /// Decodes the genotype: work for a CPU.
    pub fn decode(self) -> Result<ChampionReport, QueryError> {
        let Self { experiment: ExperimentRecord { id, fingerprint, config_json, .. }, champion } =
            self;
        let ours = sim_core::FINGERPRINT;
        if fingerprint != ours {
            return Err(QueryError::OtherSimulation { experiment: id, theirs: fingerprint, ours });
        }
        let network_json =
            network_json(&config_json, &champion.genotype).map_err(QueryError::Undecodable)?;
        Ok(ChampionReport { experiment: id, champion, network_json })
    }
}

fn network_json(config_json: &str, genotype: &[f64]) -> Result<String, String> {
    let (config, _) = ExperimentConfig::from_json(config_json, "", ALGORITHMS)
        .map_err(|error| error.to_string())?;
    let simulation = Simulation::compile(&config).map_err(|error| error.to_string())?;
    let network = simulation.network_json(genotype).map_err(|error| error.to_string())?;
    Ok(network.to_string())
}
