//! Steps of an episode as PNG: one as a picture, several as an animation.

use std::{f64::consts::PI, str::FromStr};

use experiment_file::{ExperimentConfig, ObjectConfig};
use plotters::{coord::Shift, prelude::*};
use sim_core::{Mode, StepRecord, Vec2};

use crate::{
    error::Error,
    figure::{FONT, embed_font},
};

/// Side of a picture, pixels.
const SIDE: u32 = 800;
/// Most steps of an animation.
const FRAMES_MAX: usize = 2_000;
/// Steps per second of an animation.
const PACE: u16 = 20;
/// Steps of the way behind a robot.
const TRAIL: usize = 60;
/// Around everything that is shown, cm.
const MARGIN: f64 = 40.0;

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

/// Which steps a PNG shows.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Moments {
    first: u32,
    last: u32,
}

impl FromStr for Moments {
    type Err = String;

    /// Reads `120` and `0..299`, of which both ends belong to it.
    fn from_str(text: &str) -> Result<Self, String> {
        let number = |text: &str| {
            text.parse::<u32>().map_err(|_| format!("`{text}` is not a step, a number from 0"))
        };
        let (first, last) = match text.split_once("..") {
            Some((first, last)) => (number(first)?, number(last)?),
            None => (number(text)?, number(text)?),
        };
        if last < first {
            return Err(format!("`{text}` ends before it begins"));
        }
        Ok(Self { first, last })
    }
}

/// The PNG of some of an episode's steps; of the last one if none are named.
pub fn png(
    config: &ExperimentConfig,
    steps: &[StepRecord],
    moments: Option<Moments>,
) -> Result<Vec<u8>, Error> {
    let n_steps = steps.len();
    let last = n_steps.saturating_sub(1) as u32;
    let Moments { first, last } = moments.unwrap_or(Moments { first: last, last });
    let shown = first as usize..=last as usize;
    if last as usize >= n_steps {
        return Err(Error::Input(format!(
            "--at {last}: the episode has steps 0 to {}",
            n_steps - 1
        )));
    }
    let n_frames = shown.clone().count();
    if n_frames > FRAMES_MAX {
        return Err(Error::Input(format!("an animation has at most {FRAMES_MAX} steps")));
    }
    let camera = Camera::around(config, &steps[shown.clone()]);
    let discs = discs(config);
    let mut bytes = Vec::new();
    let mut encoder = png::Encoder::new(&mut bytes, SIDE, SIDE);
    encoder.set_color(png::ColorType::Rgb);
    encoder.set_depth(png::BitDepth::Eight);
    if n_frames > 1 {
        encoder.set_animated(n_frames as u32, 0).map_err(internal)?;
        encoder.set_frame_delay(1, PACE).map_err(internal)?;
    }
    let mut writer = encoder.write_header().map_err(internal)?;
    for step in shown {
        let mut pixels = vec![0; 3 * (SIDE * SIDE) as usize];
        {
            let backend = BitMapBackend::with_buffer(&mut pixels, (SIDE, SIDE));
            let way = &steps[step.saturating_sub(TRAIL)..=step];
            draw(&backend.into_drawing_area(), &camera, &discs, way).map_err(internal)?;
        }
        writer.write_image_data(&pixels).map_err(internal)?;
    }
    writer.finish().map_err(internal)?;
    Ok(bytes)
}

fn internal(error: impl std::fmt::Display) -> Error {
    Error::Internal(format!("the picture cannot be drawn: {error}"))
}

/// The square of the plane that is seen. The plane is a torus: everything is drawn at the
/// image that is nearest to the middle.
struct Camera {
    middle: Vec2,
    period: Vec2,
    /// Pixels per cm.
    scale: f64,
}

impl Camera {
    /// Sees all robots and lights in some steps; at most the whole world.
    fn around(config: &ExperimentConfig, steps: &[StepRecord]) -> Self {
        let period = Vec2::new(config.world.width, config.world.height);
        let places = || steps.iter().flat_map(places);
        let start = places().next().unwrap_or_default();
        let (mut low, mut high) = ([0.0_f64; 2], [0.0_f64; 2]);
        for place in places() {
            let way =
                [shortest(place.x - start.x, period.x), shortest(place.y - start.y, period.y)];
            for axis in 0..2 {
                low[axis] = low[axis].min(way[axis]);
                high[axis] = high[axis].max(way[axis]);
            }
        }
        let side = (high[0] - low[0]).max(high[1] - low[1]) + 2.0 * MARGIN;
        let side = side.min(period.x.max(period.y));
        let middle = Vec2::new(
            start.x + f64::midpoint(low[0], high[0]),
            start.y + f64::midpoint(low[1], high[1]),
        );
        Self { middle, period, scale: f64::from(SIDE) / side }
    }

    /// Pixels of a place; y points up.
    fn place(&self, at: Vec2) -> (i32, i32) {
        let x = shortest(at.x - self.middle.x, self.period.x) * self.scale;
        let y = shortest(at.y - self.middle.y, self.period.y) * self.scale;
        let half = f64::from(SIDE) / 2.0;
        ((half + x).round() as i32, (half - y).round() as i32)
    }
}

fn places(step: &StepRecord) -> impl Iterator<Item = Vec2> {
    step.robots.iter().map(|robot| robot.position).chain(step.lights.iter().copied())
}

/// Radius, cm, and colour of every ground area, in the order of the records.
fn discs(config: &ExperimentConfig) -> Vec<(f64, RGBColor)> {
    let areas = config.world.objects.values().filter_map(|object| match object {
        ObjectConfig::GroundArea(area) => Some(area),
        _ => None,
    });
    let each = areas.flat_map(|area| {
        let disc = (area.params.range, color_named(&area.params.color));
        std::iter::repeat_n(disc, area.num_instances as usize)
    });
    each.collect()
}

/// The colour of a word; grey for those that only the task knows.
fn color_named(name: &str) -> RGBColor {
    match name {
        "black" => RGBColor(0, 0, 0),
        "white" => RGBColor(200, 206, 216), // against a ground that is white
        "red" => ON,
        "green" => TARGET,
        "blue" => FRAME,
        "yellow" => LIGHT,
        _ => OFF,
    }
}

/// The representative of a difference with the least absolute value.
fn shortest(difference: f64, period: f64) -> f64 {
    difference - period * (difference / period).round()
}

type Area<'a> = DrawingArea<BitMapBackend<'a>, Shift>;
type Drawn<'a> = Result<(), DrawingAreaErrorKind<<BitMapBackend<'a> as DrawingBackend>::ErrorType>>;

/// Draws the last of some steps, and the ways that lead to it.
fn draw<'a>(
    area: &Area<'a>,
    camera: &Camera,
    discs: &[(f64, RGBColor)],
    way: &[StepRecord],
) -> Drawn<'a> {
    let Some(now) = way.last() else { return Ok(()) };
    embed_font();
    area.fill(&GROUND)?;
    for ((radius, color), center) in discs.iter().zip(&now.areas) {
        let radius = (radius * camera.scale).round() as i32;
        area.draw(&Circle::new(camera.place(*center), radius, color.mix(0.25).filled()))?;
    }
    draw_grid(area, camera)?;
    for light in &now.lights {
        for (radius, opacity) in [(36, 0.2), (20, 0.35), (9, 1.0)] {
            area.draw(&Circle::new(camera.place(*light), radius, LIGHT.mix(opacity).filled()))?;
        }
    }
    for robot in 0..now.robots.len() {
        let steps = way.windows(2).map(|two| [0, 1].map(|i| two[i].robots[robot].position));
        for [from, to] in steps.map(|ends| ends.map(|end| camera.place(end))) {
            draw_line(area, from, to, WAY.stroke_width(2))?;
        }
    }
    for robot in &now.robots {
        if let Some(frame) = robot.received {
            let from = camera.place(now.robots[frame.emitter].position);
            draw_line(area, from, camera.place(robot.position), FRAME.mix(0.45).stroke_width(2))?;
        }
    }
    let radius = (5.5 * camera.scale).clamp(5.0, 20.0);
    for robot in &now.robots {
        let (x, y) = camera.place(robot.position);
        let color = if robot.led > 0 { ON } else { OFF };
        if robot.led > 0 {
            area.draw(&Circle::new((x, y), 1.9 * radius, ON.mix(0.22).filled()))?;
        }
        if robot.target == Some(true) {
            area.draw(&Circle::new((x, y), 1.6 * radius, TARGET.stroke_width(2)))?;
        }
        let (sin, cos) = libm::sincos(robot.heading % (2.0 * PI));
        let ahead = |length: f64, at: i32, share: f64| at + (length * share).round() as i32;
        let nose = (ahead(1.8 * radius, x, cos), ahead(1.8 * radius, y, -sin));
        area.draw(&PathElement::new([(x, y), nose], INK.stroke_width(3)))?;
        let opacity = if robot.failed { 0.4 } else { 1.0 };
        area.draw(&Circle::new((x, y), radius, color.mix(opacity).filled()))?;
        if robot.failed {
            // Crossed out.
            let arm = radius.round() as i32;
            for slope in [-arm, arm] {
                let ends = [(x - arm, y - slope), (x + arm, y + slope)];
                area.draw(&PathElement::new(ends, INK.stroke_width(2)))?;
            }
        }
        if robot.carries {
            area.draw(&Circle::new((x, y), 0.5 * radius, TARGET.filled()))?;
        }
        if robot.mode == Mode::Relay {
            area.draw(&Circle::new((x, y), radius, RELAY.stroke_width(2)))?;
        }
    }
    let caption = format!("step {}", now.step);
    let style = (FONT, 22).into_text_style(area).color(&INK);
    area.draw(&Text::new(caption, (14, SIDE as i32 - 32), style))?;
    area.present()
}

/// A line, unless it leads over the edge to the other side.
fn draw_line<'a>(
    area: &Area<'a>,
    from: (i32, i32),
    to: (i32, i32),
    style: ShapeStyle,
) -> Drawn<'a> {
    let is_seen = (from.0 - to.0).abs().max((from.1 - to.1).abs()) < SIDE as i32 / 2;
    if is_seen { area.draw(&PathElement::new([from, to], style)) } else { Ok(()) }
}

/// A line per metre.
fn draw_grid<'a>(area: &Area<'a>, camera: &Camera) -> Drawn<'a> {
    let side = f64::from(SIDE) / camera.scale;
    let lines = |middle: f64| {
        let first = ((middle - side / 2.0) / 100.0).ceil();
        (0..(side / 100.0).ceil() as u32).map(move |i| (first + f64::from(i)) * 100.0 - middle)
    };
    let (half, edge) = (f64::from(SIDE) / 2.0, SIDE as i32);
    for x in lines(camera.middle.x).map(|way| (half + way * camera.scale) as i32) {
        area.draw(&PathElement::new([(x, 0), (x, edge)], GRID))?;
    }
    for y in lines(camera.middle.y).map(|way| (half - way * camera.scale) as i32) {
        area.draw(&PathElement::new([(0, y), (edge, y)], GRID))?;
    }
    Ok(())
}
