#!/usr/bin/env python3
"""Looks at what the test runner says about tests that fail on purpose and files that it must refuse."""

import argparse
import re
import subprocess
import sys
import tempfile
import unittest
from pathlib import Path

HERE = Path(__file__).resolve().parent
OPTIONS = argparse.Namespace()


def run(*command):
    """Output (both streams) and exit code."""
    done = subprocess.run(command, capture_output=True, text=True, timeout=60, check=False)
    return done.stdout + done.stderr, done.returncode


def expected_failures(name):
    """Numbers of the lines of a file that must be reported."""
    lines = (HERE / name).read_text().splitlines()
    return [number for number, line in enumerate(lines) if line.strip() == "! fails above"]


def reported_failures(name, output):
    """Numbers of the lines of a file that were reported."""
    return [int(number) for number in re.findall(rf"^{name}:(\d+): ", output, re.MULTILINE)]


class Programs(unittest.TestCase):
    """The compiled test programs."""

    def test_serial_failures_have_their_lines(self):
        output, code = run(OPTIONS.serial)
        self.assertEqual(reported_failures("selftest_asserts.pf", output), expected_failures("selftest_asserts.pf"))
        self.assertIn("FAILED: 2 of 4 tests of 1 files.", output)
        self.assertNotEqual(code, 0)

    def test_filter(self):
        output, code = run(OPTIONS.serial, "-f", "asserts_that_hold")
        self.assertIn("FAILED: 1 of 1 tests", output)  # it counts on the fixtures of the test before it
        output, code = run(OPTIONS.serial, "-f", "fixtures")
        self.assertIn("PASSED: 1 tests of 1 files.", output)
        self.assertEqual(code, 0)
        output, code = run(OPTIONS.serial, "-f", "no such test")
        self.assertIn("FAILED", output)
        self.assertNotEqual(code, 0)

    def test_stop_in_a_test_is_a_failure(self):
        output, code = run(OPTIONS.early_stop)
        self.assertIn("stopped inside selftest_early_stop.stops_with_exit_code_zero", output)
        self.assertEqual(code, 1)

    def test_failure_on_one_rank(self):
        output, code = run(OPTIONS.mpiexec, "-n", "3", OPTIONS.mpi)
        self.assertEqual(reported_failures("selftest_ranks.pf", output), expected_failures("selftest_ranks.pf"))
        self.assertIn("on rank 2", output)
        self.assertIn("FAILED: 1 of 4 tests of 1 files.", output)
        self.assertNotEqual(code, 0)

    def test_success_on_all_ranks(self):
        output, code = run(OPTIONS.mpiexec, "-n", "3", OPTIONS.mpi, "-f", "counted")
        self.assertIn("PASSED: 3 tests of 1 files.", output)
        self.assertEqual(code, 0)

    def test_too_few_ranks(self):
        output, code = run(OPTIONS.mpiexec, "-n", "1", OPTIONS.mpi)
        self.assertIn("need mpirun with 3 ranks", output)
        self.assertNotEqual(code, 0)


class Refusals(unittest.TestCase):
    """Files outside the subset: file, line and reason."""

    def refuse(self, body, line, reason, *options, module="sample"):
        """`body` goes into a module at line 5; `line` is that of the whole file."""
        text = f"module {module}\n  use funit\n  implicit none\ncontains\n{body}\nend module {module}\n"
        with tempfile.TemporaryDirectory() as directory:
            source = Path(directory) / "sample.pf"
            source.write_text(text)
            target = Path(directory) / "sample.f90"
            output, code = run(sys.executable, OPTIONS.generator, "suite", str(source), str(target), *options)
            self.assertIn(f"sample.pf:{line}: ", output)
            self.assertIn(reason, output)
            self.assertNotEqual(code, 0)
            self.assertFalse(target.exists())

    @staticmethod
    def test(*asserts, mark="@test", head="subroutine a()"):
        """A test procedure; its first assert is at line 7."""
        return "\n".join([mark, head, *asserts, "end subroutine a"])

    def test_directives(self):
        self.refuse(self.test("@assertNothing(1)"), 7, "unknown directive @assertNothing")
        self.refuse(self.test("@assertThat(1)"), 7, "unknown directive @assertThat")
        self.refuse("@disable\n" + self.test(), 5, "unknown or malformed directive @disable")
        self.refuse(self.test("@assertTrue"), 7, "unknown or malformed directive @assertTrue")
        self.refuse(self.test("if (.true.) @assertTrue(.true.)"), 7, "first thing on its line")

    def test_one_directive_a_line(self):
        self.refuse(self.test("@assertEqual(1, &", "  1)"), 7, "must be on one line")
        self.refuse(self.test("@assertTrue(.true.) ! why"), 7, "malformed directive")
        self.refuse(self.test("@assertTrue(.true.))"), 7, "bracket too many")

    def test_arguments_of_asserts(self):
        self.refuse(self.test("@assertEqual(1)"), 7, "needs 2 operand")
        self.refuse(self.test("@assertEqual(1, message='a, b')"), 7, "needs 2 operand")
        self.refuse(self.test("@assertEqual(1, 1, tolerence=0)"), 7, "unknown argument tolerence=")
        self.refuse(self.test("@assertTrue(.true., tolerance=0)"), 7, "unknown argument tolerance=")

    def test_tests(self):
        self.refuse(self.test(mark="@test(cases=[1])"), 5, "unknown option")
        self.refuse(self.test(head="integer :: i"), 6, "must be followed by")
        self.refuse(self.test(head="subroutine a(this)"), 6, "takes `this` when")
        self.refuse(self.test(mark="@test(npes=[2])"), 6, "takes `this` when")
        mpi = {"mark": "@test(npes=[2])", "head": "subroutine a(this)"}
        self.refuse(self.test(**mpi), 6, "suite with MPI_RANKS")
        self.refuse(self.test(), 6, "suite with MPI_RANKS", "--mpi-ranks", "2")
        self.refuse(self.test(mark="@test(npes=[3])", head=mpi["head"]), 6, "1 to 2", "--mpi-ranks", "2")
        self.refuse(self.test() + "\n" + self.test(), 9, "a second test a")
        self.refuse("", 1, "no @test")

    def test_names(self):
        self.refuse(self.test(), 1, "name of its file", module="other")

    def test_fixtures(self):
        before = "@before\nsubroutine b()\nend subroutine b\n"
        self.refuse(before + before + self.test(), 8, "a second @before")
        self.refuse(before + self.test(), 6, "takes `this` in a suite", "--mpi-ranks", "2")


if __name__ == "__main__":
    parser = argparse.ArgumentParser()
    parser.add_argument("--generator")
    parser.add_argument("--serial")
    parser.add_argument("--early-stop")
    parser.add_argument("--mpi")
    parser.add_argument("--mpiexec")
    parser.parse_args(namespace=OPTIONS)
    unittest.main(argv=sys.argv[:1], verbosity=2)
