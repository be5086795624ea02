"""Mutations of text files, as hands, merges, disks and malice make them."""

import copy
import json
import re
import tomllib
import traceback
import warnings

import numpy as np
import tomli_w

from tracker.errors import TrackerError

# Numbers and words that no reader may choke on.
ODD_TEXT = [
    "inf", "-inf", "nan", "1e300", "-1e300", "1e-300", "1e999", "0", "-0.0", "-1", "1.5", "9" * 30, "9" * 5000,
    "-" + "9" * 400, "0x" + "f" * 5000, "2147483648", "9223372036854775808", "true", "''", '""', "'x'", '"\\u0000"',
    '"\\uD7FF"', "[]", "{}", "[[]]", "[1, 'a']", "1979-05-27", "07:32:00", "1979-05-27T07:32:00Z", "null", "None",
    "1_000", "+5", "..", "[" * 400, "{a=" * 400, ".".join("a" * 300), "\t", "\t\t\t", ",", "\n", "\r", "\x00", "\ufeff",
    "\u2028", "#", "=", '"""', "'''", "\\",
]  # fmt: skip
ODD_VALUES = [
    0, -1, 1, 10**30, -(10**30), 2**31, 2**63, 2**64, 0.5, 1e300, -1e300, 1e-300, float("inf"), float("-inf"),
    float("nan"), True, False, "", "x", "red", "../x", "a\x00b", "x" * 5000, "#ff88", "ball", [], [[]], [1], [1.0, 2.0],
    [1.0, 2.0, 3.0], ["a", 1, []], [{}], [{"name": 3}], [0.0] * 5000, {}, {"name": "x"}, {"a": {"b": {"c": []}}},
]  # fmt: skip
_TOKEN = re.compile(rb"[-+]?[\w.]+")
_NUMBER = re.compile(rb"-?\b\d{1,9}(\.\d{1,15})?\b")


def mutate_bytes(rng, data, others):
    """Change a file's bytes once: flips, deletions, splices, duplications, extreme numbers, deep nesting, truncation.

    Args:
        rng: random.Random.
        data: the file's bytes.
        others: bytes of other files, to splice from.
    """
    kind = rng.randrange(14)
    a, b = sorted((rng.randrange(len(data) + 1), rng.randrange(len(data) + 1)))
    short = min(b, a + rng.choice((1, 2, 5, 20, 100, 1000)))
    if kind == 0:
        out = bytearray(data)
        for _ in range(rng.choice((1, 1, 2, 8, 64))):
            out[rng.randrange(len(out))] ^= 1 << rng.randrange(8)
        return bytes(out)
    if kind == 1:
        return data[:a] + data[short:]
    if kind == 2:
        other = rng.choice(others)
        c = rng.randrange(len(other))
        return data[:a] + other[c : c + rng.choice((3, 30, 300))] + data[short:]
    if kind == 3:
        return data[:short] + data[a:short] * rng.choice((1, 2, 50)) + data[short:]
    if kind == 4:
        return data[:a]
    if kind == 5:
        return data[:a] + rng.randbytes(rng.choice((1, 4, 40))) + data[short:]
    if kind == 6:
        return (
            data[:a]
            + rng.choice((b"[", b"{", b'"', b"a.", b"(", b"[[", b"{a=")) * rng.choice((40, 400, 5000))
            + data[a:]
        )
    if kind == 7 and rng.random() < 0.02:  # a bomb of many megabytes
        return (data[a:short] or b"0,") * (20_000_000 // max(1, short - a))
    # Any number becomes another one, or any token gives way to an odd one.
    pattern = rng.choice((_NUMBER, _TOKEN))
    token = pattern.search(data, a) or pattern.search(data)
    if token is None:
        return rng.choice(ODD_TEXT).encode()
    if pattern is _NUMBER:
        new = f"{float(token[0]) * rng.choice((0.5, 1.001, -1, 3, 100, 1e4, 0)) + rng.choice((0, 0, 1)):.6g}"
    else:
        new = rng.choice(ODD_TEXT)
    return data[: token.start()] + new.encode() + data[token.end() :]


def mutate_tree(rng, tree):
    """Change plain data of TOML or JSON once or twice: a value of another type, a key removed, renamed or added."""
    tree = copy.deepcopy(tree)
    for _ in range(rng.choice((1, 1, 2))):
        holders = list(_holders(tree))
        holder = rng.choice(holders)
        if not holder:
            continue
        key = rng.choice(list(holder)) if isinstance(holder, dict) else rng.randrange(len(holder))
        kind = rng.randrange(8)
        if kind == 0:
            del holder[key]
        elif kind == 1 and isinstance(holder, dict):
            holder[rng.choice(("name", "version", "x" * 3000, "", "a.b", "\u00fc", "floor", "search"))] = holder.pop(
                key
            )
        elif kind == 2 and isinstance(holder, list):
            holder.extend(copy.deepcopy([holder[key]] * rng.choice((1, 3, 300))))
        elif kind == 3:
            holder[key] = copy.deepcopy(rng.choice(holders))  # another part of the same file
        else:
            holder[key] = copy.deepcopy(rng.choice(ODD_VALUES))
    return tree


def toml_bytes(tree):
    """Write a tree as TOML; a tree that TOML cannot hold is written as far as it can."""
    try:
        return tomli_w.dumps(tree).encode("utf-8", "replace")
    except (TypeError, ValueError, RecursionError):
        return repr(tree).encode("utf-8", "replace")


def json_bytes(tree):
    """Write a tree as JSON."""
    return json.dumps(tree).encode()


def _holders(tree):
    if isinstance(tree, dict | list):
        yield tree
        for value in tree.values() if isinstance(tree, dict) else tree:
            yield from _holders(value)


def mutated(rng, name, data, others):
    """Change a file once to four times; `others` are files to splice in."""
    if name.endswith((".toml", ".json")) and rng.random() < 0.5:
        tree = tomllib.loads(data.decode()) if name.endswith(".toml") else json.loads(data)
        return (toml_bytes if name.endswith(".toml") else json_bytes)(mutate_tree(rng, tree))
    for _ in range(rng.choice((1, 1, 1, 1, 2, 4))):
        data = mutate_bytes(rng, data, others) or b" "
    return data


def tried(case, read, failures, data=b""):
    """Read a mutated file; returns whether it was refused (or the answer is True), and adds faults to the failures."""
    try:
        with warnings.catch_warnings(), np.errstate(all="ignore"):
            warnings.simplefilter("ignore")
            return read() is True
    except TrackerError as error:
        if len(str(error)) > 2000:
            failures.append(f"case {case}: a message of {len(str(error))} characters: {str(error)[:300]}")
        return True
    except Exception:
        failures.append(f"case {case}: {traceback.format_exc(limit=-3)}\n{data[:300]!r}")
        return False
