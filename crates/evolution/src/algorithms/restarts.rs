//! CMA-ES that restarts: IPOP and BIPOP.
//!
//! Auger, Hansen: "A restart CMA evolution strategy with increasing population size", CEC 2005;
//! Hansen: "Benchmarking a BI-population CMA-ES on the BBOB-2009 function testbed", GECCO 2009.
//!
//! Everything around an algorithm expects generations of one size. So an iteration of a run with
//! more individuals takes several generations, all of them drawn from the same distribution, and
//! CMA-ES learns after the last one from all their individuals together.

use determinism::random::Stream;
use experiment_file::{AlgorithmDescription, DefaultValue, Domain, Parameter, Params};
use serde::{Deserialize, Serialize};

use super::{
    Described as _, Form, Sample, Strategy,
    cma_es::CmaEs,
    parameters::SIGMA_INIT,
    stopping::{Progress, Verdict},
};
use crate::ranking::ranking;

/// Restarts with twice the individuals.
const IPOP: &str = "ipop";
/// These restarts, and in between short runs from narrow distributions.
const BIPOP: &str = "bipop";

pub const RESTARTS: Parameter = Parameter::of(
    "restarts",
    Domain::OneOf { names: &["none", IPOP, BIPOP], unsupported: &[] },
    DefaultValue::Name("none"),
    "Whether a run that has converged begins anew from a random mean. `ipop`: with twice the \
     individuals. `bipop`: also short runs from narrow distributions. An iteration with k times \
     `population_size` individuals takes k generations",
)
.recent();

/// Most generations in an iteration: the package `cma` ends after nine restarts.
const WIDTH_MAX: u32 = 512;

/// Most random numbers of earlier generations in a state: 8 MiB. Iterations become no longer than
/// that.
const KEPT_MAX: usize = 1 << 20;

/// How runs follow each other.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
enum Policy {
    Ipop,
    Bipop,
}

/// A run of CMA-ES, and what the next one depends on.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct RestartingCmaEs {
    policy: Policy,
    sigma_init: f64,
    run: CmaEs,
    progress: Progress,
    /// Number of generations in an iteration of this run, and of the latest long run.
    width: u32,
    long_width: u32,
    /// Number of generations of the present iteration that are done; their normals and fitness.
    n_gathered: u32,
    normals: Vec<Vec<f64>>,
    fitness: Vec<f64>,
    /// Whether this is a short run of BIPOP, or the first one, which counts as one.
    is_short: bool,
    /// Generations of this run, of all short and of all long ones.
    n_of_run: u64,
    n_of_short: u64,
    n_of_long: u64,
    /// A short run ends after this many generations.
    n_max: u64,
    n_restarts: u64,
    /// Why the previous run ended.
    ended: Verdict,
}

impl Form for RestartingCmaEs {
    const DESCRIPTION: AlgorithmDescription = CmaEs::DESCRIPTION;

    fn start(params: &Params, d: usize) -> Option<Self> {
        let restarts: String = params.value_of(&RESTARTS);
        let policy = match restarts.as_str() {
            IPOP => Policy::Ipop,
            BIPOP => Policy::Bipop,
            _ => return None,
        };
        Some(Self {
            policy,
            sigma_init: params.value_of(&SIGMA_INIT),
            run: CmaEs::start(params, d),
            progress: Progress::new(),
            width: 1,
            long_width: 1,
            n_gathered: 0,
            normals: Vec::new(),
            fitness: Vec::new(),
            is_short: true,
            n_of_run: 0,
            n_of_short: 0,
            n_of_long: 0,
            n_max: u64::MAX,
            n_restarts: 0,
            ended: Verdict::GoOn,
        })
    }
}

impl RestartingCmaEs {
    /// Learns from an iteration whose generations are all there.
    fn iterate(&mut self, last: &Sample) -> Verdict {
        let normals = std::mem::take(&mut self.normals);
        let fitness = std::mem::take(&mut self.fitness);
        self.n_gathered = 0;
        let (d, n) = (self.n_genes(), fitness.len());
        let is_whole = last.steps.len() == n;
        let steps = if is_whole { last.steps.clone() } else { self.run.steps(&normals) };
        let ranking = ranking(&fitness);
        let sample = Sample { steps, ..Sample::new(Vec::new(), normals) };
        self.run.learn(&sample, &ranking, &fitness);
        self.progress.add(d, &fitness, &ranking);
        match self.progress.verdict(d, n) {
            Verdict::GoOn => self.progress.verdict_on(&self.run),
            verdict => verdict,
        }
    }

    /// Begins the next run. `uniforms`: draws for its mean, its number of individuals and its
    /// first deviation.
    fn restart(&mut self, uniforms: &[f64], population_size: usize) {
        let d = self.n_genes();
        let (mean, others) = uniforms.split_at(d);
        self.is_short = self.policy == Policy::Bipop && self.n_of_short < self.n_of_long;
        let sigma = if self.is_short {
            let wider = f64::from(self.long_width) / 2.0;
            self.width = (libm::pow(wider, others[0] * others[0]) as u32).max(1);
            self.n_max = self.n_of_long / 2;
            self.sigma_init * libm::pow(10.0, -2.0 * others[1])
        } else {
            self.long_width = width_after(self.long_width, population_size * d);
            self.width = self.long_width;
            self.n_max = u64::MAX;
            self.sigma_init
        };
        self.run = CmaEs::from_mean(mean.to_vec(), sigma);
        self.progress = Progress::new();
        self.n_of_run = 0;
        self.n_restarts += 1;
    }
}

/// Twice the width, unless the earlier generations of an iteration would become too large.
/// `n_drawn`: number of random numbers of a generation.
fn width_after(width: u32, n_drawn: usize) -> u32 {
    let doubled = width * 2;
    if doubled <= WIDTH_MAX && doubled as usize * n_drawn <= KEPT_MAX { doubled } else { width }
}

impl Strategy for RestartingCmaEs {
    fn n_genes(&self) -> usize {
        self.run.n_genes()
    }

    fn mean(&self) -> Option<&[f64]> {
        self.run.mean()
    }

    fn deviations(&self) -> Option<Vec<f64>> {
        self.run.deviations()
    }

    /// As CMA-ES, and then the draws for a restart.
    fn sample(&self, population_size: usize, rng: &mut Stream) -> Sample {
        let sample = self.run.sample(population_size, rng);
        let uniforms = (0..self.n_genes() + 2).map(|_| rng.uniform()).collect();
        Sample { uniforms, ..sample }
    }

    fn learn(&mut self, sample: &Sample, _ranking: &[usize], fitness: &[f64]) {
        self.n_of_run += 1;
        let n_of_kind = if self.is_short { &mut self.n_of_short } else { &mut self.n_of_long };
        *n_of_kind += 1;
        // Ranks last, as fitness that is not finite does in a single generation.
        let finite = |fitness: &f64| if fitness.is_finite() { *fitness } else { f64::MIN };
        self.normals.extend(sample.normals.iter().cloned());
        self.fitness.extend(fitness.iter().map(finite));
        self.n_gathered += 1;
        if self.n_gathered < self.width {
            return;
        }
        let verdict = match self.iterate(sample) {
            Verdict::GoOn if self.n_of_run >= self.n_max => Verdict::Budget,
            verdict => verdict,
        };
        if verdict != Verdict::GoOn {
            self.ended = verdict;
            self.restart(&sample.uniforms, fitness.len());
        }
    }

    fn n_kept(&self) -> usize {
        self.normals.len() * self.n_genes()
    }

    fn news(&self) -> Option<String> {
        (self.n_of_run == 0 && self.n_restarts > 0).then(|| {
            format!(
                "CMA-ES begins run {}, because in the previous one {}; each iteration takes {} \
                 generations",
                self.n_restarts + 1,
                self.ended.reason(),
                self.width
            )
        })
    }
}

#[cfg(test)]
mod tests;
