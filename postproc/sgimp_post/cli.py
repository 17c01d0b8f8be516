"""The command line `sgimp-post`."""

from __future__ import annotations

import argparse
import sys
from pathlib import Path

from . import __version__
from .ensemble import RUNOUTS
from .errors import PostError


def main(arguments=None) -> int:
    """Exit codes: 0, or 2 for bad input."""
    parser = argparse.ArgumentParser(prog="sgimp-post", description=__doc__.splitlines()[0])
    parser.add_argument("--version", action="version", version=f"sgimp-post {__version__}")
    commands = parser.add_subparsers(dest="command", required=True)
    report = commands.add_parser(
        "report", help="one offline HTML page with CSV and JSON of every number beside it"
    )
    report.add_argument("directory", type=Path, metavar="DIR", help="output directory of a run")
    report.add_argument(
        "--output", type=Path, help="the HTML file (default DIR/report/report.html)"
    )
    report.add_argument(
        "--runout",
        choices=list(RUNOUTS),
        default="runout_max",
        help="definition that figures and fits use (default runout_max, as the paper)",
    )
    options = parser.parse_args(arguments)
    from .report import write_report  # matplotlib takes a second; --help should not

    try:
        path = write_report(options.directory, options.output, options.runout)
    except PostError as error:
        print(f"sgimp-post: {error}", file=sys.stderr)
        return 2
    print(path)
    return 0
