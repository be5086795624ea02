"""Options and names that are given twice: values of several options are gathered, all else is refused."""

import warnings

import pytest
import tyro
from command_line import assert_refused

from app.cli.arguments import gather_repeated, parse_common_or_pairs, parse_pairs, repeatable
from app.main import _COMMANDS
from tracker.errors import TrackerError


def options(command):
    """Options of a command as its parser knows them, and whether they take any number of values, one, or none."""
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", DeprecationWarning)
        parser = tyro.extras.get_parser(command, config=(tyro.conf.FlagCreatePairsOff,))
    return [(a.option_strings[-1], a.nargs) for a in parser._actions if a.option_strings]


@pytest.mark.parametrize("name", _COMMANDS)
def test_all_options_of_all_commands(name):
    command = _COMMANDS[name]
    found = options(command)
    assert found
    for option, n_values in found:
        words = [name, "S", option, "a=1", "--other", "7", option.replace("-", "_").replace("__", "--"), "b=2"]
        if n_values == "*":
            assert gather_repeated(words, command) == [name, "S", option, "a=1", "b=2", "--other", "7"]
            assert option in repeatable(command)
        elif n_values == 0:
            flags = [name, option, option]
            assert gather_repeated(flags, command) == [name, option]
        else:
            with pytest.raises(TrackerError, match=f"expected {option} once, found it with a=1 and with b=2"):
                gather_repeated(words, command)


def test_values_behind_an_equals_sign():
    command = _COMMANDS["new"]
    assert gather_repeated(["new", "--camera=a=1", "--camera=b=2"], command) == ["new", "--camera=a=1", "b=2"]
    with pytest.raises(TrackerError, match="expected --fps once, found it with 25 and with 30"):
        gather_repeated(["new", "--fps=25", "--fps", "30"], command)


@pytest.mark.parametrize("again", ["cam=b", "cam=a"])
def test_a_name_with_two_values(again):
    expected = f"expected --camera once for 'cam', found cam=a and {again}; leave one out"
    with pytest.raises(TrackerError, match=expected):
        parse_pairs(["cam=a", "other=a", again], "--camera", str)
    with pytest.raises(TrackerError, match="once for"):
        parse_pairs(["caf\u00e9=a", "cafe\u0301=b"], "--camera", str)


@pytest.mark.parametrize("words", [["1.7", "1.8"], ["ann=1.7", "1.8"], ["1.8", "1.8"]])
def test_one_value_for_all_and_another_one(words):
    expected = (
        f"expected --height once for all people, or as NAME=VALUE for each, found {' and '.join(words)}; leave one"
    )
    with pytest.raises(TrackerError, match=expected):
        parse_common_or_pairs(words, "--height", float)


def test_from_end_to_end(run, session):
    first, second = (f"{name}=0.5" for name in ("FRONT", "RIGHT"))
    status, out, _ = run("sync", session, "--offset", first, "--json", "--offset", second)
    assert (status, out.count('"time_offset_s": 0.0,'), out.count('"time_offset_s": -0.02')) == (0, 2, 2)
    assert_refused(run("sync", session, "--offset", first, "--offset", "FRONT=1"), ["FRONT=0.5 and FRONT=1"])
    assert_refused(run("track", session, "--frames", "0:5", "--frames", "5:9"), ["--frames once", "0:5", "5:9"])
