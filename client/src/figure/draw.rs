//! The layout of figures.

use std::{fmt::Display, ops::Range, path::Path, sync::Once};

use plotters::{
    coord::Shift,
    drawing::DrawingAreaErrorKind,
    element::DashedPathElement,
    prelude::*,
    style::{
        register_font,
        text_anchor::{HPos, Pos, VPos},
    },
};

use super::{CURVES_MAX, Curve, Figure, Format};
use crate::{error::Error, output_file::Overwrite};

/// Pixels of a PNG, and units of an SVG: 20 by 12.5 cm at 300 per inch.
const SIZE: (u32, u32) = (2400, 1500);
/// Pixels per unit of a shown SVG.
const UNITS: u32 = 3;

/// A family that SVG viewers know, too.
pub const FONT: &str = "sans-serif";
pub(super) const FONT_SIZE: i32 = 54;
const TITLE_SIZE: i32 = 66;
const CAPTION_SIZE: i32 = 46;
const GREY: RGBColor = RGBColor(90, 90, 90);
/// Length of the tick marks of an axis, which sets the distance of the numbers.
pub(super) const TICK_LENGTH: i32 = 18;
const LINE_WIDTH: u32 = 5;
const BAND_OPACITY: f64 = 0.2;
pub(super) const MARGIN: i32 = 36;
/// Length of a curve's sample in the legend.
const SAMPLE: i32 = 110;
const LEGEND_ROW: i32 = 70;
const N_TICKS: usize = 8;

/// The palette of Okabe and Ito, which colour-blind people can distinguish, without
/// yellow, which is invisible on paper. Dark and light colours alternate.
const COLOURS: [RGBColor; 7] = [
    RGBColor(0, 114, 178),
    RGBColor(230, 159, 0),
    RGBColor(0, 158, 115),
    RGBColor(213, 94, 0),
    RGBColor(86, 180, 233),
    RGBColor(0, 0, 0),
    RGBColor(204, 121, 167),
];

pub(super) type Canvas<'a, B> = DrawingArea<B, Shift>;
pub(super) type Drawn<B> = Result<(), DrawingAreaErrorKind<<B as DrawingBackend>::ErrorType>>;

/// Something to draw.
pub trait Drawing {
    /// Draws it.
    fn draw<B: DrawingBackend>(&self, area: &Canvas<'_, B>) -> Drawn<B>;

    /// The drawing as SVG.
    fn to_svg(&self) -> Result<String, Error> {
        let mut svg = String::new();
        {
            let area = SVGBackend::with_string(&mut svg, SIZE).into_drawing_area();
            self.draw(&area).map_err(internal)?;
        }
        // The drawing is fine; `width` and `height` set the shown size.
        let (width, height) = SIZE;
        Ok(svg.replacen(
            &format!("width=\"{width}\" height=\"{height}\""),
            &format!("width=\"{}\" height=\"{}\"", width / UNITS, height / UNITS),
            1,
        ))
    }

    /// The drawing as PNG.
    fn to_png(&self) -> Result<Vec<u8>, Error> {
        let (width, height) = SIZE;
        let mut pixels = vec![0; 3 * width as usize * height as usize];
        {
            let area = BitMapBackend::with_buffer(&mut pixels, SIZE).into_drawing_area();
            self.draw(&area).map_err(internal)?;
        }
        let mut bytes = Vec::new();
        let mut encoder = png::Encoder::new(&mut bytes, width, height);
        encoder.set_color(png::ColorType::Rgb);
        encoder.set_depth(png::BitDepth::Eight);
        let mut writer = encoder.write_header().map_err(internal)?;
        writer.write_image_data(&pixels).map_err(internal)?;
        writer.finish().map_err(internal)?;
        Ok(bytes)
    }

    /// Writes the drawing in the format that the extension of the file's name selects.
    fn write(&self, path: &Path, overwrite: Overwrite) -> Result<(), Error> {
        let bytes = match Format::of_path(path)? {
            Format::Svg => self.to_svg()?.into_bytes(),
            Format::Png => self.to_png()?,
        };
        overwrite.write(path, &bytes)
    }
}

impl Drawing for Figure {
    fn draw<B: DrawingBackend>(&self, area: &Canvas<'_, B>) -> Drawn<B> {
        let area = draw_head(area, &self.title, &self.caption)?;
        let legend = Legend::new(&self.curves, &area)?;
        let (top, plot) = area.split_vertically(legend.n_rows() * LEGEND_ROW);
        legend.draw(&top)?;
        let (x, y) = self.ranges();
        let mut chart = ChartBuilder::on(&plot)
            .margin_top(MARGIN)
            .margin_right(2 * MARGIN)
            .x_label_area_size(150)
            .y_label_area_size(200)
            .build_cartesian_2d(x.clone(), y.clone())?;
        let (x_ticks, y_ticks) = (tick_step(&x), tick_step(&y));
        chart
            .configure_mesh()
            .x_desc(&self.x_label)
            .y_desc(&self.y_label)
            .x_labels(N_TICKS)
            .y_labels(N_TICKS)
            .x_label_formatter(&|x| tick(*x, x_ticks))
            .y_label_formatter(&|y| tick(*y, y_ticks))
            .set_tick_mark_size(LabelAreaPosition::Left, TICK_LENGTH)
            .set_tick_mark_size(LabelAreaPosition::Bottom, TICK_LENGTH)
            .label_style((FONT, FONT_SIZE))
            .axis_desc_style((FONT, FONT_SIZE))
            .axis_style(BLACK.stroke_width(3))
            .bold_line_style(BLACK.mix(0.12).stroke_width(2))
            .light_line_style(TRANSPARENT)
            .draw()?;
        // Bands first: no band covers a line.
        for (curve, style) in self.curves.iter().zip(Style::all()) {
            let lower = curve.points.iter().map(|point| (point.x, point.low));
            let upper = curve.points.iter().rev().map(|point| (point.x, point.high));
            let outline: Vec<(f64, f64)> = lower.chain(upper).collect();
            let fill = style.colour.mix(BAND_OPACITY).filled();
            chart.draw_series([Polygon::new(outline, fill)])?;
        }
        for (curve, style) in self.curves.iter().zip(Style::all()) {
            let line = curve.points.iter().map(|point| (point.x, point.middle));
            let line: Vec<(f64, f64)> = line.collect();
            let stroke = style.colour.stroke_width(LINE_WIDTH);
            if style.is_dashed {
                chart.draw_series(DashedLineSeries::new(line, 24, 16, stroke))?;
            } else {
                chart.draw_series(LineSeries::new(line, stroke))?;
            }
        }
        area.present()
    }
}

/// Draws title and caption on a white area; returns the remaining area.
pub(super) fn draw_head<'a, B: DrawingBackend>(
    area: &Canvas<'a, B>,
    title: &str,
    caption: &str,
) -> Result<Canvas<'a, B>, DrawingAreaErrorKind<B::ErrorType>> {
    embed_font();
    area.fill(&WHITE)?;
    let mut rest = area.margin(MARGIN, MARGIN, MARGIN, MARGIN);
    for (text, size, colour) in [(title, TITLE_SIZE, BLACK), (caption, CAPTION_SIZE, GREY)] {
        if text.is_empty() {
            continue;
        }
        let height = size * 3 / 2;
        let (head, below) = rest.split_vertically(height);
        let anchor = Pos::new(HPos::Left, VPos::Center);
        let style = TextStyle::from((FONT, size).into_font()).color(&colour).pos(anchor);
        head.draw(&Text::new(text, (MARGIN, height / 2), &style))?;
        rest = below;
    }
    Ok(rest)
}

impl Figure {
    /// The x axis covers all points, the y axis a little more than the bands.
    fn ranges(&self) -> (Range<f64>, Range<f64>) {
        let points = || self.curves.iter().flat_map(|curve| &curve.points);
        let x = extent(points().map(|point| point.x));
        let y = extent(points().flat_map(|point| [point.low, point.middle, point.high]));
        let room = 0.03 * (y.end - y.start);
        // An axis that would go only a little below zero starts at zero.
        let start = if y.start >= 0.0 { (y.start - room).max(0.0) } else { y.start - room };
        (x, start..y.end + room)
    }
}

/// The greatest magnitude on an axis, so that the length of an axis is a number.
const MAGNITUDE: f64 = 1e300;

/// From the least to the greatest value; never empty.
fn extent(values: impl Iterator<Item = f64>) -> Range<f64> {
    let values = values.map(|value| value.clamp(-MAGNITUDE, MAGNITUDE));
    let bounds = values.fold(None, |bounds, value| match bounds {
        None => Some((value, value)),
        Some((min, max)) => Some((f64::min(min, value), f64::max(max, value))),
    });
    let (min, max) = bounds.unwrap_or((0.0, 1.0));
    let room = f64::max(0.5, 1e-3 * min.abs());
    if min < max { min..max } else { min - room..max + room }
}

/// About the distance of two ticks.
fn tick_step(range: &Range<f64>) -> f64 {
    (range.end - range.start) / N_TICKS as f64
}

/// A tick's number, with enough digits to distinguish it from the next one.
fn tick(value: f64, step: f64) -> String {
    let n_decimals = (-libm::log10(step).floor()).clamp(0.0, 9.0) as usize;
    let text = format!("{value:.n_decimals$}");
    let text =
        if text.contains('.') { text.trim_end_matches('0').trim_end_matches('.') } else { &text };
    if text == "-0" { "0".into() } else { text.into() }
}

/// The line style of a curve.
#[derive(Debug, Clone, Copy)]
struct Style {
    colour: RGBColor,
    is_dashed: bool,
}

impl Style {
    /// One style for each possible curve.
    fn all() -> impl Iterator<Item = Self> {
        (0..CURVES_MAX).map(|index| Self {
            colour: COLOURS[index % COLOURS.len()],
            is_dashed: index >= COLOURS.len(),
        })
    }
}

/// The curves' names above the plot, in as many rows as necessary.
struct Legend<'a> {
    rows: Vec<Vec<Entry<'a>>>,
}

struct Entry<'a> {
    x: i32,
    name: &'a str,
    style: Style,
}

impl<'a> Legend<'a> {
    fn new<B: DrawingBackend>(
        curves: &'a [Curve],
        area: &Canvas<'_, B>,
    ) -> Result<Self, DrawingAreaErrorKind<B::ErrorType>> {
        let text = TextStyle::from((FONT, FONT_SIZE).into_font());
        let width = area.dim_in_pixel().0 as i32;
        let mut rows: Vec<Vec<Entry<'_>>> = vec![Vec::new()];
        let mut x = MARGIN;
        for (curve, style) in curves.iter().zip(Style::all()) {
            let (text_width, _) = area.estimate_text_size(&curve.name, &text)?;
            let entry_width = SAMPLE + FONT_SIZE / 2 + text_width as i32;
            if x + entry_width > width && x > MARGIN {
                rows.push(Vec::new());
                x = MARGIN;
            }
            let row = rows.last_mut().expect("there is a first row");
            row.push(Entry { x, name: &curve.name, style });
            x += entry_width + FONT_SIZE;
        }
        Ok(Self { rows })
    }

    fn n_rows(&self) -> i32 {
        self.rows.len() as i32
    }

    fn draw<B: DrawingBackend>(&self, area: &Canvas<'_, B>) -> Drawn<B> {
        let anchor = Pos::new(HPos::Left, VPos::Center);
        let text = TextStyle::from((FONT, FONT_SIZE).into_font()).pos(anchor);
        let mut y = LEGEND_ROW / 2;
        for row in &self.rows {
            for &Entry { x, name, style } in row {
                let band = style.colour.mix(BAND_OPACITY).filled();
                let height = LEGEND_ROW / 4;
                area.draw(&Rectangle::new([(x, y - height), (x + SAMPLE, y + height)], band))?;
                let stroke = style.colour.stroke_width(LINE_WIDTH);
                let line = [(x, y), (x + SAMPLE, y)];
                if style.is_dashed {
                    area.draw(&DashedPathElement::new(line, 24, 16, stroke))?;
                } else {
                    area.draw(&PathElement::new(line, stroke))?;
                }
                area.draw(&Text::new(name, (x + SAMPLE + FONT_SIZE / 2, y), &text))?;
            }
            y += LEGEND_ROW;
        }
        Ok(())
    }
}

/// Registers the font, which measures the size of all texts.
pub fn embed_font() {
    static ONCE: Once = Once::new();
    ONCE.call_once(|| {
        let font = register_font(FONT, FontStyle::Normal, dejavu::sans::regular());
        assert!(font.is_ok(), "the embedded font is one");
    });
}

fn internal(error: impl Display) -> Error {
    Error::Internal(format!("the figure cannot be drawn: {error}"))
}
