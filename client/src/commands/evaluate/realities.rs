//! `--pseudo-realities`: worlds unlike the one of the design, each a condition, and what they cost
//! a genotype (Ligot & Birattari 2019).

use determinism::random::{Purpose, Stream, TrialSet};
use experiment_file::{
    Drawn, ExperimentConfig, ObjectConfig, Parameters, Params, PseudoRealityConfig, RobotConfig,
    RobotController, SensorQuery,
};
use indexmap::IndexMap;
use schemars::JsonSchema;
use serde::Serialize;
use statistics::{Interval, interval_of_crossed, mean};

use super::{
    conditions::{Condition, Role},
    measured::Measured,
};
use crate::{
    change::Json,
    error::Error,
    json,
    progress::Part,
    table::{Column, Table},
    text,
};

/// What a robot needs for a key to matter.
#[derive(Debug, Clone, Copy, PartialEq)]
enum Need {
    Wheels,
    WheelsOrLed,
    Sensors,
    Radio,
}

/// The keys, in their order.
const KEYS: [(&str, Need); 10] = [
    ("wheel_gain", Need::Wheels),
    ("wheel_asymmetry", Need::Wheels),
    ("slow_robot", Need::Wheels),
    ("actuation_delay", Need::WheelsOrLed),
    ("sensor_gain", Need::Sensors),
    ("sensor_offset", Need::Sensors),
    ("sensor_noise", Need::Sensors),
    ("radio_range", Need::Radio),
    ("radio_loss", Need::Radio),
    ("antenna_heading", Need::Radio),
];

/// The ranges if the experiment file states none. `docs/robots.md` has their sources.
fn usual() -> PseudoRealityConfig {
    let range = |low, high| Drawn { low, high };
    PseudoRealityConfig {
        wheel_gain: range(0.9, 1.1),
        wheel_asymmetry: range(0.0, 0.1),
        slow_robot: range(0.5, 1.0),
        actuation_delay: Drawn { low: 0, high: 2 },
        sensor_gain: range(0.8, 1.2),
        sensor_offset: range(-0.05, 0.05),
        sensor_noise: range(0.0, 0.1),
        radio_range: range(0.7, 1.2),
        radio_loss: range(0.0, 0.6),
        antenna_heading: range(0.0, 0.2),
        ..Default::default()
    }
}

/// Ranges, and the realities drawn from them.
#[derive(Debug, Clone)]
pub struct Realities {
    /// The ranges of the keys that matter to the robots, by key.
    ranges: IndexMap<&'static str, Json>,
    /// The numbers of each reality.
    drawn: Vec<IndexMap<&'static str, Json>>,
    /// Whether the experiment file states the ranges.
    are_of_file: bool,
}

impl Realities {
    /// Draws `n` realities for the robots that evolve. The experiment's seed determines them.
    pub fn draw(config: &ExperimentConfig, n: u32) -> Result<Self, Error> {
        let evolvable = &config.algorithm.evolvable_object;
        let Some(ObjectConfig::Robot(robot)) = config.world.objects.get(evolvable) else {
            return Err(Error::Internal(format!("no robots are named {evolvable}")));
        };
        let own = robot.perturbations.pseudo_reality;
        let given = own.unwrap_or_else(usual);
        let ranges = values(&given.to_params());
        let neutral = values(&PseudoRealityConfig::default().to_params());
        let matters = |key: &str, need| ranges[key] != neutral[key] && has(config, robot, need);
        let keys = KEYS.iter().filter(|(key, need)| matters(key, *need));
        let keys: Vec<&'static str> = keys.map(|(key, _)| *key).collect();
        if keys.is_empty() {
            let problem = match own {
                Some(_) => "the file's pseudo_reality states no range or number that matters to",
                None => "no key of pseudo_reality matters to",
            };
            let what = format!("{n}: {problem} robots of `{evolvable}`");
            return Err(Error::option("--pseudo-realities", what));
        }
        let of = |values: &IndexMap<String, Json>| -> IndexMap<&'static str, Json> {
            keys.iter().map(|key| (*key, values[*key].clone())).collect()
        };
        let drawn = (0..u64::from(n)).map(|reality| {
            let (seed, purpose) = (config.seed, Purpose::Realities);
            let mut stream = Stream::new(seed, TrialSet::Evaluation, reality, purpose, 0);
            of(&values(&given.draw(|| stream.uniform()).to_params()))
        });
        Ok(Self { drawn: drawn.collect(), ranges: of(&ranges), are_of_file: own.is_some() })
    }

    /// The name, the role and the value of `pseudo_reality` of each condition: the realities, and
    /// then each range alone.
    pub fn conditions(&self) -> impl Iterator<Item = (String, Role, Json)> {
        let object = |numbers: &IndexMap<&'static str, Json>| {
            Json::Object(
                numbers.iter().map(|(key, number)| ((*key).to_owned(), number.clone())).collect(),
            )
        };
        let realities = self.drawn.iter().enumerate().map(move |(number, numbers)| {
            (format!("reality {number}"), Role::Reality, object(numbers))
        });
        let alone = self.ranges.iter().map(move |(key, range)| {
            let one = IndexMap::from([(*key, range.clone())]);
            (format!("only {key}"), Role::Key(key), object(&one))
        });
        realities.chain(alone)
    }
}

/// The values of parameters as JSON.
fn values(params: &Params) -> IndexMap<String, Json> {
    let parsed = |value| Json::parse(&json::line(value));
    params.iter().map(|(key, value)| (key.to_owned(), parsed(value))).collect()
}

/// Whether robots have what a key needs.
fn has(config: &ExperimentConfig, robot: &RobotConfig, what: Need) -> bool {
    let has_wheels = robot.actuators.wheel_actuator.is_some();
    match what {
        Need::Wheels => has_wheels,
        Need::WheelsOrLed => has_wheels || robot.actuators.led_actuator.is_some(),
        Need::Sensors => match robot.controller {
            RobotController::NeuralController => {
                config.topology.stimuli.values().any(|stimulus| stimulus.sensor.is_measured())
            }
            _ => SensorQuery::ALL
                .iter()
                .any(|query| query.is_measured() && robot.sensors.reading_len(*query).is_some()),
        },
        Need::Radio => robot.sensors.wireless_receiver.is_some(),
    }
}

/// How the intervals are made.
const METHOD: &str = "drop: 95 % percentile interval of the pigeonhole bootstrap, which resamples \
                      realities and trials; drops of single keys: 95 % empirical likelihood over \
                      trials; all differences are paired by trial";

/// What pseudo-realities cost a genotype: `pseudo_realities` of summary.json.
#[derive(Debug, Clone, Serialize, JsonSchema)]
pub struct Robustness {
    /// The range of each key of `pseudo_reality` that matters, [low, high], or its one value.
    ranges: IndexMap<&'static str, Json>,
    /// Who states the ranges: `file` or `defaults`.
    ranges_of: &'static str,
    /// Mean fitness without pseudo-reality.
    #[schemars(with = "Option<f64>")]
    nominal: f64,
    /// Mean fitness over all realities.
    #[schemars(with = "Option<f64>")]
    mean: f64,
    worst_tenth: WorstTenth,
    /// The nominal fitness minus that in the realities.
    drop: Interval,
    /// What each range costs alone, the largest drop first.
    causes: Vec<Cause>,
    /// All realities.
    realities: Vec<Reality>,
    /// How the intervals are made.
    method: &'static str,
}

/// The tenth of the realities in which the fitness is lowest, rounded up to whole realities.
#[derive(Debug, Clone, Serialize, JsonSchema)]
struct WorstTenth {
    /// Number of realities.
    realities: usize,
    /// Mean fitness over these realities.
    #[schemars(with = "Option<f64>")]
    mean: f64,
}

/// What a range costs alone.
#[derive(Debug, Clone, Serialize, JsonSchema)]
struct Cause {
    /// A key of `pseudo_reality`.
    key: &'static str,
    /// The nominal fitness minus that with the range.
    drop: Interval,
}

/// A world that was drawn.
#[derive(Debug, Clone, Serialize, JsonSchema)]
struct Reality {
    /// `reality` and its number, from 0.
    name: String,
    /// The drawn value of each key.
    numbers: IndexMap<&'static str, Json>,
    /// Mean fitness.
    #[schemars(with = "Option<f64>")]
    fitness: f64,
}

impl Robustness {
    /// The first condition is the nominal one.
    pub fn new(realities: &Realities, conditions: &[Condition], measured: &[Measured]) -> Self {
        let fitness = |measured: &Measured| -> Vec<f64> {
            measured.trials.iter().map(|trial| trial.fitness).collect()
        };
        let nominal = fitness(&measured[0]);
        let drops = |measured: &Measured| -> Vec<f64> {
            nominal.iter().zip(fitness(measured)).map(|(nominal, real)| nominal - real).collect()
        };
        let (mut names, mut rows, mut means, mut causes) = (vec![], vec![], vec![], vec![]);
        for (condition, measured) in conditions.iter().zip(measured) {
            match condition.role {
                Role::Reality => {
                    names.push(condition.name.clone());
                    rows.push(drops(measured));
                    means.push(mean(&fitness(measured)));
                }
                Role::Key(key) => causes.push(Cause { key, drop: of_trials(&drops(measured)) }),
                Role::Other => {}
            }
        }
        causes.sort_by(|a, b| b.drop.value.total_cmp(&a.drop.value));
        let mut sorted = means.clone();
        sorted.sort_by(f64::total_cmp);
        sorted.truncate(means.len().div_ceil(10));
        let drawn = names.into_iter().zip(&realities.drawn).zip(&means);
        let drawn = drawn.map(|((name, numbers), &fitness)| {
            let numbers = numbers.clone();
            Reality { name, numbers, fitness }
        });
        Self {
            ranges: realities.ranges.clone(),
            ranges_of: if realities.are_of_file { "file" } else { "defaults" },
            nominal: mean(&nominal),
            mean: mean(&means),
            worst_tenth: WorstTenth { realities: sorted.len(), mean: mean(&sorted) },
            drop: interval_of_crossed(&rows),
            causes,
            realities: drawn.collect(),
            method: METHOD,
        }
    }

    /// For people: what the realities cost, and what it is due to.
    pub fn to_parts(&self) -> Vec<Part> {
        let digits = |value| text::number(value, 3);
        let mut costs = Table::new([
            Column::text("in pseudo-realities"),
            Column::number("fitness"),
            Column::number("95 %"),
        ]);
        let n = self.realities.len();
        let mut push = |name: String, value: f64, interval: String| {
            costs.push([name, digits(value), interval])
        };
        push("nominal".into(), self.nominal, String::new());
        push(format!("mean of {n} realities"), self.mean, String::new());
        let worst = self.worst_tenth.realities;
        push(format!("worst tenth ({worst})"), self.worst_tenth.mean, String::new());
        push("drop".into(), self.drop.value, span(&self.drop));
        let mut causes = Table::new([
            Column::text("drop due to"),
            Column::text("range"),
            Column::number("drop"),
            Column::number("95 %"),
        ]);
        for Cause { key, drop } in &self.causes {
            let range = spoken(&self.ranges[key]);
            causes.push([(*key).to_owned(), range, digits(drop.value), span(drop)]);
        }
        vec![
            Part::text(""),
            Part::Table(costs),
            Part::text(""),
            Part::Table(causes),
            Part::text(""),
        ]
    }
}

/// A number, or a range.
fn spoken(value: &Json) -> String {
    match value {
        Json::List(ends) => ends.iter().map(json::line).collect::<Vec<_>>().join(" to "),
        number => json::line(number),
    }
}

/// The mean of a value per trial, with its interval by empirical likelihood.
fn of_trials(values: &[f64]) -> Interval {
    let ends = evolution::interval::interval(values);
    Interval { value: mean(values), ci95: ends.map(|(low, high)| [low.get(), high.get()]) }
}

fn span(interval: &Interval) -> String {
    let ends = interval.ci95.map(|ends| ends.map(|end| text::number(end, 3)));
    ends.map_or_else(|| "-".into(), |[low, high]| format!("{low} to {high}"))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::experiment_file::{ExperimentFile, Overrides, tests::shipped};

    fn config(name: &str) -> ExperimentConfig {
        let file = ExperimentFile::read(&shipped(name)).unwrap();
        file.compile(&Overrides::default()).unwrap().config
    }

    #[test]
    fn every_key_of_the_file_has_its_row() {
        let keys = PseudoRealityConfig::TABLE.parameters.iter().map(|parameter| parameter.key);
        let keys: Vec<&str> = keys.filter(|key| *key != "format").collect();
        assert_eq!(keys, KEYS.map(|(key, _)| key));
    }

    #[test]
    fn keys_that_cannot_matter_are_left_out() {
        let keys = |name: &str| -> Vec<&str> {
            Realities::draw(&config(name), 3).unwrap().ranges.into_keys().collect()
        };
        let radio = ["radio_range", "radio_loss", "antenna_heading"];
        assert_eq!(keys("leader_selection_snes"), [&["actuation_delay"], &radio[..]].concat());
        let wheels = ["wheel_gain", "wheel_asymmetry", "slow_robot", "actuation_delay"];
        assert_eq!(keys("orientation_consensus_snes"), [&wheels, &radio[..]].concat());
        assert_eq!(keys("light_follower_snes").len(), 10);
    }

    #[test]
    fn the_seed_determines_the_realities_and_more_of_them_keep_the_first() {
        let mut config = config("light_follower_snes");
        let five = Realities::draw(&config, 5).unwrap();
        assert_eq!(Realities::draw(&config, 3).unwrap().drawn, five.drawn[..3]);
        assert_ne!(five.drawn[0], five.drawn[1]);
        config.seed += 1;
        assert_ne!(Realities::draw(&config, 5).unwrap().drawn, five.drawn);
        for numbers in &five.drawn {
            let number = |key| json::line(&numbers[key]).parse::<f64>().unwrap();
            assert!((0.9..1.1).contains(&number("wheel_gain")));
            assert!([0.0, 1.0, 2.0].contains(&number("actuation_delay")));
        }
    }

    #[test]
    fn drops_are_paired_by_trial_and_causes_are_sorted() {
        let nominal = config("light_follower_snes");
        let realities = Realities::draw(&nominal, 3).unwrap();
        let condition = |name: &str, role| Condition {
            name: name.into(),
            role,
            changes: Vec::new(),
            config: nominal.clone(),
            experiment: sim_core::Simulation::compile(&nominal).unwrap(),
        };
        let trials =
            |fitness: [f64; 4]| Measured::new(&["x"], fitness.map(|f| (f, vec![0.0])).into());
        let conditions = [
            condition("nominal", Role::Other),
            condition("reality 0", Role::Reality),
            condition("reality 1", Role::Reality),
            condition("reality 2", Role::Reality),
            condition("only radio_loss", Role::Key("radio_loss")),
            condition("only radio_range", Role::Key("radio_range")),
        ];
        let measured = [
            trials([1.0, 2.0, 3.0, 4.0]),
            trials([0.5, 1.5, 2.5, 3.5]),
            trials([0.5, 1.5, 2.5, 3.5]),
            trials([-0.5, 0.5, 1.5, 2.5]),
            trials([1.0, 2.0, 3.0, 4.0]),
            trials([0.0, 1.0, 2.0, 3.0]),
        ];
        let found = Robustness::new(&realities, &conditions, &measured);
        assert_eq!((found.nominal, found.worst_tenth.realities), (2.5, 1));
        assert_eq!(found.worst_tenth.mean, 1.0);
        assert!((found.mean - 5.0 / 3.0).abs() < 1e-12);
        assert!((found.drop.value - 2.5 / 3.0).abs() < 1e-12);
        // All trials agree, so only the realities make the interval.
        let [low, high] = found.drop.ci95.unwrap();
        assert!((low - 0.5).abs() < 1e-12 && (high - 1.5).abs() < 1e-12, "{low} {high}");
        let causes: Vec<_> =
            found.causes.iter().map(|cause| (cause.key, cause.drop.value)).collect();
        assert_eq!(causes, [("radio_range", 1.0), ("radio_loss", 0.0)]);
        assert_eq!(found.causes[0].drop.ci95, Some([1.0; 2]));
    }
}
