"""The table of a batch as one HTML file, which sorts by a click."""

import html
from pathlib import Path
from typing import Any

from tracker.files import write_text_atomic

_STYLE = """
:root { color-scheme: light dark; }
body { font: 15px/1.5 system-ui, sans-serif; max-width: 80rem; margin: 2rem auto; padding: 0 1rem; }
table { border-collapse: collapse; width: 100%; }
th, td { padding: .3rem 1rem .3rem 0; text-align: left; border-bottom: 1px solid #8884; vertical-align: top; }
.number { text-align: right; font-variant-numeric: tabular-nums; }
th { cursor: pointer; } th:focus-visible { outline: 2px solid #2a7de1; }
.failed { color: #d22; } .alarm { color: #b36b00; }
code { user-select: all; font-size: 13px; }
"""
_SCRIPT = """
for (const [column, head] of document.querySelectorAll("th").entries()) {
  const sort = () => {
    const body = document.querySelector("tbody");
    const down = head.ariaSort !== "descending";
    const key = (row) => row.cells[column].dataset.key ?? row.cells[column].textContent;
    const rows = [...body.rows].sort((a, b) => key(a).localeCompare(key(b), undefined, { numeric: true }));
    for (const other of document.querySelectorAll("th")) other.ariaSort = "none";
    head.ariaSort = down ? "descending" : "ascending";
    body.append(...(down ? rows.reverse() : rows));
  };
  head.tabIndex = 0;
  head.addEventListener("click", sort);
  head.addEventListener("keydown", (event) => { if (event.key === "Enter") sort(); });
}
"""
_HEADS = ("Recording", "State", "Expected error, mm", "Doubted", "Verified", "Seconds", "Open at its worst frame")


def write_batch_report(found: dict[str, Any], path: Path) -> None:
    """Write the results of a batch.

    Args:
        found: the results, as `quadrille batch --json` prints them.
        path: the file; it appears complete or not at all.
    """
    sums = found["totals"]
    counts = ", ".join(f"{sums[s]} {s}" for s in ("done", "failed", "running", "waiting") if sums[s])
    summary = (
        f"{counts}; {sums['hours']:.2f} hours of workers, {sums['cpu_hours']:.2f} hours of processor time; "
        f"{100 * sums['share_verified']:.0f}% of {sums['poses']} poses verified."
    )
    head = "".join(f"<th>{html.escape(text)}</th>" for text in _HEADS)
    rows = "".join(map(_row, found["recordings"]))
    title = html.escape(Path(found["folder"]).name)
    write_text_atomic(
        path,
        f'<!doctype html><html lang="en"><meta charset="utf-8"><title>{title}</title><style>{_STYLE}</style>'
        f"<body><h1>{title}</h1><p>{summary}</p><table><thead><tr>{head}</tr></thead><tbody>{rows}</tbody></table>"
        f"<script>{_SCRIPT}</script></body></html>",
    )


def _row(row: dict[str, Any]) -> str:
    notes = [f'<br><span class="failed">{html.escape(row["error"])}</span>'] if row["error"] else []
    notes += [f'<br><span class="alarm">{html.escape(row["contradiction"])}</span>'] if row["contradiction"] else []
    notes += [f"<br>{html.escape(row[key])}" for key in ("joined", "earlier") if row[key]]
    error = row["expected_error_mm"]
    posed = row["poses"] > 0
    cells = [
        f"<td>{html.escape(row['name'])}{''.join(notes)}</td>",
        f"<td{' class=failed' if row['state'] == 'failed' else ''}>{row['state']}</td>",
        _number("" if error is None else f"{error:.1f}", error),
        _number(f"{100 * row['share_doubted']:.0f}%" if posed else "", row["share_doubted"]),
        _number(f"{row['verified']}/{row['poses']}" if posed else "", row["verified"]),
        _number(f"{row['seconds']:.0f}", row["seconds"]),
        f"<td><code>{html.escape(row['open'])}</code></td>",
    ]
    return f"<tr>{''.join(cells)}</tr>"


def _number(text: str, key: float | None) -> str:
    return f'<td class="number" data-key="{-1 if key is None else f"{key:.6f}"}">{text}</td>'
