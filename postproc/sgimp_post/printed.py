"""What the paper prints, as plain data, each number with its place.

G. Ma, M. Rezania, M. Mousavi Nezhad, Effects of spatial autocorrelation structure for friction
angle on the runout distance in heterogeneous sand collapse, Transportation Geotechnics (2022), doi
10.1016/j.trgeo.2021.100705; read in the accepted manuscript (wrap.warwick.ac.uk/161792), whose text
holds no number of the curves of Figs. 10 to 14 but those below. Runouts in dm, as there."""

from __future__ import annotations

from dataclasses import dataclass

ACFS = ("snx", "sqx", "smk", "csx", "bin")
COVS = (0.05, 0.10, 0.15)
#: The case of sections 4.2 and 4.2.1.
BASELINE = 0.05


@dataclass(frozen=True)
class Printed:
    """`value` or, for a range, (low, high); `rounding`: half a unit of the last digit printed."""

    what: str
    value: object
    unit: str
    place: str
    rounding: float = 0.0

    @property
    def low(self) -> float:
        return self._ends[0] - self.rounding

    @property
    def high(self) -> float:
        return self._ends[1] + self.rounding

    @property
    def _ends(self):
        return self.value if isinstance(self.value, tuple) else (self.value, self.value)


NUMBERS = {
    "width": Printed("width and height of the column", 5.0, "m", "3.1.1, Fig. 6"),
    "domain": Printed("walls at x = 0 and at x =", 20.0, "m", "3.1.1"),
    "points": Printed("material points", 6400, "", "3.1.1"),
    "radius": Printed("radius of a point", 0.0625, "m", "3.1.1"),
    "nodes": Printed("background computational grids", 10170, "", "3.1.1"),
    "cell_size": Printed('side of a cell, printed "0.125 mm (1.25 dm)"', 0.125, "mm", "3.1.1"),
    "time_step": Printed("time increment", 2.0e-2, "s", "3.1.1"),
    "end_time": Printed("time computed", 5.0, "s", "3.1.1"),
    "damping": Printed("damping coefficient, no unit", 2.0, "", "3.1.1, Eq. 14"),
    "density": Printed("bulk density", 1450.0, "kg/m3", "Table 2"),
    "young": Printed("Young's modulus", 2.6e6, "Pa", "Table 2"),
    "poisson": Printed("Poisson's ratio", 0.31, "", "Table 2"),
    "friction_angle": Printed("friction angle, its mean", 35.0, "degree", "Tables 2 and 4"),
    "scale": Printed("scales of fluctuation", 0.2, "m", "Table 4"),
    "scale_range": Printed("usual scales of fluctuation", (0.13, 0.71), "m", "3.1.2"),
    "tolerance": Printed("difference of mean and variance at convergence", 1e-3, "", "2.4"),
    "fast_from": Printed("runout grows rapidly from", 1.4, "s", "4.1", 0.05),
    "rest": Printed("the deposit is stable at", 4.2, "s", "4.1", 0.05),
    "homogeneous": Printed("runout of the homogeneous column", 60.03, "dm", "4.1, Fig. 7", 0.005),
    "fronts": Printed("fronts of the deposits", (110.0, 120.0), "dm", "4.2, Fig. 9"),
    "converged": Printed("simulations after which statistics converge", 700, "", "4.2, Fig. 10"),
    "members": Printed("realizations of each case", 1000, "", "4.2"),
    "minutes": Printed("time of a realization", (8.0, 10.0), "min", "4.2"),
    "range": Printed("runouts of the heterogeneous columns", (57.0, 89.0), "dm", "4.2.1", 0.5),
    "exceeding": Printed("share beyond 60.03 dm", (0.55, 0.68), "", "4.2.1", 0.005),
    "simulations": Printed("simulations in all", 5000, "", "4.2.2"),
    "exceeding_smk": Printed("the same, SMK, COV 0.05", 0.39, "", "4.2.2, Fig. 14", 0.005),
    "exceeding_csx": Printed("the same, CSX, COV 0.15", 0.74, "", "4.2.2, Fig. 14", 0.005),
}  # fmt: skip

#: Means at the baseline in dm (section 4.2.1, Fig. 11), and half a unit of their last digit.
MEANS = {"snx": 63.47, "sqx": 62.54, "smk": 62.65, "csx": 62.35, "bin": 62.37}
MEANS_PLACE = "4.2.1, Fig. 11"
MEANS_ROUNDING = 0.005

#: (AIC, BIC) at the baseline (Table 5), of runouts in dm, and half a unit of their last digit.
TABLE_5 = {
    "snx": {
        "normal": (702.86, 708.07),
        "lognormal": (693.00, 698.21),
        "gumbel": (676.12, 681.33),
        "weibull": (738.54, 743.75),
    },
    "sqx": {
        "normal": (714.45, 719.66),
        "lognormal": (699.41, 704.62),
        "gumbel": (676.15, 681.36),
        "weibull": (767.03, 772.24),
    },
    "smk": {
        "normal": (677.71, 682.92),
        "lognormal": (665.38, 670.59),
        "gumbel": (642.25, 647.46),
        "weibull": (741.22, 746.43),
    },
    "csx": {
        "normal": (688.59, 693.80),
        "lognormal": (675.25, 680.46),
        "gumbel": (652.28, 657.49),
        "weibull": (751.64, 756.85),
    },
    "bin": {
        "normal": (722.87, 728.08),
        "lognormal": (708.45, 713.66),
        "gumbel": (687.49, 692.70),
        "weibull": (768.87, 774.08),
    },
}
TABLE_5_ROUNDING = 0.005


def rows() -> list:
    """Every printed number as a row: what, low, high (with the rounding), unit, place."""
    found = [_row(one.what, one.low, one.high, one.unit, one.place) for one in NUMBERS.values()]
    for acf, mean in MEANS.items():
        ends = (mean - MEANS_ROUNDING, mean + MEANS_ROUNDING)
        found.append(_row(f"mean runout, {acf.upper()}", *ends, "dm", MEANS_PLACE))
    for acf, laws in TABLE_5.items():
        for law, pair in laws.items():
            for word, value in zip(("AIC", "BIC"), pair):
                ends = (value - TABLE_5_ROUNDING, value + TABLE_5_ROUNDING)
                found.append(_row(f"{word}, {acf.upper()}, {law}", *ends, "", "Table 5"))
    return found


def _row(what, low, high, unit, place) -> dict:
    return {"what": what, "low": low, "high": high, "unit": unit, "place": place}
