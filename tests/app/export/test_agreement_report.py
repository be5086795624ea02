"""The HTML report of agreement: figures that too few poses determine are dashes."""

import re

import numpy as np
import pytest

from app.export.agreement_report import write_report
from tracker.evaluation.agreement.comparison import compare
from tracker.evaluation.agreement.copies import Copies, Subject


@pytest.mark.parametrize(("n", "joints"), [(1, ("left_elbow", "neck")), (3, ("left_elbow",)), (2, ())])
def test_unknown_figures_are_dashes(tmp_path, n, joints):
    rng = np.random.default_rng(n)
    subjects = tuple(Subject("ann", k) for k in range(n))
    angles = rng.normal(size=(n, 1)), rng.normal(size=(n, 2, 1))
    copies = Copies(("a", "b"), subjects, joints, rng.normal(size=(n, 2, len(joints), 3)), ("bend",), *angles, 25.0)
    write_report(copies, compare(copies), None, tmp_path / "r.html")
    text = re.sub("<style>.*?</style>", "", (tmp_path / "r.html").read_text("utf-8"), flags=re.DOTALL)
    assert not re.search(r"\bnan\b", text)
    assert '<td class="number">-' in text
    assert text.count('class="bias"') == ("left_elbow" in joints)  # the line of the bias is known of one pose, too
