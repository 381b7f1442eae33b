//! The order of `docs/keys.md`: that of a file.

/// The beginning of the page.
pub const INTRODUCTION: &str = "\
# Every key of an experiment file

Look up a key here by its name, with the search of your browser, or by its place in the file. A key is a link to
itself. [Experiment files](experiment-files.md) leads from an empty file to a task that evolves.

- `required` keys must be there. All others may be left out, and then have their default.
- Numbers may have fractions unless the table says *whole*. Values out of range, unknown keys and duplicate keys are
  errors.
- Lengths are in cm, angles in radians, and times in steps of the environment, unless the table says otherwise. NAME
  stands for a name that you choose.
- With [`\"semantics\": \"original\"`](#file.semantics), some defaults are [other ones](fidelity.md).

The tables are those of the program: `swarmctl schema` prints the same for [editors](experiment-files.md#completion-in-an-editor).
[`limits.rs`](../crates/experiment-file/src/limits.rs) has the limits on the size of a whole experiment.

";

/// Sections of one subject.
pub struct Group {
    pub title: &'static str,
    /// A sentence that leads to explanations.
    pub text: &'static str,
    pub sections: &'static [Section],
}

/// The values and keys that one place of a file may have.
pub struct Section {
    /// The place; empty for the file itself.
    pub heading: &'static str,
    /// The paths in the schema, below `$defs`. If there are several, each has a name, which its
    /// rows show.
    pub parts: &'static [(&'static str, &'static str)],
    /// Whether each name has a table of its own.
    pub is_apart: bool,
}

impl Section {
    /// The heading in addresses.
    pub fn place(&self) -> String {
        match self.heading {
            "" => "file".to_owned(),
            heading => heading.replace(' ', "-"),
        }
    }
}

const fn at(heading: &'static str, parts: &'static [(&'static str, &'static str)]) -> Section {
    Section { heading, parts, is_apart: false }
}

const fn apart(heading: &'static str, parts: &'static [(&'static str, &'static str)]) -> Section {
    Section { heading, parts, is_apart: true }
}

/// Definitions that another page explains, each with its word and the page's address.
pub const ELSEWHERE: [(&str, &str, &str); 1] =
    [("GenotypeQuery", "queries", "experiment-files.md#what-a-query-selects")];

pub const GROUPS: &[Group] = &[
    Group { title: "The whole file", text: "", sections: &[at("", &[("", "")])] },
    Group { title: "World and objects", text: "", sections: WORLD },
    Group {
        title: "What robots perceive",
        text: "[Write a sensor](tasks.md#write-a-sensor) shows how to make one of your own.",
        sections: SENSORS,
    },
    Group { title: "What robots do", text: "", sections: ACTUATORS },
    Group { title: "What goes wrong", text: "", sections: PERTURBATIONS },
    Group {
        title: "Network",
        text: "[Neurons](neurons.md) has the equations of neurons, synapses, encoders, decoders and \
               plasticity.",
        sections: NETWORK,
    },
    Group {
        title: "Evolution",
        text: "[Algorithms](algorithms.md) helps to choose, and has the formulas. d is the number of \
               genes of a population.",
        sections: EVOLUTION,
    },
    Group {
        title: "A task of your own",
        text: "[Tasks](tasks.md) explains scripts.",
        sections: &[
            at("task", &[("TaskConfig", "")]),
            at("task.script", &[("TaskConfig/properties/script/anyOf/1", "")]),
        ],
    },
];

const WORLD: &[Section] = &[
    at("world", &[("WorldConfig", "")]),
    at("world.bodies", &[("BodiesConfig", "")]),
    at("world.objects.NAME", &[("ObjectConfig", "")]),
    at(
        "initializers",
        &[
            ("RobotInitializers", "robot"),
            ("PositionInitializers", "light_source"),
            ("PositionInitializers", "ground_area"),
            ("PositionInitializers", "food_area"),
            ("PositionInitializers", "nest"),
            ("BodyInitializers", "obstacle"),
            ("BodyInitializers", "movable"),
        ],
    ),
    at("initializers.positions", &[("Initializer", "")]),
    at(
        "params",
        &[
            ("RobotParams", "robot"),
            ("LightParams", "light_source"),
            ("GroundAreaParams", "ground_area"),
            ("ObstacleParams", "obstacle"),
            ("MovableParams", "movable"),
            ("ObjectConfig/oneOf/6/properties/params", "food_area"),
            ("ObjectConfig/oneOf/7/properties/params", "nest"),
        ],
    ),
    at("body of a robot", &[("BodyConfig", "")]),
    at("controller of a robot", &[("RobotController", "")]),
    at("controller of a light", &[("LightController", "")]),
];

const SENSORS: &[Section] = &[
    at("sensors", &[("SensorsConfig", "")]),
    at("sensors.light_sensor", &[("LightSensorConfig", "")]),
    at("sensors.distance_sensor", &[("DistanceSensorConfig", "")]),
    at("sensors.ground_sensor", &[("GroundSensorConfig", "")]),
    at("sensors.wireless_receiver", &[("WirelessReceiverConfig", "")]),
    at("sensors.neighborhood_pos_sensor", &[("NeighborhoodSensorConfig", "")]),
    at("sensors.script_sensor", &[("ScriptSensorConfig", "")]),
    at("sensors.proximity_sensor", &[("ProximitySensorConfig", "")]),
    at("sensors.contact_sensor", &[("ContactSensorConfig", "")]),
];

const ACTUATORS: &[Section] = &[
    at("actuators", &[("ActuatorsConfig", "")]),
    at("actuators.wheel_actuator", &[("WheelActuatorConfig", "")]),
    at("actuators.wireless_transmitter", &[("WirelessTransmitterConfig", "")]),
];

const PERTURBATIONS: &[Section] = &[
    at("perturbations", &[("PerturbationsConfig", "")]),
    at("perturbations.leader_failure", &[("LeaderFailureConfig", "")]),
    at("perturbations.stimuli_inhibition", &[("StimuliInhibitionConfig", "")]),
    at("perturbations.topology_switch", &[("TopologySwitchConfig", "")]),
    at("perturbations.uncontrollable_rotation", &[("UncontrollableRotationConfig", "")]),
    at("perturbations.pseudo_reality", &[("PseudoRealityConfig", "")]),
];

const NETWORK: &[Section] = &[
    at("topology", &[("TopologyConfig", "")]),
    at("topology.neurons", &[("TopologyConfig/properties/neurons", "")]),
    at("topology.stimuli.NAME", &[("StimulusConfig", "")]),
    at("topology.stimuli.NAME.sensor", &[("SensorQuery", "")]),
    at("topology.ensembles.NAME", &[("EnsembleConfig", "")]),
    apart("topology.ensembles.NAME.params", &[("EnsembleConfig/properties/params/anyOf", "")]),
    at("topology.synapses.NAME", &[("SynapseGroupConfig", "")]),
    at("topology.synapse_params", &[("SynapseParams", "")]),
    at(
        "topology.synapse_params.RECEPTOR",
        &[("AmpaParams", "AMPA"), ("GabaParams", "GABA"), ("NmdaParams", "NMDA")],
    ),
    at("topology.outputs.NAME", &[("OutputConfig", "")]),
    at("topology.outputs.NAME.actuator", &[("ActuatorQuery", "")]),
    at("topology.decoding.NAME", &[("DecodingConfig", "")]),
    at("topology.encoding.NAME", &[("EncodingConfig", "")]),
    at("topology.encoding.NAME.scheme", &[("EncodingScheme", "")]),
    at("topology.encoding.NAME.receptive_field", &[("ReceptiveField", "")]),
    at("topology.learning", &[("LearningConfig", "")]),
    at("topology.learning.reward", &[("RewardConfig", "")]),
];

const EVOLUTION: &[Section] = &[
    at("algorithm", &[("AlgorithmConfig", "")]),
    at("algorithm.fitness_function", &[("FitnessFunction", "")]),
    at("algorithm.fitness_params", &[("FitnessParams", "")]),
    at("algorithm.descriptors", &[("DescriptorConfig", "")]),
    at("algorithm.aims", &[("AimConfig", "")]),
    at("algorithm.populations.NAME", &[("PopulationConfig", "")]),
    apart("algorithm.populations.NAME.params", &[("PopulationConfig/properties/params/anyOf", "")]),
];
