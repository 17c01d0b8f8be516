"""What a scene can do without changes nothing: each word of `needless` on each scene, and what other keys leave out.

Byte-equal are all columns, profiles, histories and snapshots, but where the arithmetic differs: the exact return of
Mohr-Coulomb has other roundings than that to the plane, velocities gathered with their gradient may be summed in
another order, as is what points bring to nodes where none is left out, and a yield surface that nothing reaches turns
stresses into principal ones and back. These are run for some fifty steps, before sand makes much of a rounding, and
compared within ROUNDINGS."""

import re

import h5py
import numpy as np
from common import Program, arguments, check, check_equal, columns

# Words whose results are byte-equal, and those of other roundings.
EXACT = ("empty_nodes", "gaps", "cracks", "dilation", "deformation", "plastic_strain", "wave_speed", "ledger")
ROUNDED = ("exact_return", "velocity_gradient", "zero_weights")
# Largest difference over the largest number of a dataset after fifty steps, a hundred times what is found: velocities
# of some m/s are rounded by 1e-15, the strains of a step alike; with Young's modulus that is 1e-9 Pa in stresses of 10.
ROUNDINGS = {"double": 1.0e-8, "single": 1.0e-4}

GRID = "&grid x_max=12, y_max=6, cell_size=0.5, {walls} /\n"
SAND = "model='mohr_coulomb', density=1450, young=2.6e6, poisson=0.31, friction_angle=35"
BODY = "&body name='{0}', material='{0}', shape='rectangle', {1} /\n"


def scene(material, solver, walls="top='free'", body="x=0, y=0, width=4, height=4", rest=""):
    """The text of a case with one body, at first without end_time and needless."""
    return (
        "&case name='skips' /\n"
        + GRID.format(walls=walls)
        + f"&material name='it', {material} /\n"
        + BODY.format("it", body)
        + f"&solver {solver}, settle=0 /\n"
        + rest
    )


RECORD = "&output history_interval=0.01, snapshot_interval=0.1 /\n"
SCENES = {
    "sand": "",  # the case that ctest gives, with its random field
    "elastic": scene(
        "model='linear_elastic', density=1000, young=1e6, poisson=0.3",
        "scheme='usl', weighting='bspline'",
        body="x=4, y=1, width=2, height=2, velocity=2,-1, angular_velocity=1",
    ),
    "recorded": scene(SAND, "scheme='musl'", rest=RECORD),
    "dilating": scene(SAND + ", dilation_angle=10", "scheme='usl'", walls="bottom='frictional', bottom_friction=0.3"),
    "brittle": scene(
        SAND + ", cohesion=2e3, tension_strength=5e2",
        "scheme='usf'",
        body="x=6, y=1, width=2, height=3, velocity=-6,2",
        rest=RECORD,
    ),
    "softening": scene(
        SAND + ", cohesion=5e3, softening='linear', residual_friction_angle=25, softening_end=0.05",
        "scheme='musl', weighting='cpgimp'",
    ),
    "cone": scene(
        SAND.replace("mohr_coulomb", "drucker_prager") + ", cohesion=1e3", "scheme='usl', transfer='tpic'", rest=RECORD
    ),
    "rubber": scene(
        "model='neo_hookean', density=1000, young=1e6, poisson=0.3",
        "scheme='usl', time_step=2e-3",
        walls="bottom='roller'",
        rest="&material name='sand', " + SAND + " /\n" + BODY.format("sand", "x=6, y=0, width=2, height=2") + RECORD,
    ),
    "single": scene(SAND, "scheme='musl', precision='single'", rest=RECORD),
}


class Judge:
    """Runs the scenes and compares."""

    def __init__(self, given):
        self.program = Program(given)
        small = re.sub(r"&output.*", "", given.case.read_text())
        for old, new in ((", end_time=3", ""), ("end_time=3", "settle=0"), ("=160", "=2"), ("members=3", "members=2")):
            small = small.replace(old, new)
        self.scenes = SCENES | {"sand": small}

    def run(self, name, end_time, words=(), case=None):
        """Directory of a run to `end_time`; None where it was run before."""
        extra = f"end_time={end_time}"
        if words:
            extra += ", needless=" + ", ".join(f"'{word}'" for word in words)
        text = (case or self.scenes[name]).replace("&solver ", f"&solver {extra}, ")
        check(extra in text, f"{name}: no &solver")
        directory = self.program.root / "_".join([name, str(end_time), *words])
        namelist = directory.with_suffix(".nml")
        namelist.write_text(text)
        self.program.run(directory.name, 0, case=namelist)
        for key, (_, status) in columns(directory).items():
            if key.endswith("/status"):
                check(not any(status), f"{name} {words}: a member failed")
        return directory

    def same(self, one, other, bound=0.0, but="/seconds"):
        """Two runs are equal within `bound` times the largest number of each dataset, their snapshots too. Names with
        `but` in them do not count. Returns the largest difference."""
        largest = 0.0
        what = f"{other.name} beside {one.name}"
        pairs = [(one / "ensemble.h5", other / "ensemble.h5", "cases")]
        pairs += [(path, other / "snapshots" / path.name, "/") for path in sorted((one / "snapshots").glob("*.h5"))]
        for left, right, root in pairs:
            with h5py.File(left) as first, h5py.File(right) as second:
                names = datasets(first[root], but)
                check(names == datasets(second[root], but) and names, f"{what}: other datasets")
                for name in names:
                    error = difference(first[root][name][()], second[root][name][()])
                    check(error <= bound, f"{what}: {name} differs by {error:.1e} of its largest, not {bound:.0e}")
                    largest = max(largest, error)
        return largest

    def clean(self):
        """Removes all runs."""
        self.program.clean()


def datasets(group, but):
    """Names of all datasets but the computing times and those with `but` in them."""
    names = []
    group.visititems(lambda name, item: names.append(name) if isinstance(item, h5py.Dataset) else None)
    return [name for name in names if not name.endswith("/seconds") and but not in name]


def difference(one, other):
    """0 where two arrays are byte-equal, else the largest difference over the largest number."""
    one, other = np.asarray(one), np.asarray(other)
    if one.shape != other.shape:
        return np.inf
    if one.tobytes() == other.tobytes():
        return 0.0
    if one.dtype.kind != "f" or not np.array_equal(np.isfinite(one), np.isfinite(other)):
        return np.inf
    error = np.nanmax(np.abs(one - other)) / max(np.nanmax(np.abs(one)), 1.0)
    return max(error, np.finfo(float).tiny)


def check_words(judge):
    """All exact words together, one after the other only to tell which it is; each of the others alone."""
    for name in SCENES:
        plain = judge.run(name, 0.4)
        try:
            judge.same(plain, judge.run(name, 0.4, EXACT))
        except SystemExit:
            for word in EXACT:
                judge.same(plain, judge.run(name, 0.4, (word,)))
            raise
        short = judge.run(name, 0.1)
        bound = ROUNDINGS["single" if name == "single" else "double"]
        for word in ROUNDED:
            found = judge.same(short, judge.run(name, 0.1, (word,)), bound)
            # Sums in another order show that the work was done.
            check(found > 0.0 or (name, word) != ("sand", "zero_weights"), "zero_weights changes nothing at all")


def twin(name):
    """The column of the homogeneous case for one of the case with a field."""
    return name.replace("base/", "deterministic/")


def check_keys(judge):
    """What needs no word: histories and snapshots, a random field that varies nothing, a yield surface out of reach."""
    recorded = SCENES["recorded"]
    plain = judge.run("unrecorded", 0.4, case=recorded.replace(RECORD, ""))
    check_equal(plain, judge.program.root / "recorded_0.4", "recorded or not")

    field = "&random_field material='it', mean=35, cov=1e-20, acf='snx', scale_x=0.5, scale_y=0.5 /\n"
    field += "&monte_carlo realizations=1, noise_members=1 /\n"
    found = columns(judge.run("constant", 0.4, case=recorded.replace(RECORD, field)))
    compared = [name for name in found if name.startswith("base/") and twin(name) in found]
    check(len(compared) > 20, f"only {compared} can be compared")
    for name in compared:
        check(found[name] == found[twin(name)], f"a field that varies nothing: {name} is not homogeneous")

    elastic = SCENES["elastic"]
    strong = "model='mohr_coulomb', friction_angle=0, cohesion=1e30, tension_strength=1e30"
    other = judge.run("strong", 0.1, case=elastic.replace("model='linear_elastic'", strong))
    judge.same(judge.program.root / "elastic_0.1", other, ROUNDINGS["double"], but="/field_")


def main():
    """All of it."""
    judge = Judge(arguments())
    check_words(judge)
    check_keys(judge)
    judge.clean()


main()
