//! Compares the costs of an experiment with the [`limits`].

use crate::report::{Path, Report};
use crate::{
    AlgorithmDescription, BlockedBy, DescriptorConfig, ExperimentConfig, Keeps, ObjectConfig,
    RobotConfig, RobotController, Shape, SynapseModel, TopologyConfig, WorldConfig, limits,
};

pub(super) fn check(
    config: &ExperimentConfig,
    algorithm: Option<&AlgorithmDescription>,
    report: &Report<'_>,
) {
    let network = NetworkSize::from_topology(&config.topology);
    network_size(&network, report);
    generation(config, &network, algorithm, report);
    episode(config, &network, report);
}

/// Numbers that a worker keeps for a node of an encoder, in addition to one per substep.
const STATES_PER_NODE: u64 = 8;
/// Operations of a body that moves, in a substep of the physics.
const OPERATIONS_PER_BODY: u64 = 500;
/// Operations of an encoder's node in a substep: a random draw costs as many.
const OPERATIONS_PER_NODE: u64 = 16;

struct NetworkSize {
    n_inputs: u64,
    n_neurons: u64,
    /// Numbers that a worker keeps for the neurons of one robot.
    n_states: u64,
    /// Number of evolvable parameters of all neurons.
    n_neuron_genes: u64,
    /// Number of coefficients A, B, C and D of all plastic groups.
    n_learning_coefficients: u64,
    /// Numbers that a worker keeps for plasticity of one robot.
    n_learning_states: u64,
    /// Operations of plasticity per environment step.
    n_learning_operations: u64,
    /// Number of weights of all receptive fields.
    n_encoder_weights: u64,
    /// Number of weights of all decodings.
    n_decoder_weights: u64,
    /// Operations of all neurons in a substep.
    n_neuron_operations: u64,
    /// Number of synapses, if every possible one exists.
    n_synapses: u64,
}

impl NetworkSize {
    fn from_topology(topology: &TopologyConfig) -> Self {
        let size = |name: &String| {
            let ensemble = topology.ensembles.get(name).map(|ensemble| ensemble.n);
            u64::from(ensemble.unwrap_or_else(|| topology.n_sources(name)))
        };
        let size_of_all = |names: &[String]| names.iter().map(size).sum::<u64>();
        let groups = topology.synapses.values();
        let model = topology.neuron_model.spec();
        // A dynamic synapse keeps a delay; a neuron's axon keeps the spikes of nine substeps and
        // four variables of its receptors.
        let is_dynamic = u64::from(topology.synapse_model == SynapseModel::Dynamic);
        let of_synapses = 13 * is_dynamic;
        let n_neurons: u64 =
            topology.ensembles.values().map(|ensemble| u64::from(ensemble.n)).sum();
        let encoded = topology.encoding.keys().map(|name| u64::from(topology.n_sources(name)));
        let n_encoded: u64 = encoded.sum();
        let n_synapses =
            groups.map(|group| size_of_all(&group.pre) * size_of_all(&group.post)).sum::<u64>();
        let n_inputs = topology.stimuli.values().map(|stimulus| u64::from(stimulus.n)).sum::<u64>()
            + n_encoded;
        let (mut n_learning_coefficients, mut n_learning_states) = (0, 0);
        if let Some(learning) = &topology.learning {
            let n_remembered = learning.reward.map_or(1, |reward| u64::from(reward.delay));
            n_learning_coefficients = 4 * learning.synapses.len() as u64;
            n_learning_states = n_synapses + n_remembered * (n_inputs + n_neurons + 1);
        }
        Self {
            n_learning_coefficients,
            n_learning_states,
            n_learning_operations: if topology.learning.is_some() { 4 * n_synapses } else { 0 },
            n_inputs,
            n_neurons,
            n_states: n_neurons * (model.states_per_neuron + of_synapses)
                + n_encoded * (STATES_PER_NODE + of_synapses + u64::from(topology.time_scale)),
            n_neuron_genes: n_neurons * (model.evolvable().count() as u64 + is_dynamic)
                + n_encoded * is_dynamic,
            n_encoder_weights: topology
                .encoding
                .iter()
                .filter_map(|(name, encoding)| {
                    let n = topology.stimuli.get(name)?.n;
                    Some(u64::from(encoding.receptive_field.n_weights(n)))
                })
                .sum(),
            n_decoder_weights: topology
                .outputs
                .iter()
                .filter_map(|(name, output)| {
                    let n = topology.ensembles.get(&output.ensemble)?.n;
                    Some(u64::from(topology.decoding.get(name)?.n_weights(n)))
                })
                .sum(),
            n_neuron_operations: n_neurons * (model.operations_per_neuron + 2 * of_synapses)
                + n_encoded * (OPERATIONS_PER_NODE + 2 * of_synapses),
            n_synapses,
        }
    }
}

/// Reports a cost that exceeds its limit; `parts`: the places on which the cost depends.
fn limit(cost: u64, limit: u64, what: &str, path: &Path, parts: &[&Path], report: &Report<'_>) {
    if cost > limit {
        report
            .conflict(path, parts, || format!("{cost} {what} are more than the limit of {limit}"));
    }
}

fn network_size(network: &NetworkSize, report: &Report<'_>) {
    let topology = Path::from(["topology"]);
    let [stimuli, ensembles, synapses] =
        ["stimuli", "ensembles", "synapses"].map(|key| topology.key(key));
    let &NetworkSize { n_inputs, n_neurons, n_synapses, .. } = network;
    limit(n_inputs, limits::INPUTS.into(), "inputs", &stimuli, &[], report);
    limit(n_neurons, limits::NEURONS.into(), "neurons", &ensembles, &[], report);
    let parts = [&stimuli, &ensembles];
    limit(n_synapses, limits::SYNAPSES, "possible synapses", &synapses, &parts, report);
}

/// The coordinator's costs of a generation.
fn generation(
    config: &ExperimentConfig,
    network: &NetworkSize,
    description: Option<&AlgorithmDescription>,
    report: &Report<'_>,
) {
    let algorithm = Path::from(["algorithm"]);
    let topology = Path::from(["topology"]);
    let size_path = algorithm.key("population_size");
    let size = u64::from(config.algorithm.population_size);
    let n_trials = size * u64::from(config.algorithm.num_evaluations);
    let what = "trials per generation";
    let parts = [&algorithm.key("num_evaluations")];
    limit(n_trials, limits::TRIALS_PER_GENERATION, what, &size_path, &parts, report);

    let n_genes = network.n_synapses
        + network.n_learning_coefficients
        + network.n_neuron_genes
        + network.n_encoder_weights
        + network.n_decoder_weights;
    let what = "possible genes per generation";
    let parts = [&topology];
    limit(size * n_genes, limits::GENES_PER_GENERATION, what, &size_path, &parts, report);
    if let Some(genes_max) = description.and_then(|description| description.genes_max) {
        let what = "possible genes for an algorithm with a full matrix";
        limit(n_genes, genes_max, what, &algorithm.key("name"), &parts, report);
    }
    if let Some(description) = description.filter(|found| found.keeps == Keeps::Repertoire) {
        let n_cells = DescriptorConfig::n_cells(&config.algorithm.descriptors);
        for (name, population) in &config.algorithm.populations {
            let path = algorithm.key("populations").key(name);
            let n_elites = description.elites_max(&population.params, n_cells, size);
            let cost = n_elites.saturating_mul(n_genes);
            let what = "possible genes of all elites";
            let parts = [&topology, &algorithm.key("descriptors"), &algorithm.key("name")];
            limit(cost, limits::GENES_OF_REPERTOIRE, what, &path, &parts, report);
            if description.compares_behaviours() {
                let n_pool = n_elites + size;
                let n_descriptors = config.algorithm.descriptors.len() as u64;
                let cost = n_pool.saturating_mul(n_pool).saturating_mul(n_descriptors);
                let what = "distances between behaviours per generation, along all descriptors,";
                let parts = [&path, &algorithm.key("descriptors"), &algorithm.key("name")];
                limit(cost, limits::DISTANCES, what, &size_path, &parts, report);
            }
            let n_judged = n_elites * u64::from(config.algorithm.judgement_trials);
            let what = "trials that judge all elites";
            let path = algorithm.key("judgement_trials");
            limit(n_judged, limits::TRIALS_PER_GENERATION, what, &path, &parts[1..], report);
        }
    }
}

/// A worker's costs of an episode.
fn episode(config: &ExperimentConfig, network: &NetworkSize, report: &Report<'_>) {
    let path = Path::from(["world", "objects"]);
    let algorithm = Path::from(["algorithm"]);
    let topology = Path::from(["topology"]);
    let n_objects = NumberOfObjects::new(&config.world);
    let NumberOfObjects { n_robots, n_static_objects, n_movables, n_obstacles, n_edges } =
        n_objects;
    let n_steps = u64::from(config.algorithm.evaluation_steps);
    for (n, max, what) in [
        (n_robots, limits::ROBOTS, "robots"),
        (n_static_objects, limits::STATIC_OBJECTS, "lights and ground areas"),
        (n_obstacles + n_movables, limits::OBSTACLES, "walls, obstacles and movables"),
    ] {
        limit(n, max.into(), what, &path, &[], report);
    }

    let states = n_robots * (network.n_inputs + network.n_states + network.n_learning_states);
    let what = "inputs and neurons of all robots";
    limit(states, limits::NETWORK_STATES, what, &path, &[&topology], report);

    let steps_path = algorithm.key("evaluation_steps");
    let what = "steps of all robots per trial";
    limit(n_robots * n_steps, limits::ROBOT_STEPS, what, &steps_path, &[&path], report);

    let n_sensed = n_robots + n_static_objects + n_edges;
    let of_robot = |robot: &RobotConfig| {
        let substep = network.n_synapses + network.n_neuron_operations;
        let think = match robot.controller {
            RobotController::NeuralController => {
                substep * u64::from(config.topology.time_scale) + network.n_learning_operations
            }
            RobotController::BraitenbergLightFollower | RobotController::ScriptController => 0,
        };
        let sense = n_sensed * u64::from(robot.sensors.n_seen());
        // A line to a light, or to a robot that is seen or heard, meets every edge and body.
        let light = robot.sensors.light_sensor.as_ref().map(|sensor| sensor.blocked_by);
        let robots = robot.sensors.distance_sensor.as_ref().map(|sensor| sensor.blocked_by);
        let frames = robot.sensors.wireless_receiver.as_ref().map(|sensor| sensor.blocked_by);
        let line = |blocked_by| match blocked_by {
            None | Some(BlockedBy::Nothing) => 0,
            Some(BlockedBy::Walls) => n_edges,
            Some(BlockedBy::Bodies) => n_edges + n_robots + n_movables,
        };
        let look = n_static_objects * line(light) + n_robots * (line(robots) + line(frames));
        u64::from(robot.num_instances) * (think + sense + look + n_lattice_points(robot))
    };
    let substeps = config.world.bodies.map_or(0, |bodies| u64::from(bodies.substeps));
    let physics = substeps * (n_robots + n_movables) * (OPERATIONS_PER_BODY + n_edges);
    let per_step = config.robots().map(|(_, robot)| of_robot(robot)).sum::<u64>() + physics;
    let cost = per_step.saturating_mul(n_steps);
    let what = "operations per episode";
    let parts = [&path, &topology, &Path::from(["world", "bodies"])];
    limit(cost, limits::EPISODE_OPERATIONS, what, &steps_path, &parts, report);
}

/// How many objects of each kind a world has.
#[derive(Default)]
struct NumberOfObjects {
    n_robots: u64,
    /// Lights and ground areas.
    n_static_objects: u64,
    n_movables: u64,
    /// Walls and obstacles.
    n_obstacles: u64,
    /// Edges of the boundary, walls, obstacles and movables; a disc has one.
    n_edges: u64,
}

impl NumberOfObjects {
    fn new(world: &WorldConfig) -> Self {
        let n_edges = world.outline().map_or(0, |corners| corners.len() as u64);
        let mut total = Self { n_edges, ..Self::default() };
        let n_edges = |shape| match shape {
            Shape::Disc(_) => 1,
            Shape::Polygon(corners) => corners.len() as u64,
        };
        for object in world.objects.values() {
            let n = u64::from(object.num_instances());
            match object {
                ObjectConfig::Robot(_) => total.n_robots += n,
                ObjectConfig::LightSource(_) | ObjectConfig::GroundArea(_) => {
                    total.n_static_objects += n;
                }
                ObjectConfig::Wall(wall) => {
                    total.n_obstacles += n;
                    total.n_edges += wall.corners.len() as u64;
                }
                ObjectConfig::Obstacle(obstacle) => {
                    total.n_obstacles += n;
                    total.n_edges += n * n_edges(obstacle.params.shape());
                }
                ObjectConfig::Movable(movable) => {
                    total.n_movables += n;
                    total.n_edges += n * n_edges(movable.params.shape());
                }
            }
        }
        total
    }
}

fn n_lattice_points(robot: &RobotConfig) -> u64 {
    let transmitter = robot.actuators.wireless_transmitter.as_ref();
    let quantizing = transmitter.filter(|transmitter| transmitter.quantize);
    quantizing.map_or(0, |transmitter| u64::from(transmitter.n_symbols))
}
