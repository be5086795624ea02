"""The library for other programs is stable: a change of a name, an argument or a field is made on purpose."""

import dataclasses
import inspect
from pathlib import Path

import quadrille
from tracker.api.results import PoseSeries
from tracker.api.work import Found, Tracked
from tracker.estimation.acquisition.from_contours import Acquisition
from tracker.evaluation.judging.judge import Judgement
from tracker.evaluation.metric import ComparedJoints, Metric
from tracker.evaluation.metrics import Evaluation
from tracker.interchange.exports.formats import ExportFormat
from tracker.session.session import Session

SURFACE = Path(__file__).with_name("surface.txt")
RESULTS = (
    Acquisition, ComparedJoints, Evaluation, ExportFormat, Found, Judgement, Metric, PoseSeries, Session, Tracked,
)  # fmt: skip


def arguments(function):
    """Arguments with their defaults; annotations are printed otherwise by each version of Python."""
    found = inspect.signature(function)
    bare = [p.replace(annotation=inspect.Parameter.empty) for p in found.parameters.values()]
    return found.replace(parameters=bare, return_annotation=inspect.Signature.empty)


def surface():
    """Name and arguments of each public function, and the fields of what they take and return."""
    lines = []
    for name in sorted(quadrille.__all__):
        found = getattr(quadrille, name)
        lines.append(f"quadrille.{name}{arguments(found) if inspect.isfunction(found) else ''}")
    for kind in RESULTS:
        names = kind._fields if issubclass(kind, tuple) else [f.name for f in dataclasses.fields(kind)]
        lines += [f"{kind.__name__}.{name}" for name in names]
        methods = inspect.getmembers(kind, inspect.isfunction)
        own = [
            (name, f) for name, f in methods if not name.startswith("_") and f.__qualname__.startswith(kind.__name__)
        ]
        lines += [f"{kind.__name__}.{name}{arguments(f)}" for name, f in own]
    return "\n".join(lines) + "\n"


def test_the_surface_is_as_written_down():
    """After a change on purpose: write `surface()` to the file, and an entry to CHANGELOG.md."""
    assert surface() == SURFACE.read_text("utf-8")


def test_a_name_that_is_not_there_is_refused_as_usual():
    assert not hasattr(quadrille, "tracks")
    assert dir(quadrille) == sorted(quadrille.__all__)
