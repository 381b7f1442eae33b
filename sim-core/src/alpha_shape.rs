//! The outer border of a set of points: its alpha shape (Edelsbrunner, Kirkpatrick
//! & Seidel 1983) with holes filled.
//!
//! The triangulation uses exact predicates, so it is the same on every machine.

use spade::{DelaunayTriangulation, Point2, Triangulation as _};

use crate::torus::Vec2;

/// Coordinates below this count as zero, cm, because the exact predicates cannot compute with the
/// tiniest numbers.
const TINY: f64 = 1e-30;

/// Whether each point lies on the outer border of the alpha shape, the union of the Delaunay
/// triangles with a circumradius below `radius`. The border has the points that the union does not
/// surround. A point outside every such triangle is on the border, unless it lies in a hole. Points
/// at the same place have the same result.
pub(crate) fn border(points: &[Vec2], radius: f64) -> Vec<bool> {
    let mut triangulation: DelaunayTriangulation<Point2<f64>> = DelaunayTriangulation::new();
    let coordinate = |x: f64| if x.abs() < TINY { 0.0 } else { x };
    let vertices: Vec<usize> = points
        .iter()
        .map(|point| {
            let point = Point2::new(coordinate(point.x), coordinate(point.y));
            let vertex = triangulation.insert(point);
            vertex.expect("positions on the torus are finite and not tiny").index()
        })
        .collect();
    if triangulation.all_vertices_on_line() {
        return vec![true; points.len()];
    }
    let n_faces = triangulation.num_all_faces();
    let mut solid = vec![false; n_faces];
    for face in triangulation.inner_faces() {
        solid[face.index()] = face.circumcircle().1 < radius * radius;
    }
    let mut neighbours = vec![Vec::new(); n_faces];
    for edge in triangulation.directed_edges() {
        neighbours[edge.face().index()].push(edge.rev().face().index());
    }
    // A triangle is outside if a path from infinity reaches it without crossing a solid triangle.
    let mut outside = vec![false; n_faces];
    let mut reached = vec![triangulation.outer_face().index()];
    while let Some(face) = reached.pop() {
        if !solid[face] && !std::mem::replace(&mut outside[face], true) {
            reached.extend(&neighbours[face]);
        }
    }
    let mut on_border = vec![false; triangulation.num_vertices()];
    for edge in triangulation.directed_edges() {
        if outside[edge.face().index()] {
            on_border[edge.from().index()] = true;
            on_border[edge.to().index()] = true;
        }
    }
    vertices.into_iter().map(|vertex| on_border[vertex]).collect()
}

#[cfg(test)]
mod tests {
    use std::collections::BTreeSet;

    use proptest::prelude::*;

    use super::*;

    const RADIUS: f64 = 50.0;

    fn points(coordinates: &[(f64, f64)]) -> Vec<Vec2> {
        coordinates.iter().map(|&(x, y)| Vec2::new(x, y)).collect()
    }

    /// Indices of the points on the border.
    fn on_border(coordinates: &[(f64, f64)]) -> Vec<usize> {
        let border = border(&points(coordinates), RADIUS);
        (0..coordinates.len()).filter(|&index| border[index]).collect()
    }

    /// Centre and squared circumradius of a triangle; `None` if it is flat.
    fn circumcircle([a, b, c]: [Vec2; 3]) -> Option<(Vec2, f64)> {
        let (b, c) = (Vec2::new(b.x - a.x, b.y - a.y), Vec2::new(c.x - a.x, c.y - a.y));
        let d = 2.0 * (b.x * c.y - b.y * c.x);
        if d.abs() < 1e-9 {
            return None;
        }
        let (bb, cc) = (b.x * b.x + b.y * b.y, c.x * c.x + c.y * c.y);
        let x = (bb * c.y - cc * b.y) / d;
        let y = (cc * b.x - bb * c.x) / d;
        Some((Vec2::new(a.x + x, a.y + y), x * x + y * y))
    }

    /// The definition by brute force: triples of points with an empty circumcircle are the
    /// triangles.
    fn brute_force(points: &[Vec2], radius: f64) -> Vec<bool> {
        let n = points.len();
        let mut triangles = Vec::new();
        for a in 0..n {
            for b in a + 1..n {
                for c in b + 1..n {
                    let Some((center, r2)) = circumcircle([points[a], points[b], points[c]]) else {
                        continue;
                    };
                    let empty = (0..n).filter(|p| ![a, b, c].contains(p)).all(|p| {
                        let (dx, dy) = (points[p].x - center.x, points[p].y - center.y);
                        dx * dx + dy * dy >= r2
                    });
                    if empty {
                        triangles.push(([a, b, c], r2 < radius * radius));
                    }
                }
            }
        }
        let edges = |[a, b, c]: [usize; 3]| [(a, b), (a, c), (b, c)];
        let at_edge = |edge| triangles.iter().filter(move |(t, _)| edges(*t).contains(&edge));
        // Triangles that are not solid and connect to the outside, found as a fixed point.
        let mut open: BTreeSet<[usize; 3]> = BTreeSet::new();
        loop {
            let more = triangles.iter().filter(|(t, solid)| {
                let reached = |edge| {
                    let n_open = at_edge(edge).filter(|(other, _)| open.contains(other)).count();
                    n_open > 0 || at_edge(edge).count() == 1
                };
                !solid && !open.contains(t) && edges(*t).into_iter().any(reached)
            });
            let more: Vec<[usize; 3]> = more.map(|(t, _)| *t).collect();
            if more.is_empty() {
                break;
            }
            open.extend(more);
        }
        let on_hull = |p: usize| {
            let hull = triangles.iter().flat_map(|(t, _)| edges(*t));
            hull.filter(|&(a, b)| a == p || b == p).any(|edge| at_edge(edge).count() == 1)
        };
        (0..n).map(|p| on_hull(p) || open.iter().any(|t| t.contains(&p))).collect()
    }

    proptest! {
        #[test]
        fn borders_match_the_definition(
            coordinates in prop::collection::vec((0.0..300.0f64, 0.0..300.0f64), 4..25),
            radius in 20.0..120.0f64,
        ) {
            let points = points(&coordinates);
            prop_assert_eq!(border(&points, radius), brute_force(&points, radius));
        }

        #[test]
        fn a_large_radius_gives_the_convex_hull(
            coordinates in prop::collection::vec((0.0..300.0f64, 0.0..300.0f64), 4..15),
        ) {
            let points = points(&coordinates);
            let all_left = |a: Vec2, b: Vec2| points.iter().all(|p| {
                (b.x - a.x) * (p.y - a.y) - (b.y - a.y) * (p.x - a.x) >= 0.0
            });
            let border = border(&points, 1e12);
            for (point, on_border) in points.iter().zip(border) {
                let extreme = points.iter().any(|other| other != point && all_left(*point, *other));
                prop_assert_eq!(on_border, extreme);
            }
        }
    }

    #[test]
    fn a_surrounded_point_is_inside() {
        let square = [(0.0, 0.0), (60.0, 0.0), (60.0, 60.0), (0.0, 60.0), (31.0, 30.0)];
        assert_eq!(on_border(&square), [0, 1, 2, 3]);
    }

    #[test]
    fn a_point_beyond_the_radius_is_on_the_border() {
        let tail = [
            (0.0, 0.0),
            (60.0, 0.0),
            (60.0, 60.0),
            (0.0, 60.0),
            (31.0, 30.0),
            (155.0, 30.0),
            (250.0, 30.0),
        ];
        assert_eq!(on_border(&tail), [0, 1, 2, 3, 5, 6]);
    }

    #[test]
    fn a_bay_is_outside_and_a_hole_is_inside() {
        let ring = |n: usize, radius: f64| {
            (0..n).map(move |index| {
                let direction = Vec2::unit(std::f64::consts::TAU * index as f64 / 12.0);
                (radius * direction.x, radius * direction.y)
            })
        };
        // Two rings of twelve, the inner one around a hole of radius 100.
        let closed: Vec<_> = ring(12, 160.0).chain(ring(12, 100.0)).collect();
        assert_eq!(on_border(&closed), Vec::from_iter(0..12));
        // With three robots less on either ring, the hole becomes a bay.
        let open: Vec<_> = ring(9, 160.0).chain(ring(9, 100.0)).collect();
        assert_eq!(on_border(&open), Vec::from_iter(0..18));
    }

    #[test]
    fn degenerate_sets_are_all_border() {
        assert_eq!(border(&[], RADIUS), [false; 0]);
        assert_eq!(on_border(&[(3.0, 4.0)]), [0]);
        assert_eq!(on_border(&[(3.0, 4.0); 5]), [0, 1, 2, 3, 4]);
        let line: Vec<_> = (0..6).map(|i| (30.0 * f64::from(i), 10.0 * f64::from(i))).collect();
        assert_eq!(on_border(&line), Vec::from_iter(0..6));
        let sparse = [(0.0, 0.0), (90.0, 0.0), (45.0, 80.0), (135.0, 80.0), (90.0, 160.0)];
        assert_eq!(on_border(&sparse), Vec::from_iter(0..5));
    }

    #[test]
    fn points_at_one_place_have_the_same_result() {
        let square = [
            (0.0, 0.0),
            (60.0, 0.0),
            (60.0, 60.0),
            (0.0, 60.0),
            (31.0, 30.0),
            (31.0, 30.0),
            (0.0, 60.0),
        ];
        assert_eq!(on_border(&square), [0, 1, 2, 3, 6]);
    }

    #[test]
    fn the_tiniest_coordinates_are_accepted() {
        let square = [(1e-300, 0.0), (60.0, -1e-300), (60.0, 60.0), (0.0, 60.0), (31.0, 30.0)];
        assert_eq!(on_border(&square), [0, 1, 2, 3]);
    }
}
