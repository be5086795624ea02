"""The documents build as a site without a warning, and the site asks no other machine for anything."""

import importlib.util
import os
import re
import subprocess
import sys
from pathlib import Path

import pytest
import yaml

import quadrille

pytestmark = pytest.mark.slow
ROOT = Path(__file__).resolve().parents[2]
LOADED = re.compile(
    r"<(?:script|img|iframe)\b[^>]*\bsrc=\"?(https?:[^\"\s>]+)|<link\b[^>]*\bhref=\"?(https?:[^\"\s>]+)"
)


@pytest.fixture(scope="module")
def site(tmp_path_factory):
    if importlib.util.find_spec("zensical") is None:
        message = "expected the extra 'docs' to be installed: pip install '.[docs]'"
        if os.environ.get("CI") == "true":
            pytest.fail(message)
        pytest.skip(message)
    out = tmp_path_factory.mktemp("site") / "out"
    words = [sys.executable, str(ROOT / "docs" / "site" / "build.py"), str(out)]
    done = subprocess.run(words, cwd=ROOT, capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stdout + done.stderr
    return out


def places(entries):
    for entry in entries:
        for place in entry.values():
            yield from [place] if isinstance(place, str) else places(place)


def test_each_document_is_a_page(site):
    nav = yaml.load((ROOT / "mkdocs.yml").read_text("utf-8"), yaml.BaseLoader)["nav"]
    missing = [place for place in places(nav) if not (site / place.replace(".md", ".html")).is_file()]
    assert missing == []


def test_the_reference_has_each_name_of_the_library(site):
    text = (site / "reference.html").read_text("utf-8")
    assert [name for name in quadrille.__all__ if f'id="quadrille.{name}"' not in text] == []
    assert "SessionError" in text  # the errors that a function raises


def test_no_page_loads_from_another_machine(site):
    loaded = {found for page in site.rglob("*.html") for found in LOADED.findall(page.read_text("utf-8"))}
    assert {a or b for a, b in loaded} == set()
