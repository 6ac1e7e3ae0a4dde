"""Tables: of runs and measurements, read from CSV; rows of a sweep as CSV and Parquet, with units in the
header and in the metadata of the columns."""
from __future__ import annotations

import csv
import io
import json
import math
import pathlib
from typing import Any, Mapping, Sequence

from .._library import UnsupportedError, write_whole

Rows = Sequence[Mapping[str, Any]]


def read_csv(path: pathlib.Path) -> list[dict[str, str]]:
    with open(path, newline="", encoding="utf-8-sig", errors="replace") as file:
        try:
            return list(csv.DictReader(line for line in file if not line.startswith("#")))
        except csv.Error as error:
            raise ValueError(f"is no table: {error}") from None


def finite(rows: Sequence[Mapping[str, str]], name: str) -> list[float]:
    """A column; raises ValueError with the first text that is no finite number."""
    out = []
    for row in rows:
        try:
            out.append(float(row[name]))
        except (TypeError, ValueError):
            out.append(math.nan)
        if not math.isfinite(out[-1]):
            raise ValueError(json.dumps(row[name]))
    return out


def titled(name: str, units: Mapping[str, str]) -> str:
    return f"{name} [{units[name]}]" if units.get(name) else name


def write_csv(path: pathlib.Path, rows: Rows, columns: Sequence[str], units: Mapping[str, str],
              mark: str = "") -> None:
    text = io.StringIO(newline="")
    out = csv.writer(text)
    out.writerow([titled(name, units) for name in columns])
    for row in rows:
        out.writerow(["" if row.get(name) is None else row[name] for name in columns])
    write_whole(path, text.getvalue().encode(), mark)


def of_one_kind(column: Sequence[Any]) -> list[Any]:
    """What a column of one type holds: texts, where numbers stand beside something else."""
    kinds = {float if type(value) is int else type(value) for value in column if value is not None}
    return [str(value) if len(kinds) > 1 and value is not None else value for value in column]


def write_parquet(path: pathlib.Path, rows: Rows, columns: Sequence[str], units: Mapping[str, str],
                  mark: str) -> None:
    try:
        import pyarrow as arrow
        import pyarrow.parquet
    except ImportError as missing:
        raise UnsupportedError(f"Parquet needs pyarrow for this Python, pip install pyarrow ({missing}); the "
                               f"rows are in sweep.csv", "DFM_E_UNSUPPORTED") from None
    arrays, fields = [], []
    for name in columns:
        array = arrow.array(of_one_kind([row.get(name) for row in rows]))
        arrays.append(array)
        metadata = {"unit": units[name]} if units.get(name) else None
        fields.append(arrow.field(name, array.type, metadata=metadata))
    file = io.BytesIO()
    schema = arrow.schema(fields, metadata={"written_by": mark})  # stands uncompressed at the file's end
    arrow.parquet.write_table(arrow.Table.from_arrays(arrays, schema=schema), file)
    write_whole(path, file.getvalue(), mark)
