//! Points, segments and polygons in the plane.

/// A place in the plane, cm.
pub(crate) type Point = [f64; 2];

/// The corners of a simple polygon in counter-clockwise order.
pub(crate) fn counter_clockwise(corners: &[Point]) -> Vec<Point> {
    let mut corners = corners.to_vec();
    if signed_area(&corners) < 0.0 {
        corners.reverse();
    }
    corners
}

/// Area of a simple polygon; negative if its corners are clockwise.
pub(crate) fn signed_area(corners: &[Point]) -> f64 {
    let Some(&origin) = corners.first() else { return 0.0 };
    let twice = edges(corners).map(|[a, b]| cross(difference(a, origin), difference(b, origin)));
    twice.sum::<f64>() / 2.0
}

/// The edges of a polygon.
pub(crate) fn edges(corners: &[Point]) -> impl Iterator<Item = [Point; 2]> {
    let ends = corners.iter().cycle().skip(1);
    corners.iter().zip(ends).map(|(&start, &end)| [start, end])
}

fn difference(a: Point, b: Point) -> Point {
    [a[0] - b[0], a[1] - b[1]]
}

fn cross(a: Point, b: Point) -> f64 {
    a[0] * b[1] - a[1] * b[0]
}
