//! Limits on the size and cost of an experiment.
//!
//! Experiment files come from the network. An accepted file must not exhaust the memory of the
//! coordinator or of a worker, nor keep a worker busy for hours with a single episode. The limits
//! are far above typical experiments (10 to 50 robots, 24 neurons, about 450 genes).

use std::ops::RangeInclusive;

/// Bytes of an experiment file.
pub const FILE_BYTES: usize = 1 << 20;
/// Bytes of a script.
pub const SCRIPT_BYTES: usize = 32 << 10;
/// Nesting depth of lists and objects.
pub const NESTING: usize = 64;
/// Number of problems to list; further ones are counted.
pub const PROBLEMS: usize = 100;
/// Characters of a name.
pub const NAME_CHARS: usize = 128;
/// Entries of a map of names, and of a list of names.
pub const ENTRIES: usize = 256;
/// Queries of all populations together.
pub const QUERIES: usize = 1_024;
/// Absolute value of any physical quantity or network parameter, so that no
/// product of a few of them overflows. Quantities that must be positive are at
/// least its reciprocal.
pub const MAGNITUDE: f64 = 1e9;
/// Range of a quantity > 0.
pub const POSITIVE: RangeInclusive<f64> = 1.0 / MAGNITUDE..=MAGNITUDE;
/// Range of a quantity of either sign.
pub const QUANTITY: RangeInclusive<f64> = -MAGNITUDE..=MAGNITUDE;

/// Individuals per generation.
pub const POPULATION: u32 = 100_000;
/// Generations of a run.
pub const GENERATIONS: u64 = 10_000_000;
/// Environment steps per trial.
pub const STEPS: u32 = 100_000;
/// Trials of one set: of an individual in a generation, of a comparison, a judgement or an
/// evaluation. Numbers of trials are below it.
pub const TRIALS: u32 = 1_000;
/// Trials per generation, over all individuals.
pub const TRIALS_PER_GENERATION: u64 = 10_000_000;
/// Genes per generation, over all individuals.
pub const GENES_PER_GENERATION: u64 = 50_000_000;
/// Genes of a genotype whose algorithm keeps a full covariance or shape matrix. At this limit, a
/// generation of 100 individuals takes the coordinator 0.5 s (CMA-ES) to 1 s (xNES), and a
/// checkpoint has 10 to 20 MB. The time grows with the cube of the number of genes.
pub const GENES_OF_FULL_MATRIX: u64 = 1_000;

/// Genes of a genotype whose algorithm keeps several such matrices. At this limit, a generation
/// takes the coordinator about a second, and the matrices take 15 MB of a checkpoint.
pub const GENES_OF_FULL_MATRICES: u64 = 500;
/// Distributions that share a generation.
pub const EMITTERS: u32 = 15;

/// Descriptors of a behaviour.
pub const DESCRIPTORS: usize = 8;
/// Aims beside fitness: the volume that a front dominates is exact for three aims in all.
pub const AIMS: usize = 2;
/// Elites of a repertoire or of a front, and cells of a grid of descriptors.
pub const ELITES: u32 = 16_384;
/// Parts of distances between behaviours, one per descriptor, of each individual and elite from
/// each: ten seconds of the coordinator per generation.
pub const DISTANCES: u64 = 20_000_000_000;
/// Genes of all elites of a repertoire or of a front together: a checkpoint has 8 bytes for each.
pub const GENES_OF_REPERTOIRE: u64 = 10_000_000;

/// Euler steps of spiking networks, ms: the shortest time constants of their synapses and
/// decoders are 5 ms.
pub const SPIKING_DT: RangeInclusive<f64> = 0.001..=2.0;
/// Axonal delays of dynamic synapses, substeps.
pub const DELAYS: RangeInclusive<u32> = 1..=9;
/// Gain of a receptor.
pub const SYNAPSE_GAIN: f64 = 1_000.0;
/// Nodes of a receptive field per value of the stimulus.
pub const FIELD_NODES: u32 = 1_000;
/// Absolute value of inputs and outputs of receptive fields.
pub const FIELD_VALUE: f64 = 1e6;
/// Steepness of a receptive field.
pub const STEEPNESS: f64 = 1e6;
/// Rates of Poisson encoders: with the highest, a node spikes in every substep.
pub const POISSON_RATE: RangeInclusive<f64> = 0.0..=10_000.0;
/// Absolute value of A, B, C and D of plasticity.
pub const COEFFICIENT: f64 = 1e6;
/// Absolute value of a plastic weight.
pub const PLASTIC_WEIGHT: f64 = 1e6;
/// Environment steps from activities to their reward.
pub const REWARD_DELAY: u32 = 1_000;
/// Network substeps per environment step.
pub const TIME_SCALE: u32 = 1_000;
/// Values of all stimuli together.
pub const INPUTS: u32 = 10_000;
/// Neurons of all ensembles together.
pub const NEURONS: u32 = 10_000;
/// Synapses of all groups together, if every possible one exists.
pub const SYNAPSES: u64 = 1_000_000;

/// Robots of all objects together.
pub const ROBOTS: u32 = 10_000;
/// Lights and ground areas, of all objects together.
pub const STATIC_OBJECTS: u32 = 1_000;
/// Walls, obstacles and movables, of all objects together.
pub const OBSTACLES: u32 = 1_000;
/// Corners of a polygon or of a line of walls.
pub const CORNERS: usize = 64;
/// Shortest edge, and smallest distance of a corner from another edge of a polygon, cm.
pub const EDGE_MIN: f64 = 0.01;
/// Corners of a movable.
pub const MOVABLE_CORNERS: usize = 16;
/// Radii of bodies, cm.
pub const BODY_RADII: RangeInclusive<f64> = 0.1..=10_000.0;
/// Masses of bodies, kg.
pub const MASSES: RangeInclusive<f64> = 0.001..=1_000.0;
/// Physics substeps per environment step.
pub const SUBSTEPS: u32 = 64;
/// Sectors of a sensor, and rays of one.
pub const SECTORS: u32 = 360;
/// Components of a message.
pub const MESSAGE_LENGTH: u32 = 64;
/// Points of the quantiser's lattice.
pub const LATTICE_POINTS: u32 = 4_096;
/// Hops of a frame.
pub const HOPS: u32 = 1_000_000;
/// Stimuli that a robot's `stimuli_inhibition` zeroes.
pub const INHIBITIONS: usize = 16;
/// Steps of `actuation_delay`.
pub const ACTUATION_DELAY: u32 = 50;
/// Target headings of `uncontrollable_rotation`.
pub const TARGETS: usize = 1_000;

/// Inputs and neurons of all robots together: the memory of an episode.
pub const NETWORK_STATES: u64 = 10_000_000;
/// Robots x steps: the random draws of an episode.
pub const ROBOT_STEPS: u64 = 20_000_000;
/// Elementary operations of an episode. Every step of a robot has one per synapse and substep of
/// the network, one per neuron and substep, one per sector or ray and robot, light or edge of a
/// body, and one per lattice point. Every substep of the physics has 500 per body that moves, and
/// one per such body and edge. A line of sight to a light or to an emitter that something may block
/// has one per edge and body.
pub const EPISODE_OPERATIONS: u64 = 1_000_000_000_000;
