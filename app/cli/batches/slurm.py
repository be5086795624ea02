"""A batch as a job array of Slurm: one script that claims tasks, and one for the table after it."""

import shlex
import sys
from pathlib import Path

from tracker.batch.manifest import Manifest
from tracker.files import write_text_atomic

_ARRAY = """#!/bin/sh
#SBATCH --job-name={name}
#SBATCH --array=0-{last}
#SBATCH --cpus-per-task=2
#SBATCH --mem=4G
#SBATCH --output={logs}/logs/array_%a.txt
# Each job does tasks until none is left, so that fewer jobs than recordings do, too.
# Kernels are compiled once, by the first line; the folder must be shared by all machines.
export NUMBA_CACHE_DIR={kernels}
export QUADRILLE_THREADS="${{SLURM_CPUS_PER_TASK:-2}}"
exec {command} batch {plan} --out {folder} --work
"""
_COMPILE = """#!/bin/sh
#SBATCH --job-name={name}-kernels
# Before the array: compiles the kernels into the folder that all its jobs use.
export NUMBA_CACHE_DIR={kernels}
exec {python} -P -m app.bench.compile_kernels
"""
_MERGE = """#!/bin/sh
#SBATCH --job-name={name}-table
# After the array: sbatch --dependency=afterany:JOB {folder}/merge.sh
exec {command} batch {plan} --out {folder} --table --report {folder}/morning.html
"""


def write_scripts(manifest: Manifest, plan: Path) -> str:
    """Write the scripts into the folder of a batch; return what to do with them.

    Args:
        manifest: of the batch.
        plan: path of the plan.
    """
    folder = manifest.folder
    (folder / "logs").mkdir(exist_ok=True)
    values = {
        "name": shlex.quote(folder.name),
        "last": manifest.n_parts() - 1,
        "folder": shlex.quote(str(folder)),
        "logs": shlex.quote(str(folder).replace("%", "%%")),
        "plan": shlex.quote(str(plan)),
        "kernels": shlex.quote(str(folder / "kernels")),
        "python": shlex.quote(sys.executable),
        "command": f"{shlex.quote(sys.executable)} -P -m quadrille",
    }
    for name, text in (("kernels.sh", _COMPILE), ("array.sh", _ARRAY), ("merge.sh", _MERGE)):
        write_text_atomic(folder / name, text.format(**values), mode=0o755)
    return "\n".join(
        [
            f"wrote {folder}/kernels.sh, array.sh and merge.sh; submit them in this order:",
            f"  first=$(sbatch --parsable {values['folder']}/kernels.sh)",
            f"  array=$(sbatch --parsable --dependency=afterok:$first {values['folder']}/array.sh)",
            f"  sbatch --dependency=afterany:$array {values['folder']}/merge.sh",
        ]
    )
