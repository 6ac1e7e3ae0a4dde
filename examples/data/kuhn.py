"""Kuhn's cut of a cube into six tetrahedra about the diagonal from corner 000 to 111: every permutation of
the axes is one path along edges."""
import itertools

PATHS = list(itertools.permutations(range(3)))
ODD = {(0, 2, 1), (1, 0, 2), (2, 1, 0)}


def cube(mirror):
    """Yields the corners of each tetrahedron, four places of 0 and 1, of positive volume; mirrored along the
    axes where `mirror` is true."""
    for path in PATHS:
        at = [0, 0, 0]
        corners = [tuple(at)]
        for axis in path:
            at[axis] = 1
            corners.append(tuple(at))
        tet = [tuple(1 - a if m else a for a, m in zip(corner, mirror)) for corner in corners]
        if (path in ODD) != (sum(map(bool, mirror)) % 2 == 1):
            tet[2], tet[3] = tet[3], tet[2]
        yield tet
