"""How the benchmarks start sgimp on several ranks of this machine, and what they time."""

import os
import subprocess
import sys
import time
from pathlib import Path

import h5py

# As root in a container, on fewer cores than ranks, beside other programs: so not bound to the first cores.
SETTINGS = {
    "OMPI_ALLOW_RUN_AS_ROOT": "1",
    "OMPI_ALLOW_RUN_AS_ROOT_CONFIRM": "1",
    "OMPI_MCA_rmaps_base_oversubscribe": "1",
    "OMPI_MCA_hwloc_base_binding_policy": "none",
    "OPENBLAS_NUM_THREADS": "1",
}


def environment():
    """That of this process, with the settings above."""
    return os.environ | SETTINGS


def on_ranks(ranks, command, mpiexec="mpirun"):
    """The command on so many ranks."""
    return [mpiexec, "-n", str(ranks), *command]


def member_columns(directory, names):
    """Columns of all members of a run, {case: {name: [members]}}."""
    with h5py.File(Path(directory) / "ensemble.h5") as file:
        return {label: {name: group[name][:] for name in names} for label, group in file["cases"].items()}


def run_members(options, namelist, directory, names):
    """Runs or resumes a namelist with the executable and on the ranks of `options`; its member_columns. Failed members
    (exit code 4) are the caller's business, other failures end the script."""
    command = [options.executable, namelist, "--output", directory]
    if options.ranks > 1:
        command = on_ranks(options.ranks, command, options.mpiexec)
    code = subprocess.run(command, check=False, stdout=subprocess.DEVNULL, env=environment()).returncode
    if code not in (0, 4):
        sys.exit(f"{' '.join(map(str, command))}: exit code {code}")
    return member_columns(directory, names)


def timed_run(command, directory, ranks, mpiexec="mpirun"):
    """Runs sgimp in `directory` from the start, under mpirun on one rank too. Wall time from mpirun to its end in s,
    and the wall times of the members by case, {label: [members]}."""
    command = on_ranks(ranks, [*command, "--output", directory, "--overwrite"], mpiexec)
    start = time.perf_counter()
    subprocess.run(command, check=True, stdout=subprocess.DEVNULL, env=environment())
    wall = time.perf_counter() - start
    return wall, {label: columns["seconds"] for label, columns in member_columns(directory, ["seconds"]).items()}
