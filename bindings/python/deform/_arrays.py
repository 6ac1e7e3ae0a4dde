"""Memory of arrays: NumPy owns it, the library writes its answer straight into it, and what Python sees is a
view of it. So nothing is copied on the way, and an array is safe whatever becomes of its world."""
from __future__ import annotations

import ctypes
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


class Column:
    """One array, filled again at each look. A look gives None where the number of rows is another one."""

    def __init__(self, function: Any, handle: int, rows: int, width: int, kind: Any = np.float64):
        self.view = np.zeros((rows, width) if width else rows, dtype=kind)
        self.view.flags.writeable = False  # for Python; the library has the address
        self._function = function
        self._rows, self._count = rows, ctypes.c_uint32(rows)
        self._arguments = (handle, rows, self.view.ctypes.data, ctypes.byref(self._count))

    def look(self) -> np.ndarray | None:
        status = self._function(*self._arguments)
        if self._count.value != self._rows:
            return None
        if status < 0:
            check(status)
        return self.view


class Rows:
    """A list of structs whose length differs from look to look; its memory grows, and is then used again."""

    def __init__(self, function: Any, handle: int, struct: Any):
        self._function, self._handle = function, handle
        self._kind = row_type(struct)
        self._bytes = ctypes.sizeof(struct)
        self._count = ctypes.c_uint32(0)
        self._at = ctypes.byref(self._count)
        self._take(64)

    def _take(self, rows: int) -> None:
        self._memory = np.zeros(rows, dtype=self._kind)
        self._memory.flags.writeable = False
        self._address = self._memory.ctypes.data

    def look(self) -> np.ndarray:
        status = self._function(self._handle, self._bytes, len(self._memory), self._address, self._at)
        if status < 0:
            if self._count.value <= len(self._memory):
                check(status)
            # what older views look at stays theirs
            self._take(2 * self._count.value)
            check(self._function(self._handle, self._bytes, len(self._memory), self._address, self._at))
        return self._memory[:self._count.value]


class Report:
    """One struct that the library fills in: a record, whose members are attributes."""

    def __init__(self, function: Any, handle: int, struct: Any):
        self._struct = struct()
        self._function, self._handle = function, handle
        self._size = ctypes.sizeof(struct)
        self._at = ctypes.byref(self._struct)
        memory = np.frombuffer(self._struct, dtype=np.dtype((np.record, row_type(struct))))
        memory.flags.writeable = False
        self.view = memory[0]

    def look(self) -> Any:
        self._struct.size = self._size
        check(self._function(self._handle, self._at))
        return self.view
