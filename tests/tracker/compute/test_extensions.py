"""Packages of strangers: whatever their modules and files do is one line about them, and the program goes on."""

import sys
import threading
import time
from importlib import metadata

import pytest
from installed_packages import install

from tracker.compute import extensions as found
from tracker.compute.extensions import Extended, extensions, unread_packages, usable

GROUP = "quadrille.starts"


@pytest.fixture
def package(tmp_path, monkeypatch):
    """Installs a package with one module and an entry point that names its function."""
    monkeypatch.setattr(sys, "path", [str(tmp_path), *sys.path])
    monkeypatch.setattr(found, "_UNREAD", {})

    def put(name, code, points=f"[{GROUP}]\n%s = %s:start\n"):
        install(tmp_path, name, code, points.replace("%s", name) if isinstance(points, str) else points)
        found._installed.cache_clear()
        monkeypatch.delitem(sys.modules, name, raising=False)

    yield put
    found._installed.cache_clear()


def only(name):
    (one,) = extensions(GROUP, name=name)
    return one


@pytest.mark.parametrize(
    ("code", "error"),
    [
        ("raise SystemExit(3)", "SystemExit: 3"),
        ("raise KeyboardInterrupt", "KeyboardInterrupt"),
        ("raise BaseException('a\\nb')", "BaseException: a b"),
        ("class Odd(Exception):\n    def __str__(self): raise ValueError\nraise Odd", "Odd"),
        ("raise ValueError('long ' * 1000)", "ValueError: long long"),
        ("start = 3", "expected odd:start to be a function, found a int"),
        ("import no_such_module_at_all", "ModuleNotFoundError: No module named 'no_such_module_at_all'"),
        ("class Start:\n    def __call__(self): pass\n    name = 'a\\nb'\nstart = Start()", "expected the name 'a b'"),
        (
            "class Start:\n    def __call__(self): pass\n    name = property(lambda self: exit())\nstart = Start()",
            "SystemExit: None",
        ),
    ],
)
def test_a_module_that_fails_is_one_line(package, capsys, code, error):
    package("odd", code)
    one = only("odd")
    assert (one.package, one.value) == ("odd 1.0", None)
    assert one.error.startswith(error)
    assert "\n" not in one.error
    assert len(one.error) <= 200
    assert "odd" not in usable(GROUP)
    assert capsys.readouterr().out == ""


def test_output_of_a_module_is_kept_from_that_of_the_program(package, capsys):
    package("loud", "print('hello\\nthere')\ndef start(): pass")
    one = only("loud")
    assert (callable(one.value), one.error, one.printed) == (True, "", "hello there")
    assert capsys.readouterr().out == ""
    print("of the program")
    assert capsys.readouterr().out == "of the program\n"


DIRECT = """
import os, sys
os.write(1, b'raw')
os.system('echo child')
sys.__stdout__.write('original')
sys.stdout.close()
def start(): pass
"""


def test_output_beside_that_of_python_is_kept_from_that_of_the_program(package, capfd, monkeypatch):
    with open(1, "w", closefd=False) as original:
        monkeypatch.setattr(sys, "__stdout__", original)
        package("direct", DIRECT)
        assert only("direct").error == ""
        print("of the program")
        original.flush()
    out, err = capfd.readouterr()
    assert out == "of the program\n"
    assert err == "rawchild\noriginal"


def test_a_module_that_waits_is_given_up_and_prints_nothing_later(package, capsys, monkeypatch):
    monkeypatch.setattr(found._Loading, "LIMIT_S", 0.01)
    monkeypatch.setattr(sys, "stdout", sys.stdout)  # put back afterwards
    package("slow", "import threading\nthreading.goes_on.wait()\nprint('late')\ndef start(): pass")
    monkeypatch.setattr(threading, "goes_on", threading.Event(), raising=False)
    assert "expected a module that is loaded within 0.01 s" in only("slow").error
    (thread,) = (t for t in threading.enumerate() if t.name == "extension slow")
    threading.goes_on.set()
    thread.join()
    print("of the program")
    assert capsys.readouterr().out == "of the program\n"


@pytest.mark.parametrize("points", ["[a]\nno equals sign\n", b"\xff\xfe[a]\nx=y\n"])
def test_a_package_whose_entry_points_cannot_be_read_is_named_and_passed_over(package, points):
    package("good", "def start(): pass")
    package("broken", "", points)
    assert list(usable(GROUP)) == ["good"]
    assert list(unread_packages()) == ["broken 1.0"]


def test_other_libraries_pass_over_packages_that_cannot_be_read(package, monkeypatch):
    package("broken", "", "[a]\nno equals sign\n")
    monkeypatch.setattr(metadata.Distribution, "entry_points", found._OWN_POINTS)
    with pytest.raises(TypeError):
        metadata.entry_points()
    found.pass_over_unread_packages()
    assert metadata.entry_points(group=GROUP) is not None
    assert "broken 1.0" in unread_packages()


def test_extensions_are_loaded_once_they_are_meant(package, monkeypatch):
    monkeypatch.setattr(time, "loaded", [], raising=False)
    for name in ("first", "other"):
        package(name, f"import time\ntime.loaded.append('{name}')\ndef start(): pass")
    both = Extended({"own": print}, GROUP)
    assert (both["own"], next(iter(both)), "own" in both) == (print, "own", True)
    assert time.loaded == []
    assert callable(both["other"])
    assert time.loaded == ["other"]
    assert "none of them" not in both
    assert list(both) == ["own", "first", "other"]
    assert len(both) == 3
    assert time.loaded == ["other", "first"]
