//! The work of both fleets: trials, each simulated once for both.

use std::{cell::RefCell, collections::BTreeMap, rc::Rc, time::Duration};

use engine::SharedGenotype;
use sim_core::{Output, Simulation, TrialSet};
use simulated_fleet::{Note, Order, Work};

/// What the fleets have simulated. A trial is a function of its genotype and its place, so its
/// second computation would give the same bits.
pub struct Trials {
    simulation: Simulation,
    known: BTreeMap<(TrialSet, u32), Vec<Known>>,
    n_simulated: u64,
}

/// Results of a genotype, by trial.
struct Known {
    genotype: SharedGenotype,
    values: BTreeMap<u32, f64>,
}

impl Trials {
    /// Nothing is known.
    pub fn new(simulation: Simulation) -> Self {
        Self { simulation, known: BTreeMap::new(), n_simulated: 0 }
    }

    /// The number of simulated trials.
    pub fn n_simulated(&self) -> u64 {
        self.n_simulated
    }

    fn fitness(&mut self, order: &Order<'_>) -> Result<Vec<f64>, String> {
        if order.output != Output::Fitness {
            return Err("the page computes fitness alone".to_owned());
        }
        let place = (order.trial_set, order.genotype.individual);
        let variants = self.known.entry(place).or_default();
        // They differ only if a lie has reached one of the evolutions.
        let index = variants.iter().position(|known| known.genotype == *order.genotype);
        let known = match index {
            Some(index) => &mut variants[index],
            None => {
                let genotype = order.genotype.clone();
                variants.push(Known { genotype, values: BTreeMap::new() });
                variants.last_mut().expect("just added")
            }
        };
        let missing: Vec<u32> =
            order.trials.clone().filter(|trial| !known.values.contains_key(trial)).collect();
        if let (Some(&first), Some(&last)) = (missing.first(), missing.last()) {
            let trials = first..last + 1;
            self.n_simulated += trials.len() as u64;
            let values = self
                .simulation
                .evaluate(order.genotype, order.trial_set, trials.clone())
                .map_err(|error| error.to_string())?;
            known.values.extend(trials.zip(values));
        }
        Ok(order.trials.clone().map(|trial| known.values[&trial]).collect())
    }
}

/// The work of one fleet.
pub struct Computing {
    trials: Rc<RefCell<Trials>>,
    /// What has happened since the last look; none for a fleet that nobody watches.
    notes: Option<Vec<(Duration, Note)>>,
}

impl Computing {
    /// The work of a fleet.
    pub fn new(trials: Rc<RefCell<Trials>>, is_watched: bool) -> Self {
        Self { trials, notes: is_watched.then(Vec::new) }
    }

    /// Takes what has happened.
    pub fn take_notes(&mut self) -> Vec<(Duration, Note)> {
        self.notes.as_mut().map(std::mem::take).unwrap_or_default()
    }
}

impl Work for Computing {
    fn place(&self, genotype: &SharedGenotype) -> u64 {
        genotype.first().map_or(0, |gene| gene.to_bits())
    }

    fn compute(&mut self, order: &Order<'_>) -> Result<Vec<f64>, String> {
        self.trials.borrow_mut().fitness(order)
    }

    fn note(&mut self, now: Duration, note: Note) {
        if let Some(notes) = &mut self.notes {
            notes.push((now, note));
        }
    }
}
