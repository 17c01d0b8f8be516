#!/usr/bin/env python3
"""Turns pFUnit test files (.pf) into Fortran, for machines without pFUnit.

    pf_to_fortran.py suite INPUT.pf OUTPUT.F90 [--mpi-ranks N]
    pf_to_fortran.py driver OUTPUT.F90 INPUT.pf ... [--mpi-ranks N]

A strict subset of pFUnit 4: @test, @test(npes=[1, 2]), @before, @after, and the asserts of ASSERTS, each
also as @mpiAssert.... Whatever else begins with @ is an error with file:line, as is anything that pFUnit's
own line-by-line parser would misread (a directive continued over lines or followed by a comment, a module
named otherwise than its file). The output keeps the line numbers of the input.
"""

import argparse
import re
import sys
from pathlib import Path

# Assert -> (operands, whether it takes a tolerance).
ASSERTS = {
    "equal": (2, True),
    "relativelyequal": (2, True),
    "notequal": (2, False),
    "lessthan": (2, False),
    "lessthanorequal": (2, False),
    "greaterthan": (2, False),
    "greaterthanorequal": (2, False),
    "sameshape": (2, False),
    "true": (1, False),
    "false": (1, False),
    "all": (1, False),
    "any": (1, False),
    "none": (1, False),
    "notall": (1, False),
    "isnan": (1, False),
    "isfinite": (1, False),
    "fail": (1, False),
}
SUBROUTINE = re.compile(r"\s*subroutine\s+(\w+)\s*(?:\(([\w\s,]*)\))?\s*(?:!.*)?$", re.IGNORECASE)
ASSERT = re.compile(r"\s*@(mpi)?assert(\w+)\s*\((.*)\)\s*$", re.IGNORECASE)
TEST = re.compile(r"\s*@test\s*(?:\((.*)\))?\s*$", re.IGNORECASE)
NPES = re.compile(r"\s*npes\s*=\s*\[([0-9,\s]+)\]\s*$", re.IGNORECASE)
FIXTURE = re.compile(r"\s*@(before|after)\s*$", re.IGNORECASE)
MODULE = re.compile(r"\s*module\s+(?!procedure\b)(\w+)\s*$", re.IGNORECASE)
KEYWORD = re.compile(r"\s*(\w+)\s*=(?!=)")


class PfError(Exception):
    """Something in a test file that is not in the subset."""


def split_arguments(text):
    """The parts of `text` between commas that are outside brackets and quotes."""
    parts, depth, quote, start = [], 0, "", 0
    for position, char in enumerate(text):
        if quote:
            if char == quote:
                quote = ""
        elif char in "'\"":
            quote = char
        elif char in "([":
            depth += 1
        elif char in ")]":
            depth -= 1
            if depth < 0:
                raise PfError("a closing bracket too many")
        elif char == "," and depth == 0:
            parts.append(text[start:position].strip())
            start = position + 1
    if quote or depth:
        raise PfError("brackets or quotes do not balance (a directive must be on one line)")
    parts.append(text[start:].strip())
    return [part for part in parts if part]


def code_of(line):
    """`line` without comments and without what stands between quotes."""
    code, quote = [], ""
    for char in line:
        if quote:
            quote = "" if char == quote else quote
        elif char in "'\"":
            quote = char
        elif char == "!":
            break
        else:
            code.append(char)
    return "".join(code)


class TestFile:
    """One .pf file: its translation and what is to be called."""

    def __init__(self, path, mpi_ranks):
        self.path = Path(path)
        self.mpi_ranks = mpi_ranks
        self.module = self.path.stem.lower()
        self.tests = []  # (name, npes); npes is 0 for a test without MPI
        self.fixtures = {}
        self.lines = []
        self._pending = None  # the directive that waits for its subroutine
        self._has_module = False
        for number, line in enumerate(self.path.read_text().splitlines(), start=1):
            try:
                self.lines.append(self._translate(line, number))
            except PfError as error:
                raise PfError(f"{path}:{number}: {error}") from None
        try:
            self._check_whole()
        except PfError as error:
            raise PfError(f"{path}:1: {error}") from None

    def _translate(self, line, number):
        code = code_of(line)
        if self._pending and code.strip():
            self._take_subroutine(line)
            return line
        if "@" not in code:
            module = MODULE.match(line)
            if module and not self._has_module:
                self._has_module = True
                if module[1].lower() != self.module:
                    raise PfError(f"module {module[1]} must have the name of its file, {self.module}")
            return line
        if not code.lstrip().startswith("@"):
            raise PfError("a directive must be the first thing on its line")
        if ASSERT.match(line):
            return self._translate_assert(line, number)
        self._translate_mark(line)
        return line.replace("@", "!@", 1)

    def _translate_mark(self, line):
        test, fixture = TEST.match(line), FIXTURE.match(line)
        if test:
            npes = []
            if test[1] is not None:
                option = NPES.match(test[1])
                if not option:
                    raise PfError(f"unknown option in @test({test[1]}) (allowed npes=[1, 2, ...])")
                npes = [int(n) for n in option[1].replace(" ", "").split(",") if n]
            self._pending = ("test", npes)
        elif fixture:
            kind = fixture[1].lower()
            if kind in self.fixtures:
                raise PfError(f"a second @{kind}")
            self._pending = (kind, [])
        elif line.rstrip().endswith("&"):
            raise PfError("a directive must be on one line")
        else:
            word = re.match(r"\s*(@\w*)", line)[1]
            raise PfError(f"unknown or malformed directive {word} (allowed @test, @before, @after, asserts)")

    def _take_subroutine(self, line):
        found = SUBROUTINE.match(line)
        kind, npes = self._pending
        if not found:
            raise PfError(f"@{kind} must be followed by a line `subroutine name(...)`")
        name, arguments = found[1].lower(), (found[2] or "").strip()
        if kind == "test":
            if bool(npes) != bool(arguments):
                raise PfError("a test takes `this` when it has npes=[...], and no argument when it has not")
            if bool(npes) != bool(self.mpi_ranks):
                raise PfError("npes=[...] belongs to all tests of a suite with MPI_RANKS, and to no others")
            if any(n < 1 or n > self.mpi_ranks for n in npes):
                raise PfError(f"npes must be 1 to {self.mpi_ranks}, the MPI_RANKS of the suite")
            if any(name == test for test, _ in self.tests):
                raise PfError(f"a second test {name}")
            self.tests += [(name, n) for n in npes or [0]]
        else:
            if bool(self.mpi_ranks) != bool(arguments):
                raise PfError(f"@{kind} takes `this` in a suite with MPI_RANKS, and no argument in others")
            self.fixtures[kind] = name
        self._pending = None

    def _translate_assert(self, line, number):
        mpi, name, text = ASSERT.match(line).groups()
        if name.lower() not in ASSERTS:
            raise PfError(f"unknown directive @{mpi or ''}assert{name}")
        operands, has_tolerance = ASSERTS[name.lower()]
        allowed = ["message"] + (["tolerance"] if has_tolerance else [])
        positional = 0
        arguments = split_arguments(text)
        for argument in arguments:
            keyword = KEYWORD.match(argument)
            if not keyword:
                positional += 1
            elif keyword[1].lower() not in allowed:
                raise PfError(f"unknown argument {keyword[1]}= (allowed {', '.join(allowed)})")
        if positional < operands:
            raise PfError(f"@assert{name} needs {operands} operand(s)")
        indent = line[: len(line) - len(line.lstrip())]
        call = (
            f"{indent}call assert{name}({', '.join(arguments)}, "
            f"location=SourceLocation('{self.path.name}', {number}))"
        )
        # As in pFUnit, @mpiAssert does not return: the other ranks would wait in the next collective.
        return call if mpi else call + "; if (anyExceptions()) return"

    def _check_whole(self):
        if self._pending:
            raise PfError(f"nothing follows the last @{self._pending[0]}")
        if not self._has_module:
            raise PfError(f"the file must hold a module {self.module}")
        if not self.tests:
            raise PfError("no @test in this file")
        if self.mpi_ranks and len(self.fixtures) == 1:
            raise PfError("an MPI suite has both @before and @after, or neither")

    def fortran(self):
        """The translated module and the module that runs its tests."""
        # So that messages of the compiler name the .pf file.
        text = [f'#line 1 "{self.path}"', *self.lines]
        text += [
            f"module run_{self.module}",
            f"  use {self.module}",
            f"  use {'pfunit' if self.mpi_ranks else 'funit'}, only: funit_is_wanted, &",
            "    & funit_anyExceptions => anyExceptions"
            + (", funit_method => MpiTestMethod" if self.mpi_ranks else ", funit_begin, funit_end"),
            "  implicit none",
            "  private",
            f"  public :: run_all_of_{self.module}",
            "contains",
            f"  subroutine run_all_of_{self.module}()",
        ]
        if self.mpi_ranks:
            text.append("    type(funit_method) :: funit_this")
        for name, npes in self.tests:
            text += self._calls(name, npes)
        text += [f"  end subroutine run_all_of_{self.module}", f"end module run_{self.module}", ""]
        return "\n".join(text)

    def _calls(self, name, npes):
        before, after = self.fixtures.get("before"), self.fixtures.get("after")
        this = "funit_this" if npes else ""
        body = [f"call {before}({this})"] if before else []
        body.append(f"if (.not. funit_anyExceptions()) call {name}({this})")
        if after:
            body.append(f"call {after}({this})")
        label = f"{self.module}.{name}" + (f" [npes={npes}]" if npes else "")
        text = [f"    if (funit_is_wanted('{label}')) then"]
        if npes:
            text.append(f"      call funit_this%begin('{label}', {npes})")
            text.append("      if (funit_this%isActive()) then")
            text += ["        " + line for line in body]
            text += ["      end if", "      call funit_this%finish()"]
        else:
            text.append(f"      call funit_begin('{label}')")
            text += ["      " + line for line in body]
            text.append("      call funit_end()")
        return [*text, "    end if"]


def driver(paths, mpi_ranks):
    """The main program of a suite."""
    modules = [Path(path).stem.lower() for path in paths]
    runner = "pfunit" if mpi_ranks else "funit"
    lines = ["program run_tests", f"  use {runner}, only: {runner}_open, {runner}_close"]
    lines += [f"  use run_{module}, only: run_all_of_{module}" for module in modules]
    lines += ["  implicit none", "", f"  call {runner}_open({mpi_ranks or ''})"]
    lines += [f"  call run_all_of_{module}()" for module in modules]
    lines += [f"  call {runner}_close({len(modules)})", "end program run_tests", ""]
    return "\n".join(lines)


def main():
    """Command line."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawTextHelpFormatter)
    parser.add_argument("what", choices=["suite", "driver"])
    parser.add_argument("files", nargs="+")
    parser.add_argument("--mpi-ranks", type=int, default=0)
    options = parser.parse_args()
    try:
        if options.what == "suite":
            source, target = options.files
            text = TestFile(source, options.mpi_ranks).fortran()
        else:
            target, *sources = options.files
            text = driver(sources, options.mpi_ranks)
    except PfError as error:
        sys.exit(f"{error}")
    Path(target).write_text(text)


if __name__ == "__main__":
    main()
