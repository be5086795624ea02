"""A tracker that is one descriptor: the chain drives it, and help, options and the page's controls come from it."""

import shutil
from dataclasses import dataclass, replace
from types import SimpleNamespace
from typing import ClassVar

import pytest
import tyro
from command_line import SAMPLE
from fake_tracker import STEP_M, Walker
from stored_motions import put_poses

from app.cli.track import arguments_class, settings_of
from app.control.tracking import track_settings
from app.page.feeds.inspector import methods
from app.state.run_choices import RunChoices
from tracker.errors import TrackerError
from tracker.estimation.by_frame.options import WHOLE_RUN
from tracker.estimation.chamfer.settings import TrackSettings
from tracker.estimation.tracking.method import Method, Option, PaperMode
from tracker.evidence.observer import Observer
from tracker.footage.recording import Recording
from tracker.pipeline.automatic_run import ChainPlan, StoredSession, find_and_track
from tracker.pipeline.methods import METHODS, all_options
from tracker.pipeline.stored_run import TrackPlan
from tracker.session.session import load_session
from tracker.session.store.annotation_store import AnnotationStore


@dataclass(frozen=True)
class SonarSettings:
    """Settings of a made-up method."""

    method: ClassVar[str] = "sonar"
    pings: int = 3
    whole_run: bool = False


PINGS = Option(
    "pings", "Pings", "number of pings a frame", "3 by default", "whole", lambda s: s.pings,
    lambda s, value: replace(s, pings=value), limits=(1, 9),
)  # fmt: skip
SONAR = Method(
    "sonar", "Sonar", "echoes from the people", SonarSettings, Walker, (PINGS, WHOLE_RUN),
    PaperMode("Dolphin 1952", lambda: SonarSettings(9)),
)  # fmt: skip


@pytest.fixture
def sonar(monkeypatch):
    monkeypatch.setitem(METHODS, "sonar", SONAR)


def test_the_chain_drives_it(sonar, tmp_path):
    session = load_session(shutil.copytree(SAMPLE, tmp_path / "session"))
    session.annotations_path.unlink(missing_ok=True)
    sink = SimpleNamespace(report=lambda stage, share, text="": None, take=lambda run, step: None)
    with AnnotationStore(session.annotations_path) as store, Recording(session.cameras) as recording:
        values = session.people[0].model.neutral()
        put_poses(store, session.people[0], {2: values})
        plan = TrackPlan(range(5), (0,), SonarSettings())
        find_and_track(ChainPlan(plan), StoredSession(session, store, Observer(session.cameras, recording)), sink)
        assert [row.frame for row in store.frames("person")] == [0, 1, 2, 3, 4]
        record = store.pose("person", 4)
        assert record.settings["method"] == "sonar"
        assert record.values[0] == pytest.approx(values[0] + 3 * STEP_M)


def test_help_and_options_of_the_command_line_have_it(sonar, capsys):
    kind = arguments_class()
    with pytest.raises(SystemExit):
        tyro.cli(kind, args=["--help"])
    text = " ".join(capsys.readouterr().out.replace("│", " ").split())
    for words in (
        "{chamfer,contour,voxel,sonar}", "sonar: echoes from the people.", "--pings N",
        "sonar: number of pings a frame; 3 by default.", "sonar as Dolphin 1952",
    ):  # fmt: skip
        assert words in text
    assert settings_of(tyro.cli(kind, args=["s", "--method", "sonar", "--pings", "5"])) == SonarSettings(5)
    assert settings_of(tyro.cli(kind, args=["s", "--method", "sonar", "--paper"])) == SonarSettings(9)
    for words, expected in (
        (["--pings", "5"], "options of the method 'chamfer', found --pings"),
        (["--method", "sonar", "--pings", "12"], "a whole number from 1 to 9 as 'pings', found 12"),
        (["--method", "sonar", "--order", "2"], "options of the method 'sonar', found --order"),
    ):
        with pytest.raises(TrackerError, match=expected):
            settings_of(tyro.cli(kind, args=["s", *words]))


def test_the_page_gets_its_controls_and_runs_it(sonar):
    shown = methods()[-1]
    assert (shown.name, shown.label, shown.help) == ("sonar", "Sonar", "Echoes from the people")
    pings, whole_run = shown.options
    assert (pings.label, pings.kind, pings.limits, pings.default) == ("Pings", "whole", (1, 9), 3)
    assert whole_run.name == "whole_run"
    choices = track_settings.with_choices(RunChoices(), {"method": "sonar", "options": {"pings": 4}}, ["FRONT"])
    assert track_settings.of_run(TrackSettings(), choices) == SonarSettings(4)
    assert track_settings.restored(track_settings.stored(choices), ["FRONT"]) == choices


def test_descriptors_agree_with_the_settings_that_they_describe():
    for name, method in METHODS.items():
        assert method.name == method.settings().method == name
        for settings in (method.settings(), method.paper.settings()):
            assert method.make_tracker(settings).settings == settings
            for option in method.options:
                value = option.read(settings)
                assert value is None or option.write(settings, option.check(value)) == settings
                assert all_options()[option.name] is option  # methods share it
        for option in method.options:
            is_on = option.read(method.settings()) is True
            assert is_on or option.kind != "switch"  # the command line can only switch it off
