"""Text files are refused by size and depth before they are parsed, and read from whatever a path names."""

import contextlib
import json
import os
import socket
import threading
import time
import tomllib
import tracemalloc
from pathlib import Path

import pytest

from tracker.errors import SessionError
from tracker.formats.text_files import (
    MAX_NESTING,
    TABLE_BYTES,
    TextKind,
    parse_toml,
    read_json,
    read_lines,
    read_text,
    read_toml,
)

KIND = TextKind("odd file", 1_000_000, SessionError, "mend it")


def all_lines(path, kind):
    return list(read_lines(path, kind))


def seconds(text):
    """Return the processor time in which a text is parsed or refused."""
    start = time.thread_time()
    with contextlib.suppress(SessionError):
        parse_toml(text, "x", KIND)
    return time.thread_time() - start


def plain_seconds(n):
    """Return the processor time of an ordinary text of n characters."""
    return seconds("".join(f"a{i:06}=1\n" for i in range(n // 10)))


@pytest.mark.slow
@pytest.mark.parametrize("read", [read_text, read_toml, read_json, all_lines])
def test_a_file_of_many_megabytes_is_refused_unread(tmp_path, read):
    """Parsed, this one took a minute and a half."""
    path = tmp_path / "a.toml"
    path.write_text(f"a = [{'0,' * 10_000_000}]")
    tracemalloc.start()
    with pytest.raises(SessionError, match=r"odd file .*a\.toml: expected at most 1 MB, found more; check that"):
        read(path, KIND)
    peak = tracemalloc.get_traced_memory()[1]
    tracemalloc.stop()
    assert peak < 200_000
    start = time.thread_time()
    with contextlib.suppress(SessionError):
        read(path, KIND)
    assert time.thread_time() - start < plain_seconds(100_000)


@pytest.mark.parametrize("read", [read_text, read_toml, read_json, all_lines])
@pytest.mark.parametrize("kind", ["pipe", "link to a pipe", "device", "socket"])
def test_an_irregular_file_is_refused_without_waiting(tmp_path, monkeypatch, read, kind):
    path = tmp_path / "odd"
    if kind == "device":
        path.symlink_to("/dev/zero")
    elif kind == "socket":
        monkeypatch.chdir(tmp_path)  # the name of a socket must be short
        socket.socket(socket.AF_UNIX).bind("odd")
    else:
        os.mkfifo(tmp_path / "pipe")
        path.symlink_to("pipe") if "link" in kind else path.hardlink_to(tmp_path / "pipe")
    with pytest.raises(
        SessionError, match=r"odd file .*odd cannot be read: expected a regular file, found a.*; mend it"
    ):
        read(path, KIND)


def test_a_pipe_that_a_shell_has_opened_is_read():
    """As in `--calibration <(command)`."""
    reading, writing = os.pipe()
    writer = threading.Thread(target=lambda: (time.sleep(0.2), os.write(writing, b"a = 1"), os.close(writing)))
    writer.start()
    assert read_toml(Path(f"/dev/fd/{reading}"), KIND) == {"a": 1}
    writer.join()
    os.close(reading)


def test_a_byte_order_mark_is_no_text(tmp_path):
    (tmp_path / "a").write_bytes(b"\xef\xbb\xbfa = 1")
    assert read_toml(tmp_path / "a", KIND) == {"a": 1}


@pytest.mark.parametrize("read", [read_text, all_lines])
@pytest.mark.parametrize(
    ("name", "expected"),
    [
        ("none", "odd file .*none not found; check the path"),
        (
            "latin",
            "odd file .*latin cannot be read: expected UTF-8 text, found: .*( position 3|bytes in line 1).*; mend it",
        ),
        (".", "cannot be read: Is a directory; mend it"),
        ("x" * 400, "cannot be read: .*File name too long"),
        ("a\0b", "cannot be read: expected a path without null bytes, found one; check it"),
    ],
)
def test_paths_that_are_no_text_file(tmp_path, read, name, expected):
    (tmp_path / "latin").write_bytes(b"abc\xfcd\x01f")
    with pytest.raises(SessionError, match=expected):
        read(tmp_path / name, KIND)


@pytest.mark.parametrize("encoding", ["utf-8", "utf-8-sig", "utf-16", "utf-32"])
def test_encodings_with_a_mark(tmp_path, encoding):
    """As PowerShell and Notepad write text."""
    (tmp_path / "a").write_bytes('größe = "é"\r\nb = 2\r\n'.encode(encoding))
    assert read_text(tmp_path / "a", KIND).startswith('größe = "é"')
    assert all_lines(tmp_path / "a", KIND) == ['größe = "é"', "b = 2"]


@pytest.mark.parametrize("encoding", ["utf-16-le", "utf-16-be"])
@pytest.mark.parametrize("read", [read_text, read_toml, all_lines])
def test_utf_16_without_a_mark_is_named(tmp_path, read, encoding):
    (tmp_path / "a").write_bytes("abc = 1".encode(encoding))
    with pytest.raises(SessionError, match="zero bytes, as in UTF-16 without a byte order mark: save it as UTF-8"):
        read(tmp_path / "a", KIND)


@pytest.mark.parametrize("text", ["a = 1 # José\n", "image_path = 'C:\\Büro'\n", "[m]\ncomment = ['Büro']\n"])
def test_comments_and_paths_may_be_of_another_encoding(tmp_path, text):
    (tmp_path / "a").write_bytes(text.encode("latin-1"))
    assert read_toml(tmp_path / "a", KIND).keys() == tomllib.loads(text).keys()


NAMES = ["name = 'Büro'", "['Büro']\na = 1", "[a]\nmarkers = ['x', 'é']", "[path]\nname = 'é'"]


@pytest.mark.parametrize("text", NAMES)
def test_names_of_another_encoding_are_refused(tmp_path, text):
    """Nobody knows which letters they are."""
    (tmp_path / "a").write_bytes(text.encode("latin-1"))
    with pytest.raises(SessionError, match=r"expected UTF-8 text in names, found .*save the file as UTF-8"):
        read_toml(tmp_path / "a", KIND)
    (tmp_path / "a").write_bytes(json.dumps(tomllib.loads(text), ensure_ascii=False).encode("latin-1"))
    with pytest.raises(SessionError, match="expected UTF-8 text in names"):
        read_json(tmp_path / "a", KIND)


@pytest.mark.parametrize("newline", ["\n", "\r\n", "\r"])
def test_lines(tmp_path, newline):
    (tmp_path / "a").write_bytes(newline.join(["one", "", "two\u2028", "three"]).encode())
    assert all_lines(tmp_path / "a", KIND) == ["one", "", "two\u2028", "three"]


@pytest.mark.parametrize(
    "text",
    [
        "a = " + "[" * 100_000,
        "a = " + "{a = " * 100_000,
        "a = " + "[" * (MAX_NESTING + 1) + "]" * (MAX_NESTING + 1),
        ".".join("a" * 100_000) + " = 1",
        "[" + ".".join(["'a'", '"b"', "c "] * 100) + "]",
        "a = 'it' # '''\nb = " + "[" * 1000,
        'a = "\\"" \nb = ' + "[" * 1000,
        'a = """x\\""" ""\n""" \nb = ' + "[" * 1000,
    ],
    ids=lambda text: text[:12],
)
def test_deep_nesting_is_refused_at_once(text):
    with pytest.raises(SessionError, match="odd file x: expected at most 32 levels of nesting, found more; correct it"):
        parse_toml(text, "x", KIND)
    assert seconds(text) < plain_seconds(100_000)


@pytest.mark.parametrize(
    "text",
    [
        "a = " + "[" * MAX_NESTING + "]" * MAX_NESTING,
        "a = '" + "[" * 1000 + "'",
        'a = "' + "{" * 1000 + '\\""',
        "a = '''" + "[\n" * 1000 + "'''",
        'a = """' + "[\n" * 1000 + '"\\""" """',
        "a = 1 # " + "[" * 1000 + " 'it\nb = 2",
        "a = '" + ".x" * 1000 + "' # " + ".x" * 1000,
        "a = [" + "1.5, " * 1000 + "]",
        "".join(f"[[a]]\nb.c = {i}\n" for i in range(1000)),
    ],
    ids=lambda text: text[:12],
)
def test_brackets_that_do_not_nest_are_read(text):
    assert parse_toml(text, "x", KIND)


@pytest.mark.slow
@pytest.mark.parametrize(
    "text",
    [
        "a=[" + "0," * 499_000 + "]", "".join(f"[k{i}]\n" for i in range(110_000)), "a=[" + "{a=1}," * 165_000 + "]",
        "".join(f"{'.'.join('a' * 31)}{i}=1\n" for i in range(14_000)), '"""\\' * 240_000, '"\\' * 490_000,
        "'" * 990_000, ".a" * 490_000, "a." * 490_000, "[" * 990_000, '"' * 990_000, "#\n" * 490_000,
        "a=0x" + "f" * 990_000, "a=[" + '"",' * 330_000 + "]", "[[a]]\n" * 160_000,
    ],
    ids=lambda text: text[:12],
)  # fmt: skip
def test_the_largest_files_take_little_longer_than_ordinary_ones(text):
    """At most twice as long here; a search that starts again at each character takes hundreds of times as long."""
    assert len(text) <= KIND.max_bytes
    assert seconds(text) < 10 * plain_seconds(KIND.max_bytes)


def test_a_small_file_takes_little_memory_whatever_its_kind_allows(tmp_path):
    (tmp_path / "a.json").write_text("{}")
    tracemalloc.start()
    assert read_text(tmp_path / "a.json", TextKind("table", TABLE_BYTES, SessionError)) == "{}"
    peak = tracemalloc.get_traced_memory()[1]
    tracemalloc.stop()
    assert peak < 1_000_000
