"""The convex hull of points in space, as half-spaces."""

from __future__ import annotations

import numpy as np

from forcemap.arrays import FloatArray, Indices, Mask

_ON = 1e-10
"""A point counts as on a plane this close to it [m, m/s]: a tenth of the tolerance of the measured range."""

_SPAN = 1e-6  # thinnest extent [m, m/s] of the first four points; thinner ones are left to qhull

_FEW = 150  # points that are added one by one; qhull, whose import takes longer, is faster with more


def half_spaces(points: FloatArray) -> FloatArray:
    """Half-spaces n.x + b <= 0, rows (n, b), n of length 1, whose intersection is the hull of points, shape (m, 3).

    By qhull, but for few points: then a hull is accepted that proves itself, so that a command need not load
    `scipy.spatial` for the 27 states of a map.
    """
    planes = _added_one_by_one(points) if len(points) <= _FEW else None
    if planes is not None:
        return planes
    from scipy.spatial import ConvexHull

    return np.asarray(ConvexHull(points).equations)


def _added_one_by_one(points: FloatArray) -> FloatArray | None:
    """The planes of a triangulated hull; None where rounding leaves in doubt whether it is one.

    A point outside replaces the triangles that it sees by those to their rim. Farthest points come first: a later one
    on an edge or in a face sees none. What is returned is proven: every plane has all points on its inner side, and the
    triangles are a closed surface, each edge of one being the same edge of another, run through the other way.
    """
    first = _first_four(points)
    if first is None:
        return None
    inner = points[first].mean(axis=0)
    triangles = first[[[0, 1, 2], [0, 3, 1], [1, 3, 2], [2, 3, 0]]]
    if (_planes(points, triangles)[0] @ [*inner, 1.0]) > 0:
        triangles = triangles[:, ::-1]
    for point in np.argsort(-np.linalg.norm(points - inner, axis=1)):
        seen = _planes(points, triangles) @ [*points[point], 1.0] > _ON
        if seen.any():
            edges = _edges(triangles[seen])
            rim = edges[~_run_back(edges)]
            new = np.column_stack([rim, np.full(len(rim), point)])
            triangles = np.vstack([triangles[~seen], new])
    planes, edges = _planes(points, triangles), _edges(triangles)
    supporting = (planes[:, :3] @ points.T + planes[:, 3:] <= _ON).all()  # false for NaN, too
    closed = _run_back(edges).all() and len(np.unique(edges, axis=0)) == len(edges)
    return planes if supporting and closed else None


def _first_four(points: FloatArray) -> Indices | None:
    """Four points far from lying in a plane; None if there are none."""
    chosen = [int(np.linalg.norm(points - points.mean(axis=0), axis=1).argmax())]
    left = points - points[chosen[0]]  # what the directions to the chosen ones leave of all
    for _ in range(3):
        length = np.linalg.norm(left, axis=1)
        chosen.append(int(length.argmax()))
        if length[chosen[-1]] < _SPAN:
            return None
        along = left[chosen[-1]] / length[chosen[-1]]
        left = left - np.outer(left @ along, along)
    return np.array(chosen)


def _planes(points: FloatArray, triangles: Indices) -> FloatArray:
    """Planes through triangles, shape (k, 4), their normals outward if corners run counterclockwise from outside."""
    a, b, c = points[triangles.T]
    normals = np.cross(b - a, c - a)
    with np.errstate(invalid="ignore"):
        normals /= np.linalg.norm(normals, axis=1)[:, None]
    return np.column_stack([normals, -np.sum(normals * a, axis=1)])


def _edges(triangles: Indices) -> Indices:
    """Edges of triangles as they are run through, shape (3 k, 2)."""
    return np.asarray(triangles[:, [[0, 1], [1, 2], [2, 0]]].reshape(-1, 2))


def _run_back(edges: Indices) -> Mask:
    """Which edges are among them the other way round, too."""
    code = edges[:, 0] << 32 | edges[:, 1]
    return np.isin(edges[:, 1] << 32 | edges[:, 0], code)
