//! A robot: its controller, where it starts, and what goes wrong.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize, Serializer};

use super::{ActuatorsConfig, Initializer, SensorQuery, SensorsConfig, limits, schema};

/// A swarm of equal robots.
#[derive(Debug, Clone, PartialEq, Serialize, JsonSchema)]
#[schemars(
    deny_unknown_fields,
    transform = schema::optional("sensors, actuators, perturbations, params"),
    transform = schema::ignored("positions, orientations")
)]
pub struct RobotConfig {
    /// Number of robots.
    #[schemars(range(min = 1, max = limits::ROBOTS))]
    pub num_instances: u32,
    /// What decides their actions.
    pub controller: RobotController,
    /// What they perceive.
    pub sensors: SensorsConfig,
    /// What they can do.
    pub actuators: ActuatorsConfig,
    /// Where they start.
    pub initializers: RobotInitializers,
    /// What goes wrong.
    pub perturbations: PerturbationsConfig,
    /// Switches.
    pub params: RobotParams,
}

/// Controllers of robots.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
#[schemars(transform = schema::also("Braitenberg2"))]
pub enum RobotController {
    /// The network of `topology`.
    NeuralController,
    /// Braitenberg vehicle 2b: light-sensor halves to crossed wheels.
    #[serde(alias = "Braitenberg2")]
    BraitenbergLightFollower,
    /// The function `control` of the script of `task`.
    ScriptController,
}

/// Switches of a robot.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, JsonSchema)]
#[schemars(default, deny_unknown_fields)]
pub struct RobotParams {
    /// Whether its controller may evolve; default true.
    pub trainable: bool,
}

impl Default for RobotParams {
    fn default() -> Self {
        Self { trainable: true }
    }
}

/// Start of a robot.
#[derive(Debug, Clone, PartialEq, Serialize, JsonSchema)]
#[schemars(deny_unknown_fields, transform = schema::optional("orientations"))]
pub struct RobotInitializers {
    /// Positions.
    pub positions: Initializer,
    /// Headings.
    pub orientations: Initializer,
}

/// Perturbations of a swarm; absent ones do not happen.
#[derive(Debug, Clone, Default, PartialEq, Serialize, JsonSchema)]
#[schemars(default, deny_unknown_fields)]
pub struct PerturbationsConfig {
    /// Fault of a long-standing leader.
    #[serde(skip_serializing_if = "Option::is_none")]
    #[schemars(with = "LeaderFailureConfig")]
    pub leader_failure: Option<LeaderFailureConfig>,
    /// Zeroed stimuli; the robots of each are drawn by themselves. One alone is
    /// written without a list around it.
    #[serde(skip_serializing_if = "Vec::is_empty", serialize_with = "one_or_list")]
    #[schemars(schema_with = "schema::one_or_list::<StimuliInhibitionConfig>")]
    pub stimuli_inhibition: Vec<StimuliInhibitionConfig>,
    /// Redrawn positions.
    #[serde(skip_serializing_if = "Option::is_none")]
    #[schemars(with = "TopologySwitchConfig")]
    pub topology_switch: Option<TopologySwitchConfig>,
    /// Robots that turn by themselves.
    #[serde(skip_serializing_if = "Option::is_none")]
    #[schemars(with = "UncontrollableRotationConfig")]
    pub uncontrollable_rotation: Option<UncontrollableRotationConfig>,
}

fn one_or_list<S: Serializer>(
    inhibitions: &[StimuliInhibitionConfig],
    serializer: S,
) -> Result<S::Ok, S::Error> {
    match inhibitions {
        [one] => one.serialize(serializer),
        list => list.serialize(serializer),
    }
}

/// A robot that has been sole leader too long becomes faulty.
#[derive(Debug, Clone, PartialEq, Serialize, JsonSchema)]
#[schemars(default, deny_unknown_fields, transform = schema::ignored("affected_robots"))]
pub struct LeaderFailureConfig {
    /// Consecutive steps of sole leadership; default 50.
    #[schemars(range(min = 1, max = limits::STEPS))]
    pub time_to_failure: u32,
}

impl Default for LeaderFailureConfig {
    fn default() -> Self {
        Self { time_to_failure: 50 }
    }
}

/// Some robots, drawn anew each trial, lose a stimulus.
#[derive(Debug, Clone, PartialEq, Serialize, JsonSchema)]
#[schemars(deny_unknown_fields, transform = schema::optional("stimuli, affected_robots"))]
pub struct StimuliInhibitionConfig {
    /// Which reading becomes zero.
    pub stimuli: InhibitedStimulus,
    /// How many robots.
    #[schemars(schema_with = "schema::affected_robots")]
    pub affected_robots: u32,
}

/// What `stimuli_inhibition` zeroes.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, JsonSchema)]
#[serde(untagged)]
pub enum InhibitedStimulus {
    /// One reading.
    Reading(SensorQuery),
    /// Every reading of the receiver.
    Receiver(WholeReceiver),
}

/// Serialises as `"wireless_receiver"`.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
pub enum WholeReceiver {
    /// All of the receiver's readings.
    #[serde(rename = "wireless_receiver")]
    WirelessReceiver,
}

/// Positions are redrawn while neural state is kept.
#[derive(Debug, Clone, PartialEq, Serialize, JsonSchema)]
#[schemars(default, deny_unknown_fields)]
pub struct TopologySwitchConfig {
    /// Period, steps; default 200.
    #[schemars(range(min = 1, max = limits::STEPS))]
    pub every: u32,
}

impl Default for TopologySwitchConfig {
    fn default() -> Self {
        Self { every: 200 }
    }
}

/// Some robots turn to a target heading and hold it.
#[derive(Debug, Clone, PartialEq, Serialize, JsonSchema)]
#[schemars(
    deny_unknown_fields,
    transform = schema::optional("affected_robots, start, targets, switch_at, speed")
)]
pub struct UncontrollableRotationConfig {
    /// How many robots, drawn anew each trial.
    #[schemars(schema_with = "schema::affected_robots")]
    pub affected_robots: u32,
    /// First affected step; default 200.
    pub start: u32,
    /// Target headings, radians, in order; default: 270, 90, 15 and 180 degrees.
    #[schemars(length(min = 1, max = limits::TARGETS))]
    pub targets: Vec<f64>,
    /// Step at which the next target applies; default 600.
    #[schemars(range(min = 1, max = limits::STEPS))]
    pub switch_at: u32,
    /// Action of the right wheel while they turn, that of the left being its negative;
    /// default 0.1: half a turn takes 50 steps with the default wheels.
    #[schemars(range(min = 0, max = 1))]
    pub speed: f64,
}
