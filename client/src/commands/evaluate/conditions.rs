//! Conditions: the experiment file, unchanged and with changes.

use experiment_file::{ConfigError, ExperimentConfig, suggestion};
use indexmap::IndexMap;
use sim_core::Simulation;

use super::{EvaluateArgs, realities::Realities};
use crate::{
    change::{Change, Json, apply_all, split},
    error::{Code, Error},
    experiment_file::{ExperimentFile, Overrides},
    json,
};

/// Maximum number of conditions of one evaluation.
const CONDITIONS_MAX: usize = 64;

/// A variant of the experiment file under which a genotype is evaluated.
#[derive(Debug, Clone)]
pub struct Condition {
    /// Name for tables and legends.
    pub name: String,
    pub role: Role,
    /// Changes relative to the nominal condition; those of the nominal condition are
    /// relative to the experiment file.
    pub changes: Vec<Change>,
    /// The experiment file, changed.
    pub config: ExperimentConfig,
    pub experiment: Simulation,
}

/// What a condition is there for.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Role {
    /// Itself.
    Other,
    /// One of the pseudo-realities.
    Reality,
    /// A range of this key of `pseudo_reality`, alone.
    Key(&'static str),
}

impl Condition {
    /// Checks that the genotype has the length and range that the experiment demands.
    pub fn check(&self, genotype: &[f64]) -> Result<(), Error> {
        let checked = self.experiment.check_genotype(genotype);
        let misfit = |error| {
            Error::at(
                Code::BadGenotype,
                "--genotype",
                format!("the genotype does not fit: {error}"),
            )
        };
        checked.map_err(|error| self.locate(misfit(error)))
    }

    /// Adds the name of this condition to an error about it.
    pub fn locate(&self, error: Error) -> Error {
        match error {
            Error::Input(problem) => {
                let message = format!("condition {}: {problem}", self.name);
                Error::at(Code::BadArgument, &self.name, message)
            }
            Error::At { code, place, message } => {
                Error::At { code, place, message: format!("condition {}: {message}", self.name) }
            }
            error => error,
        }
    }

    /// Number of evaluated robots.
    pub fn n_robots(&self) -> u32 {
        let evolvable = &self.config.algorithm.evolvable_object;
        let mut robots = self.config.robots().filter(|(name, _)| name == evolvable);
        robots.next().map_or(0, |(_, robot)| robot.num_instances)
    }
}

/// All conditions that the arguments request, the nominal one first, and the pseudo-realities.
pub fn all(
    file: &ExperimentFile,
    args: &EvaluateArgs,
) -> Result<(Vec<Condition>, Option<Realities>), Error> {
    let overrides = Overrides { steps: args.steps.steps, ..Overrides::default() };
    let compiled = file.compile(&overrides).map_err(|error| file.invalid(&error))?;
    let mut base = to_json(&compiled.config);
    let mut base_changes = Vec::new();
    for text in &args.base {
        base_changes.extend(parsed("--base", text)?);
    }
    apply_all(&base_changes, &mut base)
        .map_err(|problems| Error::option("--base", problems.join("; ")))?;
    let of_base = |problem| Error::option("--base", problem);
    let mut config = read(&base).map_err(of_base)?;
    let realities = args.pseudo_realities.map(|n| Realities::draw(&config, n)).transpose()?;
    if realities.is_some() {
        let robots = config.algorithm.evolvable_object.clone();
        let path = ["world", "objects", &robots, "perturbations"];
        if base.get_mut(path).is_some_and(|perturbations| perturbations.remove("pseudo_reality")) {
            let path = format!("{}.pseudo_reality", path.join("."));
            base_changes.push(Change::new(path, Json::Scalar(serde_json::Value::Null)));
            config = read(&base).map_err(of_base)?;
        }
    }
    let nominal = Nominal { config, base };
    let unchanged = nominal.condition("nominal".into(), Vec::new())?;
    let mut conditions = vec![Condition { changes: base_changes, ..unchanged }];
    for &n in &args.robots {
        conditions.push(nominal.condition(format!("robots={n}"), nominal.robots(n))?);
    }
    for text in &args.perturb {
        conditions.push(nominal.condition(text.clone(), nominal.perturbation(text)?)?);
    }
    for name in &args.inhibit {
        let changes = nominal.inhibition(name)?;
        conditions.push(nominal.condition(format!("inhibit={name}"), changes)?);
    }
    for text in &args.set.set {
        conditions.extend(nominal.conditions(text)?);
    }
    for (name, role, reality) in realities.iter().flat_map(Realities::conditions) {
        let change = Change::new(nominal.place("perturbations.pseudo_reality"), reality);
        conditions.push(Condition { role, ..nominal.condition(name, vec![change])? });
    }
    if conditions.len() > CONDITIONS_MAX {
        let n = conditions.len();
        let problem = format!("at most {CONDITIONS_MAX} conditions at once; these are {n}");
        return Err(Error::at(Code::BadArgument, "--set", problem));
    }
    for (index, condition) in conditions.iter().enumerate() {
        if conditions[..index].iter().any(|other| other.name == condition.name) {
            let (name, code) = (&condition.name, Code::BadArgument);
            return Err(Error::at(code, name, format!("condition {name} is given twice")));
        }
    }
    Ok((conditions, realities))
}

/// The nominal condition, from which the others are made.
struct Nominal {
    config: ExperimentConfig,
    base: Json,
}

impl Nominal {
    fn condition(&self, name: String, changes: Vec<Change>) -> Result<Condition, Error> {
        let input = |problem: String| {
            Error::at(Code::BadArgument, &name, format!("condition {name}: {problem}"))
        };
        let mut file = self.base.clone();
        apply_all(&changes, &mut file).map_err(|problems| input(problems.join("; ")))?;
        let config = read(&file).map_err(input)?;
        let experiment = Simulation::compile(&config).map_err(|error| input(problems(&error)))?;
        Ok(Condition { name, role: Role::Other, changes, config, experiment })
    }

    /// The conditions of one `--set`: one for each combination of its values.
    fn conditions(&self, text: &str) -> Result<Vec<Condition>, Error> {
        let combinations =
            Change::parse_combinations(text).map_err(|problem| Error::option("--set", problem))?;
        if combinations.len() > CONDITIONS_MAX {
            let problem = format!("at most {CONDITIONS_MAX} conditions at once");
            return Err(Error::at(Code::BadArgument, "--set", problem));
        }
        let is_one = combinations.len() == 1;
        let condition = |changes: Vec<Change>| {
            let names: Vec<String> = changes.iter().map(Change::to_string).collect();
            let name = if is_one { text.to_owned() } else { names.join("; ") };
            self.condition(name, changes)
        };
        combinations.into_iter().map(condition).collect()
    }

    fn evolvable(&self) -> &str {
        &self.config.algorithm.evolvable_object
    }

    fn place(&self, key: &str) -> String {
        format!("world.objects.{}.{key}", self.evolvable())
    }

    /// The value of a key of the robots' object.
    fn robots_have(&self, key: &str) -> Option<&Json> {
        self.base.get(["world", "objects", self.evolvable(), key])
    }

    fn perturbations(&self) -> Option<&IndexMap<String, Json>> {
        self.robots_have("perturbations")?.object()
    }

    /// Another size of the swarm, with the same share of affected robots.
    fn robots(&self, n: u32) -> Vec<Change> {
        let was = self.robots_have("num_instances").and_then(Json::number).unwrap_or(1).max(1);
        let mut changes = vec![Change::new(self.place("num_instances"), u64::from(n).into())];
        let scaled = |key: String, perturbation: &Json| {
            let affected = perturbation.get(["affected_robots"])?.number()?;
            // Rounded to the nearest.
            let affected = (2 * affected * u64::from(n) + was) / (2 * was);
            let path = self.place(&format!("perturbations.{key}.affected_robots"));
            Some(Change::new(path, affected.into()))
        };
        for (key, value) in self.perturbations().into_iter().flatten() {
            match value {
                Json::List(list) => {
                    let each = list.iter().enumerate();
                    changes.extend(each.filter_map(|(i, item)| scaled(format!("{key}.{i}"), item)));
                }
                one => changes.extend(scaled(key.clone(), one)),
            }
        }
        changes
    }

    /// `NAME`, `NAME:KEY=VALUE,...` or `NAME:{...}`.
    fn perturbation(&self, text: &str) -> Result<Vec<Change>, Error> {
        let (name, params) = text.split_once(':').unwrap_or((text, ""));
        let params = match Json::parse(params) {
            Json::Object(params) => params,
            _ => parameters(params)
                .map_err(|problem| Error::option("--perturb", format!("{text}: {problem}")))?,
        };
        let path = self.place(&format!("perturbations.{name}"));
        Ok(vec![Change::new(path, Json::Object(params))])
    }

    /// Inhibits a stimulus in all robots, in addition to earlier inhibitions.
    fn inhibition(&self, name: &str) -> Result<Vec<Change>, Error> {
        let stimuli = self.base.get(["topology", "stimuli"]).and_then(Json::object);
        let sensors: Vec<(&str, &str)> = stimuli
            .into_iter()
            .flatten()
            .filter_map(|(name, stimulus)| Some((name.as_str(), stimulus.get(["sensor"])?.text()?)))
            .collect();
        let short = |sensor: &str| sensor.rsplit(':').next().is_some_and(|last| last == name);
        let sensor = sensors
            .iter()
            .find(|(stimulus, sensor)| *stimulus == name || *sensor == name || short(sensor))
            .map(|&(_, sensor)| sensor)
            .ok_or_else(|| {
                let known = sensors.iter().flat_map(|(stimulus, sensor)| [*stimulus, *sensor]);
                let short = sensors.iter().filter_map(|(_, sensor)| sensor.split(':').nth(1));
                let known: Vec<&str> = known.chain(short).collect();
                let suggestion = suggestion(name, &known);
                let what = format!("{name}: no stimulus has this name; {suggestion}");
                Error::option("--inhibit", what)
            })?;
        let parameters = [("stimuli", sensor), ("affected_robots", "all")];
        let parameters =
            parameters.map(|(key, value)| (key.to_owned(), Json::Scalar(value.into())));
        let inhibition = Json::Object(parameters.into());
        let path = self.place("perturbations.stimuli_inhibition");
        let before = self.perturbations().and_then(|all| all.get("stimuli_inhibition"));
        let value = match before {
            None => inhibition,
            Some(Json::List(list)) => {
                Json::List(list.iter().cloned().chain([inhibition]).collect())
            }
            Some(one) => Json::List(vec![one.clone(), inhibition]),
        };
        Ok(vec![Change::new(path, value)])
    }
}

fn parsed(option: &str, text: &str) -> Result<Vec<Change>, Error> {
    Change::parse_all(text).map_err(|problem| Error::option(option, problem))
}

/// Reads `KEY=VALUE,...`; commas within a value do not separate.
fn parameters(text: &str) -> Result<IndexMap<String, Json>, String> {
    let parts = split(text, ',').into_iter().filter(|part| !part.trim().is_empty());
    let parameter = |part: &str| {
        let (key, value) =
            part.split_once('=').ok_or_else(|| format!("`{part}`: expected KEY=VALUE"))?;
        Ok((key.trim().to_owned(), Json::parse(value.trim())))
    };
    parts.map(parameter).collect()
}

fn to_json(config: &ExperimentConfig) -> Json {
    Json::parse(&config.to_canonical_json())
}

fn read(file: &Json) -> Result<ExperimentConfig, String> {
    match ExperimentConfig::from_json(&json::line(file), "", evolution::ALGORITHMS) {
        Ok((config, _)) => Ok(config),
        Err(error) => Err(problems(&error)),
    }
}

/// The problems without line numbers, which would not match the user's file.
fn problems(error: &ConfigError) -> String {
    let mut error = error.clone();
    error.problems.iter_mut().for_each(|problem| problem.line = None);
    error.to_string()
}
