"""Meshes before they become bodies: read, made, filled, from arrays, from meshio."""
from __future__ import annotations

import ctypes
import pathlib
import tempfile
import weakref
from typing import Any, Sequence

import numpy as np

from . import _abi
from ._context import Context, called, default_context
from ._library import ArgumentError, OfThisProcess, check, encoded, lib, quick, sized
from ._values import KindError, array_of, real, whole


def points_of(points: Any, what: str = "points") -> np.ndarray:
    """[n,3] m, contiguous float64."""
    array = np.ascontiguousarray(array_of(points, what, "an array (n, 3) of numbers"))
    if array.ndim != 2 or array.shape[1] != 3:
        raise ArgumentError(f"{what} has the shape {array.shape}; expected (n, 3), in m", "DFM_E_ARG")
    bad = np.flatnonzero(~np.isfinite(array).all(axis=1))
    if bad.size:
        raise ArgumentError(f"{what}[{bad[0]}] is {tuple(array[bad[0]].tolist())}; it must be finite",
                            "DFM_E_ARG")
    return array


def cells_of(cells: Any, width: int, what: str) -> np.ndarray:
    """[n,width] point numbers, contiguous uint32."""
    given = np.asarray(cells)
    if given.ndim != 2 or given.shape[1] != width:
        raise ArgumentError(f"{what} has the shape {given.shape}; expected (n, {width}), numbers of points",
                            "DFM_E_ARG")
    if given.size and (given.dtype.kind not in "iu" or given.min() < 0 or given.max() >= 2**32):
        raise ArgumentError(f"{what} must hold whole numbers from 0 on, numbers of points", "DFM_E_ARG")
    return np.ascontiguousarray(given, dtype=np.uint32)


class _Keeper:
    """Owns a mesh of the library as long as anything looks at its arrays."""

    def __init__(self, handle: int, context: Context):
        self.handle = handle
        self._finalize = weakref.finalize(self, lambda h, _context: lib.dfm_mesh_destroy(h), handle, context)


def _borrowed(keeper: Any, address: int | None, shape: tuple[int, ...], kind: Any) -> np.ndarray:
    """A read-only array over the library's own memory; the mesh lives as long as the array does."""
    count = int(np.prod(shape))
    if not address or not count:
        return np.zeros(shape, dtype=np.dtype(kind))
    memory = (kind * count).from_address(address)
    memory.keeper = keeper
    array = np.frombuffer(memory, dtype=np.dtype(kind)).reshape(shape)
    array.flags.writeable = False
    return array


def _size(values: Sequence[float]) -> Any:
    try:
        given = list(values)
    except TypeError:
        given = []
    if not 1 <= len(given) <= 3:
        raise KindError(f"size is {values!r}; expected a list of numbers in m: [x, y, z] of a beam, or those "
                        "that TriMesh.make names for its kind", "DFM_E_ARG")
    numbers = [real(value, "a size of the mesh") for value in given]
    return (ctypes.c_double * 3)(*numbers, *([0.0] * (3 - len(numbers))))


def _groups(names: int | None, count: int) -> list[str]:
    words = (ctypes.c_char_p.from_address((names or 0) + 8 * i).value for i in range(count))
    return [(word or b"").decode() for word in words]


class _Mesh(OfThisProcess):
    _instead = "give its arrays (points and cells), or the path of its file"

    def __init__(self, handle: Any = None, context: Any = None):
        if not isinstance(context, Context):
            kind = type(self).__name__
            raise ArgumentError(f"a {kind} is made by {kind}.from_arrays(points, cells), read(path) or "
                                "another of its functions, not by calling the class", "DFM_E_ARG")
        self._keeper = _Keeper(handle, context)
        self._context = context

    def __copy__(self) -> Any:
        return self  # meshes do not change

    def __deepcopy__(self, _memo: Any) -> Any:
        return self

    @property
    def handle(self) -> int:
        return self._keeper.handle

    @classmethod
    def _of(cls, function: Any, *arguments: Any, context: Context | None = None) -> Any:
        """The mesh that a function of the library makes."""
        context, out = context or default_context(), ctypes.c_uint64()
        check(function(*arguments, ctypes.byref(out)))
        return cls(out.value, context)

    @property
    def info(self) -> Any:
        """Counts, sizes (m, m2, m3), quality (1: regular) and what reading repaired, as the C struct."""
        out = sized(_abi.dfm_mesh_info)
        check(quick.dfm_mesh_get_info(self.handle, ctypes.byref(out)))
        return out

    @property
    def points(self) -> np.ndarray:
        """[npoint,3] m."""
        info = self.info
        return _borrowed(self._keeper, info.points, (info.npoint, 3), ctypes.c_double)

    @property
    def warnings(self) -> list[str]:
        """What reading repaired, and where a made mesh is not as asked for; a sentence each."""
        return (self.info.warnings or b"").decode().splitlines()

    @property
    def volume(self) -> float:
        """m3."""
        return float(self.info.volume)


class TetMesh(_Mesh):
    """Tetrahedra: what a body is made of.

    Arrays look at the library's memory, without a copy; they stay valid when the mesh is out of scope.
    """

    @classmethod
    def _made(cls, kind: str, size: Sequence[float], cells: int) -> TetMesh:
        return cls._of(lib.dfm_mesh_make, default_context().address, kind.encode(), _size(size),
                       _abi.DFM_MESH_CELLS, whole(cells, "cells", 1))

    @classmethod
    def read(cls, path: Any) -> TetMesh:
        """Reads MSH, VTK, VTU, Medit, Abaqus, TetGen or Netgen; what was repaired is in `warnings`."""
        return cls._of(lib.dfm_mesh_load, default_context().address, encoded(path), _abi.DFM_MESH_CELLS)

    @classmethod
    def ball(cls, radius: float, cells: int = 1000) -> TetMesh:
        """A ball about the origin; radius in m, about `cells` tetrahedra: 20, 160, 540, 1280 ... (20 n^3).
        `warnings` says where the nearest number is more than a quarter off."""
        return cls._made("ball", [radius], cells)

    @classmethod
    def beam(cls, size: Sequence[float], cells: int = 1000) -> TetMesh:
        """A beam of edges [x, y, z] in m, one corner at the origin."""
        return cls._made("beam", size, cells)

    @classmethod
    def bricks(cls, size: Sequence[float], cells: int = 1000) -> TetMesh:
        """The same of hexahedra, for the models corotational_fem and linear_fem."""
        return cls._made("bricks", size, cells)

    @classmethod
    def cylinder(cls, radius: float, length: float, cells: int = 1000) -> TetMesh:
        """A cylinder along z from 0 to `length`, m."""
        return cls._made("cylinder", [radius, length], cells)

    @classmethod
    def tube(cls, inner: float, radius: float, length: float, cells: int = 1000) -> TetMesh:
        """A tube along z from 0 to `length`, m."""
        return cls._made("tube", [inner, radius, length], cells)

    @classmethod
    def fill(cls, surface: TriMesh | Any, cells: int = 5000) -> TetMesh:
        """Tetrahedra inside of a closed surface, given as a TriMesh or the path of its file. They reach out
        of the surface: give it to add_body too (surface=), which otherwise takes their jagged border. 0: from
        one inner point to the triangles, which are their border; for the model boundary."""
        surface = surface_of(surface, "surface")
        return cls._of(lib.dfm_mesh_fill, surface.handle, whole(cells, "cells", 0),
                       context=surface._context)

    @classmethod
    def lattice(cls, surface: TriMesh | Any, cells: int = 0, size: float = 0) -> TetMesh:
        """A coarse regular grid of hexahedra under a closed surface, given as a TriMesh or the path of its
        file: about `cells` of them, or of edges of about `size`, m. Give the surface to add_body too
        (surface=), and one of the models that bricks() is for."""
        surface = surface_of(surface, "surface")
        return cls._of(lib.dfm_mesh_lattice, surface.handle, whole(cells, "cells", 0), float(size),
                       context=surface._context)

    def second_order(self) -> TetMesh:
        """The same shape with points in the middles of the edges, for the same models as bricks()."""
        return TetMesh._of(lib.dfm_mesh_second_order, self.handle, context=self._context)

    def write(self, path: Any) -> None:
        """Writes *.msh, *.msh2, *.vtk, *.vtu or *.mesh; only VTK and VTU keep the shares of a filled mesh."""
        check(lib.dfm_mesh_write(self.handle, encoded(path)))

    @property
    def tets(self) -> np.ndarray:
        """[ntet,4] numbers of points."""
        info = self.info
        return _borrowed(self._keeper, info.tets, (info.ntet, 4), ctypes.c_uint32)

    @property
    def volume(self) -> float:
        """m3; of a mesh that was filled, and of a lattice, of its material. Its cells reach out of the
        surface; their volume is info.volume."""
        share, inside = self.share, self.inside
        if inside is not None:
            share = np.repeat(inside.sum(axis=1), len(self.tets) // len(inside))
        if share is None:
            return float(self.info.volume)
        corners = self.points[self.tets]
        a, b, c = (corners[:, k] - corners[:, 0] for k in (1, 2, 3))
        return float(share @ np.einsum("ij,ij->i", a, np.cross(b, c)) / 6)

    @property
    def inside(self) -> np.ndarray | None:
        """[ncell,27] material of the cells of a lattice, as dfm_mesh_info has it; else None."""
        info = self.info
        shape = (info.ncell, 27)
        return _borrowed(self._keeper, info.inside, shape, ctypes.c_double) if info.inside else None

    @property
    def share(self) -> np.ndarray | None:
        """[ntet] how much of each cell is material, of a mesh that was filled; else None."""
        info = self.info
        return _borrowed(self._keeper, info.share, (info.ntet,), ctypes.c_double) if info.share else None

    @property
    def groups(self) -> dict[str, np.ndarray]:
        """Points of each physical group, [n] numbers, ascending: a named surface is held or loaded by
        them."""
        info = self.info
        counts = _borrowed(self._keeper, info.group_npoint, (info.ngroup,), ctypes.c_uint32)
        points = _borrowed(self._keeper, info.group_points, (info.ngroup,), ctypes.c_uint64)
        return {name: _borrowed(self._keeper, int(points[i]), (int(counts[i]),), ctypes.c_uint32)
                for i, name in enumerate(_groups(info.group_names, info.ngroup))}

    def surface_groups(self) -> Any:
        """The named triangles as a body's def takes them, or None where the file has none."""
        info = self.info
        if not info.nface:
            return None
        return _abi.dfm_surface_groups(ctypes.sizeof(_abi.dfm_surface_groups), info.ngroup, info.group_names,
                                       info.nface, 0, info.faces, info.face_group)

    @classmethod
    def from_arrays(cls, points: Any, tets: Any, share: Any = None) -> TetMesh:
        """points [n,3] m, tets [m,4]; repaired as a file is: cells turned, unused points and doubles
        dropped. share: [m] how much of each cell is material, in (0,1], as TetMesh.share gives it."""
        p, t = points_of(points), cells_of(tets, 4, "tets")
        data = b""
        if share is not None:
            s = np.ascontiguousarray(array_of(share, "share", "a number for each cell"), dtype=">f8")
            if s.shape != (len(t),) or not ((s > 0) & (s <= 1)).all():
                raise ArgumentError(f"share must hold {len(t)} numbers, one for each cell, above 0 and up "
                                    "to 1", "DFM_E_ARG")
            data = (f"\nCELL_DATA {len(t)}\nSCALARS share double 1\nLOOKUP_TABLE default\n".encode()
                    + s.tobytes())
        if t.size and int(t.max()) >= len(p):
            raise ArgumentError(f"tets name point {t.max()}, but there are {len(p)} points", "DFM_E_ARG")
        rows = np.empty((len(t), 5), dtype=">i4")
        rows[:, 0], rows[:, 1:] = 4, t
        with tempfile.TemporaryDirectory() as folder:
            file = pathlib.Path(folder) / "arrays.vtk"
            file.write_bytes(b"# vtk DataFile Version 3.0\narrays\nBINARY\nDATASET UNSTRUCTURED_GRID\n"
                             + f"POINTS {len(p)} double\n".encode() + p.astype(">f8").tobytes()
                             + f"\nCELLS {len(t)} {rows.size}\n".encode() + rows.tobytes()
                             + f"\nCELL_TYPES {len(t)}\n".encode() + np.full(len(t), 10, ">i4").tobytes()
                             + data)
            with called(str(file), "from_arrays"):
                return cls.read(file)

    @classmethod
    def from_meshio(cls, mesh: Any) -> TetMesh:
        """From a `meshio.Mesh` (or the path of a file that meshio reads): its tetrahedra."""
        return cls.from_arrays(*_meshio_cells(mesh, "tetra"))

    def to_meshio(self) -> Any:
        """The same as a `meshio.Mesh`; shares of material are its cell data `share`."""
        import meshio
        share = self.share
        return meshio.Mesh(np.array(self.points), [("tetra", self.tets.astype(np.int64))],
                           cell_data=None if share is None else {"share": [np.array(share)]})

    def __repr__(self) -> str:
        info = self.info
        return (f"<deform.TetMesh: {info.npoint} points, {info.ntet} tetrahedra, {self.volume:.6g} m3"
                + "".join(f"; {warning}" for warning in self.warnings) + ">")


def _meshio_cells(mesh: Any, kind: str) -> tuple[np.ndarray, np.ndarray, np.ndarray | None]:
    if not hasattr(mesh, "cells_dict"):
        import meshio
        mesh = meshio.read(mesh)
    if kind not in mesh.cells_dict:
        raise ArgumentError(f"the mesh holds no cells of kind '{kind}'; it has "
                            f"{', '.join(mesh.cells_dict) or 'none'}", "DFM_E_ARG")
    points = np.zeros((len(mesh.points), 3))
    points[:, :np.shape(mesh.points)[1]] = mesh.points
    share = mesh.cell_data_dict.get("share", {}).get(kind)
    return points, mesh.cells_dict[kind], share


class TriMesh(_Mesh):
    """Triangles: a surface to fill, to hang on coarse cells, or an obstacle. Arrays as those of TetMesh."""

    @classmethod
    def read(cls, path: Any) -> TriMesh:
        """Reads OBJ, PLY, STL, OFF and what TetMesh.read does; what was repaired is in `warnings`."""
        return cls._of(lib.dfm_mesh_load, default_context().address, encoded(path), _abi.DFM_MESH_SURFACE)

    @classmethod
    def from_arrays(cls, points: Any, triangles: Any) -> TriMesh:
        """points [n,3] m, triangles [m,3] counter-clockwise seen from outside; repaired as a file is."""
        p, t = points_of(points), cells_of(triangles, 3, "triangles")
        return cls._of(lib.dfm_mesh_create, default_context().address, len(p), p.ctypes.data, len(t),
                       t.ctypes.data)

    @classmethod
    def make(cls, kind: str, size: Sequence[float], triangles: int = 1000) -> TriMesh:
        """A closed surface: "ball" [radius], "cylinder" [radius, length], "beam" [x, y, z], "tube" [inner,
        outer, length] or "torus" [ring radius, tube radius]; m."""
        return cls._of(lib.dfm_mesh_make, default_context().address, kind.encode(), _size(size),
                       _abi.DFM_MESH_SURFACE, whole(triangles, "triangles", 1))

    def write(self, path: Any) -> None:
        """Writes *.obj, *.ply, *.stl, *.off, *.vtk or *.vtu."""
        check(lib.dfm_mesh_write(self.handle, encoded(path)))

    @property
    def triangles(self) -> np.ndarray:
        """[ntriangle,3] numbers of points, counter-clockwise seen from outside."""
        info = self.info
        return _borrowed(self._keeper, info.faces, (info.nface, 3), ctypes.c_uint32)

    @classmethod
    def from_meshio(cls, mesh: Any) -> TriMesh:
        """From a `meshio.Mesh` (or the path of a file that meshio reads): its triangles."""
        return cls.from_arrays(*_meshio_cells(mesh, "triangle")[:2])

    def to_meshio(self) -> Any:
        """The same as a `meshio.Mesh`."""
        import meshio
        return meshio.Mesh(np.array(self.points), [("triangle", self.triangles.astype(np.int64))])

    def __repr__(self) -> str:
        info = self.info
        return f"<deform.TriMesh: {info.npoint} points, {info.ntriangle} triangles, {info.area:.6g} m2>"


def surface_of(mesh: Any, what: str) -> TriMesh:
    """A TriMesh, or the one in a file."""
    if isinstance(mesh, (str, bytes)) or hasattr(mesh, "__fspath__"):
        return TriMesh.read(mesh)
    if not isinstance(mesh, TriMesh):
        raise ArgumentError(f"{what} is a deform.TriMesh or the path of its file, not a "
                            f"{type(mesh).__name__}; TriMesh.from_arrays(points, triangles) makes one",
                            "DFM_E_ARG")
    return mesh
