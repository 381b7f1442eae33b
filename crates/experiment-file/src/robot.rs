//! A robot: its controller, its start, and its perturbations.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use super::{
    ActuatorsConfig, BodyConfig, Initializer, PseudoRealityConfig, SensorQuery, SensorsConfig,
    limits, platform, schema,
};
use crate::DefaultValue::{Depends, Name, Null, Number, Numbers, Whole};
use crate::parameters::{Variants, parameters};
use crate::{Domain, ParameterValue};

/// A swarm of equal robots.
#[derive(Debug, Clone, PartialEq, Serialize, JsonSchema)]
#[schemars(
    deny_unknown_fields,
    transform = schema::optional("sensors, actuators, body, perturbations, params"),
    transform = schema::property("platform", platform::schema()),
    transform = schema::ignored("positions, orientations")
)]
pub struct RobotConfig {
    /// Number of robots.
    #[schemars(range(min = 1, max = limits::ROBOTS))]
    pub num_instances: u32,
    /// The controller, which decides their actions.
    pub controller: RobotController,
    /// What they perceive.
    pub sensors: SensorsConfig,
    /// What they can do.
    pub actuators: ActuatorsConfig,
    /// Their bodies, in a world with `bodies`.
    #[serde(skip_serializing_if = "Option::is_none")]
    #[schemars(with = "BodyConfig")]
    pub body: Option<BodyConfig>,
    /// Where they start.
    pub initializers: RobotInitializers,
    /// Faults and disturbances.
    pub perturbations: PerturbationsConfig,
    /// Whether they may evolve.
    pub params: RobotParams,
}

/// Controllers of robots.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
#[schemars(transform = schema::also("Braitenberg2", "braitenberg_light_follower"))]
pub enum RobotController {
    /// The network of `topology`.
    NeuralController,
    /// Braitenberg vehicle 2b: light-sensor halves to crossed wheels.
    #[serde(alias = "Braitenberg2")]
    BraitenbergLightFollower,
    /// The function `control` of the script of `task`.
    ScriptController,
}

parameters! {
    /// Switches of a robot.
    #[derive(Copy)]
    pub struct RobotParams: Default {
        /// Whether its controller may evolve.
        trainable: bool = switch(true),
    }
}

/// Start of robots.
#[derive(Debug, Clone, PartialEq, Serialize, JsonSchema)]
#[schemars(deny_unknown_fields, transform = schema::optional("orientations"))]
pub struct RobotInitializers {
    /// Start positions.
    pub positions: Initializer,
    /// Headings; default `random_uniform` over a full turn.
    pub orientations: Initializer,
}

parameters! {
    /// Perturbations of a swarm; absent ones do not happen.
    pub struct PerturbationsConfig: Default {
        /// Fault of a long-standing leader.
        leader_failure: Option<LeaderFailureConfig> = optional(LeaderFailureConfig::OBJECT),
        /// Stimuli that become zero. Each has its own draw of robots. A single stimulus needs no
        /// list.
        stimuli_inhibition: Vec<StimuliInhibitionConfig> =
            of(Domain::Objects(StimuliInhibitionConfig::OBJECT, limits::INHIBITIONS), Null),
        /// Redrawn positions.
        topology_switch: Option<TopologySwitchConfig> = optional(TopologySwitchConfig::OBJECT),
        /// Robots that turn, whatever their controller decides.
        uncontrollable_rotation: Option<UncontrollableRotationConfig> =
            optional(UncontrollableRotationConfig::OBJECT),
        /// A world unlike the one of the design.
        pseudo_reality: Option<PseudoRealityConfig> = optional(PseudoRealityConfig::OBJECT),
    }

    /// A robot that has been sole leader too long becomes faulty.
    pub struct LeaderFailureConfig: Default {
        /// Consecutive steps of sole leadership.
        time_to_failure: u32 = whole(STEPS, 50),
    }
    ignored { "affected_robots": "any robot may become the leader"; }

    /// Some robots, drawn anew each trial, lose a stimulus.
    pub struct StimuliInhibitionConfig {
        /// The reading that becomes zero.
        stimuli: InhibitedStimulus = of(Domain::Variant(INHIBITED), Name("light_sensor")),
        /// Number of affected robots.
        affected_robots: u32 = of(Domain::WholeOrAll(limits::ROBOTS), Depends("all")),
    }

    /// Positions are redrawn while neural state is kept.
    pub struct TopologySwitchConfig: Default {
        /// Period, steps.
        every: u32 = whole(STEPS, 200),
    }

    /// Some robots turn to a target heading and hold it.
    pub struct UncontrollableRotationConfig {
        /// Number of affected robots, drawn anew each trial.
        affected_robots: u32 = of(Domain::WholeOrAll(limits::ROBOTS), Depends("all")),
        /// First affected step.
        start: u32 = whole([0, limits::STEPS], 200).original(Whole(101)),
        /// Target headings in their order, radians.
        targets: Vec<f64> = of(Domain::Numbers(1, limits::TARGETS), Numbers(TARGETS))
            .shown("270, 90, 15 and 180 degrees"),
        /// Step at which the next target applies.
        switch_at: u32 = whole(STEPS, 600),
        /// Action of the right wheel during a turn; the left wheel gets its negative. With 0.1 and
        /// the default wheels, half a turn takes 50 steps.
        speed: f64 = unit(0.1).original(Number(0.3)),
    }
}

const STEPS: [u32; 2] = [1, limits::STEPS];

const TARGETS: &[f64] =
    &[270.0_f64.to_radians(), 90.0_f64.to_radians(), 15.0_f64.to_radians(), 180.0_f64.to_radians()];

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

/// The name of all readings of the receiver, as [`WholeReceiver`] serialises.
const WHOLE_RECEIVER: &str = "wireless_receiver";

/// `stimuli_inhibition.stimuli`
const INHIBITED: &Variants = &Variants {
    names: SensorQuery::VARIANTS.names,
    read: |node| {
        if node.is(WHOLE_RECEIVER) {
            Some(WHOLE_RECEIVER.into())
        } else {
            (SensorQuery::VARIANTS.read)(node)
        }
    },
    schema: |generator| generator.subschema_for::<InhibitedStimulus>(),
};

impl From<InhibitedStimulus> for ParameterValue {
    fn from(stimulus: InhibitedStimulus) -> Self {
        match stimulus {
            InhibitedStimulus::Reading(reading) => reading.into(),
            InhibitedStimulus::Receiver(_) => WHOLE_RECEIVER.into(),
        }
    }
}

impl TryFrom<ParameterValue> for InhibitedStimulus {
    type Error = ParameterValue;

    fn try_from(value: ParameterValue) -> Result<Self, ParameterValue> {
        match value {
            ParameterValue::Name(name) if name == WHOLE_RECEIVER => {
                Ok(Self::Receiver(WholeReceiver::WirelessReceiver))
            }
            value => SensorQuery::try_from(value).map(Self::Reading),
        }
    }
}
