//! Finds the strongest emitter in every sector of every robot. The strongest emitters depend only
//! on positions and headings, so they are recomputed only after a robot has moved or turned.

use std::f64::consts::{PI, TAU};
use std::ops::Range;

use determinism::simd::{Simd, WithSimd};

use super::antenna::{Antenna, Receiver};
use crate::neighbours::Neighbours;
use crate::torus::{Vec2, angular_difference, sector_angle, wrap_angle};
use determinism::Isa;

/// Tolerance of sector borders, radians, so that a border belongs to both sectors in spite of
/// rounding.
const BORDER: f64 = 1e-12;

/// Number of robots to process together, few enough for their scratch data to stay in the cache.
const N_LISTENERS_AT_ONCE: usize = 128;

/// The strongest emitter in a sector of a robot.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Heard {
    /// The emitting robot; the number of robots if there is none.
    pub robot: u32,
    /// Its place among the neighbours.
    place: u32,
}

/// The strongest emitter in every sector of every robot. Every emitter puts a frame on the air in
/// each step, so the strongest emitter gives the frame of the sector.
#[derive(Debug, Clone)]
pub(crate) struct Hearing {
    /// Groups of robots with receivers.
    listeners: Vec<Listeners>,
    /// Reach of every robot's transmitter, cm; below 0 if it does not emit.
    reaches: Vec<f64>,
    emitters: Emitters,
}

/// Robots with consecutive numbers and equal receivers.
#[derive(Debug, Clone)]
pub(crate) struct Listeners {
    /// Their numbers.
    robots: Range<usize>,
    /// The receiver of each.
    pub receiver: Receiver,
    /// The strongest emitters, `[robot][sector]`.
    heard: Vec<Heard>,
    /// Direction of each sector in its robot's own frame of reference.
    angles: Vec<f64>,
    /// (cos, sin) of `angles`.
    pub directions: Vec<Vec2>,
}

/// Scratch: the neighbours of some listeners, from the listeners' view.
#[derive(Debug, Clone, Default)]
struct Emitters {
    /// Direction in the listener's own frame of reference.
    bearings: Vec<f64>,
    /// Sector whose direction is nearest.
    sectors: Vec<u32>,
    /// Logarithm of their strength.
    log_strengths: Vec<f64>,
    /// Whether any neighbour is on the border of two sectors.
    is_any_on_border: bool,
    /// The loudest in each sector of a robot.
    loudest: Vec<Loudest>,
}

/// The loudest emitter so far in a sector.
#[derive(Debug, Clone, Copy)]
struct Loudest {
    log_strength: f64,
    heard: Heard,
}

impl Loudest {
    /// Makes an emitter the loudest if it is heard and louder, or equally loud with a lower
    /// number. The outcome is unpredictable, so the code has no branch.
    #[inline(always)]
    fn hear(&mut self, log_strength: f64, emitter: Heard, is_heard: bool) {
        let is_first = (log_strength == self.log_strength) & (emitter.robot < self.heard.robot);
        let is_louder = is_heard & ((log_strength > self.log_strength) | is_first);
        self.log_strength = if is_louder { log_strength } else { self.log_strength };
        self.heard.robot = if is_louder { emitter.robot } else { self.heard.robot };
        self.heard.place = if is_louder { emitter.place } else { self.heard.place };
    }
}

impl Hearing {
    /// The state before the first [`update`](Self::update), in which no robot hears another.
    pub fn new(antennas: &[Antenna]) -> Self {
        let nobody = Heard { robot: antennas.len() as u32, place: 0 };
        let mut listeners = Vec::new();
        let mut robot = 0;
        for group in antennas.chunk_by(|a, b| a.receiver == b.receiver) {
            let robots = robot..robot + group.len();
            robot = robots.end;
            if let Some(receiver) = group[0].receiver {
                listeners.push(Listeners::new(robots, receiver, nobody));
            }
        }
        let reaches = antennas.iter().map(Antenna::reach);
        Self { listeners, reaches: reaches.collect(), emitters: Emitters::default() }
    }

    /// Groups of robots with receivers.
    pub fn listeners(&self) -> &[Listeners] {
        &self.listeners
    }

    /// Sets the distance within which each robot is heard, cm; negative if it is not heard.
    pub fn set_reaches(&mut self, reaches: impl Iterator<Item = f64>) {
        self.reaches.clear();
        self.reaches.extend(reaches);
    }

    /// Computes everything from neighbours and headings.
    pub fn update(&mut self, neighbours: &Neighbours, headings: &[f64]) {
        for listeners in &mut self.listeners {
            listeners.update(&self.reaches, &mut self.emitters, neighbours, headings);
        }
    }

    /// (cos, sin) of the emitter's sector that faces the listener, in the emitter's own frame of
    /// reference.
    pub fn sending_direction(
        &self,
        listener: &Listeners,
        heard: Heard,
        neighbours: &Neighbours,
        headings: &[f64],
    ) -> Vec2 {
        let emitter = heard.robot as usize;
        let listens = |listeners: &&Listeners| listeners.robots.contains(&emitter);
        // An emitter without a receiver has as many sectors as its listener.
        let Listeners { angles, directions, .. } =
            self.listeners.iter().find(listens).unwrap_or(listener);
        let reverse = neighbours.get(heard.place as usize).reverse_bearing();
        directions[facing(wrap_angle(reverse - headings[emitter]), angles)]
    }
}

impl Listeners {
    fn new(robots: Range<usize>, receiver: Receiver, nobody: Heard) -> Self {
        let n_sectors = receiver.n_sectors;
        let angles = (0..n_sectors).map(|sector| sector_angle(sector, n_sectors)).collect();
        let directions = receiver.directions().collect();
        let heard = vec![nobody; robots.len() * n_sectors];
        Self { robots, receiver, heard, angles, directions }
    }

    /// Each robot with the strongest emitter in each of its sectors.
    pub fn iter(&self) -> impl Iterator<Item = (usize, &[Heard])> {
        self.robots.clone().zip(self.heard.chunks_exact(self.angles.len()))
    }

    /// Logarithm of the strength of the emitter in a robot's sector.
    pub fn log_strength(
        &self,
        robot: usize,
        sector: usize,
        heard: Heard,
        neighbours: &Neighbours,
        headings: &[f64],
    ) -> f64 {
        let emitter = neighbours.get(heard.place as usize);
        let bearing = wrap_difference(emitter.bearing - headings[robot]);
        let phi = angular_difference(bearing, self.angles[sector]);
        self.receiver.decay.log_strength(emitter.rho, phi)
    }

    fn update(
        &mut self,
        reaches: &[f64],
        emitters: &mut Emitters,
        neighbours: &Neighbours,
        headings: &[f64],
    ) {
        let n_sectors = self.angles.len();
        let mut start = self.robots.start;
        for heard in self.heard.chunks_mut(N_LISTENERS_AT_ONCE * n_sectors) {
            let robots = start..start + heard.len() / n_sectors;
            start = robots.end;
            emitters.locate(self.receiver, neighbours, headings, robots.clone());
            emitters.choose(self.receiver, &self.angles, reaches, neighbours, robots, heard);
        }
    }
}

impl Emitters {
    /// Computes the neighbours of some robots, from the robots' view.
    fn locate(
        &mut self,
        receiver: Receiver,
        neighbours: &Neighbours,
        headings: &[f64],
        robots: Range<usize>,
    ) {
        let rho = neighbours.distances(places(neighbours, &robots));
        self.bearings.clear();
        for robot in robots {
            let bearings = neighbours.bearings(neighbours.places(robot));
            self.bearings.extend(bearings.iter().map(|bearing| bearing - headings[robot]));
        }
        self.sectors.resize(rho.len(), 0);
        self.log_strengths.resize(rho.len(), 0.0);
        Isa::best().run(Complete { emitters: self, receiver, rho });
    }

    /// Chooses the loudest neighbour in each sector of the robots: `heard`, `[robot][sector]`.
    fn choose(
        &mut self,
        receiver: Receiver,
        angles: &[f64],
        reaches: &[f64],
        neighbours: &Neighbours,
        robots: Range<usize>,
        heard: &mut [Heard],
    ) {
        let Self { bearings, sectors, log_strengths, is_any_on_border, loudest } = self;
        let nobody = Heard { robot: reaches.len() as u32, place: 0 };
        let first = places(neighbours, &robots).start;
        for (robot, heard) in robots.zip(heard.chunks_exact_mut(angles.len())) {
            let places = neighbours.places(robot);
            let its = places.start - first..places.end - first;
            let who = neighbours.robots(places.clone()).iter().zip(places.clone());
            let emitters = who.zip(neighbours.distances(places));
            let how = sectors[its.clone()].iter().zip(&log_strengths[its.clone()]);
            loudest.clear();
            loudest.resize(angles.len(), Loudest { log_strength: f64::MIN, heard: nobody });
            for ((((&emitter, place), &rho), (&nearest, &log_strength)), &bearing) in
                emitters.zip(how).zip(&bearings[its])
            {
                let is_heard = rho <= receiver.range.min(reaches[emitter as usize]);
                let emitter = Heard { robot: emitter, place: place as u32 };
                if !*is_any_on_border || !is_on_border(bearing, angles[nearest as usize], angles) {
                    loudest[nearest as usize].hear(log_strength, emitter, is_heard);
                    continue;
                }
                for (loudest, &angle) in loudest.iter_mut().zip(angles) {
                    if angular_difference(bearing, angle) <= half_width(angles) + BORDER {
                        loudest.hear(log_strength, emitter, is_heard);
                    }
                }
            }
            for (heard, loudest) in heard.iter_mut().zip(&*loudest) {
                *heard = loudest.heard;
            }
        }
    }
}

/// Range of the neighbours of some robots.
fn places(neighbours: &Neighbours, robots: &Range<usize>) -> Range<usize> {
    neighbours.places(robots.start).start..neighbours.places(robots.end - 1).end
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
        let border = PI / n_sectors - BORDER;
        let mut n_on_border = 0;
        let Emitters { bearings, sectors, log_strengths, .. } = &mut *emitters;
        for ((bearing, rho), (sector, log_strength)) in
            bearings.iter_mut().zip(rho).zip(sectors.iter_mut().zip(log_strengths))
        {
            *bearing = wrap_difference(*bearing);
            let nearest = (*bearing * sectors_per_radian + 0.5).floor();
            let nearest = if nearest < n_sectors { nearest } else { 0.0 };
            // sector_angle and angular_difference
            let difference = (*bearing - nearest * TAU / n_sectors).abs();
            let off = if difference < TAU - difference { difference } else { TAU - difference };
            *sector = nearest as u32;
            *log_strength = receiver.decay.log_strength(*rho, off);
            n_on_border += u32::from(off >= border);
        }
        emitters.is_any_on_border = n_on_border > 0;
    }
}

/// `wrap_angle` for a difference of two angles, without a branch.
#[inline(always)]
fn wrap_difference(difference: f64) -> f64 {
    let positive = if difference < 0.0 { difference + TAU } else { difference };
    if positive < TAU { positive } else { 0.0 }
}

/// Half the width of the sectors with the given directions, radians.
fn half_width(sectors: &[f64]) -> f64 {
    PI / sectors.len() as f64
}

/// Whether an angle is on the border of the sector that is nearest to it.
fn is_on_border(angle: f64, nearest: f64, sectors: &[f64]) -> bool {
    angular_difference(angle, nearest) >= half_width(sectors) - BORDER
}

/// Index of the sector whose direction is nearest to an angle in \[0, 2 pi); the lower index wins
/// ties.
fn facing(angle: f64, sectors: &[f64]) -> usize {
    let n_sectors = sectors.len() as f64;
    let nearest = (angle * n_sectors / TAU + 0.5) as usize;
    let nearest = if nearest < sectors.len() { nearest } else { 0 };
    if !is_on_border(angle, sectors[nearest], sectors) {
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
    use crate::sensors::Decay;
    use crate::torus::Torus;
    use experiment_file::SendingDirection;

    const TORUS: Torus = Torus::new(1000.0, 1000.0);
    const ANTENNA: Antenna = Antenna {
        emits_within: Some(100.0),
        receiver: Some(Receiver {
            n_sectors: 4,
            range: 100.0,
            decay: Decay { rho: 0.05, phi: 1.0 },
            max_hops: 10,
            sending_direction: SendingDirection::Emitter,
            observes_sending_direction: true,
        }),
    };

    /// Robots that hear each other, with positions and headings.
    struct Scene {
        neighbours: Neighbours,
        headings: Vec<f64>,
        hearing: Hearing,
    }

    fn scene(antennas: &[Antenna], robots: &[(f64, f64, f64)]) -> Scene {
        let positions: Vec<Vec2> = robots.iter().map(|&(x, y, _)| Vec2::new(x, y)).collect();
        let headings: Vec<f64> = robots.iter().map(|&(_, _, heading)| heading).collect();
        let mut hearing = Hearing::new(antennas);
        let mut neighbours = Neighbours::new(100.0, robots.len());
        neighbours.update(&TORUS, &positions);
        hearing.update(&neighbours, &headings);
        Scene { neighbours, headings, hearing }
    }

    impl Scene {
        /// The group of a robot, and the robot's strongest emitters.
        fn heard_by(&self, robot: usize) -> (&Listeners, &[Heard]) {
            let kinds = self.hearing.listeners().iter();
            let mut robots =
                kinds.flat_map(|kind| kind.iter().map(move |listening| (kind, listening)));
            let found = robots.find(|(_, (listener, _))| *listener == robot);
            found.map(|(kind, (_, heard))| (kind, heard)).expect("the robot listens")
        }

        /// The emitters that a robot hears, sector by sector.
        fn emitters(&self, robot: usize) -> Vec<Option<usize>> {
            let emitter = |heard: &Heard| {
                let robot = heard.robot as usize;
                (robot < self.headings.len()).then_some(robot)
            };
            self.heard_by(robot).1.iter().map(emitter).collect()
        }

        fn strength(&self, robot: usize, sector: usize) -> f64 {
            let (kind, heard) = self.heard_by(robot);
            let (neighbours, headings) = (&self.neighbours, &self.headings);
            libm::exp(kind.log_strength(robot, sector, heard[sector], neighbours, headings))
        }
    }

    #[test]
    fn strength_and_directions_match_a_case_by_hand() {
        // The other robot is 50 cm away, 53.13 degrees to the left, and looks up.
        let robots = [(990.0, 500.0, 0.0), (20.0, 540.0, FRAC_PI_2)];
        let scene = scene(&[ANTENNA; 2], &robots);
        assert_eq!(scene.emitters(0), [None, Some(1), None, None]);
        let phi = FRAC_PI_2 - libm::atan2(4.0, 3.0);
        assert!((scene.strength(0, 1) - libm::exp(-2.5 - phi)).abs() < 1e-15);
        // Seen from the other robot: 143.13 degrees to its left, nearest to 180.
        let (kind, heard) = scene.heard_by(0);
        let (neighbours, headings) = (&scene.neighbours, &scene.headings);
        let sending_direction =
            scene.hearing.sending_direction(kind, heard[1], neighbours, headings);
        assert!((sending_direction.x + 1.0).abs() < 1e-15);
        assert!(sending_direction.y.abs() < 1e-15);
        assert_eq!(scene.emitters(1), [None, None, Some(0), None]);
    }

    #[test]
    fn the_strongest_wins_its_sector_and_the_lower_index_wins_ties() {
        let robots = [(500.0, 500.0, 0.0), (560.0, 500.0, 0.0), (550.0, 500.0, 0.0)];
        assert_eq!(scene(&[ANTENNA; 3], &robots).emitters(0)[0], Some(2));
        let robots = [(500.0, 500.0, 0.0), (550.0, 520.0, 0.0), (550.0, 520.0, 0.0)];
        assert_eq!(scene(&[ANTENNA; 3], &robots).emitters(0)[0], Some(1));
    }

    #[test]
    fn a_robot_on_a_border_is_heard_on_both_sides() {
        for corner in 0..4 {
            let angle = FRAC_PI_4 + f64::from(corner) * FRAC_PI_2;
            let away = Vec2::unit(angle);
            let other = (500.0 + 50.0 * away.x.signum(), 500.0 + 50.0 * away.y.signum(), 0.0);
            let scene = scene(&[ANTENNA; 2], &[(500.0, 500.0, 0.0), other]);
            let heard = scene.emitters(0).iter().flatten().count();
            assert_eq!(heard, 2, "corner {corner}");
        }
    }

    #[test]
    fn the_smaller_reach_decides() {
        let weak = Antenna { emits_within: Some(40.0), ..ANTENNA };
        let robots = [(500.0, 500.0, 0.0), (550.0, 500.0, 0.0)];
        let scene = scene(&[ANTENNA, weak], &robots);
        assert_eq!(scene.emitters(0), [None; 4]);
        assert_eq!(scene.emitters(1)[2], Some(0));
    }

    #[test]
    fn robots_at_one_point_hear_each_other_ahead() {
        let scene = scene(&[ANTENNA; 2], &[(1.0, 1.0, 0.0), (1.0, 1.0, 0.0)]);
        assert_eq!(scene.emitters(0), [Some(1), None, None, None]);
        assert_eq!(scene.strength(0, 0), 1.0);
    }

    #[test]
    fn receivers_and_transmitters_are_independent() {
        let beacon = Antenna { receiver: None, ..ANTENNA };
        let listener = Antenna { emits_within: None, ..ANTENNA };
        let robots = [(500.0, 500.0, 0.0), (550.0, 500.0, 0.0), (510.0, 500.0, 0.0)];
        let scene = scene(&[beacon, ANTENNA, listener], &robots);
        let n_listeners: usize =
            scene.hearing.listeners().iter().map(|kind| kind.iter().count()).sum();
        assert_eq!(n_listeners, 2);
        assert_eq!(scene.emitters(1)[2], Some(0));
        assert_eq!(scene.emitters(2), [Some(1), None, Some(0), None]);
    }
}
