"""Count the constants of the library, and the sentences of its prose that hide their subject: both may only fall."""

import ast
import re
from collections import Counter

import pytest
from architecture import FILES, nodes, trees

MAX_CONSTANTS, MAX_UNDOCUMENTED = 578, 0
"""Present numbers; calibration added 80, imported observations 30. Each constant has its unit, and its source or the
benchmark that fixed it; CONTRIBUTING.md names the benchmarks."""
MAX_HIDDEN_SUBJECTS = 25
HIDDEN_SUBJECT = re.compile(r"(?:^|(?<=[.!?:])\s+)(?:What|Where|Who|Whose|Those|Nor)\b")
COMMENT = re.compile(r"(?:^|[ \t])#.*", re.MULTILINE)
"""A comment, or what looks like one within a string: the tokenizer takes as long as all other checks together."""
NAME = re.compile(r"_?[A-Z][A-Z0-9_]*")
OF_EXPERIMENTS = ("tracker.simulate", "tracker.simulate.experiments")
LIBRARY = sorted(name for name in FILES if name.split(".")[0] == "tracker")


def numbers_in(node):
    """Numbers that are written in an expression."""
    found = (n.value for n in ast.walk(node) if isinstance(n, ast.Constant))
    return [v for v in found if isinstance(v, int | float) and not isinstance(v, bool)]


def constants(tree):
    """Names of the numeric constants of a module, and whether a docstring follows each."""
    for node, after in zip(tree.body, [*tree.body[1:], None], strict=True):
        if not isinstance(node, ast.Assign | ast.AnnAssign) or node.value is None or not numbers_in(node.value):
            continue
        targets = node.targets if isinstance(node, ast.Assign) else [node.target]
        names = [n.id for target in targets for n in ast.walk(target) if isinstance(n, ast.Name)]
        is_documented = isinstance(after, ast.Expr) and isinstance(after.value, ast.Constant)
        yield from ((name, is_documented) for name in names if NAME.fullmatch(name))


def prose(text, found=None):
    """Paragraphs of the docstrings and of the comments of a module, given as text and the nodes of its syntax tree."""
    for node in found or ast.walk(ast.parse(text)):
        body = getattr(node, "body", None)
        for statement in body if isinstance(body, list) else []:
            if isinstance(statement, ast.Expr) and isinstance(statement.value, ast.Constant):
                value = statement.value.value
                yield from re.split(r"\n\s*\n|\n\s*(?=\w+: )", value) if isinstance(value, str) else ()
    yield from (comment.lstrip("# ") for comment in COMMENT.findall(text))


@pytest.mark.parametrize(
    ("text", "found"),
    [
        ("_A, _B = 1, 2.0\n'''Both.'''\nC = 'x'\nd = 3", [("_A", True), ("_B", True)]),
        ("A: int = 3", [("A", False)]),
        ("A = f(0.5)\nB = np.radians([1, 2])", [("A", False), ("B", False)]),
    ],
)
def test_the_count_sees_constants(text, found):
    assert [*constants(ast.parse(text))] == found


def test_the_count_sees_sentences():
    text = (
        "'''Where it is. Nobody knows what.\n\nArgs:\n    a: of it. What it raises.\n'''\n# Those of\n# the others.\n"
    )
    assert sum(len(HIDDEN_SUBJECT.findall(" ".join(p.split()))) for p in prose(text)) == 3


def test_constants_do_not_become_more():
    found = {name: [*constants(trees()[name])] for name in LIBRARY if not name.startswith(OF_EXPERIMENTS)}
    by_room = Counter({name: len(of_module) for name, of_module in found.items()})
    assert by_room.total() <= MAX_CONSTANTS, by_room.most_common(20)
    assert sum(not is_documented for of_module in found.values() for _, is_documented in of_module) <= MAX_UNDOCUMENTED


def test_sentences_begin_with_their_subject():
    found = {
        name: [
            p
            for p in map(str.split, prose(FILES[name].read_text("utf-8"), nodes()[name]))
            if HIDDEN_SUBJECT.search(" ".join(p))
        ]
        for name in LIBRARY
    }
    assert sum(map(len, found.values())) <= MAX_HIDDEN_SUBJECTS, {k: v for k, v in found.items() if v}
