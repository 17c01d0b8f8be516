"""How the benchmarks start sgimp on several ranks of this machine."""

import os

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
