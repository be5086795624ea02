"""Nothing that a file holds reaches the terminal as a sequence that it obeys."""

import json

import pytest
from command_line import SAMPLE

from app.runtime.plain_output import printable
from app.runtime.progress import Reporter
from tracker.errors import TrackerError

ODD = "a\x1b]0;title\x07\x9b2J\u202eb\u2066\x7f"
PLAIN = r"a\u001b]0;title\u0007\u009b2J\u202eb\u2066\u007f"


def test_control_and_direction_characters_are_shown_as_in_json():
    assert printable(f"{ODD}\n\tend") == f"{PLAIN}\n\tend"
    assert json.loads(f'"{printable(ODD)}"') == ODD
    assert printable("Büro 正面 👩‍🔬") == "Büro 正面 👩‍🔬"


def test_lines_of_progress(capsys):
    reporter = Reporter()
    reporter.say(f"camera {ODD} [bold]")
    with reporter.over(1, ODD) as tick:
        tick()
    err = capsys.readouterr().err
    assert f"camera {PLAIN} [bold]" in err.replace("\n", "")
    assert not set(err) & set(ODD) - set("a]0;titleJ2b")


@pytest.mark.parametrize("option", [(), ("--json",)])
def test_the_output_of_commands(run, monkeypatch, option):
    monkeypatch.setattr("app.cli.info.summarize", lambda *_: {"name": ODD, "cameras": []})
    monkeypatch.setattr("app.cli.info._format", lambda found: found["name"])
    status, out, _ = run("info", SAMPLE, "--no-check", *option)
    assert (status, out.count(PLAIN)) == (0, 1)
    assert "\x1b" not in out
    assert not option or json.loads(out)["name"] == ODD


def test_errors(run, monkeypatch):
    def failing(*_):
        raise TrackerError(f"expected a name, found {ODD}")

    monkeypatch.setattr("app.cli.info.summarize", failing)
    status, _, err = run("info", SAMPLE, "--no-check")
    assert status == 1
    assert PLAIN in err
    assert not set(err) & {"\x1b", "\x9b", "\u202e", "\x07"}
