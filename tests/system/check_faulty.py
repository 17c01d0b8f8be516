"""Every case file of faulty/ is refused as its first lines say:

    ! expect: <line>: <part of the message>
    ! expect in STEM.csv: <line>: <part of the message>

with exit code 2, each message once (only one rank speaks), and nothing written. `line` counts in the file itself,
or in the file of that name beside it (of data; it has the stem of the case).
Also: what --keys and --defaults print, files that hold nothing or cannot be read, and all cases of input/, which are
good."""

import argparse
import json
import os
import pathlib
import re
import shutil
import subprocess
import tempfile

FAULTY = pathlib.Path(__file__).parent / "faulty"
INPUT = pathlib.Path(__file__).parents[2] / "input"
EXPECT = re.compile(rb"! expect(?: in (\S+))?: (\d+): (.*)\n")
RANKS = 3
# Every so many files one runs under mpirun, which takes far longer.
STRIDE = 4


def check(condition, message):
    """Ends the test with a message."""
    if not condition:
        raise SystemExit(f"FAILED: {message}")


def expected_lines(content, name):
    """Place (file:line: ) and part of the message, from the first lines of the file of this name."""
    expected = []
    position = 0
    while match := EXPECT.match(content, position):
        expected.append((f"{match[1].decode() if match[1] else name}:{int(match[2])}: ", match[3].decode()))
        position = match.end()
    return expected


class Runner:
    """Runs the program in an empty directory."""

    def __init__(self, given):
        self.sgimp = str(given.sgimp.resolve())
        self.mpiexec = given.mpiexec
        self.environment = dict(os.environ, OMPI_MCA_rmaps_base_oversubscribe="1")

    def run(self, *options, case=None, beside=None, ranks=0):
        """Exit code, standard output, standard error, after a look at what was written."""
        directory = pathlib.Path(tempfile.mkdtemp(prefix="sgimp_faulty_"))
        command = [self.sgimp, *options]
        if case is not None:
            (directory / case[0]).write_bytes(case[1])
            command.append(case[0])
        if beside is not None:
            shutil.copy(beside, directory)
        if ranks:
            command = [self.mpiexec, "-n", str(ranks), *command]
        before = sorted(directory.rglob("*"))
        ended = subprocess.run(command, cwd=directory, env=self.environment, capture_output=True, timeout=30)
        check(sorted(directory.rglob("*")) == before, f"{command} has written something")
        shutil.rmtree(directory)
        return ended.returncode, ended.stdout.decode(), ended.stderr.decode(errors="replace")

    def refuse(self, name, content, expected, ranks, beside=None):
        """The case is refused with these messages and no others of the same kind."""
        code, _, errors = self.run(case=(name, content), beside=beside, ranks=ranks)
        where = f"{name} on {ranks or 'one'} ranks"
        check(code == 2, f"{where}: exit code {code}, not 2\n{errors}")
        # Files beside the case are named by their whole path.
        files = {place.split(":")[0] for place, _ in expected} | {name}
        told = [re.sub(r"^(?:sgimp: )?(?:/\S*/)?(?=[^/\s]+:\d)", "", text) for text in errors.splitlines()]
        for place, message in expected:
            found = [text for text in told if text.startswith(place) and message in text]
            check(len(found) == 1, f"{where}: {len(found)} times, not once: {place}{message}\n{errors}")
        reported = [text for text in told if any(text.startswith(f"{file}:") for file in files)]
        check(len(reported) == len(expected), f"{where}: {len(reported)} faults, not {len(expected)}:\n{errors}")


def check_files(runner):
    """The files of faulty/, with every fault of each named."""
    cases = sorted(FAULTY.glob("*.nml"))
    check(len(cases) >= 25, f"only {len(cases)} files in {FAULTY}")
    for number, path in enumerate(cases):
        content = path.read_bytes()
        expected = expected_lines(content, path.name)
        check(expected, f"{path.name} has no line '! expect: <line>: <message>'")
        beside = path.with_suffix(".csv")
        beside = beside if beside.exists() else None
        runner.refuse(path.name, content, expected, RANKS if number % STRIDE == 0 else 0, beside)


def check_no_case(runner):
    """Nothing in the file, no file, or a directory instead."""
    groups = ["case", "grid", "material", "body", "solver"]
    missing = [("nothing.nml:1: ", f"&{group}: this group is missing") for group in groups]
    for ranks in (0, RANKS):
        runner.refuse("nothing.nml", b"", missing, ranks)
        for path in ("there_is_no_such_case.nml", "/"):
            code, _, errors = runner.run(path, ranks=ranks)
            said = [line for line in errors.splitlines() if line.startswith("sgimp: ")]
            check(code == 2 and len(said) == 1 and path in said[0], f"{path}: exit code {code}\n{errors}")
    code, _, errors = runner.run("--chekc", "x.nml")
    check(code == 2 and "did you mean --check?" in errors, f"--chekc: exit code {code}\n{errors}")


def check_listings(runner):
    """--keys --json is JSON of every key that --keys names; the case of --defaults passes --check."""
    code, text, _ = runner.run("--keys", "--json")
    check(code == 0, "--keys --json fails")
    rows = json.loads(text)
    names = [(row["group"], row["key"]) for row in rows]
    check(len(set(names)) == len(names) > 60, f"{len(names)} keys, {len(set(names))} different")
    check(all(row["meaning"] and row["type"] for row in rows), "a key without type or meaning")
    code, listing, _ = runner.run("--keys")
    check(code == 0, "--keys fails")
    listed = re.findall(r"^  (\w+) +(?:real|integer|word|name|text|\d)", listing, re.MULTILINE)
    check(listed == [key for _, key in names], "--keys and --keys --json list different keys")
    code, text, _ = runner.run("--keys", "grid", "--json")
    check({row["group"] for row in json.loads(text)} == {"grid"}, "--keys grid --json lists other groups")
    code, text, errors = runner.run("--keys", "gird")
    check(code == 2 and "gird" in errors, f"--keys gird: exit code {code}")
    code, text, _ = runner.run("--defaults")
    check(code == 0, "--defaults fails")
    code, _, errors = runner.run("--check", case=("defaults.nml", text.encode()))
    check(code == 0, f"the case of --defaults is refused:\n{errors}")


def check_member(runner):
    """--check looks at --realization and --study-case too."""
    case = ("small.nml", (FAULTY.parent / "small.nml").read_bytes())
    for study_case, realization, expected, said in (
        ("csx_cov0.10", "60", 0, "60 of csx_cov0.10"),
        ("csx_cov0.10", "161", 2, "realizations 1 to 160"),
        ("csx_cov0.1", "1", 2, "no study case is called csx_cov0.1"),
        (None, "1", 2, "needs --study-case"),
    ):
        options = ["--check", "--realization", realization]
        options += ["--study-case", study_case] if study_case else []
        for ranks in (0, RANKS):
            code, text, errors = runner.run(*options, case=case, ranks=ranks)
            check(code == expected and said in text + errors, f"{options}: exit code {code}\n{text}{errors}")


def check_inputs(runner):
    """Every case that comes with the program is accepted, and its members are listed."""
    paths = sorted(INPUT.rglob("*.nml"))
    check(len(paths) > 20, f"only {len(paths)} cases in {INPUT}")
    for path in paths:
        code, text, errors = runner.run(str(path), "--dry")
        check(code == 0 and "members in" in text, f"{path}: exit code {code}\n{errors}")


def main():
    """All of it."""
    parser = argparse.ArgumentParser()
    parser.add_argument("--sgimp", required=True, type=pathlib.Path)
    parser.add_argument("--mpiexec", default="mpirun")
    runner = Runner(parser.parse_args())
    check_files(runner)
    check_no_case(runner)
    check_listings(runner)
    check_member(runner)
    check_inputs(runner)


main()
