"""Errors of the library name no option of the command line; the command line and the page phrase each remedy."""

import ast
import re
import string
from pathlib import Path

from architecture import FILES, ROOT, nodes

from app.remedies import Phrases, command_line_text, page_text, phrases
from tracker.errors import Remedy, SessionError, TrackerError

OPTION = re.compile(r"(?<![\w-])--[a-z][a-z-]*")
OF_THE_COMMAND_LINE = ("app.cli", "app.bench", "app.main", "app.remedies")
OF_THE_START = {
    "app.server.access",  # options of `open`, checked before there is a page
    "app.server.address",
    "app.runtime.kernel_compiler",  # starts a process
}


def sentences(found):
    """Strings among the nodes of a module that are no docstrings; of f-strings the constant parts."""
    skipped = set()
    for node in found:
        body = getattr(node, "body", None)
        for statement in body if isinstance(body, list) else []:
            if isinstance(statement, ast.Expr) and isinstance(statement.value, ast.Constant):
                skipped.add(id(statement.value))
    return [
        node.value
        for node in found
        if isinstance(node, ast.Constant) and isinstance(node.value, str) and id(node) not in skipped
    ]


def options_in(name):
    return [option for text in sentences(nodes()[name]) for option in OPTION.findall(text)]


def remedies():
    """Code and names of fields of each remedy that the program makes, with the module."""
    found = []
    for name, of_module in nodes().items():
        for node in of_module:
            if isinstance(node, ast.Call) and isinstance(node.func, ast.Name) and node.func.id == "Remedy":
                (code,) = node.args
                assert isinstance(code, ast.Constant), f"{name}: the code of a remedy is written where it is made"
                found.append((code.value, {k.arg for k in node.keywords}, name))
    return found


def test_the_scan_sees_options():
    text = '"""Docs --a."""\ndef f(x):\n    """--b"""\n    raise E(f"say --camera {x}=PATH, c--y", R("c", o="--o"))\n'
    assert [o for t in sentences([*ast.walk(ast.parse(text))]) for o in OPTION.findall(t)] == ["--camera", "--o"]


def test_no_text_that_can_reach_the_page_names_an_option():
    names = [n for n in FILES if not n.startswith(OF_THE_COMMAND_LINE) and n not in OF_THE_START]
    assert {name: found for name in names if (found := options_in(name))} == {}


def test_no_text_of_the_page_names_an_option():
    for path in (ROOT / "static").rglob("*.html"):
        html = re.sub(r"<!--.*?-->", "", path.read_text("utf-8"), flags=re.DOTALL)
        assert OPTION.findall(html) == [], path.name
    assert [p.page for p in phrases().values() if OPTION.search(p.page)] == []


def test_every_remedy_has_phrases_for_its_fields():
    made = remedies()
    assert {code for code, _, _ in made} == phrases().keys()
    for code, fields, name in made:
        for phrase in phrases()[code]:
            asked = {field for _, field, _, _ in string.Formatter().parse(phrase) if field}
            assert asked <= fields, f"{name}: {code}"


def test_each_phrase_ends_a_sentence():
    for code, pair in phrases().items():
        assert isinstance(pair, Phrases)
        for phrase in pair:
            assert phrase[0].islower(), code
            assert phrase[-1] not in ".;", code


def test_a_remedy_is_phrased_for_either():
    error = SessionError("expected a figure, found none", Remedy("another_frame", condition="all stand apart"))
    assert command_line_text(error) == "expected a figure, found none; choose another --frame, on which all stand apart"
    assert page_text(error) == "expected a figure, found none; go to another frame, on which all stand apart"
    assert page_text(TrackerError("expected a, found b; correct it")) == "expected a, found b; correct it"
    assert page_text(ValueError("a fault")) == "a fault"


def test_remedies_are_values():
    assert Remedy("relink", session=Path("a")) == Remedy("relink", session=Path("a")) != Remedy("relink")
    assert repr(Remedy("another_frame", condition="b")) == "Remedy('another_frame', condition='b')"
    assert len({Remedy("a"), Remedy("a"), Remedy("b")}) == 2
