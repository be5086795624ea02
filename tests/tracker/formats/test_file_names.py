"""Names that are made of other names: each its own on every file system, whatever the names are."""

import re
import unicodedata

import pytest
from hypothesis import given
from hypothesis import strategies as st

from tracker.formats.file_names import file_stems, identifier, identifiers, own_identifier

ODD = [
    "x/y", "x_y", "X_Y", "x y", "x_y.", ".x_y", "é", "e\u0301", "É", "ﬁ", "fi", "ß", "ss", "con", "CON", "con.txt",
    "_con", "aux ", "", ".", "..", "_", "a" * 300, "a" * 299, "ü" * 300, "\ud800", "a\nb", "a\tb", "a\u200db", "İ",
    "i\u0307", "ſ", "s", "x-0123456789", "K", "\u212a",
]  # fmt: skip
"""Names that some file system or program takes for one another, or does not take at all."""
names = st.one_of(
    st.sampled_from(ODD),
    st.text(st.characters(exclude_categories=()), max_size=12),
    st.text("aA_/ -.\u0301é", max_size=5),
)


def as_one(text):
    """A form that is the same for names that some file system takes for one."""
    return unicodedata.normalize("NFD", unicodedata.normalize("NFKD", text).upper().casefold())


@pytest.mark.parametrize("function", [identifiers, file_stems, lambda all_: [*map(own_identifier, all_)]])
@given(all_=st.lists(names, max_size=12, unique=True))
def test_each_name_has_its_own_on_every_file_system(function, all_):
    found = function(all_)
    assert len({*map(as_one, found)}) == len(all_)
    for text in found:
        assert 0 < len(text.encode()) <= 120
        assert not re.search(r'[\x00-\x1f<>:"/\\|?*]', text)
        assert text == text.strip(" .")
        assert not re.fullmatch(r"(?i)(con|prn|aux|nul|com\d|lpt\d) *(\..*)?", text)


@given(st.lists(names, max_size=8, unique=True).flatmap(lambda all_: st.tuples(st.just(all_), st.permutations(all_))))
def test_the_order_of_names_does_not_matter(orders):
    one, other = orders
    assert dict(zip(one, identifiers(one), strict=True)) == dict(zip(other, identifiers(other), strict=True))


@given(st.lists(names, max_size=8, unique=True))
def test_a_name_that_looks_like_a_made_one_differs_from_it(all_):
    every = [*dict.fromkeys([*all_, *identifiers(all_), *map(own_identifier, all_)])]
    assert len({*map(as_one, identifiers(every))}) == len({*map(as_one, map(own_identifier, every))}) == len(every)


def test_names_that_need_no_change_stay():
    assert identifiers(["walk_3", "Ann", "hip"]) == ["walk_3", "Ann", "hip"]
    assert file_stems(["Ann Lee", "walk (2)"]) == ["Ann Lee", "walk (2)"]
    assert own_identifier("ann") == "ann"
    assert identifier("Ann Lee/2") == "Ann_Lee_2"


def test_of_names_that_coincide_the_plain_one_stays():
    first, second = identifiers(["x/y", "x_y"])
    assert second == "x_y"
    assert re.fullmatch(r"x_y-[0-9a-f]{10}", first)


def test_a_name_that_occurs_twice_has_two():
    assert len({*identifiers(["a", "a", "a"])}) == 3
