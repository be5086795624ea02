"""Tables that benchmarks write into the documents: each place has its benchmark, and only the place is replaced."""

import ast
import importlib.util
import re

import pytest
from architecture import ROOT

BENCHMARKS = ROOT / "tests" / "benchmarks"
DOCUMENTS = sorted((ROOT / "docs").rglob("*.md"))
PLACE = re.compile(r"^<!-- table: (.+) -->$", re.MULTILINE)
DOCUMENT = "# A\n\n<!-- table: a -->\n\nold\n\n<!-- end -->\n\nbetween\n\n<!-- table: a b -->\n<!-- end -->\n\nlast\n"

spec = importlib.util.spec_from_file_location("doc_tables", BENCHMARKS / "doc_tables.py")
doc_tables = importlib.util.module_from_spec(spec)
spec.loader.exec_module(doc_tables)


def declared(path):
    """Names of the tables that a benchmark states in `TABLES`."""
    for node in ast.parse(path.read_text("utf-8")).body:
        if isinstance(node, ast.Assign) and any(isinstance(t, ast.Name) and t.id == "TABLES" for t in node.targets):
            return ast.literal_eval(node.value)
    return ()


def test_each_table_has_a_benchmark_and_each_benchmark_a_place():
    places = [name for page in DOCUMENTS for name in PLACE.findall(page.read_text("utf-8"))]
    names = {name: path.stem for path in BENCHMARKS.glob("*.py") for name in declared(path)}
    assert len(names) > 10
    assert {name: stem for name, stem in names.items() if name.split()[0] != stem} == {}
    assert sorted(places) == sorted(names)


@pytest.mark.parametrize("page", DOCUMENTS, ids=lambda p: p.relative_to(ROOT).as_posix())
def test_each_place_states_conditions_and_tree(page):
    text = page.read_text("utf-8")
    for name in PLACE.findall(text):
        doc_tables.document_of([page], name)
        block = text.split(f"<!-- table: {name} -->\n", 1)[1].split(doc_tables.END, 1)[0]
        paragraph, rows = re.split(r"\n\n(?=\|)", block.strip(), maxsplit=1)
        command = re.search(r"tests/benchmarks/(\w+)\.py", paragraph)
        assert command is not None, name
        assert command[1] == name.split()[0]
        assert re.search(r"tree `[0-9a-f]{8}`", paragraph.replace("\n", " ")), name
        assert all(line.startswith("|") for line in rows.splitlines()), name


def test_a_table_replaces_exactly_its_place():
    once = doc_tables.with_table(DOCUMENT, "a", "| new |\n")
    assert once == DOCUMENT.replace("old", "| new |")
    both = doc_tables.with_table(once, "a b", "| b |")
    assert both == once.replace("b -->\n<!-- end", "b -->\n\n| b |\n\n<!-- end")
    assert doc_tables.with_table(both, "a", "| new |") == both


@pytest.mark.parametrize(
    ("document", "message"),
    [
        ("text\n", "expected one line '<!-- table: a -->', found 0; put it"),
        (DOCUMENT + DOCUMENT, "expected one line '<!-- table: a -->', found 2; put it"),
        ("<!-- table: a -->\n", "expected a line '<!-- end -->' after '<!-- table: a -->', found none"),
        ("<!-- table: a -->\n<!-- table: b -->\n<!-- end -->\n", "expected a line '<!-- end -->' after"),
    ],
)
def test_a_place_that_is_missing_or_double_is_refused(document, message):
    with pytest.raises(SystemExit, match=re.escape(message)):
        doc_tables.with_table(document, "a", "| new |")


def test_a_table_is_written_into_the_document_that_has_its_place(tmp_path, capsys):
    first, second = tmp_path / "first.md", tmp_path / "second.md"
    first.write_text("# Other\n", "utf-8")
    second.write_text(DOCUMENT, "utf-8")
    conditions = doc_tables.Conditions("f", "b", "s", "d", "none", "python tests/benchmarks/a.py --write docs/a.md")
    doc_tables.check_places([first, second], ["a", "a b"])
    doc_tables.show([first, second], "a", conditions, doc_tables.table(["mm"], {"walk": ["1"]}, "recording"))
    assert first.read_text("utf-8") == "# Other\n"
    text = second.read_text("utf-8")
    assert "*Settings chosen on this footage:* none." in text
    assert "| recording | mm |\n|---|---|\n| walk | 1 |\n\n<!-- end -->\n\nbetween" in text
    assert "| walk | 1 |" in capsys.readouterr().out
    with pytest.raises(SystemExit, match="found it in 0; name the right documents"):
        doc_tables.check_places([first], ["a"])
