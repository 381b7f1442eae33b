//! The contents of a figure, as SVG and as PNG.

use std::fs;

use super::*;

fn curve(name: &str, points: &[(f64, f64, f64, f64)]) -> Curve {
    let points = points.iter().map(|&(x, low, middle, high)| Point { x, low, middle, high });
    Curve { name: name.into(), points: points.collect() }
}

fn figure(curves: Vec<Curve>) -> Figure {
    Figure {
        title: "two runs".into(),
        caption: "line: mean".into(),
        x_label: "generation".into(),
        y_label: "fitness".into(),
        curves,
    }
}

fn two_runs() -> Figure {
    figure(vec![
        curve("GA", &[(0.0, 0.0, 0.25, 0.5), (1.0, 0.0, 0.5, 0.75), (2.0, 0.25, 0.5, 1.0)]),
        curve("SNES", &[(0.0, 0.0, 0.5, 0.5), (1.0, 0.5, 0.75, 1.0), (2.0, 0.5, 1.0, 1.0)]),
    ])
}

/// `n` curves, one above the other.
fn many(n: usize) -> Figure {
    let curves = (0..n).map(|i| {
        let y = i as f64;
        curve(
            &format!("condition {i}"),
            &[(0.0, y, y + 0.25, y + 0.5), (9.0, y, y + 0.25, y + 0.5)],
        )
    });
    figure(curves.collect())
}

/// Width, height and RGB pixels.
fn decoded(bytes: &[u8]) -> (u32, u32, Vec<[u8; 3]>) {
    let mut reader = png::Decoder::new(std::io::Cursor::new(bytes)).read_info().unwrap();
    let mut pixels = vec![0; reader.output_buffer_size().unwrap()];
    let frame = reader.next_frame(&mut pixels).unwrap();
    assert_eq!(frame.color_type, png::ColorType::Rgb);
    (frame.width, frame.height, pixels.as_chunks().0.to_vec())
}

#[test]
fn axes_have_a_length_whatever_the_values() {
    for (low, high) in [(-f64::MAX, f64::MAX), (f64::MAX, f64::MAX), (1e20, 1e20), (0.0, 0.0)] {
        let points = [(0.0, low, low, high), (1.0, low, high, high)];
        let svg = figure(vec![curve("GA", &points)]).to_svg().unwrap();
        assert!(svg.ends_with("</svg>\n"), "{low} to {high}");
    }
}

#[test]
fn an_svg_has_a_band_a_line_and_a_name_per_curve() {
    insta::assert_snapshot!(two_runs().to_svg().unwrap());
}

#[test]
fn a_png_shows_every_curve_in_its_colour() {
    let png = two_runs().to_png().unwrap();
    assert!(png == two_runs().to_png().unwrap(), "the same curves give the same bytes");
    let (width, height, pixels) = decoded(&png);
    assert_eq!((width, height), (2400, 1500));
    let n = |colour: [u8; 3]| pixels.iter().filter(|pixel| **pixel == colour).count();
    let (blue, orange) = (n([0, 114, 178]), n([230, 159, 0]));
    // Lines of some 2,000 pixels by 5.
    assert!((5_000..50_000).contains(&blue), "{blue}");
    assert!((5_000..50_000).contains(&orange), "{orange}");
    // Axes and letters, on white.
    assert!(n([0; 3]) > 5_000);
    assert!(n([255; 3]) > pixels.len() / 3);
}

#[test]
fn the_same_curves_give_the_same_bytes() {
    assert_eq!(two_runs().to_svg().unwrap(), two_runs().to_svg().unwrap());
}

#[test]
fn the_maximum_number_of_curves_differ_in_colour_or_dashes() {
    let svg = many(CURVES_MAX).to_svg().unwrap();
    for i in 0..CURVES_MAX {
        assert!(svg.contains(&format!("\ncondition {i}\n")), "{i}");
    }
    // The samples of the legend, and the curves: both are straight lines.
    let n_solid = svg.lines().filter(|line| line.contains(r#"stroke-width="5""#));
    let of_colour = |colour: &str| n_solid.clone().filter(|l| l.contains(colour)).count();
    // A solid curve, a dashed one of many pieces, and their samples.
    assert!(of_colour("#0072B2") > 20);
    let colours = ["#0072B2", "#E69F00", "#009E73", "#D55E00", "#56B4E9", "#000000", "#CC79A7"];
    assert!(colours.iter().all(|colour| of_colour(colour) == of_colour("#0072B2")));
}

#[test]
fn curves_of_one_point_or_one_height_can_be_drawn() {
    for points in [&[(0.0, 0.0, 0.0, 0.0)][..], &[(0.0, 1.0, 1.0, 1.0), (5.0, 1.0, 1.0, 1.0)]] {
        let svg = figure(vec![curve("a", points)]).to_svg().unwrap();
        assert!(!svg.contains("NaN") && !svg.contains("inf"), "{svg}");
    }
}

#[test]
fn names_are_text_whatever_they_contain() {
    let svg = figure(vec![curve("<b>&\"ü\"", &[(0.0, 0.0, 1.0, 2.0)])]).to_svg().unwrap();
    assert!(svg.contains("\n&lt;b&gt;&amp;&quot;ü&quot;\n"), "{svg}");
}

#[test]
fn the_file_name_selects_the_format() {
    let dir = tempfile::tempdir().unwrap();
    let path = dir.path().join("a.svg");
    two_runs().write(&path, Overwrite::default()).unwrap();
    assert_eq!(fs::read_to_string(path).unwrap(), two_runs().to_svg().unwrap());
    assert_eq!(Format::of_path("a.svg".as_ref()).unwrap(), Format::Svg);
    assert_eq!(Format::of_path("b/a.png".as_ref()).unwrap(), Format::Png);
    for name in ["a.pdf", "svg", "missing/a.svg"] {
        let error = two_runs().write(&dir.path().join(name), Overwrite::default()).unwrap_err();
        assert_eq!(error.exit_code(), 2, "{error}");
    }
}
