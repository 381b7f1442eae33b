//! Who hears whom, in which sector and how strongly. It depends on positions and
//! headings alone, so it is computed again only when a robot has moved or turned.

use std::f64::consts::{PI, TAU};
use std::ops::Range;

use pulp::{Simd, WithSimd};

use crate::neighbours::{Neighbour, Neighbours};
use crate::sensors::Decay;
use crate::torus::{Vec2, angular_difference, sector_angle, wrap_angle};
use experiment_file::SendingDirection;
use numeric::Isa;

/// A border between sectors belongs to both in spite of rounding, radians.
const BORDER: f64 = 1e-12;

/// What a robot's receiver and transmitter are like.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub(crate) struct Antenna {
    /// Reach of the transmitter, cm; none: it does not emit.
    pub emits_within: Option<f64>,
    /// The receiver; none: it does not listen.
    pub receiver: Option<Receiver>,
}

/// What a receiver is like.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Receiver {
    /// Sectors, n.
    pub n_sectors: usize,
    /// Reach, cm.
    pub range: f64,
    /// Fading of the strength.
    pub decay: Decay,
    /// Frames of so many hops are not accepted.
    pub max_hops: u32,
    /// Whose sector the sending direction is.
    pub sending_direction: SendingDirection,
}

/// The strongest emitter in a sector.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Heard {
    /// The robot that is heard, as the listener has it nearby.
    pub emitter: Neighbour,
    /// How far off the sector's direction it is, radians.
    phi: f64,
}

/// What a listener observes of the frame that it takes.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Observed {
    /// Strength of the frame.
    pub signal: f64,
    /// (cos, sin) of the emitter's sector that faces the listener, in the emitter's own
    /// frame.
    pub sending_direction: Vec2,
}

/// The strongest emitter in every sector of every robot. Every emitter puts a
/// frame on the air in each step, so it is also the sector's frame.
#[derive(Debug, Clone)]
pub(crate) struct Hearing {
    /// `[robot][sector]`
    sectors: Vec<Option<Heard>>,
    /// Direction of each sector in its robot's own frame, `[robot][sector]`.
    angles: Vec<f64>,
    /// (cos, sin) of `angles`.
    directions: Vec<Vec2>,
    /// First sector of each robot, and the end.
    first: Vec<usize>,
    /// What [`observe`](Self::observe) has found, `[robot][sector]`.
    observed: Vec<Option<Observed>>,
    /// Scratch: every neighbour of every robot, as it hears them.
    emitters: Emitters,
}

/// Robots as their neighbours hear them.
#[derive(Debug, Clone, Default)]
struct Emitters {
    /// Direction in the listener's own frame.
    bearings: Vec<f64>,
    /// Sector whose direction is nearest.
    sectors: Vec<f64>,
    /// How far off that direction they are, radians.
    phis: Vec<f64>,
    /// Logarithm of their strength.
    log_strengths: Vec<f64>,
    /// The loudest in each sector of a robot: logarithm of its strength, and its index.
    loudest: Vec<(f64, usize)>,
}

impl Hearing {
    /// Before the first [`update`](Self::update): no robot hears another one.
    pub fn new(antennas: &[Antenna]) -> Self {
        let mut first = vec![0];
        let mut angles = Vec::new();
        for antenna in antennas {
            let n_sectors = antenna.receiver.map_or(0, |receiver| receiver.n_sectors);
            angles.extend((0..n_sectors).map(|sector| sector_angle(sector, n_sectors)));
            first.push(angles.len());
        }
        let directions = angles.iter().map(|&angle| Vec2::unit(angle)).collect();
        let (sectors, observed) = (vec![None; angles.len()], vec![None; angles.len()]);
        let emitters = Emitters::default();
        Self { sectors, angles, directions, first, observed, emitters }
    }

    /// The sectors of one robot.
    pub fn of(&self, robot: usize) -> &[Option<Heard>] {
        &self.sectors[self.first[robot]..self.first[robot + 1]]
    }

    /// (cos, sin) of a robot's sector in its own frame.
    pub fn direction(&self, robot: usize, sector: usize) -> Vec2 {
        self.directions[self.first[robot] + sector]
    }

    /// What a robot observes of the emitter in one of its sectors, which must have one. It is
    /// computed once: robots that stand hear the same all the time.
    pub fn observe(
        &mut self,
        robot: usize,
        sector: usize,
        decay: Decay,
        headings: &[f64],
    ) -> Option<Observed> {
        let index = self.first[robot] + sector;
        if self.observed[index].is_none() {
            self.observed[index] = self.sectors[index].as_ref().map(|heard| Observed {
                signal: heard.strength(decay),
                sending_direction: self.sending_direction(robot, heard, headings),
            });
        }
        self.observed[index]
    }

    /// As [`Observed`] has it.
    fn sending_direction(&self, listener: usize, heard: &Heard, headings: &[f64]) -> Vec2 {
        // What cannot listen has as many sectors as its listener.
        let emitter = heard.emitter.robot;
        let listens = self.first[emitter] < self.first[emitter + 1];
        let robot = if listens { emitter } else { listener };
        let angles = &self.angles[self.first[robot]..self.first[robot + 1]];
        let bearing = wrap_angle(heard.emitter.reverse_bearing() - headings[emitter]);
        self.direction(robot, facing(bearing, angles))
    }

    /// Computes everything from who is near whom and from headings.
    pub fn update(&mut self, antennas: &[Antenna], neighbours: &Neighbours, headings: &[f64]) {
        self.sectors.fill(None);
        self.observed.fill(None);
        let mut robot = 0;
        for group in antennas.chunk_by(|a, b| a.receiver == b.receiver) {
            let robots = robot..robot + group.len();
            robot = robots.end;
            if let Some(receiver) = group[0].receiver {
                self.update_group(robots, receiver, antennas, neighbours, headings);
            }
        }
    }

    /// As above, for robots whose receivers are alike.
    fn update_group(
        &mut self,
        robots: Range<usize>,
        receiver: Receiver,
        antennas: &[Antenna],
        neighbours: &Neighbours,
        headings: &[f64],
    ) {
        let places = neighbours.places(robots.start).start..neighbours.places(robots.end - 1).end;
        self.emitters.bearings.clear();
        for robot in robots.clone() {
            let bearings = neighbours.bearings(neighbours.places(robot));
            self.emitters.bearings.extend(bearings.iter().map(|bearing| bearing - headings[robot]));
        }
        self.emitters.complete(receiver, neighbours.distances(places.clone()));
        let half_width = PI / receiver.n_sectors as f64;
        for robot in robots {
            let angles = &self.angles[self.first[robot]..self.first[robot + 1]];
            self.emitters.loudest.clear();
            self.emitters.loudest.resize(angles.len(), (f64::NEG_INFINITY, 0));
            for place in neighbours.places(robot) {
                let emitter = neighbours.get(place);
                let reach = antennas[emitter.robot].emits_within.unwrap_or(-1.0);
                let is_heard = emitter.rho <= receiver.range.min(reach);
                let index = place - places.start;
                if self.emitters.phis[index] < half_width - BORDER {
                    self.emitters.hear(self.emitters.sectors[index] as usize, index, is_heard);
                    continue;
                }
                // On a border.
                for (sector, &angle) in angles.iter().enumerate() {
                    let phi = angular_difference(self.emitters.bearings[index], angle);
                    if phi <= half_width + BORDER {
                        self.emitters.hear(sector, index, is_heard);
                    }
                }
            }
            let sectors = &mut self.sectors[self.first[robot]..self.first[robot + 1]];
            let loudest = self.emitters.loudest.iter().zip(angles);
            for (heard, (&(log_strength, index), &angle)) in sectors.iter_mut().zip(loudest) {
                let is_heard = log_strength > f64::NEG_INFINITY;
                *heard = is_heard.then(|| Heard {
                    emitter: neighbours.get(places.start + index),
                    phi: angular_difference(self.emitters.bearings[index], angle),
                });
            }
        }
    }
}

impl Emitters {
    /// Makes an emitter the loudest of a sector if it is heard and louder than those before.
    /// That is not to be foreseen, so there is no branch.
    fn hear(&mut self, sector: usize, index: usize, is_heard: bool) {
        let loudest = &mut self.loudest[sector];
        let log_strength = self.log_strengths[index];
        let is_louder = is_heard & (log_strength > loudest.0);
        loudest.0 = if is_louder { log_strength } else { loudest.0 };
        loudest.1 = if is_louder { index } else { loudest.1 };
    }

    /// Completes what `bearings` begins: differences of two angles in \[0, 2 pi). `rho`: how
    /// far they are, cm.
    fn complete(&mut self, receiver: Receiver, rho: &[f64]) {
        self.sectors.resize(rho.len(), 0.0);
        self.phis.resize(rho.len(), 0.0);
        self.log_strengths.resize(rho.len(), 0.0);
        Isa::best().run(Complete { emitters: self, receiver, rho });
    }
}

struct Complete<'a> {
    emitters: &'a mut Emitters,
    receiver: Receiver,
    rho: &'a [f64],
}

impl WithSimd for Complete<'_> {
    type Output = ();

    /// Without a branch, the compiler computes several emitters at once.
    #[inline(always)]
    fn with_simd<S: Simd>(self, _simd: S) {
        let Self { emitters, receiver, rho } = self;
        let n_sectors = receiver.n_sectors as f64;
        let sectors_per_radian = n_sectors / TAU;
        let Emitters { bearings, sectors, phis, log_strengths, .. } = emitters;
        let heard = sectors.iter_mut().zip(phis).zip(log_strengths);
        for ((bearing, rho), ((sector, phi), log_strength)) in
            bearings.iter_mut().zip(rho).zip(heard)
        {
            // wrap_angle, for a difference of two angles
            let positive = if *bearing < 0.0 { *bearing + TAU } else { *bearing };
            *bearing = if positive < TAU { positive } else { 0.0 };
            let nearest = (*bearing * sectors_per_radian + 0.5).floor();
            let nearest = if nearest < n_sectors { nearest } else { 0.0 };
            // sector_angle and angular_difference
            let difference = (*bearing - nearest * TAU / n_sectors).abs();
            let off = if difference < TAU - difference { difference } else { TAU - difference };
            (*sector, *phi) = (nearest, off);
            *log_strength = receiver.decay.log_strength(*rho, off);
        }
    }
}

impl Heard {
    /// Strength of its frames.
    fn strength(&self, decay: Decay) -> f64 {
        decay.strength(self.emitter.rho, self.phi)
    }
}

/// The sector, of those with the given directions, that is nearest to an angle in
/// \[0, 2 pi); on ties the one of the lower index.
fn facing(angle: f64, sectors: &[f64]) -> usize {
    let n_sectors = sectors.len() as f64;
    let nearest = (angle * n_sectors / TAU + 0.5) as usize;
    let nearest = if nearest < sectors.len() { nearest } else { 0 };
    if angular_difference(angle, sectors[nearest]) < PI / n_sectors - BORDER {
        return nearest;
    }
    let mut nearest = (f64::INFINITY, 0);
    for (sector, &direction) in sectors.iter().enumerate() {
        let difference = angular_difference(angle, direction);
        if difference < nearest.0 - BORDER {
            nearest = (difference, sector);
        }
    }
    nearest.1
}

#[cfg(test)]
mod tests {
    use std::f64::consts::{FRAC_PI_2, FRAC_PI_4};

    use super::*;
    use crate::torus::Torus;

    const TORUS: Torus = Torus { width: 1000.0, height: 1000.0 };
    const ANTENNA: Antenna = Antenna {
        emits_within: Some(100.0),
        receiver: Some(Receiver {
            n_sectors: 4,
            range: 100.0,
            decay: Decay { rho: 0.05, phi: 1.0 },
            max_hops: 10,
            sending_direction: SendingDirection::Emitter,
        }),
    };

    fn hearing(antennas: &[Antenna], robots: &[(f64, f64, f64)]) -> Hearing {
        let positions: Vec<Vec2> = robots.iter().map(|&(x, y, _)| Vec2::new(x, y)).collect();
        let headings: Vec<f64> = robots.iter().map(|&(_, _, heading)| heading).collect();
        let mut hearing = Hearing::new(antennas);
        let mut neighbours = Neighbours::new(100.0, robots.len());
        neighbours.update(&TORUS, &positions);
        hearing.update(antennas, &neighbours, &headings);
        hearing
    }

    fn emitters(hearing: &Hearing, robot: usize) -> Vec<Option<usize>> {
        hearing.of(robot).iter().map(|heard| heard.map(|heard| heard.emitter.robot)).collect()
    }

    #[test]
    fn strength_and_directions_match_a_case_by_hand() {
        // 50 cm away, 53.13 degrees to the left; the other one looks up.
        let robots = [(990.0, 500.0, 0.0), (20.0, 540.0, FRAC_PI_2)];
        let hearing = hearing(&[ANTENNA; 2], &robots);
        assert_eq!(emitters(&hearing, 0), [None, Some(1), None, None]);
        let heard = hearing.of(0)[1].unwrap();
        let phi = FRAC_PI_2 - libm::atan2(4.0, 3.0);
        let strength = heard.strength(ANTENNA.receiver.unwrap().decay);
        assert!((strength - libm::exp(-2.5 - phi)).abs() < 1e-15);
        // Seen from the other: 143.13 degrees to its left, nearest to 180.
        let sending_direction = hearing.sending_direction(0, &heard, &[0.0, FRAC_PI_2]);
        assert!((sending_direction.x + 1.0).abs() < 1e-15);
        assert!(sending_direction.y.abs() < 1e-15);
        assert_eq!(emitters(&hearing, 1), [None, None, Some(0), None]);
    }

    #[test]
    fn the_strongest_wins_its_sector_and_the_lower_index_wins_ties() {
        let robots = [(500.0, 500.0, 0.0), (560.0, 500.0, 0.0), (550.0, 500.0, 0.0)];
        assert_eq!(emitters(&hearing(&[ANTENNA; 3], &robots), 0)[0], Some(2));
        let robots = [(500.0, 500.0, 0.0), (550.0, 520.0, 0.0), (550.0, 520.0, 0.0)];
        assert_eq!(emitters(&hearing(&[ANTENNA; 3], &robots), 0)[0], Some(1));
    }

    #[test]
    fn a_robot_on_a_border_is_heard_on_both_sides() {
        for corner in 0..4 {
            let angle = FRAC_PI_4 + f64::from(corner) * FRAC_PI_2;
            let away = Vec2::unit(angle);
            let other = (500.0 + 50.0 * away.x.signum(), 500.0 + 50.0 * away.y.signum(), 0.0);
            let hearing = hearing(&[ANTENNA; 2], &[(500.0, 500.0, 0.0), other]);
            let heard = emitters(&hearing, 0).iter().flatten().count();
            assert_eq!(heard, 2, "corner {corner}");
        }
    }

    #[test]
    fn the_smaller_reach_decides() {
        let weak = Antenna { emits_within: Some(40.0), ..ANTENNA };
        let robots = [(500.0, 500.0, 0.0), (550.0, 500.0, 0.0)];
        let hearing = hearing(&[ANTENNA, weak], &robots);
        assert_eq!(hearing.of(0), [None; 4]);
        assert_eq!(emitters(&hearing, 1)[2], Some(0));
    }

    #[test]
    fn robots_at_one_point_hear_each_other_ahead() {
        let hearing = hearing(&[ANTENNA; 2], &[(1.0, 1.0, 0.0), (1.0, 1.0, 0.0)]);
        assert_eq!(emitters(&hearing, 0), [Some(1), None, None, None]);
        assert_eq!(hearing.of(0)[0].unwrap().strength(ANTENNA.receiver.unwrap().decay), 1.0);
    }

    #[test]
    fn ears_and_voices_are_independent() {
        let beacon = Antenna { receiver: None, ..ANTENNA };
        let listener = Antenna { emits_within: None, ..ANTENNA };
        let robots = [(500.0, 500.0, 0.0), (550.0, 500.0, 0.0), (510.0, 500.0, 0.0)];
        let hearing = hearing(&[beacon, ANTENNA, listener], &robots);
        assert!(hearing.of(0).is_empty());
        assert_eq!(emitters(&hearing, 1)[2], Some(0));
        assert_eq!(emitters(&hearing, 2), [Some(1), None, Some(0), None]);
    }
}
