"""What all HTML pages share: the templates and how numbers are written in them."""

from __future__ import annotations

import math

import jinja2

from .style import UNIT_TEXTS


def environment() -> jinja2.Environment:
    templates = jinja2.Environment(
        loader=jinja2.PackageLoader("sgimp_post"),
        autoescape=True,
        trim_blocks=True,
        lstrip_blocks=True,
    )
    templates.filters["number"] = _number
    templates.filters["share"] = lambda value: _number(100.0 * max(value, 0.0), 0)
    templates.filters["scientific"] = _scientific
    templates.filters["percent"] = lambda value: _number(100.0 * value, 1)
    return templates


def _number(value, digits: int = 3) -> str:
    """A number for a table; a dash for what is not known."""
    if value is None or not math.isfinite(value):
        return "–"
    return f"{value:.{digits}f}"


def _scientific(value) -> str:
    """A probability for a table, two digits."""
    if value is None or not math.isfinite(value):
        return "–"
    return f"{value:.2g}" if value >= 1e-3 or value == 0.0 else f"{value:.1e}"


def field_unit(ensemble) -> str:
    """Of the property that the first random field varies, as the columns field_* have it."""
    unit = next((case.units.get("field_mean", "") for case in ensemble.cases), "")
    return UNIT_TEXTS.get(unit, unit)
