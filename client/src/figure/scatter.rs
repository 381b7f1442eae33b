//! Scatter plots: points in a plane, some of which stand out.

use plotters::prelude::*;

use super::draw::{Canvas, Drawing, Drawn, FONT, FONT_SIZE, MARGIN, TICK_LENGTH, draw_head};

/// Of points that stand out: the blue of Okabe and Ito, dark enough for white paper.
const STRONG: RGBColor = RGBColor(0, 114, 178);
const WEAK: RGBColor = RGBColor(170, 170, 170);
/// Radius of a point, pixels.
const RADIUS: i32 = 13;
/// Room beyond the outermost points, as a share of their extent.
const ROOM: f64 = 0.04;

/// Points in a plane.
#[derive(Debug, Clone, PartialEq)]
pub struct Scatter {
    /// The title, at the top.
    pub title: String,
    /// Below the title.
    pub caption: String,
    /// Labels of the axes: to the right, and upwards.
    pub labels: [String; 2],
    /// Finite points, and whether they stand out.
    pub points: Vec<([f64; 2], bool)>,
}

impl Drawing for Scatter {
    fn draw<B: DrawingBackend>(&self, area: &Canvas<'_, B>) -> Drawn<B> {
        let area = draw_head(area, &self.title, &self.caption)?;
        let [x, y] = [0, 1].map(|axis| self.range(axis));
        let mut chart = ChartBuilder::on(&area)
            .margin_top(MARGIN)
            .margin_right(2 * MARGIN)
            .x_label_area_size(150)
            .y_label_area_size(220)
            .build_cartesian_2d(x, y)?;
        chart
            .configure_mesh()
            .light_line_style(TRANSPARENT)
            .x_desc(&self.labels[0])
            .y_desc(&self.labels[1])
            .set_tick_mark_size(LabelAreaPosition::Left, TICK_LENGTH)
            .set_tick_mark_size(LabelAreaPosition::Bottom, TICK_LENGTH)
            .label_style((FONT, FONT_SIZE))
            .axis_desc_style((FONT, FONT_SIZE))
            .axis_style(BLACK.stroke_width(3))
            .draw()?;
        // Those that stand out lie above the others.
        for (strong, colour) in [(false, WEAK), (true, STRONG)] {
            let points = self.points.iter().filter(|(_, is_strong)| *is_strong == strong);
            let circle =
                |&([x, y], _): &([f64; 2], bool)| Circle::new((x, y), RADIUS, colour.filled());
            chart.draw_series(points.map(circle))?;
        }
        area.present()
    }
}

impl Scatter {
    fn range(&self, axis: usize) -> std::ops::Range<f64> {
        let values = || self.points.iter().map(|(point, _)| point[axis]);
        let least = values().fold(f64::INFINITY, f64::min);
        let most = values().fold(f64::NEG_INFINITY, f64::max);
        if least > most {
            return 0.0..1.0;
        }
        let room = if most > least { ROOM * (most - least) } else { 0.5 };
        least - room..most + room
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn scatter(points: Vec<([f64; 2], bool)>) -> Scatter {
        let labels = ["fitness", "turning"].map(str::to_owned);
        Scatter { title: "Front".into(), caption: String::new(), labels, points }
    }

    #[test]
    fn every_point_has_a_circle_and_few_points_have_axes() {
        let n_circles = |points: &[([f64; 2], bool)]| {
            scatter(points.to_vec()).to_svg().unwrap().matches("<circle").count()
        };
        assert_eq!(n_circles(&[]), 0);
        assert_eq!(n_circles(&[([1.0, 2.0], true)]), 1);
        assert_eq!(n_circles(&[([1.0, 2.0], true), ([0.5, 3.0], false)]), 2);
        assert!(scatter(vec![([1.0, 2.0], true)]).to_png().unwrap().starts_with(b"\x89PNG"));
    }
}
