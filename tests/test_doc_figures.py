"""Figures of several documents are those of the recordings' table of docs/log/accuracy.md, where they are kept."""

import re

import numpy as np
from architecture import ROOT

KEPT_IN, ALL_ROWS = "docs/log/accuracy.md", "docs/measurements.md"


def tables(page):
    """Tables of a document in order: for each the cells of its rows, without marks of code."""
    found, table = [], []
    for line in [*(ROOT / page).read_text("utf-8").splitlines(), ""]:
        if line.startswith("|"):
            table.append([cell.strip().replace("`", "") for cell in line.strip("|").split("|")])
        elif table:
            found.append((table[0], table[2:]))
            table = []
    return found


def table_with(page, *heads):
    """The only table of a document whose header has these cells; rows by their first cell, cells by their column."""
    (found,) = [(header, rows) for header, rows in tables(page) if set(heads) <= set(header)]
    header, rows = found
    return [dict(zip(header, row, strict=True)) | {"": row} for row in rows]


def numbers(text):
    return re.findall(r"\d+(?:\.\d+)?", text)


def kept():
    """Errors, mm, and lost frames by recording, by height alone and with the acquired body, of people in order."""
    head = ["recording", "frames", "by height alone", "lost", "acquired body", "lost"]
    (rows,) = [rows for header, rows in tables(KEPT_IN) if header == head]
    return {row[0].split(":")[0]: [numbers(cell) for cell in row[2:]] for row in rows if ":" in row[0] and row[4]}


def test_the_table_is_found():
    assert kept().keys() == {"walk", "balance_real", "fast_arms", "two_people"}
    assert all(len(cells) == 4 for cells in kept().values())
    assert len(kept()["two_people"][0]) == 2


def test_the_readme_shows_the_same_figures():
    rows = {r["recording"].split(":")[0]: r for r in table_with("README.md", "by height alone", "lost frames")}
    for name, (alone, alone_lost, acquired, acquired_lost) in kept().items():
        assert numbers(rows[name]["by height alone"]) == alone, name
        assert numbers(rows[name]["acquired body"]) == acquired, name
        assert numbers(rows[name]["lost frames"]) == alone_lost + acquired_lost, name


def test_starts_from_the_reference_show_the_same_figures():
    rows = table_with(KEPT_IN, "from nothing", "from the reference joints")
    for row in rows:
        name, _, which = row["recording"].partition(", ")
        person = 1 if which == "woman" else 0
        wanted = [kept()[name][2][person], kept()[name][3][person]]
        assert numbers(row["from the reference joints"]) == wanted, row["recording"]
    assert len(rows) == 5


def test_means_of_simulated_people_are_those_of_their_rows():
    text = (ROOT / KEPT_IN).read_text("utf-8")
    acquired = table_with(ALL_ROWS, "person", "height off", "cost, px")[:10]
    found = table_with(ALL_ROWS, "person", "frames called good")[:10]
    assert acquired[9]["person"] == found[9]["person"] == "broad man"
    before, after = np.mean([[float(x) for x in r["error, mm"].split(" → ")] for r in acquired], axis=0)
    assert f"mean error is {before:.1f} mm by height alone and {after:.1f} mm after" in text
    assert f"it is {np.mean([float(r['error, mm']) for r in found]):.1f} mm, no frame is lost" in text
    assert all(r["lost frames"] == "0" for r in found)
