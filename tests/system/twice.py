"""A second run in a directory where one is at work refuses, also with --overwrite, and the first is not disturbed."""

from common import Journal, Program, arguments, await_end, check, check_equal, tried, wait_until

given = arguments()
program = Program(given)
given.case = program.changed_case("realizations=160", "realizations=120")
program.run("alone", 2)
directory = program.root / "shared"
first = program.start("shared", 2)
wait_until(lambda: len(Journal(directory / "journal.bin").records) > 5, "members")
for options, ranks in (((), 2), (("--overwrite",), 0)):
    text = program.run("shared", ranks, *options, expect=2)
    check(f"another run is at work in {directory}" in text, f"not said:\n{text}")
check(first.poll() is None, "the first run was over before the others began")
text = await_end(first)
check(first.returncode == 0, f"the first run was disturbed: exit code {first.returncode}\n{text}")
check(len((directory / "run.log").read_text().split("members of 3 cases")) == 2, "others have written into run.log")
check_equal(program.root / "alone", directory, "two runs")
tried("two runs in one directory")
program.clean()
