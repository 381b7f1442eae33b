//! `world`: the arena and what is in it.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};
use serde_json::json;

use super::{ActuatorQuery, NamedMap, SensorQuery, limits, schema};

/// Of [`WorldConfig::height`] and [`WorldConfig::width`].
pub(super) const DEFAULT_WORLD_SIZE: f64 = 1000.0;

/// A flat torus and its objects.
#[derive(Debug, Clone, PartialEq, Serialize, JsonSchema)]
#[schemars(
    deny_unknown_fields,
    transform = schema::optional("height, width"),
    transform = schema::ignored("world_delay, render_connections")
)]
pub struct WorldConfig {
    /// Height H (y axis), cm; default 1000.
    #[schemars(range(min = 1), extend("default" = DEFAULT_WORLD_SIZE))]
    pub height: f64,
    /// Width W (x axis), cm; default 1000.
    #[schemars(range(min = 1), extend("default" = DEFAULT_WORLD_SIZE))]
    pub width: f64,
    /// Robots, lights, ground areas; their order numbers the robots.
    #[schemars(extend("minProperties" = 1, "maxProperties" = limits::ENTRIES))]
    pub objects: NamedMap<ObjectConfig>,
}

/// One kind of object.
#[derive(Debug, Clone, PartialEq, Serialize, JsonSchema)]
#[serde(tag = "type", rename_all = "snake_case")]
#[expect(clippy::large_enum_variant, reason = "a world has a handful of them")]
pub enum ObjectConfig {
    /// A swarm of equal robots.
    Robot(RobotConfig),
    /// Point lights.
    LightSource(LightSourceConfig),
    /// Coloured discs on the ground.
    GroundArea(GroundAreaConfig),
}

impl ObjectConfig {
    /// How many of them there are.
    pub fn num_instances(&self) -> u32 {
        match self {
            Self::Robot(robot) => robot.num_instances,
            Self::LightSource(light) => light.num_instances,
            Self::GroundArea(area) => area.num_instances,
        }
    }
}

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

/// Sensors; absent ones are not mounted.
#[derive(Debug, Clone, Default, PartialEq, Serialize, JsonSchema)]
#[schemars(default, deny_unknown_fields)]
pub struct SensorsConfig {
    /// Frames of other robots.
    #[serde(skip_serializing_if = "Option::is_none")]
    #[schemars(with = "WirelessReceiverConfig")]
    pub wireless_receiver: Option<WirelessReceiverConfig>,
    /// Lights.
    #[serde(skip_serializing_if = "Option::is_none")]
    #[schemars(with = "LightSensorConfig")]
    pub light_sensor: Option<LightSensorConfig>,
    /// Other robots.
    #[serde(skip_serializing_if = "Option::is_none")]
    #[schemars(with = "DistanceSensorConfig")]
    pub distance_sensor: Option<DistanceSensorConfig>,
    /// Ground areas.
    #[serde(skip_serializing_if = "Option::is_none")]
    #[schemars(with = "GroundSensorConfig")]
    pub ground_sensor: Option<GroundSensorConfig>,
}

impl SensorsConfig {
    /// Number of values of a reading; none if its sensor is not mounted.
    pub fn reading_len(&self, reading: SensorQuery) -> Option<u32> {
        let receiver = self.wireless_receiver.as_ref();
        match reading {
            SensorQuery::ReceiverMessage => receiver.map(|receiver| receiver.msg_length),
            SensorQuery::ReceiverSignal | SensorQuery::ReceiverState => receiver.map(|_| 1),
            SensorQuery::ReceiverReceivingDirection | SensorQuery::ReceiverSendingDirection => {
                receiver.map(|_| 2)
            }
            SensorQuery::Light => self.light_sensor.as_ref().map(|sensor| sensor.n_sectors),
            SensorQuery::Distance => self.distance_sensor.as_ref().map(|sensor| sensor.n_sectors),
            SensorQuery::Ground => self.ground_sensor.as_ref().map(|_| 1),
        }
    }
}

/// Receiver of the wireless link (section 3.3).
#[derive(Debug, Clone, PartialEq, Serialize, JsonSchema)]
#[schemars(default, deny_unknown_fields, transform = schema::ignored("noise_sigma"))]
pub struct WirelessReceiverConfig {
    /// Sectors; default 4.
    #[schemars(range(min = 1, max = limits::SECTORS))]
    pub n_sectors: u32,
    /// Reach, cm; default 100.
    #[schemars(extend("exclusiveMinimum" = 0))]
    pub range: f64,
    /// Components of a message, M; default 2.
    #[schemars(range(min = 1, max = limits::MESSAGE_LENGTH))]
    pub msg_length: u32,
    /// A frame of this many hops is not accepted any more; default 10.
    #[schemars(range(min = 1, max = limits::HOPS))]
    pub max_hops: u32,
    /// Decay of the strength per cm; default 0.05.
    #[schemars(range(min = 0))]
    pub decay_rho: f64,
    /// Decay of the strength per radian; default 1.
    #[schemars(range(min = 0))]
    pub decay_phi: f64,
}

impl Default for WirelessReceiverConfig {
    fn default() -> Self {
        Self {
            n_sectors: 4,
            range: 100.0,
            msg_length: 2,
            max_hops: 10,
            decay_rho: 0.05,
            decay_phi: 1.0,
        }
    }
}

/// Light sensor.
#[derive(Debug, Clone, PartialEq, Serialize, JsonSchema)]
#[schemars(
    default,
    deny_unknown_fields,
    transform = schema::property("noise_sigma", schema::amount("Its square is `noise_variance`."))
)]
pub struct LightSensorConfig {
    /// Sectors; default 6.
    #[schemars(range(min = 1, max = limits::SECTORS))]
    pub n_sectors: u32,
    /// Reach, cm; default 80. The light's own range bounds it too.
    #[schemars(extend("exclusiveMinimum" = 0))]
    pub range: f64,
    /// Colour it sees; default "red".
    pub color: String,
    /// Decay per cm; default 0.05.
    #[schemars(range(min = 0))]
    pub decay_rho: f64,
    /// Decay per radian; default 1.
    #[schemars(range(min = 0))]
    pub decay_phi: f64,
    /// Variance of the Gaussian noise; default 0.1.
    #[schemars(range(min = 0))]
    pub noise_variance: f64,
}

impl Default for LightSensorConfig {
    fn default() -> Self {
        Self {
            n_sectors: 6,
            range: 80.0,
            color: "red".to_owned(),
            decay_rho: 0.05,
            decay_phi: 1.0,
            noise_variance: 0.1,
        }
    }
}

/// Distance sensor.
#[derive(Debug, Clone, PartialEq, Serialize, JsonSchema)]
#[schemars(
    default,
    deny_unknown_fields,
    transform = schema::property("noise_sigma", schema::amount("Its square is `noise_variance`."))
)]
pub struct DistanceSensorConfig {
    /// Sectors; default 4.
    #[schemars(range(min = 1, max = limits::SECTORS))]
    pub n_sectors: u32,
    /// Reach, cm; default 60.
    #[schemars(extend("exclusiveMinimum" = 0))]
    pub range: f64,
    /// Decay per cm; default 0.05.
    #[schemars(range(min = 0))]
    pub decay_rho: f64,
    /// Decay per radian; default 1.
    #[schemars(range(min = 0))]
    pub decay_phi: f64,
    /// Variance of the Gaussian noise; default 0.1.
    #[schemars(range(min = 0))]
    pub noise_variance: f64,
}

impl Default for DistanceSensorConfig {
    fn default() -> Self {
        Self { n_sectors: 4, range: 60.0, decay_rho: 0.05, decay_phi: 1.0, noise_variance: 0.1 }
    }
}

/// Ground sensor.
#[derive(Debug, Clone, PartialEq, Serialize, JsonSchema)]
#[schemars(default, deny_unknown_fields)]
pub struct GroundSensorConfig {
    /// Colour it sees; default "black".
    pub color: String,
}

impl Default for GroundSensorConfig {
    fn default() -> Self {
        Self { color: "black".to_owned() }
    }
}

/// Actuators; absent ones are not mounted.
#[derive(Debug, Clone, Default, PartialEq, Serialize, JsonSchema)]
#[schemars(default, deny_unknown_fields)]
pub struct ActuatorsConfig {
    /// Differential drive.
    #[serde(skip_serializing_if = "Option::is_none")]
    #[schemars(with = "WheelActuatorConfig")]
    pub wheel_actuator: Option<WheelActuatorConfig>,
    /// LED.
    #[serde(skip_serializing_if = "Option::is_none")]
    #[schemars(with = "LedActuatorConfig")]
    pub led_actuator: Option<LedActuatorConfig>,
    /// Emitter of the wireless link.
    #[serde(skip_serializing_if = "Option::is_none")]
    #[schemars(with = "WirelessTransmitterConfig")]
    pub wireless_transmitter: Option<WirelessTransmitterConfig>,
}

impl ActuatorsConfig {
    /// Whether the actuator is mounted.
    pub fn has(&self, actuator: ActuatorQuery) -> bool {
        match actuator {
            ActuatorQuery::Wheels => self.wheel_actuator.is_some(),
            ActuatorQuery::Led => self.led_actuator.is_some(),
            ActuatorQuery::Message | ActuatorQuery::Mode => self.wireless_transmitter.is_some(),
        }
    }
}

/// Differential drive (section 3.2.1).
#[derive(Debug, Clone, PartialEq, Serialize, JsonSchema)]
#[schemars(
    default,
    deny_unknown_fields,
    transform = schema::property("dt", schema::amount("A fifth of it is `step_duration`.")),
    transform = schema::property("min_thresh", json!({"const": 0}))
)]
pub struct WheelActuatorConfig {
    /// Wheel speed at action 1, cm/s; default 10.
    #[schemars(extend("exclusiveMinimum" = 0))]
    pub max_speed: f64,
    /// Distance between the wheels L_w, cm; default 11.
    #[schemars(extend("exclusiveMinimum" = 0))]
    pub axle_length: f64,
    /// Duration of an environment step dk, s; default 0.33.
    #[schemars(extend("exclusiveMinimum" = 0))]
    pub step_duration: f64,
}

impl Default for WheelActuatorConfig {
    fn default() -> Self {
        Self { max_speed: 10.0, axle_length: 11.0, step_duration: 0.33 }
    }
}

/// LED.
#[derive(Debug, Clone, PartialEq, Serialize, JsonSchema)]
#[schemars(deny_unknown_fields)]
pub struct LedActuatorConfig {}

/// Emitter of the wireless link (section 3.3).
#[derive(Debug, Clone, PartialEq, Serialize, JsonSchema)]
#[schemars(default, deny_unknown_fields)]
pub struct WirelessTransmitterConfig {
    /// Reach, cm; default 100. A frame is heard within the smaller of the
    /// emitter's and the receiver's reach.
    #[schemars(extend("exclusiveMinimum" = 0))]
    pub range: f64,
    /// Components of a message, M; default 2. Equals the receiver's.
    #[schemars(range(min = 1, max = limits::MESSAGE_LENGTH))]
    pub msg_length: u32,
    /// Whether messages are quantised; default true.
    pub quantize: bool,
    /// Number of lattice points K^M of the quantiser, M*; default 16.
    #[schemars(range(min = 2, max = limits::LATTICE_POINTS))]
    pub n_symbols: u32,
    /// Inverse temperature of the quantiser; default 100.
    #[schemars(range(min = 0))]
    pub beta: f64,
}

impl Default for WirelessTransmitterConfig {
    fn default() -> Self {
        Self { range: 100.0, msg_length: 2, quantize: true, n_symbols: 16, beta: 100.0 }
    }
}

impl WirelessTransmitterConfig {
    /// Levels per component of the quantiser, K = round(M*^(1/M)), Eq. 3.13.
    pub fn n_levels(&self) -> u32 {
        libm::round(libm::pow(self.n_symbols.into(), f64::from(self.msg_length).recip())) as u32
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

/// Draws start values (section 5 of the simulation's specification).
#[derive(Debug, Clone, PartialEq, Serialize, JsonSchema)]
#[serde(tag = "name", content = "params", rename_all = "snake_case")]
#[schemars(deny_unknown_fields)]
pub enum Initializer {
    /// Given values, one per object; a single one serves all.
    Fixed {
        /// Positions `[x, y]`, or headings `[theta]`.
        values: Vec<Vec<f64>>,
    },
    /// Independent uniform components.
    #[schemars(transform = schema::optional("low, high, size"))]
    RandomUniform {
        /// Lower bound, inclusive.
        low: f64,
        /// Upper bound, exclusive.
        high: f64,
        /// Components: 2 for positions, 1 for headings.
        size: u32,
    },
    /// Uniform on a circle.
    #[schemars(transform = schema::optional("radius, center"))]
    RandomCircumference {
        /// Radius, cm.
        radius: f64,
        /// Centre, cm.
        center: [f64; 2],
    },
    /// A connected, compact random geometric graph.
    #[schemars(transform = schema::optional("max_rad, initial_pos"))]
    RandomGraph {
        /// Distance from the centre at which steps turn tangential, cm.
        max_rad: f64,
        /// First robot, and centre, cm.
        initial_pos: [f64; 2],
    },
}

/// Perturbations of a swarm; absent ones do not happen.
#[derive(Debug, Clone, Default, PartialEq, Serialize, JsonSchema)]
#[schemars(default, deny_unknown_fields)]
pub struct PerturbationsConfig {
    /// Fault of a long-standing leader.
    #[serde(skip_serializing_if = "Option::is_none")]
    #[schemars(with = "LeaderFailureConfig")]
    pub leader_failure: Option<LeaderFailureConfig>,
    /// Zeroed stimuli.
    #[serde(skip_serializing_if = "Option::is_none")]
    #[schemars(with = "StimuliInhibitionConfig")]
    pub stimuli_inhibition: Option<StimuliInhibitionConfig>,
    /// Redrawn positions.
    #[serde(skip_serializing_if = "Option::is_none")]
    #[schemars(with = "TopologySwitchConfig")]
    pub topology_switch: Option<TopologySwitchConfig>,
    /// Robots that turn by themselves.
    #[serde(skip_serializing_if = "Option::is_none")]
    #[schemars(with = "UncontrollableRotationConfig")]
    pub uncontrollable_rotation: Option<UncontrollableRotationConfig>,
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
    transform = schema::optional("affected_robots, start, targets, switch_at")
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
}

/// Point lights.
#[derive(Debug, Clone, PartialEq, Serialize, JsonSchema)]
#[schemars(
    deny_unknown_fields,
    transform = schema::optional("controller, params"),
    transform = schema::ignored("positions, orientations")
)]
pub struct LightSourceConfig {
    /// Number of lights.
    #[schemars(range(min = 1, max = limits::FIXTURES))]
    pub num_instances: u32,
    /// How they move.
    pub controller: LightController,
    /// Where they start.
    pub initializers: PositionInitializers,
    /// Physical properties.
    pub params: LightParams,
}

/// How a light moves.
#[derive(Debug, Clone, PartialEq, Serialize, JsonSchema)]
#[serde(tag = "name", content = "params", rename_all = "snake_case")]
#[schemars(deny_unknown_fields, transform = schema::or_name_or_null)]
pub enum LightController {
    /// Stands still.
    #[schemars(transform = schema::optional(""))]
    Static {},
    /// Circles the centre of the world (Eq. 5.7-5.8).
    #[schemars(transform = schema::optional(""))]
    LightOrbitController {},
    /// Drifts to random targets (Eq. 6.4).
    #[schemars(transform = schema::optional("every, step"))]
    LightRndPosController {
        /// Period at which the target is redrawn, steps; default 50.
        every: u32,
        /// alpha: share of the way to the target covered per step; default 0.03.
        step: f64,
    },
}

/// Start of a light or ground area.
#[derive(Debug, Clone, PartialEq, Serialize, JsonSchema)]
#[schemars(deny_unknown_fields, transform = schema::ignored("orientations"))]
pub struct PositionInitializers {
    /// Positions.
    pub positions: Initializer,
}

/// Physical properties of a light.
#[derive(Debug, Clone, PartialEq, Serialize, JsonSchema)]
#[schemars(default, deny_unknown_fields, transform = schema::ignored("static"))]
pub struct LightParams {
    /// Reach, cm; default 80.
    #[schemars(extend("exclusiveMinimum" = 0))]
    pub range: f64,
    /// Colour; default "red".
    pub color: String,
}

impl Default for LightParams {
    fn default() -> Self {
        Self { range: 80.0, color: "red".to_owned() }
    }
}

/// Coloured discs on the ground.
#[derive(Debug, Clone, PartialEq, Serialize, JsonSchema)]
#[schemars(
    deny_unknown_fields,
    transform = schema::optional("params"),
    transform = schema::property("controller", json!({"type": "null"})),
    transform = schema::ignored("positions, orientations")
)]
pub struct GroundAreaConfig {
    /// Number of discs.
    #[schemars(range(min = 1, max = limits::FIXTURES))]
    pub num_instances: u32,
    /// Where they are.
    pub initializers: PositionInitializers,
    /// Physical properties.
    pub params: GroundAreaParams,
}

/// Physical properties of a ground area.
#[derive(Debug, Clone, PartialEq, Serialize, JsonSchema)]
#[schemars(default, deny_unknown_fields)]
pub struct GroundAreaParams {
    /// Radius, cm; default 100.
    #[schemars(extend("exclusiveMinimum" = 0))]
    pub range: f64,
    /// Colour; default "black".
    pub color: String,
}

impl Default for GroundAreaParams {
    fn default() -> Self {
        Self { range: 100.0, color: "black".to_owned() }
    }
}
