"""How the benchmarks start sgimp on several ranks of this machine, and what they time."""

import os
import subprocess
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


def timed_run(command, directory, ranks, mpiexec="mpirun"):
    """Runs sgimp in `directory` from the start, under mpirun on one rank too. Wall time from mpirun to its end in s,
    and the wall times of the members by case, {label: [members]}."""
    command = on_ranks(ranks, [*command, "--output", directory, "--overwrite"], mpiexec)
    start = time.perf_counter()
    subprocess.run(command, check=True, stdout=subprocess.DEVNULL, env=environment())
    wall = time.perf_counter() - start
    with h5py.File(Path(directory) / "ensemble.h5") as file:
        return wall, {label: group["seconds"][:] for label, group in file["cases"].items()}
