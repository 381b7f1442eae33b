//! Episodes of an experiment, simulated again and packed for the player of the crate `web`.
//!
//! - [`Episode`] and [`Replay`]: an episode, and its packed form
//! - [`WhatIf`]: changes of the experiment, and [`Interventions`] in the middle of its episode
//! - [`Trials`]: the trials of an individual, one of which a replay shows
//!
//! Packed, an episode is gzip of: the length of the header (u32), the header (JSON, padded
//! with spaces to a multiple of 8 bytes), and the columns that the header lists. A column is
//! a little-endian array `[row][step]`; a row is a robot, or a component of a robot's
//! reading, or a light, or a measure.

mod column;
mod interventions;
mod robots;
mod scene;
mod trials;
mod what_if;

use std::io::Write as _;

use experiment_file::ExperimentConfig;
use flate2::{Compression, write::GzEncoder};
use serde::Serialize;
use sim_core::{EpisodeSummary, EvaluateError, RoomRecord, Simulation, StepRecord, TrialSet};

use self::{
    column::{Column, Form, Place},
    robots::{ROBOT_COLUMNS, RobotColumn},
    scene::Scene,
};
pub use self::{
    interventions::Interventions,
    trials::{Judged, Trials},
    what_if::{WhatIf, WhatIfError},
};

/// Values of all robots in all steps: some 1,000 steps of 1,000 robots, or 250 MB.
const VALUES_MAX: usize = 64_000_000;

/// The simulated experiment, genotype and worlds.
#[derive(Debug, Clone)]
pub struct Episode<'a> {
    /// The experiment.
    pub config: &'a ExperimentConfig,
    /// The compiled experiment.
    pub simulation: &'a Simulation,
    /// Genes in \[0, 1\].
    pub genotype: &'a [f64],
    /// The name of the genotype, for people.
    pub name: &'a str,
    /// The worlds.
    pub trial_set: TrialSet,
    /// The trial.
    pub trial: u32,
}

/// The reason why there is no replay.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum ReplayError {
    /// The simulation fails.
    #[error(transparent)]
    Evaluate(#[from] EvaluateError),
    /// The client has gone.
    #[error("it was stopped")]
    Stopped,
    /// The episode is too large for a browser.
    #[error(
        "a replay has at most {} million values of robots, but this one would have {}; simulate \
         fewer steps or robots",
        VALUES_MAX / 1_000_000,
        n_values / 1_000_000
    )]
    TooLong {
        /// Number of values of the episode: steps times robots times values per robot.
        n_values: usize,
    },
}

/// An episode, ready to be packed.
#[derive(Debug)]
pub struct Replay {
    scene: Scene,
    summary: EpisodeSummary,
    columns: Vec<Column>,
}

/// The header, which the player reads first.
#[derive(Serialize)]
struct Header<'a> {
    #[serde(flatten)]
    scene: &'a Scene,
    fitness: f64,
    /// Means over the steps, by name.
    measures: &'a sim_core::Measures,
    columns: Vec<Place>,
}

impl Replay {
    /// Simulates the episode.
    pub fn simulate(episode: &Episode<'_>) -> Result<Self, ReplayError> {
        Self::simulate_while(episode, &|| true)
    }

    /// Like [`Self::simulate`], but stops when `keep_going` returns false.
    pub fn simulate_while(
        episode: &Episode<'_>,
        keep_going: &dyn Fn() -> bool,
    ) -> Result<Self, ReplayError> {
        let Episode { simulation, genotype, trial_set, trial, .. } = *episode;
        let scene = Scene::new(episode)?;
        let per_robot: usize =
            ROBOT_COLUMNS.iter().map(|column| (column.n_components)(&scene)).sum();
        let n_values = scene.steps as usize * scene.n_robots * per_robot;
        if n_values > VALUES_MAX {
            return Err(ReplayError::TooLong { n_values });
        }
        let mut columns = Columns::new(&scene);
        let mut observe = |step: &StepRecord| columns.record(&scene, step);
        let summary =
            simulation.simulate_while(genotype, trial_set, trial, keep_going, &mut observe)?;
        let summary = summary.ok_or(ReplayError::Stopped)?;
        Ok(Self { scene, summary, columns: columns.into_vec() })
    }

    /// The same replay, with all trials of the individual, one of which it shows.
    #[must_use]
    pub fn of_trials(mut self, trials: Trials) -> Self {
        self.scene.trials = Some(trials);
        self
    }

    /// The packed episode for the player.
    pub fn encode(&self) -> Vec<u8> {
        let mut body = Vec::new();
        let places = self.columns.iter().map(|column| column.write(&mut body)).collect();
        let EpisodeSummary { fitness, measures } = &self.summary;
        let header = Header { scene: &self.scene, fitness: *fitness, measures, columns: places };
        let mut header = serde_json::to_vec(&header).expect("plain data serialises");
        // Columns are aligned to four bytes.
        header.resize((header.len() + 4).next_multiple_of(8) - 4, b' ');
        let mut packed = GzEncoder::new(Vec::new(), Compression::best());
        let parts = [&(header.len() as u32).to_le_bytes()[..], &header, &body];
        parts
            .into_iter()
            .try_for_each(|part| packed.write_all(part))
            .and_then(|()| packed.finish())
            .expect("memory takes all writes")
    }
}

/// The columns of an episode, step by step.
struct Columns {
    /// In the order of [`ROBOT_COLUMNS`].
    robots: Vec<Column>,
    lights: [Column; 2],
    areas: [Column; 2],
    /// What a world with bodies has in addition.
    bodies: Option<BodyColumns>,
    fitness: Column,
    measures: Column,
    /// Scratch: a robot's values.
    values: Vec<f64>,
}

impl Columns {
    fn new(scene: &Scene) -> Self {
        let n_steps = scene.steps as usize;
        let of_robots = |column: &RobotColumn| {
            let n_rows = scene.n_robots * (column.n_components)(scene);
            Column::new(column.name, column.form, n_rows, n_steps)
        };
        let light = |name| Column::new(name, Form::Position, scene.lights.len(), n_steps);
        let area = |name| Column::new(name, Form::Position, scene.areas.len(), n_steps);
        Self {
            robots: ROBOT_COLUMNS.iter().map(of_robots).collect(),
            lights: [light("light_x"), light("light_y")],
            areas: [area("area_x"), area("area_y")],
            bodies: scene.room.as_ref().map(|room| BodyColumns::new(room, n_steps)),
            fitness: Column::new("fitness", Form::Real, 1, n_steps),
            measures: Column::new("measures", Form::Real, scene.measure_names.len(), n_steps),
            values: Vec::new(),
        }
    }

    fn record(&mut self, scene: &Scene, record: &StepRecord) {
        let step = record.step as usize;
        for (column, described) in self.robots.iter_mut().zip(ROBOT_COLUMNS) {
            let n_components = (described.n_components)(scene);
            for (index, robot) in record.robots.iter().enumerate() {
                self.values.clear();
                (described.read)(robot, &mut self.values);
                for (component, value) in self.values.iter().enumerate() {
                    column.set(index * n_components + component, step, *value);
                }
            }
        }
        for ([x, y], positions) in
            [(&mut self.lights, &record.lights), (&mut self.areas, &record.areas)]
        {
            for (index, position) in positions.iter().enumerate() {
                x.set(index, step, position.x);
                y.set(index, step, position.y);
            }
        }
        if let Some(bodies) = &mut self.bodies {
            bodies.record(step, record);
        }
        self.fitness.set(0, step, record.fitness.unwrap_or(f64::NAN));
        for (row, name) in scene.measure_names.iter().enumerate() {
            let value = record.measures.get(name).copied().unwrap_or(f64::NAN);
            self.measures.set(row, step, value);
        }
    }

    fn into_vec(self) -> Vec<Column> {
        let Self { mut robots, lights, areas, bodies, fitness, measures, .. } = self;
        robots.extend(lights.into_iter().chain(areas).chain([fitness, measures]));
        robots.extend(
            bodies
                .into_iter()
                .flat_map(|bodies| [bodies.touches].into_iter().chain(bodies.movables)),
        );
        robots
    }
}

/// What bodies do, step by step.
struct BodyColumns {
    touches: Column,
    /// Coordinates and heading.
    movables: [Column; 3],
}

impl BodyColumns {
    fn new(room: &RoomRecord, n_steps: usize) -> Self {
        let movable = |name, form| Column::new(name, form, room.movables.len(), n_steps);
        Self {
            touches: Column::new("touches", Form::Byte(1.0), room.radii.len(), n_steps),
            movables: [
                movable("movable_x", Form::Position),
                movable("movable_y", Form::Position),
                movable("movable_heading", robots::ANGLE),
            ],
        }
    }

    fn record(&mut self, step: usize, record: &StepRecord) {
        for (index, robot) in record.robots.iter().enumerate() {
            self.touches.set(index, step, robot.touches.into());
        }
        for (index, movable) in record.movables.iter().enumerate() {
            let values = [movable.position.x, movable.position.y, movable.heading];
            for (column, value) in self.movables.iter_mut().zip(values) {
                column.set(index, step, value);
            }
        }
    }
}

#[cfg(test)]
mod tests;
