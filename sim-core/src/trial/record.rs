//! What a watcher sees of a step.

use super::Trial;
use crate::fitness::Moment;
use crate::record::{Measures, RobotRecord, StepRecord};
use crate::simulation::EvaluateError;

impl Trial<'_> {
    /// Fills in the measures of the last scored step.
    pub fn measure(&mut self, step: u32, measures: &mut Measures) -> Result<(), EvaluateError> {
        measures.clear();
        if let Some(fitness) = &self.fitness {
            let moment = Moment::new(self.world, &self.swarm, &self.lights, step);
            fitness.measure(&moment, measures);
        }
        self.run_script(step, |script, view| script.measure(view, measures))?;
        Ok(())
    }

    /// Fills in the last scored step, without the data of controllers.
    pub fn record(
        &mut self,
        step: u32,
        fitness: Option<f64>,
        record: &mut StepRecord,
    ) -> Result<(), EvaluateError> {
        let StepRecord {
            step: number,
            fitness: of_step,
            measures,
            robots,
            lights,
            areas,
            movables,
        } = record;
        (*number, *of_step) = (step, fitness);
        self.measure(step, measures)?;
        robots.resize_with(self.world.n_robots(), RobotRecord::default);
        for (robot, record) in robots.iter_mut().enumerate() {
            self.swarm.record(robot, record);
        }
        let targets = self.fitness.as_ref().map_or(&[][..], |fitness| fitness.targets());
        for (robot, target) in self.world.evaluated().zip(targets) {
            robots[robot].target = Some(*target);
        }
        if let Some(interior) = &self.interior {
            interior.record(robots, movables);
        }
        lights.clone_from(&self.lights);
        areas.clone_from(&self.areas);
        Ok(())
    }
}
