"""A thousand members leave at most 10 files and 50 MB, a hundred as many files, whatever the number of ranks.

The members are real but small (a block of four points for a few steps): files depend on their number and on the 160
columns of the profile, which are those of the paper."""

from common import Journal, Program, arguments, check, ids

CASE = """
&case name='many' /
&grid x_max=20, y_max=1, cell_size=0.125 /
&material name='sand', model='mohr_coulomb', density=1450, young=2.6e6, poisson=0.31, friction_angle=35 /
&body name='block', material='sand', shape='rectangle', x=0, y=0, width=0.125, height=0.125 /
&solver end_time=0.005 /
&random_field material='sand', mean=35, cov=0.1, acf='snx', scale_x=0.2, scale_y=0.2 /
&monte_carlo realizations={realizations}, noise_members=8 /
&output directory='many', report_seconds=0.2 /
"""
program = Program(arguments())
counts = {}
for realizations, ranks in ((100, 1), (1000, 2)):
    case = program.root / f"many_{realizations}.nml"
    case.write_text(CASE.format(realizations=realizations))
    program.run(f"many_{realizations}", ranks, case=case)
    directory = program.root / f"many_{realizations}"
    files = [path for path in directory.rglob("*") if path.is_file()]
    size = sum(path.stat().st_size for path in files)
    check(
        len(ids(directory)) == len(Journal(directory / "journal.bin").records) == realizations + 8,
        "members are missing",
    )
    check(len(files) <= 10 and size <= 50e6, f"{realizations} members: {len(files)} files, {size} bytes")
    counts[realizations] = len(files)
    print(f"{realizations} members: {len(files)} files, {size / 1e6:.2f} MB")
check(counts[100] == counts[1000], f"the number of files depends on that of members: {counts}")
program.clean()
