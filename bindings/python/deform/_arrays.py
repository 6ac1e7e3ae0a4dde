"""Memory of arrays: NumPy owns it, the library writes its answer straight into it, and what Python sees is a
view of it. So nothing is copied on the way, and an array is safe whatever becomes of its world.

An array that somebody keeps keeps its values: memory that anything refers to, a slice included, is not
written again. Two pieces of memory serve a loop that rebinds one name, so nothing is allocated there.
"""
from __future__ import annotations

import ctypes
from sys import getrefcount
from typing import Any

import numpy as np

from ._library import check

_HIDDEN = ("size", "reserved", "reserved2")


def row_type(struct: Any) -> np.dtype:
    """The dtype of a C struct without its members that say nothing."""
    full = np.dtype(struct)
    names = [n for n in full.names or () if n not in _HIDDEN]
    return np.dtype({"names": names, "formats": [full.fields[n][0] for n in names],
                     "offsets": [full.fields[n][1] for n in names], "itemsize": full.itemsize})


class _Piece:
    """Memory of one answer. view: what the caller gets, or what all that it gets refers to."""

    __slots__ = ("arguments", "view")

    def __init__(self, view: Any, arguments: tuple[Any, ...]):
        self.view, self.arguments = view, arguments


_NOBODYS = _Piece(object(), ())
_UNKEPT = getrefcount(_NOBODYS.view)  # as it is counted below


class _Result:
    """Hands out memory that nobody looks at any more."""

    def __init__(self) -> None:
        self._piece = self._make()
        self._spare: _Piece | None = None

    def _make(self) -> _Piece:
        raise NotImplementedError

    def _take(self) -> _Piece:
        piece = self._piece
        if getrefcount(piece.view) == _UNKEPT:
            return piece
        spare = self._spare
        if spare is None or getrefcount(spare.view) != _UNKEPT:
            spare = self._make()  # a spare that is kept now belongs to its keeper alone
        self._piece, self._spare = spare, piece
        return spare


class Column(_Result):
    """One array, filled again at each look. A look gives None where the number of rows is another one."""

    def __init__(self, function: Any, handle: int, rows: int, width: int, kind: Any = np.float64):
        self._function, self._handle = function, handle
        self._shape, self._kind = (rows, width) if width else (rows,), kind
        self._rows, self._count = rows, ctypes.c_uint32(rows)
        self._at = ctypes.byref(self._count)
        super().__init__()

    def _make(self) -> _Piece:
        view = np.zeros(self._shape, dtype=self._kind)
        view.flags.writeable = False  # for Python; the library has the address
        return _Piece(view, (self._handle, self._rows, view.ctypes.data, self._at))

    def look(self) -> np.ndarray | None:
        piece = self._take()
        status = self._function(*piece.arguments)
        if self._count.value != self._rows:
            return None
        if status < 0:
            check(status)
        return piece.view


class Rows(_Result):
    """A list of structs whose length differs from look to look; its memory grows, and is then used again."""

    def __init__(self, function: Any, handle: int, struct: Any):
        self._function, self._handle = function, handle
        self._kind = row_type(struct)
        self._bytes = ctypes.sizeof(struct)
        self._count = ctypes.c_uint32(0)
        self._at = ctypes.byref(self._count)
        self._room = 64
        super().__init__()

    def _make(self) -> _Piece:
        memory = np.zeros(self._room, dtype=self._kind)
        memory.flags.writeable = False
        return _Piece(memory, (self._handle, self._bytes, self._room, memory.ctypes.data, self._at))

    def look(self) -> np.ndarray:
        piece = self._take()
        status = self._function(*piece.arguments)
        if status < 0:
            if self._count.value <= len(piece.view):
                check(status)
            self._room = 2 * self._count.value
            piece = self._piece = self._make()
            check(self._function(*piece.arguments))
        return piece.view[:self._count.value]


class Report(_Result):
    """One struct that the library fills in: a record, whose members are attributes."""

    def __init__(self, function: Any, handle: int, struct: Any):
        self._function, self._handle, self._kind = function, handle, struct
        self._row = np.dtype((np.record, row_type(struct)))
        super().__init__()

    def _make(self) -> _Piece:
        struct = self._kind()
        struct.size = ctypes.sizeof(struct)
        memory = np.frombuffer(struct, dtype=self._row)
        memory.flags.writeable = False
        return _Piece(memory[0], (self._handle, ctypes.byref(struct)))

    def look(self) -> Any:
        piece = self._take()
        check(self._function(*piece.arguments))
        return piece.view
