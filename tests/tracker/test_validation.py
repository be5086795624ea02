"""A wrong value is explained by its key, what was expected, and what was found."""

from typing import Annotated, Literal

import msgspec
import pytest
from msgspec import UNSET, Meta, UnsetType

from tracker.errors import FormatError
from tracker.validation import FileStem, Name, Number, Vector, check, check_version


class Wheel(msgspec.Struct, forbid_unknown_fields=True):
    size: Annotated[float, Meta(gt=0, description="a size above 0")]
    name: Name = "x"
    spokes: list[int] = []

    def __post_init__(self):
        if self.size == 13:
            raise ValueError("expected a lucky 'size', found 13; choose another")


class Cart(msgspec.Struct, forbid_unknown_fields=True):
    wheels: list[Wheel]
    kind: Literal["hand", "dog"] = "hand"
    place: Vector = (0.0, 0.0, 0.0)
    load: Annotated[int, Meta(ge=0)] | None = None
    note: str | UnsetType = UNSET
    by_name: dict[str, Number] = {}


def with_wheel(**fields):
    return {"wheels": [{"size": 1} | fields]}


@pytest.mark.parametrize(
    ("data", "expected"),
    [
        ({}, "cart: expected the key 'wheels', found none; correct it"),
        (3, "cart: expected a group of keys, found 3; correct it"),
        ({"wheels": [{}]}, "cart: expected the key 'size' in 'wheels[0]', found none; correct it"),
        ({"wheels": "x" * 1000}, "a list as 'wheels', found 'xxx"),
        (with_wheel(name="left", size="big"), "a size above 0 as 'wheels[left].size', found 'big'"),
        (with_wheel(size=float("nan")), "a size above 0 as 'wheels[0].size', found nan"),
        (with_wheel(size=10**5000), "a size above 0 as 'wheels[0].size', found a number out of range"),
        (with_wheel(size=13.0), "cart: expected a lucky 'size' in 'wheels[0]', found 13; choose another"),
        (with_wheel(name=4), "on one line, without control or direction characters as 'wheels[0].name', found 4"),
        (with_wheel(name="a\nb"), "characters as 'wheels[0].name', found 'a\\nb'"),
        (with_wheel(spokes=[1, 2.5]), "a whole number as 'wheels[0].spokes[1]', found 2.5"),
        ({"wheels": [], "wheel": 1}, "only wheels, kind, place, load, note, by_name as keys, found 'wheel'"),
        ({"wheels": [], "a` - at `$.b`": 1}, "as keys, found 'a` - at `$.b`'"),
        ({"wheels": [], "kind": "ox"}, "expected one of 'dog', 'hand' as 'kind', found 'ox'"),
        ({"wheels": [], "kind": []}, "expected one of 'dog', 'hand' as 'kind', found []"),
        ({"wheels": [], "place": [1, 2]}, "expected 3 finite numbers as 'place', found [1, 2]"),
        ({"wheels": [], "place": [1, 2, "c"]}, "a finite number within 1e9 as 'place[2]', found 'c'"),
        ({"wheels": [], "place": "here"}, "expected 3 finite numbers as 'place', found 'here'"),
        ({"wheels": [], "load": "much"}, "expected a whole number or nothing as 'load', found 'much'"),
        ({"wheels": [], "load": -1}, "expected a whole number >= 0 as 'load', found -1"),
        ({"wheels": [], "note": 3}, "expected text as 'note', found 3"),
        ({"wheels": [], "by_name": {"a": "b"}}, "as 'by_name', found {'a': 'b'}"),
    ],
)
def test_the_first_wrong_value_is_explained(data, expected):
    with pytest.raises(FormatError) as caught:
        check(data, Cart, "cart", FormatError)
    assert expected in str(caught.value)
    assert len(str(caught.value)) < 250


@pytest.mark.parametrize("name", ["", ".", "..", "a/b", "a\\b", "a\0b", "a\nb", "x" * 101, 3])
def test_names_that_could_lead_out_of_a_folder(name):
    with pytest.raises(FormatError, match="without slashes"):
        check(name, FileStem, "camera", FormatError)


@pytest.mark.parametrize("declaration", [Name, FileStem])
@pytest.mark.parametrize("char", "\x1b\x7f\x85\x9b\u061c\u200e\u200f\u2028\u2029\u202a\u202e\u2066\u2069\ufeff")
def test_names_without_control_and_direction_characters(declaration, char):
    with pytest.raises(FormatError, match=r"control or direction characters, found 'a.*b'") as caught:
        check(f"a{char}b", declaration, "camera", FormatError)
    assert str(caught.value).isprintable()


@pytest.mark.parametrize("name", ["cam01", "b 2", "a.1", "..a", "ü", "正面", "it's"])
def test_names_of_files(name):
    assert check(name, FileStem, "camera", FormatError) == name


@pytest.mark.parametrize(
    ("version", "expected"),
    [
        (3, "x has version 3, this program reads up to 2; upgrade"),
        ("2", "a whole number, found '2'"),
        (2.0, "a whole number, found 2.0"),
        (True, "a whole number, found True"),
        (-1, "a whole number >= 0, found -1"),
    ],
)
def test_versions(version, expected):
    with pytest.raises(FormatError, match=expected):
        check_version({"version": version}, 2, "x", FormatError)
    check_version({"version": 2}, 2, "x", FormatError)
