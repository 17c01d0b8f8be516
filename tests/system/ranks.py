"""Results are byte-equal on 1, 2, 3 and 5 ranks, and with and without mpirun."""

from common import Program, arguments, check, check_equal, state

given = arguments()
program = Program(given)
given.case = program.changed_case("realizations=160", "realizations=80")
for ranks in (0, 1, 2, 3, 5):
    program.run(f"on_{ranks}", ranks)
    check(state(program.root / f"on_{ranks}") == "complete", "not complete")
for ranks in (1, 2, 3, 5):
    check_equal(program.root / "on_0", program.root / f"on_{ranks}", f"{ranks} ranks")
program.clean()
