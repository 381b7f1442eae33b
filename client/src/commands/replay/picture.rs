//! Steps of an episode as pictures: one as PNG or SVG, several as an animated PNG.

mod animation;
mod camera;
mod draw;

use std::{ops::RangeInclusive, str::FromStr};

use clap::Args;
use experiment_file::ExperimentConfig;
use plotters::prelude::*;
use png::{Compression, Filter, PixelDimensions, Unit};
use sim_core::{RoomRecord, StepRecord};

use self::{
    animation::{Frames, Palette},
    camera::Camera,
    draw::Fixed,
};
use crate::{
    args::whole,
    error::{Code, Error},
};

/// Side of a picture and of an animation, pixels. 100 frames of an animation should stay below
/// 1 MB.
const SIDE: u32 = 800;
const SIDE_OF_ANIMATIONS: u32 = 480;
/// Most steps of an animation.
const FRAMES_MAX: usize = 2_000;
/// Steps per second of an animation.
const PACE: u16 = 20;
/// Steps of the trail behind a robot.
const TRAIL: usize = 60;
/// Number of drawn pixels along each side of a pixel of the picture. A pixel of the picture is
/// the mean of its drawn pixels, which smooths edges. Animations, with their many pictures, are
/// drawn less finely.
const FINE: u32 = 3;
const FINE_OF_ANIMATIONS: u32 = 2;
/// Number of frames from which the colours of an animation are chosen.
const SAMPLED: usize = 8;

/// The options of a picture.
#[derive(Debug, Clone, Copy, Args)]
pub struct PictureArgs {
    /// Step that a .png or .svg shows; FIRST..LAST, both included, makes an animated .png
    /// [default: the last step]
    #[arg(long, value_name = "STEP|FIRST..LAST", requires = "to")]
    pub at: Option<Moments>,
    /// Width and height of a picture, in pixels [default: 800; of an animated one 480]
    #[arg(long, value_name = "PIXELS", requires = "to", value_parser = whole(100..=4000u32))]
    pub size: Option<u32>,
    /// Pixels per inch that a .png states [default: 300]
    #[arg(long, value_name = "N", requires = "to", value_parser = whole(30..=2400u32))]
    pub dpi: Option<u32>,
}

impl PictureArgs {
    /// The first option that is for pictures only, if one is given.
    pub fn given(&self) -> Option<&'static str> {
        let given = [
            ("--at", self.at.is_some()),
            ("--size", self.size.is_some()),
            ("--dpi", self.dpi.is_some()),
        ];
        given.into_iter().find_map(|(name, is_given)| is_given.then_some(name))
    }

    fn side(&self, n_frames: usize) -> u32 {
        self.size.unwrap_or(if n_frames > 1 { SIDE_OF_ANIMATIONS } else { SIDE })
    }
}

/// Which steps a picture shows.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Moments {
    first: u32,
    last: u32,
}

impl FromStr for Moments {
    type Err = String;

    /// Reads `120` and `0..299`, both ends included.
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

/// Some steps of an episode, to be drawn.
struct Shown<'a> {
    config: &'a ExperimentConfig,
    room: Option<&'a RoomRecord>,
    steps: &'a [StepRecord],
    range: RangeInclusive<usize>,
}

impl<'a> Shown<'a> {
    fn new(
        config: &'a ExperimentConfig,
        room: Option<&'a RoomRecord>,
        steps: &'a [StepRecord],
        moments: Option<Moments>,
    ) -> Result<Self, Error> {
        let n_steps = steps.len();
        let end = n_steps.saturating_sub(1) as u32;
        let Moments { first, last } = moments.unwrap_or(Moments { first: end, last: end });
        if last as usize >= n_steps {
            let what = format!("{last}: the episode has steps 0 to {end}");
            return Err(Error::option("--at", what));
        }
        Ok(Self { config, room, steps, range: first as usize..=last as usize })
    }

    fn n_frames(&self) -> usize {
        self.range.end() - self.range.start() + 1
    }

    fn camera(&self, side: u32) -> Camera {
        Camera::around(self.config, self.room, &self.steps[self.range.clone()], side)
    }

    /// A step, and the steps of its trail.
    fn way(&self, step: usize) -> &'a [StepRecord] {
        &self.steps[step.saturating_sub(TRAIL)..=step]
    }
}

/// The SVG of one step.
pub fn svg(
    config: &ExperimentConfig,
    room: Option<&RoomRecord>,
    steps: &[StepRecord],
    args: &PictureArgs,
) -> Result<Vec<u8>, Error> {
    let shown = Shown::new(config, room, steps, args.at)?;
    if shown.n_frames() > 1 {
        let message = "an .svg shows one step; a .png may be animated";
        return Err(Error::at(Code::BadArgument, "--at", message));
    }
    let side = args.side(1);
    let fine = side * FINE;
    let mut text = String::new();
    {
        let area = SVGBackend::with_string(&mut text, (fine, fine)).into_drawing_area();
        let (camera, fixed) = (shown.camera(fine), Fixed::new(config, room));
        draw::draw(&area, fine, &camera, &fixed, shown.way(*shown.range.end()))
            .map_err(internal)?;
    }
    // The drawing is fine; `width` and `height` set the shown size.
    let sizes = [fine, side].map(|side| format!("width=\"{side}\" height=\"{side}\""));
    Ok(text.replacen(&sizes[0], &sizes[1], 1).into_bytes())
}

/// The PNG of the requested steps of an episode, or of its last step without a request.
pub fn png(
    config: &ExperimentConfig,
    room: Option<&RoomRecord>,
    steps: &[StepRecord],
    args: &PictureArgs,
) -> Result<Vec<u8>, Error> {
    let shown = Shown::new(config, room, steps, args.at)?;
    let n_frames = shown.n_frames();
    if n_frames > FRAMES_MAX {
        let message = format!("an animation has at most {FRAMES_MAX} steps");
        return Err(Error::at(Code::BadArgument, "--at", message));
    }
    let side = args.side(n_frames);
    let times = if n_frames > 1 { FINE_OF_ANIMATIONS } else { FINE };
    let (camera, fixed) = (shown.camera(side * times), Fixed::new(config, room));
    let frame = |step: usize| smooth(side, times, &camera, &fixed, shown.way(step));
    let mut bytes = Vec::new();
    let mut encoder = png::Encoder::new(&mut bytes, side, side);
    encoder.set_depth(png::BitDepth::Eight);
    let per_metre = (f64::from(args.dpi.unwrap_or(300)) / 0.0254).round() as u32;
    let dims = PixelDimensions { xppu: per_metre, yppu: per_metre, unit: Unit::Meter };
    encoder.set_pixel_dims(Some(dims));
    encoder.set_compression(Compression::High);
    if n_frames == 1 {
        encoder.set_color(png::ColorType::Rgb);
        let mut writer = encoder.write_header().map_err(internal)?;
        writer.write_image_data(&frame(*shown.range.end())?).map_err(internal)?;
        writer.finish().map_err(internal)?;
        return Ok(bytes);
    }
    let sampled = shown.range.clone().step_by(n_frames.div_ceil(SAMPLED)).map(frame);
    let sampled: Vec<Vec<u8>> = sampled.collect::<Result<_, _>>()?;
    let palette = Palette::from_frames(sampled.iter().map(Vec::as_slice));
    encoder.set_color(png::ColorType::Indexed);
    encoder.set_palette(palette.bytes());
    encoder.set_trns(Palette::opacity());
    encoder.set_filter(Filter::NoFilter);
    encoder.set_animated(n_frames as u32, 0).map_err(internal)?;
    encoder.set_frame_delay(1, PACE).map_err(internal)?;
    let mut writer = encoder.write_header().map_err(internal)?;
    let mut frames = Frames::new(side, palette);
    for step in shown.range.clone() {
        frames.write(&mut writer, &frame(step)?).map_err(internal)?;
    }
    writer.finish().map_err(internal)?;
    Ok(bytes)
}

/// A picture of the last of some steps. It is drawn with `times` as many pixels along a side,
/// then reduced.
fn smooth(
    side: u32,
    times: u32,
    camera: &Camera,
    fixed: &Fixed<'_>,
    way: &[StepRecord],
) -> Result<Vec<u8>, Error> {
    let fine = side * times;
    let mut drawn = vec![0; 3 * (fine as usize).pow(2)];
    {
        let area = BitMapBackend::with_buffer(&mut drawn, (fine, fine)).into_drawing_area();
        draw::draw(&area, fine, camera, fixed, way).map_err(internal)?;
    }
    let (side, times) = (side as usize, times as usize);
    let mut pixels = Vec::with_capacity(3 * side * side);
    let mut sums = vec![[0; 3]; side];
    for lines in drawn.chunks_exact(3 * fine as usize * times) {
        sums.fill([0; 3]);
        for line in lines.chunks_exact(3 * fine as usize) {
            for (sum, block) in sums.iter_mut().zip(line.chunks_exact(3 * times)) {
                for [red, green, blue] in block.as_chunks().0 {
                    sum[0] += usize::from(*red);
                    sum[1] += usize::from(*green);
                    sum[2] += usize::from(*blue);
                }
            }
        }
        pixels.extend(sums.as_flattened().iter().map(|sum| (sum / (times * times)) as u8));
    }
    Ok(pixels)
}

fn internal(error: impl std::fmt::Display) -> Error {
    Error::Internal(format!("the picture cannot be drawn: {error}"))
}
