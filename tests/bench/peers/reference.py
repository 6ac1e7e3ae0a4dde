#!/usr/bin/env python3
"""References of scenes.py that need no engine: linear elasticity on blocks of 27-node elements (numpy).

Prints, on finer and finer meshes: sag of the tip and period of the clamped beam, shortening of the stack as
one block whose foot is held. Beside them the sag of Timoshenko's beam.
"""
import math

import numpy as np

import scenes


def shape_1d(x):
    """Values and slopes of the three quadratic functions on [-1, 1] at x."""
    return (np.array([x * (x - 1) / 2, 1 - x * x, x * (x + 1) / 2]), np.array([x - 0.5, -2 * x, x + 0.5]))


def element(size, material):
    """Stiffness and mass of a box of edges `size`, nodes in the order i + 3 j + 9 k."""
    young, nu, rho = (material[k] for k in ("young", "poisson", "density"))
    lame, shear = young * nu / ((1 + nu) * (1 - 2 * nu)), young / (2 * (1 + nu))
    law = np.zeros((6, 6))
    law[:3, :3] = lame
    law[range(3), range(3)] += 2 * shear
    law[range(3, 6), range(3, 6)] = shear
    points, weights = np.polynomial.legendre.leggauss(3)
    k, m, volume = np.zeros((81, 81)), np.zeros((27, 27)), np.prod(size) / 8
    for a, wa in zip(points, weights):
        for b, wb in zip(points, weights):
            for c, wc in zip(points, weights):
                (fx, gx), (fy, gy), (fz, gz) = shape_1d(a), shape_1d(b), shape_1d(c)
                product = lambda z, y, x: np.einsum("k,j,i->kji", z, y, x).ravel()
                n = product(fz, fy, fx)
                dx, dy, dz = (product(fz, fy, gx) * 2 / size[0], product(fz, gy, fx) * 2 / size[1],
                              product(gz, fy, fx) * 2 / size[2])
                strain = np.zeros((6, 81))
                strain[0, 0::3], strain[1, 1::3], strain[2, 2::3] = dx, dy, dz
                strain[3, 0::3], strain[3, 1::3] = dy, dx
                strain[4, 1::3], strain[4, 2::3] = dz, dy
                strain[5, 0::3], strain[5, 2::3] = dz, dx
                k += wa * wb * wc * volume * strain.T @ law @ strain
                m += wa * wb * wc * volume * rho * np.outer(n, n)
    return k, m


class Block:
    """A box of edges `size` cut into `cells` elements: stiffness, mass, places of the nodes."""

    def __init__(self, size, cells, material):
        nodes = [2 * c + 1 for c in cells]
        k, m = element([s / c for s, c in zip(size, cells)], material)
        place = np.indices(nodes[::-1]).reshape(3, -1)[::-1].T
        self.points = place * (np.array(size) / (2 * np.array(cells)))
        n = len(self.points)
        self.k, self.m = np.zeros((3 * n, 3 * n)), np.zeros((n, n))
        local = np.indices((3, 3, 3)).reshape(3, -1)
        for cz in range(cells[2]):
            for cy in range(cells[1]):
                for cx in range(cells[0]):
                    ids = ((2 * cz + local[0]) * nodes[1] + 2 * cy + local[1]) * nodes[0] + 2 * cx + local[2]
                    dofs = (3 * ids[:, None] + np.arange(3)).ravel()
                    self.k[np.ix_(dofs, dofs)] += k
                    self.m[np.ix_(ids, ids)] += m

    def sunk(self, held, gravity):
        """Displacements under a gravity along -z; points where `held` do not move."""
        free = np.flatnonzero(~np.repeat(held, 3))
        load = np.zeros(3 * len(held))
        load[2::3] = -gravity * self.m.sum(1)
        u = np.zeros_like(load)
        u[free] = np.linalg.solve(self.k[np.ix_(free, free)], load[free])
        return u.reshape(-1, 3)

    def period(self, held, shape):
        """Of the lowest mode that has a part in `shape`, by inverse iteration from there."""
        free = np.flatnonzero(~np.repeat(held, 3))
        mass = np.kron(self.m, np.eye(3))[np.ix_(free, free)]
        inverse = np.linalg.inv(self.k[np.ix_(free, free)])
        u = shape.ravel()[free]
        for _ in range(60):
            u = inverse @ (mass @ u)
            u /= math.sqrt(u @ mass @ u)
        return 2 * math.pi * math.sqrt((u @ mass @ u) / (u @ self.k[np.ix_(free, free)] @ u))


def main():
    length, _, height = scenes.BEAM_SIZE
    m = scenes.BEAM
    bending = 12 * m["density"] * scenes.G * length ** 4 / (8 * m["young"] * height ** 2)
    shear = m["density"] * scenes.G * length ** 2 / (2 * 5 / 6 * m["young"] / (2 * (1 + m["poisson"])))
    print("beam, Timoshenko: sag %.6g m" % (bending + shear))
    for cells in ((5, 1, 1), (10, 2, 2), (15, 3, 3), (20, 3, 3)):
        block = Block(scenes.BEAM_SIZE, cells, m)
        held = block.points[:, 0] < 1e-9
        u = block.sunk(held, scenes.G)
        tip = np.abs(block.points - [length, height / 2, height / 2]).sum(1).argmin()
        print("beam %s: sag %.6g m, period %.6g s" % (cells, -u[tip, 2], block.period(held, u)), flush=True)
    case = next(c for c in scenes.cases() if c["name"] == "stack")
    size, count = case["body"]["size"], case["count"]
    size = [*size[:2], count * size[2]]
    for cells in ((2, 2, 3), (4, 4, 6), (6, 6, 9)):
        block = Block(size, cells, case["body"]["material"])
        u = block.sunk(block.points[:, 2] < 1e-9, scenes.G * math.cos(case["angle"]))
        print("stack %s: shortening %.6g m" % (cells, -mean_top(block, u, size)), flush=True)


def mean_top(block, u, size):
    """Mean of u_z over the top face (Simpson's weights)."""
    top = block.points[:, 2] > size[2] - 1e-9
    weight = np.ones(top.sum())
    for axis in (0, 1):
        place = np.unique(np.round(block.points[top, axis], 9), return_inverse=True)[1]
        last = place.max()
        weight *= np.where(place % 2 == 1, 4.0, np.where((place == 0) | (place == last), 1.0, 2.0))
    return (weight * u[top, 2]).sum() / weight.sum()


if __name__ == "__main__":
    main()
