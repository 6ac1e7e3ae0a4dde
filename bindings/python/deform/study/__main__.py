"""deform sweep, deform fit: the command lines."""
from __future__ import annotations

import argparse
import re
import signal
import sys
from typing import Any, NoReturn

from .._library import ArgumentError, Error, refuse_foreign
from .executors import EXECUTORS
from .export import export
from .fit import MARKS as FIT_MARKS, fit
from .spec import read_study
from .sweep import MARKS as SWEEP_MARKS, out_folder, sweep


class Parser(argparse.ArgumentParser):
    def error(self, message: str) -> NoReturn:
        print(f"{self.prog.split()[0]}: {message} (see: {self.prog} --help)", file=sys.stderr)
        sys.exit(2)


def _parser() -> Parser:
    top = Parser(prog="deform", allow_abbrev=False)
    commands = top.add_subparsers(dest="command", required=True)
    for name, about in (("sweep", "runs a scene over ranges of its values: tables, plots, a page"),
                        ("fit", "finds values of a scene from measured curves, with intervals")):
        sub = commands.add_parser(name, help=about, description=about, allow_abbrev=False)
        sub.add_argument("study", metavar="STUDY.json")
        sub.add_argument("--out", metavar="DIR", help="folder for the results (out/STUDY)")
        sub.add_argument("--executor", default="local", choices=EXECUTORS, help="where runs are made (local)")
        sub.add_argument("--workers", type=int, metavar="N", help="how many (one for each processor)")
        sub.add_argument("--address", default="", metavar="tcp://HOST:PORT", help="of a Dask scheduler")
        sub.add_argument("--quiet", action="store_true", help="print results and errors only")
        if name == "sweep":
            sub.add_argument("--retry", action="store_true", help="make failed runs again")
            sub.add_argument("--parquet", action="store_true", help="write sweep.parquet, too (pyarrow)")
            sub.add_argument("--only", metavar="FIRST-LAST", help="make these runs alone, counted from 0")
            sub.add_argument("--export", choices=("snakemake", "slurm"),
                             help="write a workflow for this instead of running")
    return top


def _only(text: str | None) -> tuple[int, int] | None:
    if text is None:
        return None
    found = re.fullmatch(r"(\d+)(?:-(\d+))?", text)
    if not found:
        raise ArgumentError(f'--only: expected FIRST-LAST as 0-9, found "{text}"', "DFM_E_ARG")
    return int(found[1]), int(found[2] or found[1])


def _refuse_others(given: Any, marks: dict[str, str]) -> None:
    """Before the runs: what could not be written after them."""
    folder = out_folder(read_study(given.study), given.out)
    for name, mark in marks.items():
        refuse_foreign(folder / name, mark)


def _sweep(given: Any) -> int:
    for option, ignored in (("export", ("only", "retry", "parquet", "workers", "executor", "address")),
                            ("only", ("parquet",))):
        for other in ignored if getattr(given, option) else ():
            if getattr(given, other) not in (None, False, "", "local"):
                raise ArgumentError(f"--{option} ignores --{other}: omit one of the two", "DFM_E_ARG")
    if given.export:
        print(f"written: {export(given.study, given.export, out=given.out)}")
        return 0
    only = _only(given.only)
    if only is None:
        _refuse_others(given, {name: mark for name, mark in SWEEP_MARKS.items()
                               if given.parquet or name != "sweep.parquet"})
    rows = sweep(given.study, out=given.out, executor=given.executor, workers=given.workers,
                 address=given.address, retry=given.retry, only=only, progress=not given.quiet)
    if only is None:
        written = rows.write(parquet=given.parquet)
        print(rows.notes[0])
        for sentence in list(dict.fromkeys(row["said"] for row in rows.failed))[:5]:
            print(f"failed: {sentence}")
        if rows.failed and not given.retry:
            print("--retry makes failed runs again")
        print("written: " + ", ".join(map(str, written)))
    return 1 if only is None and rows.failed else 0  # of a block, a failed run is a result


def _fit(given: Any) -> int:
    _refuse_others(given, FIT_MARKS)
    tell = None if given.quiet else lambda sentence: print(sentence, file=sys.stderr, flush=True)
    found = fit(given.study, out=given.out, executor=given.executor, workers=given.workers,
                address=given.address, tell=tell)
    written = found.write()
    print(found)
    print("written: " + ", ".join(map(str, written)))
    return 0


def main() -> int:
    given = _parser().parse_args()
    signal.signal(signal.SIGTERM, lambda *_: sys.exit(128 + signal.SIGTERM))  # ends its processes, too
    try:
        return _sweep(given) if given.command == "sweep" else _fit(given)
    except Error as error:
        print(f"deform: {error}", file=sys.stderr)
        return 3 if error.status == "DFM_E_FATAL" else 2
    except OSError as error:
        what = error.filename or "the results cannot be written"
        print(f"deform: {what}: {error.strerror}", file=sys.stderr)
        return 2
    except KeyboardInterrupt:
        kept = "what is done is kept, and the next call goes on"
        print(f"deform: interrupted; {kept if given.command == 'sweep' else 'a fit keeps nothing'}",
              file=sys.stderr)
        return 130


if __name__ == "__main__":
    sys.exit(main())
