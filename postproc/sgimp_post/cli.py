"""The command line `sgimp-post`."""

from __future__ import annotations

import argparse
import sys
from pathlib import Path

from . import __version__
from .ensemble import RUNOUTS
from .errors import PostError


def main(arguments=None) -> int:
    """Exit codes: 0; 1 for fields that are not what they should be or a replay that fails; 2 for
    bad input."""
    parser = argparse.ArgumentParser(prog="sgimp-post", description=__doc__.splitlines()[0])
    parser.add_argument("--version", action="version", version=f"sgimp-post {__version__}")
    commands = parser.add_subparsers(dest="command", required=True)
    _add_report(commands)
    _add_fields(commands)
    _add_allocate(commands)
    _add_merge(commands)
    _add_fit(commands)
    _add_diff(commands)
    _add_watch(commands)
    _add_export(commands)
    _add_casebook(commands)
    _add_paper(commands)
    options = parser.parse_args(arguments)
    try:
        return options.run(options)
    except PostError as error:
        print(f"sgimp-post: {error}", file=sys.stderr)
        return 2


def _add_runout(parser, purpose: str):
    parser.add_argument(
        "--runout",
        choices=list(RUNOUTS),
        default="runout_max",
        help=f"definition {purpose} (default runout_max, as the paper)",
    )


def _add_report(commands):
    report = commands.add_parser(
        "report", help="one offline HTML page with CSV and JSON of every number beside it"
    )
    report.add_argument("directory", type=Path, metavar="DIR", help="output directory of a run")
    report.add_argument(
        "--output", type=Path, help="the HTML file (default DIR/report/report.html)"
    )
    _add_runout(report, "that figures and fits use")
    report.set_defaults(run=_report)


def _report(options) -> int:
    from .report import write_report  # matplotlib takes a second; --help should not

    print(write_report(options.directory, options.output, options.runout))
    return 0


def _add_fields(commands):
    fields = commands.add_parser(
        "fields",
        help="audit, export or compare the random fields, rebuilt from seed and id without the"
        " program",
    )
    fields.add_argument("directory", type=Path, metavar="DIR", help="output directory of a run")
    fields.add_argument(
        "--members", type=int, metavar="N", help="the first N of each study case (default 200)"
    )
    fields.add_argument(
        "--out", type=Path, metavar="DIR2", help="where the audit goes (default DIR/fields)"
    )
    fields.add_argument("--realization", type=int, metavar="I", help="the member to export")
    fields.add_argument("--study-case", metavar="LABEL", help="its case, where there are several")
    form = fields.add_mutually_exclusive_group()
    form.add_argument("--csv", type=Path, metavar="FILE", help="export x, y and values as CSV")
    form.add_argument("--h5", type=Path, metavar="FILE", help="export as `sgimp --write-fields`")
    form.add_argument(
        "--against",
        type=Path,
        metavar="FILE",
        help="compare with FILE.h5 of `sgimp --write-fields`, or with a directory of snapshots",
    )
    fields.add_argument(
        "--tolerance",
        type=float,
        default=1e-12,
        help="largest relative difference that --against accepts (default 1e-12)",
    )
    fields.set_defaults(run=_fields)


def _fields(options) -> int:
    from .field_report import run

    return run(options)


def _add_allocate(commands):
    allocate = commands.add_parser(
        "allocate", help="how many members and twins on coarser cells to run, from a pilot"
    )
    allocate.add_argument(
        "directory", type=Path, metavar="DIR", help="output directory of the pilot"
    )
    target = allocate.add_mutually_exclusive_group()
    target.add_argument(
        "--half-width", type=float, metavar="M", help="of the 95 %% interval of the mean, in m"
    )
    target.add_argument("--hours", type=float, metavar="H", help="core-hours of all cases together")
    _add_runout(allocate, "whose mean is meant")
    allocate.set_defaults(run=_allocate)


def _allocate(options) -> int:
    from .allocate import run

    return run(options)


def _add_merge(commands):
    merge = commands.add_parser(
        "merge", help="directories of disjoint members of one configuration become one"
    )
    merge.add_argument("directories", type=Path, nargs="+", metavar="DIR")
    merge.add_argument("--out", type=Path, required=True, help="the new directory")
    merge.set_defaults(run=_merge)


def _merge(options) -> int:
    from .merge import run

    return run(options)


def _add_fit(commands):
    fit = commands.add_parser(
        "fit", help="the law of the runout, how sure it is, and its quantiles with intervals"
    )
    fit.add_argument("directory", type=Path, metavar="DIR", help="output directory of a run")
    _add_runout(fit, "that is fitted")
    fit.add_argument("--case", metavar="LABEL", help="one case (default all with random fields)")
    fit.add_argument(
        "--bootstrap", type=int, default=1000, metavar="N", help="samples (default 1000)"
    )
    fit.set_defaults(run=_fit)


def _fit(options) -> int:
    from .fit_report import run

    return run(options)


def _add_diff(commands):
    diff = commands.add_parser(
        "diff", help="in which keys two runs differ, and whether their runouts do"
    )
    diff.add_argument("first", type=Path, metavar="A", help="output directory of a run")
    diff.add_argument("second", type=Path, metavar="B", help="of another one")
    diff.set_defaults(run=_diff)


def _diff(options) -> int:
    from .diff import run

    return run(options)


def _add_watch(commands):
    watch = commands.add_parser("watch", help="how far a sweep has come, until it ends")
    watch.add_argument("directory", type=Path, metavar="DIR", help="output directory of a run")
    _add_runout(watch, "that is shown")
    watch.add_argument(
        "--interval", type=float, default=5.0, metavar="S", help="seconds between looks (default 5)"
    )
    watch.add_argument("--once", action="store_true", help="one look")
    watch.set_defaults(run=_watch)


def _watch(options) -> int:
    from .watch import run

    return run(options)


def _add_export(commands):
    export = commands.add_parser(
        "export", help="snapshots for ParaView or as CSV, the ensemble as netCDF for xarray"
    )
    export.add_argument("directory", type=Path, metavar="DIR", help="output directory of a run")
    form = export.add_mutually_exclusive_group(required=True)
    form.add_argument(
        "--vtkhdf",
        dest="form",
        action="store_const",
        const="vtkhdf",
        help="snapshots, a file a member (ParaView 5.12, pyvista)",
    )
    form.add_argument(
        "--csv", dest="form", action="store_const", const="csv", help="snapshots, a file a step"
    )
    form.add_argument(
        "--netcdf",
        dest="form",
        action="store_const",
        const="netcdf",
        help="ensemble.h5 as ensemble.nc with the dimensions case, member and x",
    )
    export.add_argument("--members", metavar="IDS", help="these alone, as 1-20,417")
    export.add_argument("--study-case", metavar="LABEL", help="this one alone")
    export.add_argument(
        "--step", metavar="N", help="'first', 'last' or the number of one step (default all)"
    )
    export.add_argument(
        "--out", type=Path, metavar="DIR2", help="where the files go (default DIR/export)"
    )
    export.add_argument("--overwrite", action="store_true", help="replace files that are there")
    export.set_defaults(run=_export)


def _export(options) -> int:
    from .export import run

    return run(options)


def _add_casebook(commands):
    casebook = commands.add_parser(
        "casebook",
        help="members at the quantiles of the runout computed again, as animations and stills",
    )
    casebook.add_argument("directory", type=Path, metavar="DIR", help="output directory of a run")
    casebook.add_argument(
        "--study-case", metavar="LABEL", help="this one alone (default a handful of study cases)"
    )
    _add_runout(casebook, "whose quantiles are meant")
    casebook.add_argument(
        "--sgimp", metavar="PROGRAM", help="the program (default: the one built here, or on PATH)"
    )
    casebook.add_argument(
        "--frames", type=int, metavar="N", help="frames of an animation (default 40)"
    )
    casebook.add_argument(
        "--out", type=Path, metavar="DIR2", help="where all of it goes (default DIR/casebook)"
    )
    casebook.set_defaults(run=_casebook)


def _casebook(options) -> int:
    from .casebook import run

    return run(options)


def _add_paper(commands):
    paper = commands.add_parser(
        "paper", help="the paper of 2022 beside a run of input/paper/study.nml or baseline.nml"
    )
    paper.add_argument("directory", type=Path, metavar="DIR", help="output directory of a run")
    paper.add_argument(
        "--out", type=Path, metavar="DIR2", help="where the page goes (default DIR/paper)"
    )
    _add_runout(paper, "that verdicts, fits and tables use")
    paper.add_argument(
        "--sensitivity",
        type=Path,
        nargs="+",
        default=[],
        metavar="DIR",
        help="runs of the same seed with other keys, compared member by member",
    )
    paper.set_defaults(run=_paper)


def _paper(options) -> int:
    from .paper_report import run

    return run(options)
