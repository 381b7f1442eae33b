//! A step as a drawing, on pixels or as SVG. Lengths are in points: a canvas has [`POINTS`] along
//! each side, each of several pixels, so finer pixels give a smoother drawing.

use std::{f64::consts::PI, iter};

use experiment_file::{ExperimentConfig, ObjectConfig};
use plotters::{
    coord::Shift,
    drawing::DrawingAreaErrorKind,
    prelude::*,
    style::text_anchor::{HPos, Pos, VPos},
};
use sim_core::{Mode, Outline, RobotRecord, RoomRecord, StepRecord, Vec2};

use super::camera::Camera;
use crate::figure::{FONT, embed_font};

/// Side of a canvas, points.
const POINTS: f64 = 800.0;
/// Radius of a robot, cm, and the smallest and largest drawn radius, points.
const RADIUS: f64 = 5.5;
const RADII: (f64, f64) = (5.0, 20.0);
/// Rings of a glow, from its reach inwards: share of the reach, and opacity.
const GLOW: [(f64, f64); 5] = [(1.0, 0.03), (0.8, 0.035), (0.6, 0.04), (0.4, 0.05), (0.2, 0.08)];
/// Length of an arrow's head, points, and half its angle.
const HEAD: (f64, f64) = (9.0, 0.45);
/// Lengths of a scale bar, cm; the longest that fits a quarter of the side is drawn.
const BARS: [f64; 10] = [5.0, 10.0, 20.0, 50.0, 100.0, 200.0, 500.0, 1000.0, 2000.0, 5000.0];

const GROUND: RGBColor = RGBColor(251, 252, 254);
const GRID: RGBColor = RGBColor(230, 233, 240);
const INK: RGBColor = RGBColor(28, 35, 51);
const WAY: RGBColor = RGBColor(179, 192, 220);
const FRAME: RGBColor = RGBColor(36, 86, 201);
const OFF: RGBColor = RGBColor(91, 107, 140);
const ON: RGBColor = RGBColor(215, 38, 61);
const RELAY: RGBColor = RGBColor(199, 119, 0);
const TARGET: RGBColor = RGBColor(24, 121, 78);
const LIGHT: RGBColor = RGBColor(245, 179, 1);

type Area<B> = DrawingArea<B, Shift>;
type Drawn<B> = Result<(), DrawingAreaErrorKind<<B as DrawingBackend>::ErrorType>>;
type Place = (i32, i32);

/// Constants of all steps.
pub struct Fixed<'a> {
    /// Reach, cm, and colour.
    areas: Vec<(f64, RGBColor)>,
    lights: Vec<(f64, RGBColor)>,
    /// Of a world with bodies.
    room: Option<&'a RoomRecord>,
}

impl<'a> Fixed<'a> {
    /// The areas and lights, in the order of the records.
    pub fn new(config: &ExperimentConfig, room: Option<&'a RoomRecord>) -> Self {
        let mut discs = Self { areas: Vec::new(), lights: Vec::new(), room };
        for object in config.world.objects.values() {
            let (all, disc, n) = match object {
                ObjectConfig::GroundArea(area) => {
                    let disc = (area.params.range, color_named(&area.params.color));
                    (&mut discs.areas, disc, area.num_instances)
                }
                ObjectConfig::LightSource(light) => {
                    let disc = (light.params.range, color_named(&light.params.color));
                    (&mut discs.lights, disc, light.num_instances)
                }
                _ => continue,
            };
            all.extend(iter::repeat_n(disc, n as usize));
        }
        discs
    }
}

/// The colour of a word; grey for colours that only the task knows.
fn color_named(name: &str) -> RGBColor {
    match name {
        "black" => RGBColor(0, 0, 0),
        "white" => RGBColor(200, 206, 216), // visible on a white ground
        "red" => ON,
        "green" => TARGET,
        "blue" => FRAME,
        "yellow" => LIGHT,
        _ => OFF,
    }
}

/// Draws the last of some steps, and the trails that lead to it. `side`: of the canvas,
/// pixels.
pub fn draw<B: DrawingBackend>(
    area: &Area<B>,
    side: u32,
    camera: &Camera,
    fixed: &Fixed<'_>,
    way: &[StepRecord],
) -> Drawn<B> {
    let Some(now) = way.last() else { return Ok(()) };
    embed_font();
    let pen = Pen { area, camera, side, unit: f64::from(side) / POINTS };
    area.fill(&GROUND)?;
    pen.places(fixed, now)?;
    pen.grid()?;
    if let Some(room) = fixed.room {
        pen.room(room, now)?;
    }
    pen.trails(way)?;
    pen.hearing(now)?;
    for (index, robot) in now.robots.iter().enumerate() {
        let radius = fixed.room.map(|room| pen.pixels(room.radii[index]));
        pen.robot(robot, radius.unwrap_or(pen.radius()))?;
    }
    pen.scale_bar()?;
    let style = pen.text(22.0).pos(Pos::new(HPos::Right, VPos::Bottom));
    let corner = side as i32 - pen.px(14.0);
    area.draw(&Text::new(format!("step {}", now.step), (corner, corner), style))?;
    area.present()
}

/// Draws the view of a camera on a canvas.
struct Pen<'a, B: DrawingBackend> {
    area: &'a Area<B>,
    camera: &'a Camera,
    side: u32,
    /// Pixels of a point.
    unit: f64,
}

impl<B: DrawingBackend> Pen<'_, B> {
    fn px(&self, points: f64) -> i32 {
        (points * self.unit).round() as i32
    }

    fn stroke(&self, color: impl Into<RGBAColor>, points: f64) -> ShapeStyle {
        ShapeStyle::from(color.into()).stroke_width(self.px(points).max(1) as u32)
    }

    fn text(&self, points: f64) -> TextStyle<'static> {
        (FONT, points * self.unit).into_font().color(&INK)
    }

    fn disc(&self, at: Place, radius: i32, color: RGBAColor) -> Drawn<B> {
        self.area.draw(&Circle::new(at, radius, color.filled()))
    }

    fn line(&self, ends: &[Place], style: ShapeStyle) -> Drawn<B> {
        self.area.draw(&PathElement::new(ends.to_vec(), style))
    }

    /// Whether a line lies within the picture and does not jump across the edge of the world.
    fn is_near(&self, from: Place, to: Place) -> bool {
        let seen = 0..=self.side as i32;
        let is_seen = |at: Place| seen.contains(&at.0) && seen.contains(&at.1);
        is_seen(from)
            && is_seen(to)
            && (from.0 - to.0).abs().max((from.1 - to.1).abs()) < self.side as i32 / 2
    }

    fn places(&self, discs: &Fixed<'_>, now: &StepRecord) -> Drawn<B> {
        let pixels = |cm: f64| self.pixels(cm);
        for ((reach, color), center) in discs.lights.iter().zip(&now.lights) {
            for (share, opacity) in GLOW {
                self.disc(self.camera.place(*center), pixels(share * reach), color.mix(opacity))?;
            }
        }
        // Drawn over the glow, areas keep their colours.
        for ((reach, color), center) in discs.areas.iter().zip(&now.areas) {
            self.disc(self.camera.place(*center), pixels(*reach), color.mix(0.3))?;
        }
        for ((_, color), center) in discs.lights.iter().zip(&now.lights) {
            self.disc(self.camera.place(*center), self.px(6.0), color.mix(1.0))?;
        }
        Ok(())
    }

    fn pixels(&self, cm: f64) -> i32 {
        (cm * self.camera.scale).round() as i32
    }

    /// Walls, what stands in the room, and what robots push.
    fn room(&self, room: &RoomRecord, now: &StepRecord) -> Drawn<B> {
        let still = (Vec2::default(), 0.0);
        for obstacle in &room.obstacles {
            self.outline(obstacle, still, WAY)?;
        }
        for (movable, record) in room.movables.iter().zip(&now.movables) {
            self.outline(movable, (record.position, record.heading), LIGHT)?;
        }
        let wall = self.stroke(INK, 4.0);
        let corners = room.boundary.iter().chain(room.boundary.first());
        let boundary: Vec<Place> = corners.map(|corner| self.camera.place(*corner)).collect();
        self.line(&boundary, wall)?;
        for ends in &room.walls {
            self.line(&ends.map(|end| self.camera.place(end)), wall)?;
        }
        Ok(())
    }

    /// A shape at a place, turned by a heading.
    fn outline(&self, shape: &Outline, (at, heading): (Vec2, f64), color: RGBColor) -> Drawn<B> {
        let (sin, cos) = libm::sincos(heading);
        let placed = |corner: &Vec2| {
            let x = at.x + cos * corner.x - sin * corner.y;
            self.camera.place(Vec2::new(x, at.y + sin * corner.x + cos * corner.y))
        };
        match shape {
            Outline::Disc { center, radius } => {
                let (center, radius) = (placed(center), self.pixels(*radius));
                self.disc(center, radius, color.mix(0.6))?;
                self.area.draw(&Circle::new(center, radius, self.stroke(INK, 1.5)))
            }
            Outline::Polygon(corners) => {
                let mut corners: Vec<Place> = corners.iter().map(placed).collect();
                self.area.draw(&Polygon::new(corners.clone(), color.mix(0.6).filled()))?;
                corners.extend(corners.first().copied());
                self.line(&corners, self.stroke(INK, 1.5))
            }
        }
    }

    /// A line per metre.
    fn grid(&self) -> Drawn<B> {
        let (side, scale) = (self.side as i32, self.camera.scale);
        let half = f64::from(self.side) / 2.0;
        let lines = |middle: f64| {
            let across = f64::from(self.side) / scale;
            let first = ((middle - across / 2.0) / 100.0).ceil();
            (0..=(across / 100.0) as u32).map(move |i| (first + f64::from(i)) * 100.0 - middle)
        };
        let style = self.stroke(GRID, 1.0);
        for x in lines(self.camera.middle.x).map(|way| (half + way * scale) as i32) {
            self.line(&[(x, 0), (x, side)], style)?;
        }
        for y in lines(self.camera.middle.y).map(|way| (half - way * scale) as i32) {
            self.line(&[(0, y), (side, y)], style)?;
        }
        Ok(())
    }

    /// The trails of all robots, cut where a robot crossed the edge.
    fn trails(&self, way: &[StepRecord]) -> Drawn<B> {
        let n_robots = way.last().map_or(0, |now| now.robots.len());
        let style = self.stroke(WAY, 1.5);
        for robot in 0..n_robots {
            let places: Vec<Place> =
                way.iter().map(|step| self.camera.place(step.robots[robot].position)).collect();
            for piece in places.chunk_by(|from, to| self.is_near(*from, *to)) {
                if piece.len() > 1 {
                    self.line(piece, style)?;
                }
            }
        }
        Ok(())
    }

    /// Arrows from emitters to receivers.
    fn hearing(&self, now: &StepRecord) -> Drawn<B> {
        let style = self.stroke(FRAME.mix(0.55), 1.6);
        for robot in &now.robots {
            let Some(frame) = robot.received else { continue };
            let from = self.camera.place(now.robots[frame.emitter].position);
            let to = self.camera.place(robot.position);
            let (dx, dy) = (f64::from(to.0 - from.0), f64::from(to.1 - from.1));
            let length = libm::hypot(dx, dy);
            let edge = self.radius() + self.px(2.0);
            if !self.is_near(from, to) || length < f64::from(3 * edge) {
                continue;
            }
            let share = 1.0 - f64::from(edge) / length;
            let tip = (from.0 + (dx * share) as i32, from.1 + (dy * share) as i32);
            self.line(&[from, tip], style)?;
            let (size, angle) = HEAD;
            let back = libm::atan2(dy, dx) + PI;
            let barb = |side: f64| {
                let (sin, cos) = libm::sincos(back + side * angle);
                let length = size * self.unit;
                (tip.0 + (length * cos).round() as i32, tip.1 + (length * sin).round() as i32)
            };
            let head = vec![barb(1.0), tip, barb(-1.0)];
            self.area.draw(&Polygon::new(head, FRAME.mix(0.8).filled()))?;
        }
        Ok(())
    }

    /// Pixels.
    fn radius(&self) -> i32 {
        let (least, most) = RADII;
        (RADIUS * self.camera.scale).clamp(least * self.unit, most * self.unit).round() as i32
    }

    fn robot(&self, robot: &RobotRecord, radius: i32) -> Drawn<B> {
        let (x, y) = self.camera.place(robot.position);
        let times = |factor: f64| (factor * f64::from(radius)).round() as i32;
        let ring = |factor: f64, color: RGBColor| {
            self.area.draw(&Circle::new((x, y), times(factor), self.stroke(color, 2.0)))
        };
        let color = if robot.led > 0 { ON } else { OFF };
        if robot.led > 0 {
            self.disc((x, y), times(1.9), ON.mix(0.22))?;
        }
        if robot.target == Some(true) {
            ring(1.6, TARGET)?;
        }
        let (sin, cos) = libm::sincos(robot.heading % (2.0 * PI));
        let nose = (x + times(1.8 * cos), y - times(1.8 * sin));
        self.line(&[(x, y), nose], self.stroke(INK, 2.6))?;
        self.disc((x, y), radius, color.mix(if robot.failed { 0.4 } else { 1.0 }))?;
        if robot.failed {
            // Crossed out.
            for slope in [-radius, radius] {
                let ends = [(x - radius, y - slope), (x + radius, y + slope)];
                self.line(&ends, self.stroke(INK, 2.0))?;
            }
        }
        if robot.touches {
            ring(1.0, FRAME)?;
        }
        if robot.carries {
            self.disc((x, y), times(0.5), TARGET.mix(1.0))?;
        }
        if robot.mode == Mode::Relay {
            ring(1.0, RELAY)?;
        }
        Ok(())
    }

    /// A length to compare with.
    fn scale_bar(&self) -> Drawn<B> {
        let room = f64::from(self.side) / 4.0;
        let fits = |cm: &&f64| **cm * self.camera.scale <= room;
        let cm = BARS.iter().rev().find(fits).copied().unwrap_or(BARS[0]);
        let (left, bottom) = (self.px(14.0), self.side as i32 - self.px(14.0));
        let right = left + (cm * self.camera.scale).round() as i32;
        let tick = self.px(6.0);
        let bar = [(left, bottom - tick), (left, bottom), (right, bottom), (right, bottom - tick)];
        self.line(&bar, self.stroke(INK, 2.0))?;
        let name = if cm < 100.0 { format!("{cm} cm") } else { format!("{} m", cm / 100.0) };
        let style = self.text(18.0).pos(Pos::new(HPos::Left, VPos::Bottom));
        let at = (left + self.px(6.0), bottom - self.px(4.0));
        self.area.draw(&Text::new(name, at, style))
    }
}
