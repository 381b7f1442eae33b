//! Where two shapes touch or nearly touch: the points, the normal between them, and the gap.

use super::shape::{Polygon, Shape};
use crate::torus::Vec2;

/// A place where two shapes are near each other.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Touch {
    /// Unit vector from the first shape to the second.
    pub normal: Vec2,
    /// Point of the first shape.
    pub point: Vec2,
    /// Distance, negative if they overlap; cm.
    pub gap: f64,
}

/// A shape at its place.
#[derive(Debug, Clone, Copy)]
pub(super) struct Placed<'a> {
    pub shape: &'a Shape,
    pub position: Vec2,
    /// (cos, sin) of the heading.
    pub axis: Vec2,
}

/// A fixed segment of a wall.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Segment {
    pub from: Vec2,
    pub to: Vec2,
    /// Unit vector to the side on which all bodies are, also beyond the segment's ends; `None`:
    /// they may be on both sides.
    pub inner: Option<Vec2>,
}

/// Hands the places to `take` where `a` and `b` are nearest to each other: none if they are more
/// than `within` apart, two if sides lie along each other.
pub(super) fn between(a: Placed<'_>, b: Placed<'_>, within: f64, take: &mut impl FnMut(Touch)) {
    match (a.shape, b.shape) {
        (Shape::Disc(radius), Shape::Disc(other)) => {
            let touch = discs(a.position, *radius, b.position, *other);
            if touch.gap <= within {
                take(touch);
            }
        }
        (Shape::Disc(radius), Shape::Polygon(polygon)) => {
            disc_and_polygon(a.position, *radius, b, polygon, within, take);
        }
        (Shape::Polygon(polygon), Shape::Disc(radius)) => {
            let mut reverse = |touch: Touch| {
                let point = touch.point + touch.normal * touch.gap;
                take(Touch { normal: -touch.normal, point, ..touch });
            };
            disc_and_polygon(b.position, *radius, a, polygon, within, &mut reverse);
        }
        (Shape::Polygon(first), Shape::Polygon(second)) => {
            polygons(&Outline::new(a, first), &Outline::new(b, second), within, take);
        }
    }
}

/// The same for a fixed segment as the second shape.
pub(super) fn with_segment(
    a: Placed<'_>,
    segment: &Segment,
    within: f64,
    take: &mut impl FnMut(Touch),
) {
    match a.shape {
        Shape::Disc(radius) => {
            let touch = disc_and_segment(a.position, *radius, segment);
            if touch.gap <= within {
                take(touch);
            }
        }
        Shape::Polygon(polygon) => match segment.inner {
            Some(inner) => polygon_and_half_plane(a, polygon, segment.from, inner, within, take),
            None => {
                polygons(&Outline::new(a, polygon), &Outline::of_segment(segment), within, take);
            }
        },
    }
}

fn discs(a: Vec2, radius: f64, b: Vec2, other: f64) -> Touch {
    let way = b - a;
    let distance = way.norm();
    let normal = if distance > 0.0 { way * (1.0 / distance) } else { Vec2::new(1.0, 0.0) };
    Touch { normal, point: a + normal * radius, gap: distance - radius - other }
}

fn disc_and_segment(centre: Vec2, radius: f64, segment: &Segment) -> Touch {
    let (from, along) = (segment.from, segment.to - segment.from);
    if let Some(inner) = segment.inner {
        let gap = (centre - from).dot(inner) - radius;
        return Touch { normal: -inner, point: centre - inner * radius, gap };
    }
    let share = (centre - from).dot(along) / along.dot(along);
    let nearest = from + along * share.clamp(0.0, 1.0);
    let way = nearest - centre;
    let distance = way.norm();
    let normal =
        if distance > 0.0 { way * (1.0 / distance) } else { along.unit_or_zero().turned_right() };
    Touch { normal, point: centre + normal * radius, gap: distance - radius }
}

/// The polygon's deepest corner in a half-plane that begins at `from`, and the deeper one of the
/// corners beside it.
fn polygon_and_half_plane(
    a: Placed<'_>,
    polygon: &Polygon,
    from: Vec2,
    inner: Vec2,
    within: f64,
    take: &mut impl FnMut(Touch),
) {
    let n = polygon.corners.len();
    let corner = |index: usize| a.position + polygon.corners[index].rotated(a.axis);
    let gap = |index: usize| (corner(index) - from).dot(inner);
    let deepest = farthest((0..n).map(|index| -gap(index)));
    let beside = [(deepest + n - 1) % n, (deepest + 1) % n];
    let beside = if gap(beside[0]) < gap(beside[1]) { beside[0] } else { beside[1] };
    // In the order of the corners, so that each keeps its number from substep to substep.
    for index in [deepest.min(beside), deepest.max(beside)] {
        let gap = gap(index);
        if gap <= within {
            take(Touch { normal: -inner, point: corner(index), gap });
        }
    }
}

/// `polygon` is the shape of `b`.
fn disc_and_polygon(
    centre: Vec2,
    radius: f64,
    b: Placed<'_>,
    polygon: &Polygon,
    within: f64,
    take: &mut impl FnMut(Touch),
) {
    // In the polygon's own frame.
    let local = (centre - b.position).unrotated(b.axis);
    let distance = |side: usize| polygon.normals[side].dot(local - polygon.corners[side]);
    let side = farthest((0..polygon.corners.len()).map(distance));
    let (from, to) = (polygon.corners[side], polygon.corners[(side + 1) % polygon.corners.len()]);
    let outside = distance(side);
    // Beside a corner, the corner is nearest.
    let corner = if (local - from).dot(to - from) < 0.0 {
        Some(from)
    } else if (local - to).dot(from - to) < 0.0 {
        Some(to)
    } else {
        None
    };
    let (away, distance) = match corner {
        Some(corner) if outside > 0.0 => {
            let way = local - corner;
            (way.unit_or_zero(), way.norm())
        }
        _ => (polygon.normals[side], outside),
    };
    let gap = distance - radius;
    if gap <= within {
        let normal = -away.rotated(b.axis);
        take(Touch { normal, point: centre + normal * radius, gap });
    }
}

/// A polygon at its place.
struct Outline {
    corners: Vec<Vec2>,
    normals: Vec<Vec2>,
}

impl Outline {
    fn new(placed: Placed<'_>, polygon: &Polygon) -> Self {
        let (position, axis) = (placed.position, placed.axis);
        Self {
            corners: polygon.corners.iter().map(|c| position + c.rotated(axis)).collect(),
            normals: polygon.normals.iter().map(|n| n.rotated(axis)).collect(),
        }
    }

    fn of_segment(segment: &Segment) -> Self {
        let normal = (segment.to - segment.from).unit_or_zero().turned_right();
        Self { corners: vec![segment.from, segment.to], normals: vec![normal, -normal] }
    }

    fn side(&self, side: usize) -> (Vec2, Vec2) {
        (self.corners[side], self.corners[(side + 1) % self.corners.len()])
    }

    /// The side that separates the polygon best from another one, and by how much.
    fn best_side(&self, other: &Self) -> (usize, f64) {
        let separation = |side: usize| {
            let (normal, corner) = (self.normals[side], self.corners[side]);
            let nearest = |&c: &Vec2| normal.dot(c - corner);
            other.corners.iter().map(nearest).fold(f64::INFINITY, f64::min)
        };
        let side = farthest((0..self.corners.len()).map(separation));
        (side, separation(side))
    }
}

/// Separating sides, and the other polygon's side clipped to the extent of the best one.
fn polygons(a: &Outline, b: &Outline, within: f64, take: &mut impl FnMut(Touch)) {
    let (side_a, apart_a) = a.best_side(b);
    let (side_b, apart_b) = b.best_side(a);
    // `a` is preferred by a hair, so that rounding does not choose.
    let a_is_reference = apart_a + 1e-9 >= apart_b;
    let (reference, side, other, apart) =
        if a_is_reference { (a, side_a, b, apart_a) } else { (b, side_b, a, apart_b) };
    if apart > within {
        return;
    }
    let normal = reference.normals[side];
    let (from, to) = reference.side(side);
    let along = (to - from).unit_or_zero();
    // Of the other polygon, the side that faces this one.
    let facing = farthest(other.normals.iter().map(|n| -n.dot(normal)));
    let (first, second) = other.side(facing);
    // The part of that side which lies beside the reference.
    let (low, high) = (along.dot(from), along.dot(to));
    let (start, end) = (along.dot(second), along.dot(first));
    let (way, length) = (first - second, end - start);
    let at = |coordinate: f64| {
        if length.abs() < 1e-12 { second } else { second + way * ((coordinate - start) / length) }
    };
    let (least, most) = (start.min(end).max(low), start.max(end).min(high));
    if least > most {
        return;
    }
    let mut hand = |corner: Vec2| {
        let gap = normal.dot(corner - from);
        if gap <= within {
            let touch = if a_is_reference {
                Touch { normal, point: corner - normal * gap, gap }
            } else {
                Touch { normal: -normal, point: corner, gap }
            };
            take(touch);
        }
    };
    hand(at(least));
    if most > least {
        hand(at(most));
    }
}

/// Index of the largest value, the first of equal ones.
fn farthest(values: impl Iterator<Item = f64>) -> usize {
    let mut best = (0, f64::NEG_INFINITY);
    for (index, value) in values.enumerate() {
        if value > best.1 {
            best = (index, value);
        }
    }
    best.0
}
