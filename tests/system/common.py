"""What the tests of the program share: starting it, comparing results, the journal."""

import argparse
import os
import pathlib
import shutil
import signal
import struct
import subprocess
import tempfile
import time
import zlib

import h5py


def arguments():
    """Paths given by ctest."""
    parser = argparse.ArgumentParser()
    parser.add_argument("--sgimp", required=True, type=pathlib.Path)
    parser.add_argument("--mpiexec", default="mpirun")
    parser.add_argument("--case", required=True, type=pathlib.Path)
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--faulty-disk", type=pathlib.Path, help="library of tests/support/faulty_disk.c")
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

    def start(self, directory, ranks, *options, case=None, fault=None, output=subprocess.PIPE):
        """Starts it in a process group of its own, so that a signal reaches every rank. `fault` are variables for
        faulty_disk.c; SGIMP_FAULT_PATH is below the root of all directories."""
        environment = dict(os.environ, OMPI_MCA_rmaps_base_oversubscribe="1")
        if fault:
            environment.update(fault, LD_PRELOAD=str(self.given.faulty_disk.resolve()))
            environment["SGIMP_FAULT_PATH"] = str(self.root / fault["SGIMP_FAULT_PATH"])
        return subprocess.Popen(
            self.command(directory, ranks, *options, case=case),
            stdout=output,
            stderr=subprocess.STDOUT,
            text=True,
            start_new_session=True,
            env=environment,
        )

    def run(self, directory, ranks, *options, expect=0, **how):
        """Runs it to its end and returns what it printed; `how` is that of `start`."""
        process = self.start(directory, ranks, *options, **how)
        text = await_end(process)
        check(process.returncode == expect, f"{directory}: exit code {process.returncode}, not {expect}:\n{text}")
        return text

    def changed_case(self, old, new, name="changed.nml"):
        """The case file with one text replaced."""
        text = self.given.case.read_text()
        check(old in text, f"{old} is not in the case file")
        path = self.root / name
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


def check_equal(one, other, what, leave_out=()):
    """All results byte-equal, apart from datasets that are left out."""
    left, right = columns(one), columns(other)
    check(left.keys() == right.keys(), f"{what}: other datasets")
    different = [name for name in left if left[name] != right[name] and name not in leave_out]
    check(not different, f"{what}: these differ: {different}")
    check(any(name.endswith("runout_q995") for name in left), "no results at all")


def state(path):
    """The state that ensemble.h5 tells."""
    with h5py.File(path / "ensemble.h5") as file:
        value = file.attrs["state"]
    return value.decode() if isinstance(value, bytes) else value


def ids(path):
    """(case, id) of every member of ensemble.h5, cases counted as in the journal."""
    with h5py.File(path / "ensemble.h5") as file:
        groups = file["cases"].values()
        return {(int(group.attrs["order"]), int(member)) for group in groups for member in group["id"][:]}


class Journal:
    """A journal.bin: `header`, the good `records` that follow it, and the `rest` from the first other byte on.
    The format is that of src/monte_carlo/sg_journal.f90."""

    HEADER = struct.Struct("<8s5i")
    RECORD = struct.Struct("<3i")
    PAYLOAD = struct.Struct("<4iq")

    def __init__(self, path):
        content = path.read_bytes() if path.exists() else b""
        self.header, self.records = b"", []
        if len(content) >= self.HEADER.size:
            end = self.HEADER.size + self.HEADER.unpack_from(content)[4]
            self.header = content[:end] if len(content) >= end else b""
        mark = len(self.header)
        while mark and (length := self._length(content, mark)):
            self.records.append(content[mark : mark + length])
            mark += length
        self.rest = content[mark:]

    def _length(self, content, mark):
        """Bytes of the good record at `mark`, 0 if there is none."""
        if mark + self.RECORD.size > len(content):
            return 0
        _, length, crc = self.RECORD.unpack_from(content, mark)
        payload = content[mark + self.RECORD.size : mark + self.RECORD.size + length]
        good = len(payload) == length and zlib.crc32(struct.pack("<i", length) + payload) == crc % 2**32
        return self.RECORD.size + length if good else 0

    def content(self):
        """Header and good records."""
        return self.header + b"".join(self.records)

    def members(self):
        """(case, id) of each record."""
        found = [self.PAYLOAD.unpack_from(record, self.RECORD.size) for record in self.records]
        return [(case, member) for case, _, _, _, member in found]


def ranks_of(process):
    """Process ids of the ranks that mpirun has started."""
    found = []
    for path in pathlib.Path("/proc").glob("[0-9]*/stat"):
        try:
            name, _, rest = path.read_text().rpartition(")")
        except OSError:  # ended meanwhile
            continue
        if int(rest.split()[1]) == process.pid and name.endswith("(sgimp"):
            found.append(int(path.parent.name))
    return found


def await_end(process, limit=250):
    """What a run prints until it ends; one that goes on for longer than `limit` seconds is a failure, and killed."""
    try:
        return process.communicate(timeout=limit)[0]
    except subprocess.TimeoutExpired:
        for victim in [*ranks_of(process), process.pid]:
            os.kill(victim, signal.SIGKILL)
        raise SystemExit(f"FAILED: still at work after {limit} s: {' '.join(process.args)}") from None


def wait_until(condition, what, limit=60):
    """Waits for a condition; that it never comes true is a failure."""
    end = time.monotonic() + limit
    while not condition():
        check(time.monotonic() < end, f"waited {limit} s for {what}")
        time.sleep(0.01)


def tried(fault):
    """Tells of a fault that was tried and met as it should be: a row of docs/faults.md (faults_table.py)."""
    print(f"tried  {fault}", flush=True)
