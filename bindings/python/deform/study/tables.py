"""Rows of a sweep as CSV and Parquet, with units: in the header, and in the metadata of the columns."""
from __future__ import annotations

import csv
import math
import os
import pathlib
from typing import Any, Mapping, Sequence

from .._library import UnsupportedError

Rows = Sequence[Mapping[str, Any]]


def titled(name: str, units: Mapping[str, str]) -> str:
    return f"{name} [{units[name]}]" if units.get(name) else name


def write_csv(path: pathlib.Path, rows: Rows, columns: Sequence[str], units: Mapping[str, str]) -> None:
    part = path.with_name(path.name + ".part")
    with open(part, "w", newline="") as file:
        out = csv.writer(file)
        out.writerow([titled(name, units) for name in columns])
        for row in rows:
            out.writerow(["" if row.get(name) is None else row[name] for name in columns])
    os.replace(part, path)


def write_parquet(path: pathlib.Path, rows: Rows, columns: Sequence[str], units: Mapping[str, str]) -> None:
    try:
        import pyarrow as arrow
        import pyarrow.parquet
    except ImportError as missing:
        raise UnsupportedError(f"Parquet needs pyarrow for this Python, pip install pyarrow ({missing}); the "
                               f"rows are in sweep.csv", "DFM_E_UNSUPPORTED") from None
    arrays, fields = [], []
    for name in columns:
        array = arrow.array([row.get(name) for row in rows])
        arrays.append(array)
        metadata = {"unit": units[name]} if units.get(name) else None
        fields.append(arrow.field(name, array.type, metadata=metadata))
    part = path.with_name(path.name + ".part")
    arrow.parquet.write_table(arrow.Table.from_arrays(arrays, schema=arrow.schema(fields)), part)
    os.replace(part, path)


def shown(value: Any) -> str:
    if isinstance(value, float):
        return "" if math.isnan(value) else f"{value:.5g}"
    return "" if value is None else str(value)
