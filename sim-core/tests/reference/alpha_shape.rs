//! The swarm's border (section 5.2): alpha shapes by brute force.

use super::torus::{Torus, Vector, norm};

/// For each robot, whether it is on the alpha shape of its connected component. Robots less than
/// `range` apart are connected. The shape consists of the triangles with a circumradius under
/// `largest_radius`.
pub fn borderline(
    positions: &[Vector],
    torus: Torus,
    range: f64,
    largest_radius: f64,
) -> Vec<bool> {
    let mut is_border = vec![false; positions.len()];
    for component in components(positions, torus, range) {
        let points: Vec<Vector> = component.iter().map(|&(_, point)| point).collect();
        for (&(robot, _), is_on_shape) in component.iter().zip(alpha_shape(&points, largest_radius))
        {
            is_border[robot] = is_on_shape;
        }
    }
    is_border
}

/// Connected components as lists of (robot, point in the plane). The torus is
/// unrolled along the edges.
fn components(positions: &[Vector], torus: Torus, range: f64) -> Vec<Vec<(usize, Vector)>> {
    let mut is_found = vec![false; positions.len()];
    let mut components = Vec::new();
    for first in 0..positions.len() {
        if is_found[first] {
            continue;
        }
        is_found[first] = true;
        let mut component = vec![(first, positions[first])];
        let mut next = 0;
        while next < component.len() {
            let (robot, point) = component[next];
            for neighbour in 0..positions.len() {
                let step = torus.displacement(positions[robot], positions[neighbour]);
                if !is_found[neighbour] && norm(step) < range {
                    is_found[neighbour] = true;
                    component.push((neighbour, [point[0] + step[0], point[1] + step[1]]));
                }
            }
            next += 1;
        }
        components.push(component);
    }
    components
}

/// For each point of the plane, whether it is on the outer ring of the alpha shape. The shape is
/// made of the Delaunay triangles (no point inside the circumcircle) with a circumradius under
/// `largest_radius`. The outside is the part of the plane that a walk from afar reaches without
/// entering the shape; points that touch it are on the ring. Fewer than 4 points, or points on a
/// line, are all on the ring.
fn alpha_shape(points: &[Vector], largest_radius: f64) -> Vec<bool> {
    let n = points.len();
    let mut triangles = Vec::new();
    for a in 0..n {
        for b in a + 1..n {
            for c in b + 1..n {
                let Some((centre, radius)) = circumcircle(points[a], points[b], points[c]) else {
                    continue;
                };
                let is_inside = |d: usize| {
                    ![a, b, c].contains(&d) && norm(difference(points[d], centre)) < radius
                };
                if !(0..n).any(is_inside) {
                    let edges = [(a, b), (a, c), (b, c)];
                    triangles.push(Triangle { edges, in_shape: radius < largest_radius });
                }
            }
        }
    }
    if n < 4 || triangles.is_empty() {
        return vec![true; n];
    }

    // Edges that face the outside. At first, these are the edges of the convex hull.
    let n_at = |edge| triangles.iter().filter(|t: &&Triangle| t.edges.contains(&edge)).count();
    let all_edges = triangles.iter().flat_map(|triangle| triangle.edges);
    let mut outside: Vec<(usize, usize)> = all_edges.filter(|&edge| n_at(edge) == 1).collect();
    let mut next = 0;
    while next < outside.len() {
        let edge = outside[next];
        next += 1;
        // A walk may cross a triangle that is not in the shape.
        for triangle in triangles.iter().filter(|t| !t.in_shape && t.edges.contains(&edge)) {
            for further in triangle.edges {
                if !outside.contains(&further) {
                    outside.push(further);
                }
            }
        }
    }
    (0..n).map(|point| outside.iter().any(|&(a, b)| a == point || b == point)).collect()
}

struct Triangle {
    edges: [(usize, usize); 3],
    in_shape: bool,
}

/// Centre and radius of the circle through three points; `None` if they are on a line.
fn circumcircle(a: Vector, b: Vector, c: Vector) -> Option<(Vector, f64)> {
    let [bx, by] = difference(b, a);
    let [cx, cy] = difference(c, a);
    let doubled_cross = 2.0 * (bx * cy - by * cx);
    if doubled_cross.abs() < 1e-9 {
        return None;
    }
    let b2 = bx * bx + by * by;
    let c2 = cx * cx + cy * cy;
    let to_centre = [(cy * b2 - by * c2) / doubled_cross, (bx * c2 - cx * b2) / doubled_cross];
    Some(([a[0] + to_centre[0], a[1] + to_centre[1]], norm(to_centre)))
}

fn difference(a: Vector, b: Vector) -> Vector {
    [a[0] - b[0], a[1] - b[1]]
}

#[test]
fn the_middle_of_a_pentagon_is_inside_also_across_the_border_of_the_torus() {
    let torus = Torus { width: 1000.0, height: 1000.0 };
    // A regular pentagon is on one circle, but each of its circumscribed
    // triangles holds the middle.
    let pentagon = |centre: Vector, radius: f64| -> Vec<Vector> {
        let corner = |i: f64| {
            let angle = 0.1 + i * std::f64::consts::TAU / 5.0;
            torus.wrap([centre[0] + radius * angle.cos(), centre[1] + radius * angle.sin()])
        };
        [centre].into_iter().chain((0..5).map(|i| corner(f64::from(i)))).collect()
    };
    let border = |positions: &[Vector]| borderline(positions, torus, 130.0, 1000.0 / 15.0);
    for centre in [[500.0, 500.0], [0.0, 0.0]] {
        let close = pentagon(centre, 60.0);
        assert_eq!(border(&close), [false, true, true, true, true, true]);
        // Wide triangles are not part of the shape.
        assert_eq!(border(&pentagon(centre, 120.0)), [true; 6]);
        // Each component has its own border.
        let far = pentagon([centre[0] + 300.0, centre[1]], 60.0);
        let both = [close.clone(), far].concat();
        assert_eq!(border(&both).iter().filter(|&&is_border| !is_border).count(), 2);
        // Three robots have no interior, and neither have robots on a line.
        assert_eq!(border(&close[..3]), [true; 3]);
    }
    let line: Vec<Vector> = (0..5).map(|i| [950.0 + 30.0 * f64::from(i), 10.0]).collect();
    assert_eq!(border(&line), [true; 5]);
}
