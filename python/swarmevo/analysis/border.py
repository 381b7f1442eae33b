"""The border of a swarm: its alpha shape (thesis, section 5.2). Needs SciPy (`analysis`)."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np
from numpy.typing import ArrayLike, NDArray

from ..extras import needs

Floats = NDArray[np.float64]
Ints = NDArray[np.int64]

ALPHA = 15.0
"""The thesis's alpha, with the width of the world as the unit of length."""


def displacements(positions: ArrayLike, size: ArrayLike) -> Floats:
    """``[R, R, 2]``: the shortest way on a torus of ``size`` ``[2]`` from robot i to robot j, for
    ``positions`` ``[R, 2]``, in their unit."""
    points, extent = np.asarray(positions, np.float64), np.asarray(size, np.float64)
    ways = points[np.newaxis] - points[:, np.newaxis]
    return np.asarray(ways - extent * np.round(ways / extent))


def components(positions: ArrayLike, size: ArrayLike, reach: float) -> Iterator[tuple[Ints, Floats]]:
    """The connected parts of a swarm, in which robots less than ``reach`` apart are connected: for each
    part, the numbers of its robots ``[K]`` and their positions in the plane ``[K, 2]``, in one piece
    even across the seam of the torus."""
    points = np.asarray(positions, np.float64)
    ways = displacements(points, size)
    near = np.hypot(ways[..., 0], ways[..., 1]) < reach
    seen = np.zeros(len(points), bool)
    for first in range(len(points)):
        if seen[first]:
            continue
        at = {first: points[first]}
        seen[first] = True
        queue = [first]
        for robot in queue:
            for other in np.flatnonzero(near[robot] & ~seen).tolist():
                seen[other] = True
                at[other] = at[robot] + ways[robot, other]
                queue.append(other)
        yield np.array(queue), np.stack([at[robot] for robot in queue])


def alpha_shape(points: ArrayLike, radius: float) -> tuple[Ints, Ints]:
    """The outer border of the alpha shape of ``points`` ``[K, 2]`` (Edelsbrunner, Kirkpatrick & Seidel
    1983), with holes filled: the outer border of the union of the Delaunay triangles whose circumradius is
    less than ``radius``.

    Returns the points that the union does not surround ``[B]``, in ascending order, and the edges of
    its outline ``[E, 2]``. All points are border if they lie on a line or if there is no such triangle.
    """
    with needs("analysis"):
        from scipy.spatial import Delaunay, QhullError

    at = np.asarray(points, np.float64)
    nothing = np.arange(len(at)), np.empty((0, 2), np.int64)
    if len(at) < 4:
        return nothing
    try:
        triangulation = Delaunay(at)
    except QhullError:
        return nothing
    triangles = triangulation.simplices
    solid = _circumradii(at[triangles]) < radius
    outside = _reached(solid, triangulation.neighbors)
    on_border: set[int] = set(triangulation.convex_hull.reshape(-1).tolist())
    on_border.update(triangles[outside].reshape(-1).tolist())
    edges = []
    for triangle, neighbours, is_solid in zip(triangles, triangulation.neighbors, solid):
        for corner in range(3) if is_solid else ():
            beyond = neighbours[corner]
            if beyond < 0 or outside[beyond]:
                edges.append(np.delete(triangle, corner))
    outline = np.array(edges, np.int64).reshape(-1, 2)
    return np.array(sorted(on_border)), outline


def border(positions: ArrayLike, size: ArrayLike, reach: float, alpha: float = ALPHA) -> NDArray[np.bool_]:
    """``[R]``: whether each robot of ``positions`` ``[R, 2]`` lies on the outer border of the alpha shape of
    its part of the swarm (see :func:`components`). ``alpha`` is in the inverse of the world's width;
    0 is the convex hull. Parts of fewer than four robots have no interior."""
    found = np.ones(len(np.asarray(positions)), bool)
    width = float(np.asarray(size, np.float64)[0])
    radius = width / alpha if alpha > 0 else np.inf
    for robots, points in components(positions, size, reach):
        if len(robots) >= 4:
            found[robots] = False
            found[robots[alpha_shape(points, radius)[0]]] = True
    return found


def _circumradii(corners: Floats) -> Floats:
    """``[K]`` of triangles ``[K, 3, 2]``; infinite if flat."""
    a, b, c = (np.linalg.norm(corners[:, i] - corners[:, i - 1], axis=-1) for i in range(3))
    one, two = corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]
    doubled = np.abs(one[:, 0] * two[:, 1] - one[:, 1] * two[:, 0])
    with np.errstate(divide="ignore"):
        return np.asarray(a * b * c / (2 * doubled))


def _reached(solid: NDArray[np.bool_], neighbours: Ints) -> NDArray[np.bool_]:
    """Triangles that a path from outside reaches without crossing a solid one."""
    outside = np.zeros(len(solid), bool)
    queue = np.flatnonzero((neighbours < 0).any(axis=1) & ~solid).tolist()
    outside[queue] = True
    for triangle in queue:
        for beyond in neighbours[triangle].tolist():
            if beyond >= 0 and not solid[beyond] and not outside[beyond]:
                outside[beyond] = True
                queue.append(beyond)
    return outside
