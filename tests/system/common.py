"""What the tests of the program share: starting it, comparing results."""

import argparse
import os
import pathlib
import shutil
import subprocess
import tempfile

import h5py


def arguments():
    """Paths given by ctest."""
    parser = argparse.ArgumentParser()
    parser.add_argument("--sgimp", required=True, type=pathlib.Path)
    parser.add_argument("--mpiexec", default="mpirun")
    parser.add_argument("--case", required=True, type=pathlib.Path)
    parser.add_argument("--seed", type=int, default=1)
    return parser.parse_args()


class Program:
    """The program with one case, run in directories of its own."""

    def __init__(self, given):
        self.given = given
        self.root = pathlib.Path(tempfile.mkdtemp(prefix="sgimp_system_"))

    def command(self, directory, ranks, *options, case=None):
        """The command line."""
        sgimp = [str(self.given.sgimp.resolve()), str((case or self.given.case).resolve())]
        sgimp += ["--output", str(self.root / directory), *options]
        if ranks == 0:
            return sgimp
        return [self.given.mpiexec, "-n", str(ranks), *sgimp]

    def start(self, directory, ranks, *options, case=None):
        """Starts it in a process group of its own, so that a signal reaches every rank."""
        return subprocess.Popen(
            self.command(directory, ranks, *options, case=case),
            stdout=subprocess.PIPE,
            stderr=subprocess.STDOUT,
            text=True,
            start_new_session=True,
            env=dict(os.environ, OMPI_MCA_rmaps_base_oversubscribe="1"),
        )

    def run(self, directory, ranks, *options, case=None, expect=0):
        """Runs it to its end and returns what it printed."""
        process = self.start(directory, ranks, *options, case=case)
        text, _ = process.communicate(timeout=250)
        check(process.returncode == expect, f"exit code {process.returncode}, not {expect}:\n{text}")
        return text

    def changed_case(self, old, new):
        """The case file with one text replaced."""
        text = self.given.case.read_text()
        check(old in text, f"{old} is not in the case file")
        path = self.root / "changed.nml"
        path.write_text(text.replace(old, new))
        return path

    def clean(self):
        """Removes all directories."""
        shutil.rmtree(self.root)


def check(condition, message):
    """Ends the test with a message."""
    if not condition:
        raise SystemExit(f"FAILED: {message}")


def columns(path):
    """Every dataset of ensemble.h5 as bytes, apart from the computing times."""
    found = {}

    def take(name, item):
        if isinstance(item, h5py.Dataset) and not name.endswith("/seconds"):
            found[name] = (item.shape, item[()].tobytes())

    with h5py.File(path / "ensemble.h5") as file:
        file["cases"].visititems(lambda name, item: take(name, item))
    return found


def check_equal(one, other, what):
    """All results byte-equal."""
    left, right = columns(one), columns(other)
    check(left.keys() == right.keys(), f"{what}: other datasets")
    different = [name for name in left if left[name] != right[name]]
    check(not different, f"{what}: these differ: {different}")
    check(any(name.endswith("runout_q995") for name in left), "no results at all")


def state(path):
    """The state that ensemble.h5 tells."""
    with h5py.File(path / "ensemble.h5") as file:
        value = file.attrs["state"]
    return value.decode() if isinstance(value, bytes) else value
