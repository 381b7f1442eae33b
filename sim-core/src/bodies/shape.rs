//! Shapes of bodies: discs and convex polygons, with what their mass resists.

use crate::torus::Vec2;

/// A shape about its centre of mass.
#[derive(Debug, Clone, PartialEq)]
pub(crate) enum Shape {
    /// A disc of this radius, cm.
    Disc(f64),
    /// A convex polygon.
    Polygon(Polygon),
}

/// A convex polygon; its corners go round counter-clockwise. Two corners are a segment.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Polygon {
    /// Corners, about the centre of mass; cm.
    pub corners: Vec<Vec2>,
    /// Unit vectors that point outwards; number i belongs to the side from corner i to the next.
    pub normals: Vec<Vec2>,
    /// Largest distance of a corner from the centre of mass, cm.
    pub reach: f64,
}

impl Shape {
    /// The polygon of these corners, in either direction of rotation; its centre of mass becomes
    /// the origin. The corners make a convex polygon of an area above 0.
    pub fn polygon(corners: &[Vec2]) -> Self {
        let mut corners = corners.to_vec();
        if twice_the_area(&corners) < 0.0 {
            corners.reverse();
        }
        let centre = centroid(&corners);
        corners.iter_mut().for_each(|corner| *corner = *corner - centre);
        Self::Polygon(Polygon::new(corners))
    }

    /// Largest distance of its points from the centre, cm.
    pub fn reach(&self) -> f64 {
        match self {
            Self::Disc(radius) => *radius,
            Self::Polygon(polygon) => polygon.reach,
        }
    }

    /// Moment of inertia per mass, about the centre of mass; cm^2.
    pub fn inertia(&self) -> f64 {
        match self {
            Self::Disc(radius) => 0.5 * radius * radius,
            Self::Polygon(polygon) => polygon.inertia(),
        }
    }

    /// Mean distance of its points from the centre, by the disc of the same area; cm. Friction
    /// with the ground has this lever against turning.
    pub fn lever(&self) -> f64 {
        let radius = match self {
            Self::Disc(radius) => *radius,
            Self::Polygon(polygon) => {
                (0.5 * twice_the_area(&polygon.corners) / std::f64::consts::PI).sqrt()
            }
        };
        2.0 / 3.0 * radius
    }
}

impl Polygon {
    /// Two or more corners, counter-clockwise.
    pub fn new(corners: Vec<Vec2>) -> Self {
        let normals = sides(&corners).map(|(from, to)| (to - from).unit_or_zero().turned_right());
        let normals = normals.collect();
        let reach = corners.iter().map(|corner| corner.norm()).fold(0.0, f64::max);
        Self { corners, normals, reach }
    }

    /// By triangles about the origin.
    pub fn inertia(&self) -> f64 {
        let (mut area, mut moment) = (0.0, 0.0);
        for (a, b) in sides(&self.corners) {
            let cross = a.cross(b);
            area += cross;
            moment += cross * (a.dot(a) + a.dot(b) + b.dot(b));
        }
        moment / (6.0 * area)
    }
}

/// The sides of a polygon, from corner to corner.
pub(crate) fn sides(corners: &[Vec2]) -> impl Iterator<Item = (Vec2, Vec2)> {
    let next = corners.iter().cycle().skip(1);
    corners.iter().copied().zip(next.copied())
}

/// Twice the area of a polygon; negative if its corners go round clockwise.
fn twice_the_area(corners: &[Vec2]) -> f64 {
    let origin = corners[0];
    sides(corners).map(|(a, b)| (a - origin).cross(b - origin)).sum()
}

/// Whether a simple polygon contains a point.
pub(crate) fn contains(corners: &[Vec2], point: Vec2) -> bool {
    // A ray to the right crosses its sides an odd number of times.
    let crosses = |(a, b): &(Vec2, Vec2)| {
        (a.y > point.y) != (b.y > point.y)
            && point.x < a.x + (point.y - a.y) * (b.x - a.x) / (b.y - a.y)
    };
    sides(corners).filter(crosses).count() % 2 == 1
}

/// By triangles about the first corner: about a distant origin, their areas would cancel out.
fn centroid(corners: &[Vec2]) -> Vec2 {
    let origin = corners[0];
    let (mut sum, mut twice_the_area) = (Vec2::default(), 0.0);
    for (a, b) in sides(corners) {
        let (a, b) = (a - origin, b - origin);
        let cross = a.cross(b);
        sum = sum + (a + b) * cross;
        twice_the_area += cross;
    }
    origin + sum * (1.0 / (3.0 * twice_the_area))
}
