//! Heat maps: the fitness of the cells of a grid.

use plotters::{
    prelude::*,
    style::text_anchor::{HPos, Pos, VPos},
};

use super::draw::{Canvas, Drawing, Drawn, FONT, FONT_SIZE, MARGIN, TICK_LENGTH, draw_head};

/// The colours of Viridis, which colour-blind people can order, from the least to the most.
const VIRIDIS: [RGBColor; 9] = [
    RGBColor(68, 1, 84),
    RGBColor(71, 44, 122),
    RGBColor(59, 81, 139),
    RGBColor(44, 113, 142),
    RGBColor(33, 144, 141),
    RGBColor(39, 173, 129),
    RGBColor(92, 200, 99),
    RGBColor(170, 220, 50),
    RGBColor(253, 231, 37),
];
/// Width of the scale with its numbers, pixels.
const SCALE_WIDTH: u32 = 380;
const SCALE_STEPS: i32 = 128;

/// A grid with a value in some cells.
#[derive(Debug, Clone, PartialEq)]
pub struct HeatMap {
    /// The title, at the top.
    pub title: String,
    /// Below the title.
    pub caption: String,
    /// Label of the scale.
    pub value: String,
    /// The axes: to the right, and upwards.
    pub axes: [MapAxis; 2],
    /// Cells by their index on each axis, with finite values.
    pub cells: Vec<([u32; 2], f64)>,
}

/// An axis of a grid.
#[derive(Debug, Clone, PartialEq)]
pub struct MapAxis {
    /// Label.
    pub label: String,
    /// Beginning of the range.
    pub low: f64,
    /// End of the range.
    pub high: f64,
    /// Number of cells.
    pub n_cells: u32,
}

impl MapAxis {
    /// The value at the beginning of a cell.
    fn begin(&self, cell: u32) -> f64 {
        self.low + (self.high - self.low) * f64::from(cell) / f64::from(self.n_cells)
    }
}

impl Drawing for HeatMap {
    fn draw<B: DrawingBackend>(&self, area: &Canvas<'_, B>) -> Drawn<B> {
        let area = draw_head(area, &self.title, &self.caption)?;
        let width = area.dim_in_pixel().0;
        let (plot, scale) = area.split_horizontally(width - SCALE_WIDTH);
        let [x, y] = &self.axes;
        let mut chart = ChartBuilder::on(&plot)
            .margin_top(MARGIN)
            .margin_right(MARGIN)
            .x_label_area_size(150)
            .y_label_area_size(220)
            .build_cartesian_2d(x.low..x.high, y.low..y.high)?;
        chart
            .configure_mesh()
            .disable_mesh()
            .x_desc(&x.label)
            .y_desc(&y.label)
            .set_tick_mark_size(LabelAreaPosition::Left, TICK_LENGTH)
            .set_tick_mark_size(LabelAreaPosition::Bottom, TICK_LENGTH)
            .label_style((FONT, FONT_SIZE))
            .axis_desc_style((FONT, FONT_SIZE))
            .axis_style(BLACK.stroke_width(3))
            .draw()?;
        let values = || self.cells.iter().map(|(_, value)| *value);
        let least = values().fold(f64::INFINITY, f64::min);
        let most = values().fold(f64::NEG_INFINITY, f64::max);
        let share = |value: f64| if most > least { (value - least) / (most - least) } else { 1.0 };
        chart.draw_series(self.cells.iter().map(|&([i, j], value)| {
            let corners = [(x.begin(i), y.begin(j)), (x.begin(i + 1), y.begin(j + 1))];
            Rectangle::new(corners, colour(share(value)).filled())
        }))?;
        if least <= most {
            self.draw_scale(&scale, least, most)?;
        }
        area.present()
    }
}

impl HeatMap {
    fn draw_scale<B: DrawingBackend>(
        &self,
        area: &Canvas<'_, B>,
        least: f64,
        most: f64,
    ) -> Drawn<B> {
        let (top, bottom) = (3 * MARGIN, area.dim_in_pixel().1 as i32 - 150);
        let place = |step: i32| bottom - (bottom - top) * step / SCALE_STEPS;
        for step in 0..SCALE_STEPS {
            let corners = [(MARGIN, place(step + 1)), (3 * MARGIN, place(step))];
            let shade = colour(f64::from(step) / f64::from(SCALE_STEPS - 1));
            area.draw(&Rectangle::new(corners, shade.filled()))?;
        }
        let anchor = Pos::new(HPos::Left, VPos::Center);
        let style = TextStyle::from((FONT, FONT_SIZE).into_font()).pos(anchor);
        let beside = 3 * MARGIN + MARGIN / 2;
        for (value, y) in [(least, bottom), (most, top)] {
            let text = swarm_telemetry::number(value, 3);
            area.draw(&Text::new(text, (beside, y), &style))?;
        }
        area.draw(&Text::new(self.value.as_str(), (MARGIN, MARGIN), &style))
    }
}

/// The colour of a share in [0, 1], by linear interpolation.
fn colour(share: f64) -> RGBColor {
    let place = share.clamp(0.0, 1.0) * (VIRIDIS.len() - 1) as f64;
    let below = (place as usize).min(VIRIDIS.len() - 2);
    let (a, b, rest) = (VIRIDIS[below], VIRIDIS[below + 1], place - below as f64);
    let mix = |a: u8, b: u8| (f64::from(a) + rest * (f64::from(b) - f64::from(a))).round() as u8;
    RGBColor(mix(a.0, b.0), mix(a.1, b.1), mix(a.2, b.2))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn map(cells: Vec<([u32; 2], f64)>) -> HeatMap {
        let axis = |label: &str| MapAxis { label: label.into(), low: -1.0, high: 1.0, n_cells: 4 };
        HeatMap {
            title: "Repertoire".into(),
            caption: String::new(),
            value: "fitness".into(),
            axes: [axis("order"), axis("speed")],
            cells,
        }
    }

    #[test]
    fn every_cell_has_a_rectangle_and_an_empty_map_has_none() {
        let n_rectangles = |map: &HeatMap| map.to_svg().unwrap().matches("<rect").count();
        let empty = n_rectangles(&map(Vec::new()));
        let scale = SCALE_STEPS as usize;
        assert_eq!(n_rectangles(&map(vec![([0, 3], 1.0)])), empty + scale + 1);
        assert_eq!(n_rectangles(&map(vec![([0, 3], 1.0), ([2, 2], 0.5)])), empty + scale + 2);
        assert!(map(vec![([0, 3], 1.0)]).to_png().unwrap().starts_with(b"\x89PNG"));
    }

    #[test]
    fn the_scale_goes_from_dark_to_bright() {
        let brightness = |share: f64| {
            let RGBColor(r, g, b) = colour(share);
            0.3 * f64::from(r) + 0.6 * f64::from(g) + 0.1 * f64::from(b)
        };
        assert!(
            (0..20).all(|i| brightness(f64::from(i) / 20.0) < brightness(f64::from(i + 1) / 20.0))
        );
    }
}
