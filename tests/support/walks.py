"""Walks through the code: the files that a piece of work passes, and how often it crosses from one to another."""

import re
import sys
import threading
from collections import Counter
from contextlib import contextmanager

from architecture import ROOT

ROW = re.compile(r"^\| `([^`]+\.py)` \| `([\w.]+)` \|", re.MULTILINE)
HOUSES = tuple(f"{ROOT / house}/" for house in ("app", "tracker"))


class Walk:
    """Calls from one file of the project to another, by both names; those of kernels are not seen."""

    def __init__(self):
        self._crossings = None
        self.first_calls = {}
        """Order in which functions were first called while calls were counted, by file and qualified name."""
        self._of_code = {}

    @contextmanager
    def counted(self):
        """Gives the calls from one file to another meanwhile, in all threads that were started since `traced`."""
        self._crossings = Counter()
        try:
            yield self._crossings
        finally:
            self._crossings = None

    def assert_documented(self, heading):
        """The calls of the table below a heading of the document were made, and first made in its order."""
        text = (ROOT / "docs" / "architecture.md").read_text("utf-8")
        calls = ROW.findall(text.split(f"\n## {heading}")[1].split("\n## ")[0])
        assert len(calls) > 5
        assert [call for call in calls if call not in self.first_calls] == []
        assert sorted(calls, key=self.first_calls.get) == calls

    def profile(self, frame, event, _):
        crossings = self._crossings
        if event != "call" or crossings is None:
            return
        to = self._file(frame.f_code)
        if to is None:
            return
        caller = frame.f_back
        while caller is not None and (file := self._file(caller.f_code)) is None:
            caller = caller.f_back
        self.first_calls.setdefault((to, frame.f_code.co_qualname), len(self.first_calls))
        if caller is not None and file != to:
            crossings[file, to] += 1

    def _file(self, code):
        """Name of the file of some code below the project; None of others."""
        if code not in self._of_code:
            name = code.co_filename
            self._of_code[code] = name.removeprefix(f"{ROOT}/") if name.startswith(HOUSES) else None
        return self._of_code[code]


@contextmanager
def traced():
    """A walk of this thread, and of those that are started meanwhile."""
    walk = Walk()
    threading.setprofile(walk.profile)
    sys.setprofile(walk.profile)
    try:
        yield walk
    finally:
        sys.setprofile(None)
        threading.setprofile(None)
