//! Figures: curves with a band around each, heat maps and scatter plots, as SVG or PNG. The same
//! data give the same bytes on every machine: the font is part of the program.

mod draw;
mod heat_map;
mod scatter;

pub use draw::{Drawing, FONT, embed_font};
pub use heat_map::{HeatMap, MapAxis};
pub use scatter::Scatter;

use std::path::Path;

use crate::{
    error::{Code, Error},
    output_file::Overwrite,
};

/// Maximum number of curves of a figure: more would be indistinguishable.
pub const CURVES_MAX: usize = 14;

/// Curves over the same axes.
#[derive(Debug, Clone, PartialEq)]
pub struct Figure {
    /// The title, at the top; empty: no title.
    pub title: String,
    /// The meaning of line and band, below the title.
    pub caption: String,
    /// Label of the x axis.
    pub x_label: String,
    /// Label of the y axis, with the unit.
    pub y_label: String,
    /// At most [`CURVES_MAX`], in the order of the legend.
    pub curves: Vec<Curve>,
}

/// A line with a band around it.
#[derive(Debug, Clone, PartialEq)]
pub struct Curve {
    /// Name in the legend.
    pub name: String,
    /// The points, by ascending x.
    pub points: Vec<Point>,
}

/// A point of a curve; all values are finite.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Point {
    pub x: f64,
    /// Lower edge of the band.
    pub low: f64,
    /// Value of the line.
    pub middle: f64,
    /// Upper edge of the band.
    pub high: f64,
}

/// File format of a figure.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Format {
    Svg,
    Png,
}

impl Format {
    /// Refuses a bad file name, and a file that may not be replaced.
    pub fn check(path: &Path, overwrite: Overwrite) -> Result<(), Error> {
        Self::of_path(path)?;
        overwrite.check(path)
    }

    /// The format that the extension of a file's name selects.
    pub fn of_path(path: &Path) -> Result<Self, Error> {
        match path.extension().and_then(|extension| extension.to_str()) {
            Some("svg") => Ok(Self::Svg),
            Some("png") => Ok(Self::Png),
            _ => Err(Error::at(
                Code::BadArgument,
                path.display(),
                format!("{}: a figure's name ends in .svg or .png", path.display()),
            )),
        }
    }
}

#[cfg(test)]
mod tests;
