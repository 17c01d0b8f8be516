"""A second run in a directory where one is at work refuses, also with --overwrite, and the first is not disturbed."""

from common import Journal, Program, arguments, await_end, check, check_equal, tried, wait_until

given = arguments()
program = Program(given)
given.case = program.changed_case("realizations=160", "realizations=120")
program.run("alone", 2)
directory = program.root / "shared"
# So many members that it is at work for as long as the others need, however fast the machine.
endless = program.root / "endless.nml"
endless.write_text(given.case.read_text().replace("realizations=120", "realizations=50000"))
first = program.start("shared", 2, case=endless)
wait_until(lambda: len(Journal(directory / "journal.bin").records) > 5, "members")
for options, ranks in (((), 2), (("--overwrite",), 0)):
    text = program.run("shared", ranks, *options, expect=2)
    check(f"another run is at work in {directory}" in text, f"not said:\n{text}")
(directory / "STOP").touch()
text = await_end(first)
check(first.returncode == 3, f"the first run was disturbed: exit code {first.returncode}\n{text}")
check(len((directory / "run.log").read_text().split("members of 3 cases")) == 2, "others have written into run.log")
program.run("shared", 2)
check_equal(program.root / "alone", directory, "two runs")
tried("two runs in one directory")
program.clean()
