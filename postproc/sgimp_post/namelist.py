"""Reads `resolved.nml`: Fortran namelists as the program writes them, nothing more general. (f90nml
would do, but Debian has no package of it, and the post-processor runs with Debian's own.)"""

from __future__ import annotations

import re

from .ensemble import FILE_NAME
from .errors import PostError

_TOKEN = re.compile(
    r"""\s*(?:(?P<comment>![^\n]*)|(?P<text>'(?:[^']|'')*'|"(?:[^"]|"")*")"""
    r"""|(?P<mark>[&/=,])|(?P<word>[^\s&/=,'"!]+))"""
)
_LOGICALS = {".true.": True, "t": True, ".false.": False, "f": False}


def resolved_text(ensemble):
    """The resolved namelist of a run, of DIR/resolved.nml or else of the results file, and where it
    stands. PostError if the file cannot be read."""
    path = ensemble.directory / "resolved.nml"
    try:
        return path.read_text(encoding="utf-8"), str(path)
    except FileNotFoundError:
        text = ensemble.attributes.get("resolved_namelist", "")
        return str(text), f"{ensemble.directory / FILE_NAME}: resolved_namelist"
    except (OSError, UnicodeDecodeError) as cause:
        raise PostError(f"{path}: cannot be read ({cause})") from cause


def by_key(groups: list) -> dict:
    """Values by `group(k)%key`, k counting the groups of a name: as the program names keys in the
    text of what its results depend on."""
    found, seen = {}, {}
    for group, keys in groups:
        seen[group] = seen.get(group, 0) + 1
        found.update({f"{group}({seen[group]})%{key}": value for key, value in keys.items()})
    return found


def identity_by_key(text: str) -> dict:
    """The same of that text, values as they stand there. Equal keys of texts of earlier versions by
    their number among the same lines."""
    found, seen = {}, {}
    for line in filter(None, (line.strip() for line in text.splitlines())):
        key, _, value = line.partition(" = ")
        seen[key] = seen.get(key, 0) + 1
        found[key if seen[key] == 1 else f"{key} ({seen[key]})"] = value
    return found


def differing_keys(first: dict, second: dict) -> list:
    """(key, value in the first, in the second) where they differ; `(not set)` for what is not
    there."""
    nothing = "(not set)"
    pairs = (
        (key, first.get(key, nothing), second.get(key, nothing)) for key in {**first, **second}
    )
    return [(key, one, two) for key, one, two in pairs if one != two]


def read_namelist(text: str, name: str = "resolved.nml") -> list:
    """[(group, {key: value})] in the order of the file; names in lower case, a value a number, a
    word, a truth value, or a list of them. PostError, naming the file, on anything else."""
    tokens = _tokens(text, name)
    groups, k = [], 0
    while k < len(tokens):
        if tokens[k] != ("mark", "&") or k + 1 == len(tokens):
            raise PostError(f"{name}: '&' and a name expected at '{tokens[k][1]}'")
        keys, k = _read_group(tokens, k + 2, name)
        groups.append((keys.pop(None), keys))
    return groups


def _read_group(tokens, k, name):
    """The keys of the group whose name is token k - 1, and the token behind its slash."""
    keys = {None: tokens[k - 1][1].lower()}
    key, values = None, []
    while k < len(tokens) and tokens[k] != ("mark", "/"):
        if k + 1 < len(tokens) and tokens[k][0] == "word" and tokens[k + 1] == ("mark", "="):
            key, values = tokens[k][1].lower(), []
            keys[key] = values
            k += 2
            continue
        if tokens[k] != ("mark", ","):
            if key is None or tokens[k][0] == "mark":
                raise PostError(f"{name}: &{keys[None]}: '{tokens[k][1]}' is out of place")
            values.append(_value(*tokens[k]))
        k += 1
    if k == len(tokens):
        raise PostError(f"{name}: &{keys[None]} has no end")
    return {key: _single(values) for key, values in keys.items()}, k + 1


def _single(values):
    return values[0] if isinstance(values, list) and len(values) == 1 else values


def _tokens(text, name):
    found, at = [], 0
    text = text.rstrip("\x00 \n\t\r")
    while at < len(text):
        match = _TOKEN.match(text, at)
        if not match:
            raise PostError(f"{name}: cannot be read at '{text[at : at + 20]}'")
        at = match.end()
        if match.lastgroup != "comment":
            found.append((match.lastgroup, match[match.lastgroup]))
    return found


def _value(kind, token):
    if kind == "text":
        return token[1:-1].replace(2 * token[0], token[0])
    if token.lower() in _LOGICALS:
        return _LOGICALS[token.lower()]
    for convert in (int, lambda word: float(word.lower().replace("d", "e"))):
        try:
            return convert(token)
        except ValueError:
            pass
    return token
