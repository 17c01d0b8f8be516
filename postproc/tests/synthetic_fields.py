"""Writes what the program records of its random fields, with fields that a test makes itself: dense
matrices, one point at a time, nothing of the code under test."""

import h5py
import numpy as np
from scipy.special import ndtri
from synthetic import write_ensemble

SEED = 2022
STATISTICS = (("field_mean", np.mean), ("field_min", np.min), ("field_max", np.max))


def lattice_points(nx, ny, spacing=0.25):
    """x, y [n], x fastest."""
    x, y = np.meshgrid((np.arange(nx) + 0.5) * spacing, (np.arange(ny) + 0.5) * spacing)
    return x.ravel(), y.ravel()


def white_noise(realization, count, stream=1, seed=SEED):
    """Philox4x64-10 in plain integers: block b of the counter (b, id, 0, 0), b from 1."""
    words = []
    for block in range(1, count // 4 + 2):
        words += philox([block, realization, 0, 0], [seed, stream])
    return ndtri([((word >> 12) + 0.5) * 2.0**-52 for word in words[:count]])


def philox(counter, key):
    """Salmon et al. 2011."""
    mask = 2**64 - 1
    for _ in range(10):
        high0, low0 = divmod(0xD2E7470EE14C6C93 * counter[0], 2**64)
        high1, low1 = divmod(0xCA5A826395121157 * counter[2], 2**64)
        counter = [high1 ^ counter[1] ^ key[0], low1, high0 ^ counter[3] ^ key[1], low0]
        key = [(key[0] + 0x9E3779B97F4A7C15) & mask, (key[1] + 0xBB67AE8584CAA73B) & mask]
    return counter


def write_run(directory, groups, points, *, members=20, values=None, records=None, acfs=("snx",),
              covs=(0.1,), more="", state="complete", done=None):  # fmt: skip
    """A run with one case a function and coefficient of variation. `groups`: keys of each
    &random_field; `points`: x, y [n] of each; `records`: method, jitter and ring of each for every
    function; `values(case, id)`: the field [n] whose statistics are recorded."""
    done = members if done is None else done
    cases = [{"label": "deterministic", "values": np.full(2, 5.0)}]
    cases += [
        {"label": f"{acf}_cov{cov:.2f}", "acf": acf, "cov": cov, "planned": members,
         "values": np.full(done, 5.5)}
        for acf in acfs for cov in covs
    ]  # fmt: skip
    write_ensemble(directory, cases, state)
    records = records or [{"method": "kronecker", "jitter": [0.0, 0.0]}] * len(groups)
    with h5py.File(directory / "ensemble.h5", "r+") as file:
        file.attrs["seed"] = SEED
        for k, (keys, (x, y)) in enumerate(zip(groups, points), start=1):
            group = file.create_group(f"random_fields/{keys['name']}")
            group.attrs.update(index=k, property=keys["property"], material="sand", units="deg")
            mean = keys["mean"] + keys.get("mean_gradient", 0.0) * (keys.get("datum", 0.0) - y)
            sd = keys["sd"] if "sd" in keys else covs[0] * abs(mean)
            spacing = keys.get("spacing", 0.25)
            columns = {"x": x, "y": y, "width": spacing, "height": spacing, "mean": mean, "sd": sd}
            for name, column in columns.items():
                column = np.broadcast_to(column, x.shape)
                group[name] = column[:1] if np.ptp(column) == 0.0 and name not in "xy" else column
            for acf in acfs:
                made_by = group.create_group(acf)
                made_by.attrs["method"] = records[k - 1]["method"]
                for name in ("jitter", "ring"):
                    if name in records[k - 1]:
                        made_by[name] = records[k - 1][name]
        for case in cases[1:]:
            for name, reduce in STATISTICS:
                column = file[f"cases/{case['label']}/{name}"]
                column[...] = np.nan if values is None else [
                    reduce(values(case, i)) for i in range(1, done + 1)
                ]  # fmt: skip
    text = "".join(f"&random_field\n{_lines(keys)}/\n" for keys in groups)
    text += f"&monte_carlo\n  realizations = {members}\n  seed = {SEED}\n/\n{more}"
    (directory / "resolved.nml").write_text(
        "! every key\n&case\n  name = 'it''s / one'\n/\n" + text
    )
    return directory


def _lines(keys):
    lines = []
    for key, value in keys.items():
        if key == "spacing":
            continue
        text = f"'{value}'" if isinstance(value, str) else f"{value!r}".replace("e", "d")
        lines.append(f"  {key} = {text}\n")
    return "".join(lines)
