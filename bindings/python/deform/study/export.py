"""A sweep as a workflow of others: a Snakefile, or a job array of SLURM. Each of their jobs makes a block of
runs by `deform sweep --only`; the next `deform sweep` gathers the results and writes tables and page."""
from __future__ import annotations

import pathlib
import shlex
import sys
from typing import Any

from .._library import ArgumentError, command_path, write_whole
from .design import points
from .spec import read_study
from .sweep import out_folder

MARK = "# Written by `deform sweep --export"
SNAKEFILE = MARK + ''' snakemake`. Run: snakemake -s {file} --cores N
BLOCKS = {blocks}

rule all:
    input: expand({done!r}, block=BLOCKS)
    shell: {gather!r}  # exit code 1: some runs have failed, which the page says

rule block:
    input: {inputs!r}  # a changed one makes the runs anew
    output: touch({done!r})
    shell: {run!r}
'''

SLURM = "#!/bin/sh\n" + MARK + ''' slurm`. Run: sbatch {file}; when it has ended: {gather}
#SBATCH --job-name={name}
#SBATCH --array=0-{last}
#SBATCH --cpus-per-task=1
first=$((SLURM_ARRAY_TASK_ID * {block}))
last=$((first + {block} - 1))
[ "$last" -lt {n} ] || last={most}
exec {run} --only "$first-$last"
'''


def export(study: Any, kind: str, *, out: Any = None, block: int = 0) -> pathlib.Path:
    """Writes a workflow for a study's file and returns its path: kind "snakemake" (Snakefile) or "slurm"
    (array.sh). block: runs of a job (so many that there are about a hundred jobs)."""
    read = read_study(study)
    if kind not in ("snakemake", "slurm"):
        raise ArgumentError(f'there is no export "{kind}"; there are snakemake and slurm', "DFM_E_ARG")
    n, folder = len(points(read)), out_folder(read, out).absolute()
    block = block or max(1, n // 100)
    # whatever folder and whatever first python3 a job has
    command = ["env", f"DEFORM_PYTHON={sys.executable}", str(command_path().absolute()), "sweep",
               str(pathlib.Path(study).absolute()), "--out", str(folder), "--workers", "1"]
    run, gather = shlex.join(command), shlex.join(command[:-2])
    folder.mkdir(parents=True, exist_ok=True)
    path = folder / ("Snakefile" if kind == "snakemake" else "array.sh")
    if kind == "slurm":
        text = SLURM.format(file=shlex.quote(str(path)), gather=gather, name=shlex.quote(read.name),
                            n=n, most=n - 1, last=-(-n // block) - 1, block=block, run=run)
        write_whole(path, text.encode(), MARK)
        return path
    blocks = [f"{first}-{min(first + block, n) - 1}" for first in range(0, n, block)]
    braces = run.replace("{", "{{").replace("}", "}}")
    text = SNAKEFILE.format(file=shlex.quote(str(path)), blocks=blocks,
                            done=str(folder / "runs" / "{block}.done"),
                            inputs=[str(pathlib.Path(study).absolute()), read.runs[0][0]],
                            gather=gather.replace("{", "{{").replace("}", "}}") + " || [ $? = 1 ]",
                            run=braces + " --only {wildcards.block}")
    write_whole(path, text.encode(), MARK)
    return path
