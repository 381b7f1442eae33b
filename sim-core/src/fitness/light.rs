//! `goto_light`: robots are near the light.

use super::{Definition, Fitness, Moment, mean};
use crate::record::Measures;
use crate::torus::Vec2;
use experiment_file::FitnessFunction;

/// The function of this file.
pub(super) const DEFINITIONS: &[Definition] = &[Definition {
    function: FitnessFunction::GotoLight,
    measures: MEASURES,
    start: |_, params| Box::new(GotoLight { near: params.near }),
}];

const MEASURES: &[&str] = &[
    "light_distance_photosensitive",
    "near_light_photosensitive",
    "center_distance_photosensitive",
    "light_distance_others",
    "near_light_others",
    "center_distance_others",
];

/// f = share of robots near a light.
#[derive(Debug)]
pub(super) struct GotoLight {
    /// Distance that counts as near, cm.
    near: f64,
}

impl Fitness for GotoLight {
    fn step(&mut self, moment: &Moment<'_>) -> Option<f64> {
        let near = moment.positions.iter().map(|&robot| {
            let near = |&light| moment.torus.distance(robot, light) <= self.near;
            f64::from(moment.lights.iter().any(near))
        });
        Some(mean(near))
    }

    fn measure(&self, moment: &Moment<'_>, measures: &mut Measures) {
        let torus = moment.torus;
        let centroid = torus.centroid(moment.positions);
        for (photosensitive, [light_distance, near_light, center_distance]) in [
            (true, [MEASURES[0], MEASURES[1], MEASURES[2]]),
            (false, [MEASURES[3], MEASURES[4], MEASURES[5]]),
        ] {
            let robots = moment.positions.iter().zip(moment.photosensitive);
            let robots: Vec<Vec2> = robots
                .filter(|&(_, &sees_light)| sees_light == photosensitive)
                .map(|(&position, _)| position)
                .collect();
            if robots.is_empty() {
                continue;
            }
            if !moment.lights.is_empty() {
                let to_light = |&robot: &Vec2| {
                    let distances = moment.lights.iter().map(|&light| torus.distance(robot, light));
                    distances.fold(f64::INFINITY, f64::min)
                };
                measures.insert(light_distance.into(), mean(robots.iter().map(to_light)));
                let near = |robot| f64::from(to_light(robot) <= self.near);
                measures.insert(near_light.into(), mean(robots.iter().map(near)));
            }
            let to_center = |&robot: &Vec2| torus.distance(robot, centroid);
            measures.insert(center_distance.into(), mean(robots.iter().map(to_center)));
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::fitness::measures;

    /// The function of experiment D.
    fn goto_light() -> GotoLight {
        GotoLight { near: 80.0 }
    }

    #[test]
    fn fitness_is_the_share_of_robots_near_the_light() {
        let light = [Vec2::new(990.0, 500.0)];
        let positions = [
            Vec2::new(990.0, 500.0),
            Vec2::new(70.0, 500.0),
            Vec2::new(71.0, 500.0),
            Vec2::new(500.0, 500.0),
        ];
        let moment = Moment { positions: &positions, lights: &light, ..Moment::EMPTY };
        assert_eq!(goto_light().step(&moment), Some(0.5));
        assert_eq!(goto_light().step(&Moment { lights: &[], ..moment }), Some(0.0));
        assert_eq!(GotoLight { near: 81.0 }.step(&moment), Some(0.75));
    }

    #[test]
    fn photosensitive_and_other_robots_have_separate_measures() {
        let positions = [Vec2::new(0.0, 0.0), Vec2::new(30.0, 0.0), Vec2::new(60.0, 0.0)];
        let moment = Moment {
            positions: &positions,
            photosensitive: &[false, true, false],
            lights: &[Vec2::new(990.0, 0.0), Vec2::new(500.0, 500.0)],
            ..Moment::EMPTY
        };
        let expected = [
            ("light_distance_photosensitive", 40.0),
            ("near_light_photosensitive", 1.0),
            ("center_distance_photosensitive", 0.0),
            ("light_distance_others", 40.0),
            ("near_light_others", 1.0),
            ("center_distance_others", 30.0),
        ];
        assert_eq!(measures(&mut goto_light(), &moment), expected);
        let far = Moment { lights: &[Vec2::new(940.0, 0.0)], ..moment };
        assert_eq!(measures(&mut goto_light(), &far)[4], ("near_light_others", 0.5));
        let blind = Moment { photosensitive: &[false; 3], lights: &[], ..moment };
        assert_eq!(measures(&mut goto_light(), &blind), [("center_distance_others", 20.0)]);
    }
}
