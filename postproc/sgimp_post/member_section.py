"""The section of the report, and the head of each case of the casebook, that shows the members at
the quantiles of the runout: entries for the template `members.html.j2`."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from .ensemble import RUNOUTS
from .member_figures import member_figure
from .member_states import FieldRebuild, last_field, varied_property
from .quantile_members import quantile_members, shown_cases
from .style import Gallery

#: Columns of the table beside the runout.
COLUMNS = ("field_mean", "field_min", "height_max", "settle_time")


def member_entries(
    ensemble, runout: str, gallery: Gallery, label: str | None = None, states: Path | None = None
) -> list:
    """One entry a case that is shown (`shown_cases`) and has a member: `label`, `title`, `image`
    (data URI, added to the gallery), `runout` in words and `rows` of name, id, value and COLUMNS.
    `label` names one case, `states` the directory whose snapshots and replays are drawn (that of
    the run). Empty if no member has ended well."""
    directory = states or ensemble.directory
    cases = shown_cases(ensemble, label)
    rebuild, quantity = FieldRebuild(ensemble.directory), varied_property(ensemble)
    entries = []
    for case in cases:
        members = quantile_members(case, runout, ensemble.is_weighted)
        if not members:
            continue
        fields = rebuild.of(case, [member.id for member in members])
        deposits = {m.id: last_field(directory, case, m.id, quantity) for m in members}
        figure = member_figure(case, members, fields, deposits)
        entries.append(
            {
                "label": case.label,
                "title": f"{case.label}, {case.count} member{'s' * (case.count > 1)}",
                "image": gallery.add(f"members_{case.label}", figure),
                "runout": RUNOUTS[runout],
                "rows": [_row(case, member) for member in members],
            }
        )
    return entries


def _row(case, member) -> dict:
    k = int(np.flatnonzero(case.id == member.id)[0])
    values = {name: float(case.column(name)[k]) for name in COLUMNS}
    return {"name": member.name, "id": member.id, "value": member.value, **values}
