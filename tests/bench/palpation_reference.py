#!/usr/bin/env python3
"""Force on a sphere that is pushed into a block over a stiff ball, at places along the block: linear
elasticity on elements of 27 nodes (numpy alone), frictionless contact at their nodes. Nothing here is the
library's.

palpation_reference.py [OUT.csv]   a row per place and mesh; default tests/data/palpation_reference.csv

The block is clamped below; y = 0 is its middle, and half of it is modeled. Modulus by integration point.
Nodes are numbered by planes across x, so that the stiffness is a chain of dense blocks, which are eliminated
in turn.
"""
import csv
import pathlib
import sys

import numpy as np

import palpation_case as case

MESHES = ((20, 6, 6), (30, 8, 8), (40, 9, 9))  # elements along x, half of y, z
ROOT = pathlib.Path(__file__).resolve().parents[2]


def shapes_1d(x):
    return np.array([x * (x - 1) / 2, 1 - x * x, x * (x + 1) / 2]), np.array([x - 0.5, -2 * x, x + 0.5])


def element(lo, size, points):
    """Stiffness in N/m of a box of edges `size` at `lo`; nodes in the order k + 3 j + 9 i (x slowest)."""
    at, weight = np.polynomial.legendre.leggauss(points)
    law = np.zeros((6, 6))
    law[:3, :3] = case.POISSON / ((1 + case.POISSON) * (1 - 2 * case.POISSON))
    law[range(3), range(3)] += 1 / (1 + case.POISSON)
    law[range(3, 6), range(3, 6)] = 0.5 / (1 + case.POISSON)
    out = np.zeros((81, 81))
    for i, a in enumerate(at):
        for j, b in enumerate(at):
            for k, c in enumerate(at):
                (fx, gx), (fy, gy), (fz, gz) = shapes_1d(a), shapes_1d(b), shapes_1d(c)
                product = lambda x, y, z: np.einsum("i,j,k->ijk", x, y, z).ravel()
                dx, dy, dz = (product(gx, fy, fz) * 2 / size[0], product(fx, gy, fz) * 2 / size[1],
                              product(fx, fy, gz) * 2 / size[2])
                strain = np.zeros((6, 81))
                strain[0, 0::3], strain[1, 1::3], strain[2, 2::3] = dx, dy, dz
                strain[3, 0::3], strain[3, 1::3] = dy, dx
                strain[4, 1::3], strain[4, 2::3] = dz, dy
                strain[5, 0::3], strain[5, 2::3] = dz, dx
                x = lo + (np.array([a, b, c]) + 1) / 2 * size
                scale = weight[i] * weight[j] * weight[k] * np.prod(size) / 8 * case.young_at(x)
                out += scale * strain.T @ law @ strain
    return out


class Block:
    """Half of the block; self.nodes [n,3] m, numbered z fastest, then y, then x."""

    def __init__(self, cells):
        nx, ny, nz = cells
        self.plane = (2 * ny + 1) * (2 * nz + 1) * 3
        # finer toward the middle and the top
        edges = [np.linspace(0, case.SIZE[0], nx + 1), case.SIZE[1] / 2 * graded(ny),
                 case.SIZE[2] * (1 - graded(nz))[::-1]]
        lines = [np.sort(np.concatenate([e, (e[1:] + e[:-1]) / 2])) for e in edges]
        self.nodes = np.stack(np.meshgrid(*lines, indexing="ij"), -1).reshape(-1, 3)
        held = np.repeat(self.nodes[:, 2] < 1e-12, 3)
        held[1::3] |= self.nodes[:, 1] < 1e-12  # symmetry
        self.held = held.reshape(2 * nx + 1, self.plane)
        shape = (2 * ny + 1, 2 * nz + 1)
        self.inverse, self.next = [], []
        schur = np.zeros((self.plane, self.plane))
        for e in range(nx):
            k = np.zeros((3 * self.plane, 3 * self.plane))
            for j in range(ny):
                for m in range(nz):
                    lo = np.array([edges[0][e], edges[1][j], edges[2][m]])
                    size = np.array([edges[0][e + 1], edges[1][j + 1], edges[2][m + 1]]) - lo
                    near = np.clip(case.BALL, lo, lo + size)
                    far = np.abs(np.array(case.BALL) - lo - size / 2) + size / 2
                    cut = ((near - case.BALL) ** 2).sum() < case.RADIUS ** 2 < (far ** 2).sum()
                    local = np.indices((3, 3, 3)).reshape(3, -1)
                    ids = (local[0] * shape[0] + 2 * j + local[1]) * shape[1] + 2 * m + local[2]
                    dofs = (3 * ids[:, None] + np.arange(3)).ravel()
                    k[np.ix_(dofs, dofs)] += element(lo, size, 6 if cut else 3)
            held = self.held[2 * e:2 * e + 3].ravel()
            k[held, :] = 0
            k[:, held] = 0
            p = self.plane
            k[:p, :p] += schur
            k[np.flatnonzero(held[:2 * p]), np.flatnonzero(held[:2 * p])] = 1
            self.inverse.append(np.linalg.inv(k[:2 * p, :2 * p]))
            self.next.append(k[:2 * p, 2 * p:].copy())
            schur = k[2 * p:, 2 * p:] - self.next[-1].T @ (self.inverse[-1] @ self.next[-1])
        held = np.flatnonzero(self.held[-1])
        schur[held, held] = 1
        self.inverse.append(np.linalg.inv(schur))

    def solve(self, load):
        """Displacements [ndof, m] under the loads [ndof, m]."""
        p, n = self.plane, len(self.next)
        load = load.copy()
        load[self.held.ravel()] = 0
        part = [load[2 * p * e:2 * p * (e + 1)] for e in range(n + 1)]
        for e in range(n):
            part[e + 1][:p] -= self.next[e].T @ (self.inverse[e] @ part[e])
        out = np.zeros_like(load)
        out[2 * p * n:] = self.inverse[n] @ part[n]
        for e in reversed(range(n)):
            after = out[2 * p * (e + 1):2 * p * (e + 1) + p]
            out[2 * p * e:2 * p * (e + 1)] = self.inverse[e] @ (part[e] - self.next[e] @ after)
        return out


def graded(n):
    """0 to 1 in n cells, the first about a third of the last."""
    x = np.linspace(0, 1, n + 1)
    return 0.55 * x + 0.45 * x * x


def pressed(compliance, nodes, x):
    """Force (x, z) in N on a sphere at x that is pushed in by DEPTH, and how many nodes it touches.

    compliance: [3n,3n] m/N, of `nodes`.
    """
    center = np.array([x, 0, case.SIZE[2] + case.PROBE - case.DEPTH])
    u = np.zeros_like(nodes)
    for _ in range(30):
        from_center = nodes + u - center
        distance = np.linalg.norm(from_center, axis=1)
        normal = from_center / distance[:, None]
        some = np.flatnonzero(distance < case.PROBE + 2 * case.DEPTH)
        c = compliance.reshape(len(nodes), 3, len(nodes), 3)[some][:, :, some]
        a = np.einsum("ik,ikjl,jl->ij", normal[some], c, normal[some])
        b = (distance - case.PROBE - (normal * u).sum(1))[some]
        active = b < 0
        force = np.zeros(len(some))
        for _ in range(100):
            force[:] = 0
            force[active] = np.linalg.solve(a[np.ix_(active, active)], -b[active])
            wrong = (active & (force < 0)) | (~active & (a @ force + b < -1e-12))
            if not wrong.any():
                break
            active ^= wrong
        pushed = np.zeros_like(nodes)
        pushed[some] = force[:, None] * normal[some]
        after = (compliance @ pushed.ravel()).reshape(-1, 3)
        change = np.abs(after - u).max()
        u = after
        if change < 1e-10:
            break
    total = -2 * pushed.sum(0)
    return total[0], total[2], len(some[force > 0])


def main():
    out = pathlib.Path(sys.argv[1] if len(sys.argv) > 1 else ROOT / "tests/data/palpation_reference.csv")
    rows = []
    for cells in MESHES:
        block = Block(cells)
        reach = 1.5 * (2 * case.PROBE * case.DEPTH) ** 0.5
        x, y, z = block.nodes.T
        top = np.flatnonzero((z > case.SIZE[2] - 1e-12) & (y < reach) & (x > case.PLACES[0] - reach)
                             & (x < case.PLACES[-1] + reach))
        dofs = (3 * top[:, None] + np.arange(3)).ravel()
        load = np.zeros((3 * len(block.nodes), len(dofs)))
        load[dofs, range(len(dofs))] = 1
        compliance = block.solve(load)[dofs]
        for place in case.PLACES:
            fx, fz, count = pressed(compliance, block.nodes[top], place)
            rows.append(["x".join(map(str, cells)), f"{place:.6g}", f"{fx:.6g}", f"{fz:.6g}", count])
            print(*rows[-1], flush=True)
    with open(out, "w", newline="") as file:
        writer = csv.writer(file, lineterminator="\n")
        writer.writerow(["mesh", "x_m", "force_x_N", "force_z_N", "points_in_contact"])
        writer.writerows(rows)


if __name__ == "__main__":
    main()
