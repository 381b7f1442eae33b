//! `swarmctl bench`: how fast this machine simulates, and how long an experiment
//! will take here and on larger fleets.

use std::{
    iter::Sum,
    path::{Path, PathBuf},
    thread,
    time::{Duration, Instant},
};

use clap::Args;
use determinism::random::{Purpose, Stream};
use experiment_file::ExperimentConfig;
use schemars::JsonSchema;
use serde::Serialize;
use sim_core::{EvaluateError, Isa, Simulation};

use crate::{
    args::{IsaArgs, cores, whole},
    clock,
    error::Error,
    experiment_file::{ExperimentFile, Overrides},
    progress::Progress,
    text, waiting,
};

/// The experiment to simulate if none is named.
const DEFAULT: &str = include_str!("../../../configs/leader_selection_snes.json");

/// Measure how fast this machine simulates an experiment.
///
/// Every core evaluates random genotypes for some seconds. Prints how long the whole
/// experiment will take here, and on larger fleets.
#[derive(Debug, Args)]
#[command(after_help = HELP)]
pub struct BenchArgs {
    /// The experiment file [default: the thesis's leader selection, by SNES]
    config: Option<PathBuf>,
    /// Duration of the measurement, in seconds.
    #[arg(long, value_name = "S", default_value_t = 10, value_parser = whole::<u16>(1..=3600))]
    seconds: u16,
    /// Number of cores to keep busy [default: all]
    #[arg(long, value_name = "N", value_parser = whole::<u16>(1..=1024))]
    cores: Option<u16>,
    #[command(flatten)]
    isa: IsaArgs,
}

const HELP: &str = "\
Examples:
  swarmctl bench
  swarmctl bench configs/borderline_snes.json --cores 1 --output json";

/// Simulates for some seconds on every core, and prints how fast that was.
pub fn bench(args: &BenchArgs, progress: &mut Progress) -> Result<(), Error> {
    let isa = args.isa.get();
    let (config, experiment) = experiment(args.config.as_deref())?;
    let experiment = experiment.with_isa(isa);
    let n_cores = match args.cores {
        Some(n) => n.into(),
        None => cores(),
    };
    let duration = Duration::from_secs(args.seconds.into());
    let n_trials = config.algorithm.num_evaluations;
    let what =
        format!("simulating on {n_cores} cores for {} s; --seconds shortens this", args.seconds);
    let (speed, failure) = waiting::busy(&what, || {
        thread::scope(|scope| {
            let simulate = |core| {
                let experiment = &experiment;
                move || Speed::of_core(experiment, n_trials, core, duration)
            };
            let cores: Vec<_> =
                (0..n_cores as u64).map(|core| scope.spawn(simulate(core))).collect();
            let speeds =
                cores.into_iter().map(|core| core.join().expect("simulation does not panic"));
            let (speeds, failures): (Vec<Speed>, Vec<_>) = speeds.unzip();
            (speeds.into_iter().sum::<Speed>(), failures.into_iter().flatten().next())
        })
    });
    if let (0, Some(error)) = (speed.n_genotypes, failure) {
        return Err(Error::Input(format!("{}: {error}", config.name)));
    }
    let report = Report::new(&config, isa, n_cores, &speed);
    match progress.is_json() {
        true => progress.print_document(&report),
        false => progress.print(&report.to_text()),
    }
}

fn experiment(path: Option<&Path>) -> Result<(ExperimentConfig, Simulation), Error> {
    if let Some(path) = path {
        let file = ExperimentFile::read(path)?;
        let compiled = file.compile(&Overrides::default()).map_err(|error| file.invalid(&error))?;
        return Ok((compiled.config, compiled.experiment));
    }
    let (config, _warnings) =
        ExperimentConfig::from_json(DEFAULT, "default", evolution::ALGORITHMS)
            .expect("a shipped file is right");
    let experiment = Simulation::compile(&config).expect("a shipped file is right");
    Ok((config, experiment))
}

/// Work of one or more cores.
#[derive(Debug, Default, Clone, Copy)]
struct Speed {
    n_genotypes: u64,
    /// Time summed over the cores.
    time: Duration,
}

impl Speed {
    /// Evaluates one genotype after the other, for `duration` at least. Also returns the last
    /// failure; its time counts.
    fn of_core(
        experiment: &Simulation,
        n_trials: u32,
        core: u64,
        duration: Duration,
    ) -> (Self, Option<EvaluateError>) {
        let mut genes = Stream::new(0, 0, 0, Purpose::Evolution, core);
        let start: Instant = clock::now();
        let (mut n_genotypes, mut n_failed) = (0, 0);
        let mut failure = None;
        while start.elapsed() < duration {
            let genotype: Vec<f64> =
                (0..experiment.genotype_len()).map(|_| genes.uniform()).collect();
            match experiment.evaluate(&genotype, n_genotypes + n_failed, 0..n_trials) {
                Ok(_) => n_genotypes += 1,
                Err(error) => {
                    n_failed += 1;
                    failure = Some(error);
                }
            }
        }
        (Self { n_genotypes, time: start.elapsed() }, failure)
    }
}

impl Sum for Speed {
    fn sum<I: Iterator<Item = Self>>(speeds: I) -> Self {
        speeds.fold(Self::default(), |sum, speed| Self {
            n_genotypes: sum.n_genotypes + speed.n_genotypes,
            time: sum.time + speed.time,
        })
    }
}

/// The measured speed, and the estimated time of the experiment.
#[derive(Debug, Serialize, JsonSchema)]
#[schemars(rename = "Speed")]
pub struct Report<'a> {
    /// Name of the experiment.
    experiment: &'a str,
    /// The vector instructions.
    isa: &'static str,
    /// Number of cores that simulated.
    cores: usize,
    /// Steps of all robots that a core simulates per second.
    robot_steps_per_second_per_core: f64,
    /// Time of a core for a step of a robot, microseconds.
    us_per_robot_step: f64,
    /// Episodes that a core simulates per second.
    episodes_per_second_per_core: f64,
    /// Robot-steps of the whole experiment, without re-evaluations of champions.
    robot_steps: f64,
    /// Time of one core for the whole experiment, minutes.
    core_minutes: f64,
    /// Time of these cores for the whole experiment, minutes.
    minutes: f64,
}

impl<'a> Report<'a> {
    fn new(config: &'a ExperimentConfig, isa: Isa, cores: usize, speed: &Speed) -> Self {
        let algorithm = &config.algorithm;
        let n_robots: u32 = config.robots().map(|(_, robot)| robot.num_instances).sum();
        let episodes = speed.n_genotypes as f64 * f64::from(algorithm.num_evaluations);
        let episode = f64::from(n_robots) * f64::from(algorithm.evaluation_steps);
        let episodes_per_second_per_core = episodes / speed.time.as_secs_f64();
        let robot_steps_per_second_per_core = episodes_per_second_per_core * episode;
        let robot_steps = episode
            * f64::from(algorithm.num_evaluations)
            * f64::from(algorithm.population_size)
            * algorithm.generations as f64;
        let core_minutes = robot_steps / robot_steps_per_second_per_core / 60.0;
        Self {
            experiment: &config.name,
            isa: isa.name(),
            cores,
            robot_steps_per_second_per_core,
            us_per_robot_step: 1e6 / robot_steps_per_second_per_core,
            episodes_per_second_per_core,
            robot_steps,
            core_minutes,
            minutes: core_minutes / cores as f64,
        }
    }

    fn to_text(&self) -> String {
        let minutes = |minutes: f64| clock::duration(Duration::from_secs_f64(60.0 * minutes));
        format!(
            "{}, {} on {} {}\n  \
             speed of a core   {:.2} million robot-steps/s ({:.3} us each), {:.0} episodes/s\n  \
             whole experiment  {} robot-steps\n  \
             on this machine   {}\n  \
             on 16, 64 cores   {}, {}",
            self.experiment,
            self.isa,
            self.cores,
            if self.cores == 1 { "core" } else { "cores" },
            self.robot_steps_per_second_per_core / 1e6,
            self.us_per_robot_step,
            self.episodes_per_second_per_core,
            text::large_number(self.robot_steps),
            minutes(self.minutes),
            minutes(self.core_minutes / 16.0),
            minutes(self.core_minutes / 64.0),
        )
    }
}

#[cfg(test)]
mod tests {
    use std::fs;

    use super::*;

    #[test]
    fn an_experiment_takes_its_robot_steps_at_the_speed_of_its_cores() {
        let (config, _) = experiment(None).unwrap();
        let speed = Speed { n_genotypes: 100, time: Duration::from_secs(2) };
        let report = Report::new(&config, Isa::best(), 2, &speed);
        // 100 genotypes x 5 trials x 300 steps x 10 robots in 2 s.
        assert_eq!(report.episodes_per_second_per_core, 250.0);
        assert_eq!(report.robot_steps_per_second_per_core, 750_000.0);
        assert_eq!(report.robot_steps, 1.5e9);
        assert!((report.core_minutes - 2000.0 / 60.0).abs() < 1e-9);
        assert!((report.minutes - 1000.0 / 60.0).abs() < 1e-9);
        assert!(report.to_text().contains("16 min 40 s"), "{}", report.to_text());
    }

    #[test]
    fn an_experiment_that_cannot_be_simulated_has_no_speed() {
        let dir = tempfile::tempdir().unwrap();
        let path = dir.path().join("aggregation.json");
        fs::write(&path, include_str!("../../../configs/tasks/aggregation.json")).unwrap();
        let script = include_str!("../../../configs/tasks/aggregation.star");
        let script = script.replace("def fitness(world):", "def fitness(world):\n    fail(\"no\")");
        fs::write(dir.path().join("aggregation.star"), script).unwrap();
        let (_, experiment) = experiment(Some(&path)).unwrap();
        let (speed, failure) = Speed::of_core(&experiment, 1, 0, Duration::from_millis(1));
        assert_eq!(speed.n_genotypes, 0);
        assert!(failure.unwrap().to_string().contains("no"));
    }

    #[test]
    fn a_core_simulates_until_its_time_is_over() {
        let (_, experiment) = experiment(None).unwrap();
        let speed = Speed::of_core(&experiment, 1, 0, Duration::from_millis(1)).0;
        assert!(speed.n_genotypes >= 1 && speed.time >= Duration::from_millis(1));
    }
}
