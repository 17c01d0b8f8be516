"""docs/faults.md has a row for every fault that the tests try, in the script that tries it, and no others.

A test says what it has tried by tried("name"), or hands the name, the first argument, to a procedure that does."""

import ast
import pathlib
import re

from common import check

HERE = pathlib.Path(__file__).parent
TABLE = HERE.parents[1] / "docs" / "faults.md"
ROW = re.compile(r"^\| (?P<fault>[^|]+) \| [^|]+ \| (?P<script>\w+) \|$", re.MULTILINE)


def first_words(tree):
    """First arguments of calls that tell of a fault: of `tried`, and of procedures whose first argument goes there."""
    tellers = {"tried"}
    for item in ast.walk(tree):
        if isinstance(item, ast.FunctionDef) and item.args.args:
            for call in ast.walk(item):
                if isinstance(call, ast.Call) and getattr(call.func, "id", "") == "tried":
                    if getattr(call.args[0], "id", None) == item.args.args[0].arg:
                        tellers.add(item.name)
    calls = [call for call in ast.walk(tree) if isinstance(call, ast.Call) and getattr(call.func, "id", "") in tellers]
    for argument in (call.args[0] for call in calls):
        if isinstance(argument, ast.Constant):
            yield re.escape(argument.value)
        elif isinstance(argument, ast.JoinedStr):
            yield "".join(
                re.escape(part.value) if isinstance(part, ast.Constant) else r"[\w ]+" for part in argument.values
            )


rows = [match.groupdict() for match in ROW.finditer(TABLE.read_text())][1:]
patterns = {path.stem: set(first_words(ast.parse(path.read_text()))) for path in HERE.glob("*.py")}
for row in rows:
    check(row["script"] in patterns, f"{row['fault']}: there is no {row['script']}.py")
    found = any(re.fullmatch(pattern, row["fault"]) for pattern in patterns[row["script"]])
    check(found, f"{row['script']}.py does not try: {row['fault']}")
for script, tries in patterns.items():
    for pattern in tries:
        found = any(row["script"] == script and re.fullmatch(pattern, row["fault"]) for row in rows)
        check(found, f"no row of {TABLE.name} tells of {pattern} ({script}.py)")
check(len(rows) > 40, f"only {len(rows)} rows")
print(f"{len(rows)} faults")
