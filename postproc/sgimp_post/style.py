"""The one style sheet of every picture, and the forms in which it leaves.

Colours are Okabe and Ito's, told apart by colour-blind readers; an autocorrelation function and a
law have the same one everywhere. Every axis has its unit in brackets."""

from __future__ import annotations

import base64
import functools
import io
import re
from pathlib import Path

import matplotlib

matplotlib.use("Agg")

import matplotlib.pyplot as plt

ACF_COLOURS = {
    "snx": "#D55E00",
    "sqx": "#0072B2",
    "smk": "#009E73",
    "csx": "#CC79A7",
    "bin": "#7A6A00",
    "matern32": "#E69F00",
    "matern52": "#56B4E9",
    "matern": "#000000",
    "spherical": "#8C4B2F",
}
LAW_STYLES = {
    "normal": ("#0072B2", "-"),
    "lognormal": ("#009E73", "--"),
    "gumbel": ("#D55E00", "-"),
    "weibull": ("#7F7F7F", ":"),
}
OTHER = "#3B5B7A"
INK = "#22303C"
STYLE = {
    "font.family": "DejaVu Sans",
    "font.size": 9,
    "axes.edgecolor": "#8795A1",
    "axes.labelcolor": INK,
    "axes.titlesize": 10,
    "axes.titlelocation": "left",
    "axes.spines.top": False,
    "axes.spines.right": False,
    "axes.grid": True,
    "grid.color": "#E4E9ED",
    "text.color": INK,
    "xtick.color": "#52616B",
    "ytick.color": "#52616B",
    "legend.frameon": False,
    "legend.fontsize": 8,
    "figure.constrained_layout.use": True,
    "svg.fonttype": "none",  # text stays text: a third of the size, and can be edited
    "svg.hashsalt": "sgimp",
    "pdf.fonttype": 42,
}
#: Forms in which every figure of a report is also written, for papers, with the resolution of what
#: is rasterized in them; the pages embed the first.
FIGURE_KINDS = {"svg": 100, "pdf": 200}
_FONT = b"'DejaVu Sans'"
_COMMENT = re.compile(rb" *<!--.*?-->\n", re.DOTALL)
_PATH = re.compile(rb' d="([^"]*)"')
_DIGITS = re.compile(rb"(\.\d\d)\d+")
ACF_TEXTS = {"matern32": "Matérn 3/2", "matern52": "Matérn 5/2", "matern": "Matérn"}
PROPERTY_TEXTS = {
    "friction_angle": "friction angle",
    "tan_friction_angle": "tan(friction angle)",
    "cohesion": "cohesion",
    "undrained_strength": "undrained strength",
    "young": "Young's modulus",
    "density": "density",
    "dilation_angle": "dilation angle",
}
UNIT_TEXTS = {"deg": "°", "degree": "°", "degrees": "°", "1": "–", "": "–", "kg/m3": "kg/m³"}
#: Unit, factor and text for values that are large in SI.
LARGE_UNITS = {"Pa": ((1e6, "MPa"), (1e3, "kPa"))}


def acf_text(acf: str) -> str:
    return ACF_TEXTS.get(acf, acf.upper() if len(acf) <= 3 else acf)


def axis_label(spec, typical: float):
    """'property [unit]' and the number that the values are divided by."""
    name = PROPERTY_TEXTS.get(spec.property, spec.property)
    if spec.name != spec.property:
        name = f"{spec.name}, {name}"
    for factor, unit in LARGE_UNITS.get(spec.units, ()):
        if abs(typical) >= factor:
            return f"{name} [{unit}]", factor
    return f"{name} [{UNIT_TEXTS.get(spec.units, spec.units)}]", 1.0


def acf_colour(acf: str) -> str:
    """Colour of an autocorrelation function."""
    return ACF_COLOURS.get(acf, OTHER)


def colour(case) -> str:
    """Colour of a case: that of its autocorrelation function."""
    return acf_colour(case.acf)


def rendered(figure, kind: str = "svg", dpi: int = 100) -> bytes:
    """The figure as a file of this kind; the same figure gives the same bytes."""
    undated = {"svg": {"Date": None}, "pdf": {"CreationDate": None}}
    buffer = io.BytesIO()
    with matplotlib.rc_context(STYLE):
        figure.savefig(buffer, format=kind, dpi=dpi, metadata=undated.get(kind))
    return _slim(buffer.getvalue()) if kind == "svg" else buffer.getvalue()


def _slim(svg: bytes) -> bytes:
    """Half the size for the same picture: paths to 0.01 pt, no comments. Where there is no DejaVu,
    text is set in its relative of the same widths, or in whatever there is."""
    svg = _COMMENT.sub(b"", svg)
    svg = _PATH.sub(lambda d: b' d="' + b" ".join(_DIGITS.sub(rb"\1", d[1]).split()) + b'"', svg)
    return svg.replace(_FONT, _FONT + b", Verdana, sans-serif")


class Gallery:
    """The figures of one page: each embedded, and in the forms that papers take as a file."""

    def __init__(self):
        #: Contents by file name.
        self.files = {}

    def add(self, name: str, figure) -> str | None:
        """The data URI of the figure, which is closed; None of None."""
        if figure is None:
            return None
        self.files.update(
            {f"{name}.{kind}": rendered(figure, kind, dpi) for kind, dpi in FIGURE_KINDS.items()}
        )
        plt.close(figure)
        return svg_uri(self.files[f"{name}.svg"])

    def write(self, directory: Path) -> None:
        directory.mkdir(parents=True, exist_ok=True)
        for name, content in self.files.items():
            (directory / name).write_bytes(content)


def svg_uri(content: bytes) -> str:
    return f"data:image/svg+xml;base64,{base64.b64encode(content).decode('ascii')}"


def styled(draw):
    """Runs a drawing function under the style sheet."""

    @functools.wraps(draw)
    def inner(*args, **kwargs):
        with matplotlib.rc_context(STYLE):
            return draw(*args, **kwargs)

    return inner
