//! Frames as a small animated PNG: it stores only the changed pixels of each frame, in at most 255
//! colours.

use std::{collections::BTreeMap, io::Write};

use png::{BlendOp, EncodingError, Writer};

/// Red, green and blue.
type Rgb = [u8; 3];

/// The colour that leaves a pixel unchanged.
const KEPT: u8 = 0;

/// The colours of an animation.
pub struct Palette {
    /// All colours but the first one, [`KEPT`].
    colors: Vec<Rgb>,
    /// A cache of the places of colours.
    places: BTreeMap<Rgb, u8>,
}

impl Palette {
    /// The palette of the most frequent colours in some frames.
    pub fn from_frames<'a>(frames: impl Iterator<Item = &'a [u8]>) -> Self {
        let mut counts: BTreeMap<Rgb, usize> = BTreeMap::new();
        for frame in frames {
            for run in runs(frame) {
                *counts.entry(run[0]).or_default() += run.len();
            }
        }
        let mut colors: Vec<(Rgb, usize)> = counts.into_iter().collect();
        colors.sort_unstable_by_key(|(color, count)| (usize::MAX - count, *color));
        colors.truncate(255);
        let colors = colors.into_iter().map(|(color, _)| color).collect();
        Self { colors, places: BTreeMap::new() }
    }

    /// The palette in the format of PNG.
    pub fn bytes(&self) -> Vec<u8> {
        let kept = [[0; 3]];
        kept.iter().chain(&self.colors).flatten().copied().collect()
    }

    /// The opacity of its colours: all but the first are opaque.
    pub fn opacity() -> Vec<u8> {
        vec![0]
    }

    /// The place of the nearest colour.
    fn place(&mut self, color: Rgb) -> u8 {
        *self.places.entry(color).or_insert_with(|| {
            let distance = |other: &Rgb| -> u32 {
                let parts = color.iter().zip(other);
                parts.map(|(a, b)| u32::from(a.abs_diff(*b)).pow(2)).sum()
            };
            let nearest = (0..self.colors.len()).min_by_key(|&i| distance(&self.colors[i]));
            nearest.map_or(KEPT, |i| i as u8 + 1)
        })
    }
}

/// The pixels of a frame in runs of one colour, most of which are long.
fn runs(frame: &[u8]) -> impl Iterator<Item = &[Rgb]> {
    frame.as_chunks().0.chunk_by(|a, b| a == b)
}

/// Writes frames of `side` pixels one after the other.
pub struct Frames {
    side: usize,
    palette: Palette,
    /// The shown picture, as places in the palette; empty before the first frame.
    shown: Vec<u8>,
}

impl Frames {
    pub fn new(side: u32, palette: Palette) -> Self {
        Self { side: side as usize, palette, shown: Vec::new() }
    }

    /// Writes the changes of a frame.
    pub fn write<W: Write>(
        &mut self,
        writer: &mut Writer<W>,
        frame: &[u8],
    ) -> Result<(), EncodingError> {
        let mut next = Vec::with_capacity(frame.len() / 3);
        for run in runs(frame) {
            next.resize(next.len() + run.len(), self.palette.place(run[0]));
        }
        if self.shown.is_empty() {
            self.shown = next;
            return writer.write_image_data(&self.shown);
        }
        let [left, top, right, bottom] = self.changed(&next);
        let mut part = Vec::with_capacity((right - left) * (bottom - top));
        for y in top..bottom {
            let row = y * self.side + left..y * self.side + right;
            let both = next[row.clone()].iter().zip(&self.shown[row]);
            part.extend(both.map(|(next, shown)| if next == shown { KEPT } else { *next }));
        }
        self.shown = next;
        // The encoder checks a new size at the previous position, so start in the corner.
        writer.set_frame_position(0, 0)?;
        writer.set_frame_dimension((right - left) as u32, (bottom - top) as u32)?;
        writer.set_frame_position(left as u32, top as u32)?;
        writer.set_blend_op(BlendOp::Over)?;
        writer.write_image_data(&part)
    }

    /// The rectangle of the changes: left, top, and the first column and row beyond it. A frame
    /// has at least one pixel.
    fn changed(&self, next: &[u8]) -> [usize; 4] {
        let differing = (0..next.len()).filter(|&i| next[i] != self.shown[i]);
        let bounds =
            differing.map(|i| [i % self.side, i / self.side]).fold(None, |bounds, [x, y]| {
                let [left, top, right, bottom] = bounds.unwrap_or([x, y, x + 1, y + 1]);
                Some([left.min(x), top.min(y), right.max(x + 1), bottom.max(y + 1)])
            });
        bounds.unwrap_or([0, 0, 1, 1])
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn few_colours_are_kept_and_many_are_replaced_by_the_nearest() {
        let frame: Vec<u8> =
            (0..=255).flat_map(|i| [i, i, 0].repeat(if i == 7 { 1 } else { 2 })).collect();
        let mut palette = Palette::from_frames([&*frame].into_iter());
        assert_eq!(palette.bytes().len(), 3 * 256);
        assert_ne!(palette.place([8, 8, 0]), palette.place([9, 9, 0]));
        assert!(
            [palette.place([6, 6, 0]), palette.place([8, 8, 0])]
                .contains(&palette.place([7, 7, 0]))
        );
        assert!((0..=255).all(|i| palette.place([i, i, 0]) != KEPT));
    }

    #[test]
    fn changes_have_a_rectangle() {
        let mut frames = Frames::new(4, Palette::from_frames(std::iter::empty()));
        frames.shown = vec![1; 16];
        assert_eq!(frames.changed(&[1; 16]), [0, 0, 1, 1]);
        let mut next = vec![1; 16];
        (next[5], next[11]) = (2, 3);
        assert_eq!(frames.changed(&next), [1, 1, 4, 3]);
    }
}
