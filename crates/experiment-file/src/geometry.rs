//! Points, edges and polygons in the plane, for checks before anything moves.

use crate::limits;

/// A place in the plane, cm.
pub(crate) type Point = [f64; 2];

/// Why corners are not those of a simple polygon, or of a line of walls. Corners count from 0, and
/// an edge has the number of the corner at which it begins.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Flaw {
    /// The edge is too short.
    ShortEdge(usize),
    /// Two edges cross.
    Crossing(usize, usize),
    /// The corner is too near to the edge, which is not its own.
    Narrow(usize, usize),
}

/// The first flaw of a polygon.
pub(crate) fn flaw_of_polygon(corners: &[Point]) -> Option<Flaw> {
    let n = corners.len();
    let edges: Vec<[Point; 2]> = edges(corners).collect();
    let mut pairs = (0..n).flat_map(|i| (i + 1..n).map(move |j| (i, j)));
    let crossing = || {
        let (i, j) = pairs.find(|&(i, j)| cross_each_other(edges[i], edges[j]))?;
        Some(Flaw::Crossing(i, j))
    };
    let narrow = || {
        let mut pairs = (0..n).flat_map(|corner| (0..n).map(move |edge| (corner, edge)));
        let is_own = |corner: usize, edge: usize| edge == corner || (edge + 1) % n == corner;
        let is_near = |&(corner, edge): &(usize, usize)| {
            !is_own(corner, edge) && distance(corners[corner], edges[edge]) < limits::EDGE_MIN
        };
        pairs.find(is_near).map(|(corner, edge)| Flaw::Narrow(corner, edge))
    };
    short_edge(edges.iter().copied()).or_else(crossing).or_else(narrow)
}

/// The first flaw of a line, which may cross itself.
pub(crate) fn flaw_of_line(corners: &[Point]) -> Option<Flaw> {
    short_edge(corners.windows(2).map(|ends| [ends[0], ends[1]]))
}

fn short_edge(mut edges: impl Iterator<Item = [Point; 2]>) -> Option<Flaw> {
    edges
        .position(|[start, end]| length(difference(end, start)) < limits::EDGE_MIN)
        .map(Flaw::ShortEdge)
}

/// The first corner at which a simple polygon turns inwards.
pub(crate) fn reflex_corner(corners: &[Point]) -> Option<usize> {
    /// Sine of a turn that is still straight, as rounded coordinates make it.
    const STRAIGHT: f64 = 1e-9;
    let n = corners.len();
    let sense = signed_area(corners).signum();
    (0..n).find(|&corner| {
        let before = difference(corners[corner], corners[(corner + n - 1) % n]);
        let after = difference(corners[(corner + 1) % n], corners[corner]);
        sense * cross(before, after) < -STRAIGHT * length(before) * length(after)
    })
}

/// Whether corners are those of a convex polygon.
pub(crate) fn is_convex(corners: &[Point]) -> bool {
    flaw_of_polygon(corners).is_none() && reflex_corner(corners).is_none()
}

/// Radius of the largest disc around the centroid of a convex polygon that lies within it.
pub(crate) fn inner_radius(corners: &[Point]) -> f64 {
    let centroid = centroid(corners);
    edges(corners).map(|edge| distance(centroid, edge)).fold(f64::INFINITY, f64::min)
}

/// The centroid of a simple polygon.
fn centroid(corners: &[Point]) -> Point {
    let Some(&origin) = corners.first() else { return [0.0; 2] };
    let (mut sum, mut area) = ([0.0; 2], 0.0);
    for [start, end] in edges(corners) {
        let (start, end) = (difference(start, origin), difference(end, origin));
        let twice = cross(start, end);
        area += twice;
        sum = [sum[0] + twice * (start[0] + end[0]), sum[1] + twice * (start[1] + end[1])];
    }
    [origin[0] + sum[0] / (3.0 * area), origin[1] + sum[1] / (3.0 * area)]
}

/// The corners of a simple polygon in counter-clockwise order.
pub(crate) fn counter_clockwise(corners: &[Point]) -> Vec<Point> {
    let mut corners = corners.to_vec();
    if signed_area(&corners) < 0.0 {
        corners.reverse();
    }
    corners
}

/// Area of a simple polygon; negative if its corners are clockwise.
fn signed_area(corners: &[Point]) -> f64 {
    let Some(&origin) = corners.first() else { return 0.0 };
    let twice = edges(corners).map(|[a, b]| cross(difference(a, origin), difference(b, origin)));
    twice.sum::<f64>() / 2.0
}

/// Whether a place lies in a simple polygon.
pub(crate) fn contains(corners: &[Point], [x, y]: Point) -> bool {
    let is_right_of = |[start, end]: &[Point; 2]| {
        let share = (y - start[1]) / (end[1] - start[1]);
        (start[1] > y) != (end[1] > y) && x < start[0] + share * (end[0] - start[0])
    };
    edges(corners).filter(is_right_of).count() % 2 == 1
}

/// Whether a square `low` to `high` in both coordinates has places in a simple polygon.
pub(crate) fn meets_square(corners: &[Point], low: f64, high: f64) -> bool {
    let square = [[low, low], [high, low], [high, high], [low, high]];
    let is_in_square = |corner: &Point| corner.iter().all(|x| (low..=high).contains(x));
    let crosses =
        |edge| edges(&square).any(|of_square: [Point; 2]| cross_each_other(edge, of_square));
    square.iter().any(|&corner| contains(corners, corner))
        || corners.iter().any(is_in_square)
        || edges(corners).any(crosses)
}

/// Whether a circle has places in a simple polygon.
pub(crate) fn meets_circle(corners: &[Point], center: Point, radius: f64) -> bool {
    let crosses = |edge: [Point; 2]| {
        let farthest = edge.map(|end| length(difference(end, center)));
        distance(center, edge) <= radius && farthest[0].max(farthest[1]) >= radius
    };
    contains(corners, [center[0] + radius, center[1]]) || edges(corners).any(crosses)
}

/// The edges of a polygon.
fn edges(corners: &[Point]) -> impl Iterator<Item = [Point; 2]> {
    let ends = corners.iter().cycle().skip(1);
    corners.iter().zip(ends).map(|(&start, &end)| [start, end])
}

/// Whether two edges cross at a place that is an end of neither.
fn cross_each_other([a, b]: [Point; 2], [c, d]: [Point; 2]) -> bool {
    let side =
        |[start, end]: [Point; 2], point| cross(difference(end, start), difference(point, start));
    side([a, b], c) * side([a, b], d) < 0.0 && side([c, d], a) * side([c, d], b) < 0.0
}

/// Distance of a place from an edge.
fn distance(point: Point, [start, end]: [Point; 2]) -> f64 {
    let (way, to_point) = (difference(end, start), difference(point, start));
    let share = (dot(way, to_point) / dot(way, way)).clamp(0.0, 1.0);
    length([to_point[0] - share * way[0], to_point[1] - share * way[1]])
}

/// Length of a vector.
pub(crate) fn length(vector: Point) -> f64 {
    dot(vector, vector).sqrt()
}

fn difference(a: Point, b: Point) -> Point {
    [a[0] - b[0], a[1] - b[1]]
}

fn dot(a: Point, b: Point) -> f64 {
    a[0] * b[0] + a[1] * b[1]
}

fn cross(a: Point, b: Point) -> f64 {
    a[0] * b[1] - a[1] * b[0]
}

#[cfg(test)]
mod tests {
    use super::*;

    const SQUARE: [Point; 4] = [[0.0, 0.0], [4.0, 0.0], [4.0, 4.0], [0.0, 4.0]];
    /// A square whose upper left quarter is missing.
    const ANGLE: [Point; 6] =
        [[0.0, 0.0], [4.0, 0.0], [4.0, 4.0], [2.0, 4.0], [2.0, 2.0], [0.0, 2.0]];

    fn reversed(corners: &[Point]) -> Vec<Point> {
        corners.iter().rev().copied().collect()
    }

    #[test]
    fn simple_polygons_have_no_flaw_in_either_order() {
        for corners in [&SQUARE[..], &ANGLE] {
            assert_eq!(flaw_of_polygon(corners), None);
            assert_eq!(flaw_of_polygon(&reversed(corners)), None);
        }
    }

    #[test]
    fn flawed_polygons_are_found() {
        for (corners, flaw) in [
            (&[[0.0, 0.0], [4.0, 4.0], [4.0, 0.0], [0.0, 4.0]][..], Flaw::Crossing(0, 2)),
            (&[[0.0, 0.0], [1.0, 1.0], [2.0, 2.0]], Flaw::Narrow(1, 2)),
            (&[[0.0, 0.0], [4.0, 0.0], [4.0, 0.0], [4.0, 4.0]], Flaw::ShortEdge(1)),
            (&[[0.0, 0.0], [4.0, 0.0], [4.0, 4.0], [0.0, 0.001]], Flaw::ShortEdge(3)),
            // A spike: back along the edge before.
            (&[[0.0, 0.0], [4.0, 0.0], [8.0, 0.0], [6.0, 0.0], [3.0, 5.0]], Flaw::Narrow(3, 1)),
            // A corner on an edge.
            (&[[0.0, 0.0], [4.0, 0.0], [4.0, 4.0], [2.0, 0.0], [0.0, 4.0]], Flaw::Narrow(3, 0)),
        ] {
            assert_eq!(flaw_of_polygon(corners), Some(flaw), "{corners:?}");
        }
        // A star with five points turns left at every corner.
        let star = [[0.0, -5.0], [3.0, 4.0], [-5.0, -1.5], [5.0, -1.5], [-3.0, 4.0]];
        assert_eq!(reflex_corner(&star), None);
        assert!(matches!(flaw_of_polygon(&star), Some(Flaw::Crossing(0, 2))));
    }

    #[test]
    fn a_line_may_cross_itself() {
        let line = [[0.0, 0.0], [4.0, 4.0], [4.0, 0.0], [0.0, 4.0], [0.0, 0.0]];
        assert_eq!(flaw_of_line(&line), None);
        assert_eq!(flaw_of_line(&[[0.0, 0.0], [1.0, 0.0], [1.0, 0.0]]), Some(Flaw::ShortEdge(1)));
    }

    #[test]
    fn reflex_corners_are_found_and_straight_ones_are_not() {
        assert_eq!(reflex_corner(&SQUARE), None);
        assert_eq!(reflex_corner(&ANGLE), Some(4));
        assert_eq!(reflex_corner(&reversed(&ANGLE)), Some(1));
        let straight = [[0.0, 0.0], [1.1, 0.33], [2.2, 0.66], [3.3, 0.99], [0.0, 4.0]];
        assert_eq!(reflex_corner(&straight), None);
    }

    #[test]
    fn corners_become_counter_clockwise() {
        assert_eq!(counter_clockwise(&SQUARE), SQUARE);
        assert_eq!(signed_area(&counter_clockwise(&reversed(&ANGLE))), 12.0);
        assert_eq!(signed_area(&reversed(&ANGLE)), -12.0);
    }

    #[test]
    fn the_inner_radius_is_that_of_the_largest_disc_around_the_centroid() {
        let far = SQUARE.map(|[x, y]| [x + 100.0, 2.0 * y - 300.0]);
        assert_eq!(inner_radius(&far), 2.0);
        assert_eq!(centroid(&far), [102.0, -296.0]);
        assert!(
            (inner_radius(&[[0.0, 0.0], [3.0, 0.0], [0.0, 3.0]]) - 0.5_f64.sqrt()).abs() < 1e-12
        );
    }

    #[test]
    fn places_squares_and_circles_meet_a_polygon_or_not() {
        for (place, is_in) in
            [([1.0, 1.0], true), ([1.0, 3.0], false), ([3.0, 3.0], true), ([5.0, 1.0], false)]
        {
            assert_eq!(contains(&ANGLE, place), is_in, "{place:?}");
        }
        for (low, high, meets) in
            [(1.0, 1.0, true), (-9.0, 9.0, true), (3.0, 9.0, true), (4.5, 9.0, false)]
        {
            assert_eq!(meets_square(&ANGLE, low, high), meets, "{low} to {high}");
        }
        // A plus of a square and a bar has no corner in the other.
        let bar = [[1.0, -9.0], [2.0, -9.0], [2.0, 9.0], [1.0, 9.0]];
        assert!(meets_square(&bar, 0.0, 3.0));
        for (center, radius, meets) in [
            ([1.0, 1.0], 0.5, true),
            ([1.0, 3.0], 0.5, false),
            ([1.0, 3.0], 1.5, true),
            ([2.0, 2.0], 50.0, false),
            ([-50.0, 1.0], 52.0, true),
        ] {
            assert_eq!(meets_circle(&ANGLE, center, radius), meets, "{center:?} {radius}");
        }
    }
}
