"""Counts of code that may only fall: lines of code, numbers that somebody chose, private names in tests."""

import ast
import re
import subprocess
from collections import Counter

from architecture import ROOT

EXACT, HALF = {0, 1, 2}, 0.5
"""Numbers that are not chosen; a half in an expression is arithmetic, too."""
OF_MEASURING = "tracker/simulate"
ALONE = re.compile(r'^[ \t]*"""(?:[^"]|"(?!""))*"""[ \t]*$|/\*.*?\*/', re.MULTILINE | re.DOTALL)
"""A docstring, or a comment of several lines."""
PRIVATE = re.compile(
    r"""(?<!\bself)\._(?!_|replace\b|asdict\b|make\b|fields\b|exit\b)\w+|attr\([\w.]+, ["']_(?!_)\w+|"""
    r"""^(?:from .* import .*|    )\b_(?!_)\w+(?:,|$)""",
    re.MULTILINE,
)
"""An attribute, a patched name and an import. Named tuples and `os` have public names that begin with an underscore."""
REASON = re.compile(r"^Numbers: \S", re.MULTILINE)
"""Line in the body of a commit: the principle or the measurement that its numbers come from."""


def code_lines(text, comment="#"):
    """Lines of a file without blanks, comments and docstrings; `comment` begins one, `//` in a script."""
    lines = map(str.strip, ALONE.sub("", text).split("\n"))
    return sum(bool(line) and not line.startswith(comment) for line in lines)


def numbers(tree):
    """Count the chosen numbers of a module: in its constants, in defaults, and floats in bodies."""
    found, seen = Counter(), set()
    for kind, node in _places(tree):
        for n in ast.walk(node):
            value = n.value if isinstance(n, ast.Constant) else None
            if not isinstance(value, int | float) or isinstance(value, bool) or n in seen:
                continue
            seen.add(n)
            is_exact = value in EXACT or (kind == "bodies" and (isinstance(value, int) or value == HALF))
            found[kind] += not is_exact
    return +found


def _places(tree):
    for statement in tree.body:
        if isinstance(statement, ast.Assign | ast.AnnAssign) and statement.value is not None:
            yield "constants", statement.value
    for node in ast.walk(tree):
        if isinstance(node, ast.ClassDef):
            yield from (("defaults", s.value) for s in node.body if isinstance(s, ast.AnnAssign) and s.value)
        elif isinstance(node, ast.FunctionDef | ast.AsyncFunctionDef):
            yield from (("defaults", d) for d in [*node.args.defaults, *node.args.kw_defaults] if d)
    yield "bodies", tree


def private_names(text):
    """Private names of others that a test uses."""
    return PRIVATE.findall(text)


def unexplained_rises(n_commits):
    """Commits among the newest that add numbers to the library and name no reason; None without their history.

    Only files whose changed lines hold digits are parsed.
    """
    log = git("log", f"--max-count={n_commits}", "--format=%H %P")
    if log is None:
        return None
    rises = {}
    for commit, *parents in map(str.split, log.splitlines()):
        if len(parents) == 1 and git("cat-file", "-e", f"{parents[0]}:tests/support/code_counts.py") is not None:
            rise = _rise(parents[0], commit)
            if rise > 0 and not REASON.search(git("log", "-1", "--format=%b", commit)):
                rises[git("log", "-1", "--format=%h %s", commit).strip()] = rise
    return rises


def _rise(parent, commit):
    """By how many numbers the library has more after a commit."""
    rise = 0
    for change in re.split(r"^diff --git ", git("diff", "-U0", "-M", parent, commit, "--", "tracker"), flags=re.M)[1:]:
        names = re.match(r"a/(\S+) b/(\S+)", change)
        if OF_MEASURING in names[2] or not re.search(r"^[-+](?![-+]).*\d", change, re.MULTILINE):
            continue
        for sign, at, name in ((-1, parent, names[1]), (1, commit, names[2])):
            text = git("show", f"{at}:{name}") if name.endswith(".py") else None
            rise += sign * numbers(ast.parse(text)).total() if text else 0
    return rise


def git(*words):
    """The output of a command of git; None if it fails."""
    done = subprocess.run(["git", "-C", ROOT, *words], capture_output=True, text=True)
    return None if done.returncode else done.stdout
