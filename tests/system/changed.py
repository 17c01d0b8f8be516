"""Another configuration in the directory is refused with the key that differs, and nothing of it is
changed; --overwrite starts anew; more realizations go on."""

from common import Program, arguments, check, check_equal

program = Program(arguments())
program.run("run", 2)
directory = program.root / "run"
before = {p: (p.stat().st_mtime_ns, p.read_bytes()) for p in directory.iterdir() if p.is_file()}
other = program.changed_case("seed=1", "seed=2")
text = program.run("run", 3, case=other, expect=2)
check("seed" in text and "1 -> 2" in text, f"the key is not named:\n{text}")
after = {p: (p.stat().st_mtime_ns, p.read_bytes()) for p in directory.iterdir() if p.is_file()}
check(before == after, "files were changed")
program.run("run", 2, "--overwrite", case=other)
program.run("fresh", 1, case=other)
check_equal(program.root / "fresh", directory, "--overwrite")
text = program.run("/dev/null/nowhere", 3, expect=2)
check("/dev/null/nowhere" in text, f"the directory is not named:\n{text}")
program.clean()
