"""The declared messages: what follows from them, and how messages of a page are parsed."""

import re
from typing import get_args

import msgspec
import protocol_docs
import pytest

from app.messages import client, observation, pose
from app.messages.client import CLIENT_MESSAGES
from app.messages.parsing import MessageError, parse
from app.page import inbox
from app.page.commands import COMMANDS

SUBSCRIPTIONS = {
    client.SetView, client.CheckEpipolar, client.ShowCurves, client.WatchTab,
    client.ShowHistory, observation.WatchProvenance,
}  # fmt: skip

DRAG = '{"type":"drag","phase":"move","frame":2,"camera":0,"person":0,"point":"torso","seq":1,"u":%s,"v":2}'


def test_the_reference_is_that_of_the_declarations():
    text = protocol_docs.DOCS.read_text(encoding="utf-8")
    assert protocol_docs.with_tables(text) == text, "run `python tests/recipes/protocol_docs.py`"


def test_the_page_has_a_type_for_each_message():
    types = dict(re.findall(r"^export type (\w+) = (.*);$", protocol_docs.declarations(), re.MULTILINE))
    assert types["Select"] == '{type: "select", person: number, point?: string | null}'
    assert {kind.__name__ for kind in CLIENT_MESSAGES} == set(types["ClientMessage"].split(" | "))


def test_every_message_is_carried_out():
    assert set(COMMANDS) | SUBSCRIPTIONS == set(CLIENT_MESSAGES)
    assert not set(COMMANDS) & SUBSCRIPTIONS
    assert set(inbox.COALESCED) <= set(CLIENT_MESSAGES)


def test_messages_of_one_type_differ_by_action():
    message = parse('{"type":"pose","action":"copy","frame":2,"person":1,"from":3}')
    assert message == pose.CopyFrame(frame=2, person=1, action="copy", source=3)
    assert parse('{"type":"track","action":"pause"}') == client.ControlTracking("pause")
    for action in get_args(client.RangeAction):
        assert parse(f'{{"type":"range","action":"{action}","first":1,"last":2}}').action == action


def test_settings_left_out_are_not_changed():
    changes = parse('{"type":"search_settings","changes":{"theta_px":null}}').changes
    assert changes.theta_px is None
    assert changes.patience is msgspec.UNSET


@pytest.mark.parametrize(
    ("text", "expected", "found"),
    [
        ('{"frame":3}', "the key 'type'", "none"),
        ('{"type":"fly"}', "a type of message", "'fly'"),
        ("[]", "a group of keys", "[]"),
        ("", "a message in JSON", "0 bytes"),
        ('{"type":"seek"}', "the key 'frame'", "none"),
        ('{"type":"seek","frame":-1}', "a whole number >= 0 as 'frame'", "-1"),
        ('{"type":"seek","frame":2.5}', "a whole number as 'frame'", "2.5"),
        ('{"type":"seek","frame":"two"}', "a whole number as 'frame'", "'two'"),
        ('{"type":"seek","frame":1e400}', "a finite number as 'frame'", "a number out of range"),
        ('{"type":"seek","frame":99999999999999999999}', "a whole number <= 2147483648 as 'frame'", "9999999999999999"),
        ('{"type":"seek","frame":Infinity}', "a message in JSON", "32 bytes"),
        ('{"type":"seek","frame":NaN}', "a message in JSON", "27 bytes"),
        ('{"type":"seek","frame":1,"then":2}', "only type, frame as keys", "'then'"),
        (DRAG % "1e400", "a finite number as 'u'", "a number out of range"),
        (DRAG % "1e300", "a number <= 1000000000.0 as 'u'", "1e+300"),
        ('{"type":"pose","action":"fold","frame":2,"person":0}', "'set' or 'turn'", "'fold'"),
        ('{"type":"search"}', "as action of 'search'", "None"),
        ('{"type":"search","action":[1]}', "text or nothing as 'action'", "[1]"),
        ('{"type":"curves","group":"ears"}', "as 'group'", "'ears'"),
        ('{"type":"search_settings","changes":{"passes":[1,"a"]}}', "a number as 'changes.passes[1]'", "'a'"),
        ('{"type":"select","person":0,"point":"%s"}' % ("x" * 300), "text of length <= 200 as 'point'", "'xxx"),
        (b'{"type":"\xff"}', "a message in JSON", "12 bytes"),
        ('{"type":"\\ud800"}', "a message in JSON", "17 bytes"),
        (b'{"type":1,"\xe5":2}', "as 'type'", ""),  # wrong before the byte that is wrong as well
        (b'7\xe5', "a group of keys", ""),
        ("[" * 100_000, "a group of keys", "None"),
        ('{"type":"seek","frame":' + "[" * 100_000, "a message in JSON", "100023 bytes"),
    ],
)  # fmt: skip
def test_a_wrong_message_says_what_was_expected_and_what_was_found(text, expected, found):
    with pytest.raises(MessageError) as error:
        parse(text)
    first, _, second = str(error.value).partition(", found ")
    assert first.startswith("expected ")
    assert expected in first
    assert second.startswith(found)
