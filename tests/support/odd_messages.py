"""Messages that no page sends, generated from the declarations."""

import json

import msgspec

from app.messages.client import CLIENT_MESSAGES

_ODD = (
    "Infinity", "-Infinity", "NaN", "1e400", "-1e400", "1e308", "-1", "2.5", "2147483648", "2147483649",
    "99999999999999999999999999", "null", "true", '""', '"two"', '"NaN"', '"\\ud800"', '"\\u0000"', "[]", "{}", "[[]]",
    '{"type":"seek"}', "-0.0", "1E-400", "0x10",
)  # fmt: skip
"""Values as JSON text, some of which JSON does not have."""


def fields_of(kind):
    """A plausible value of each field of a message, as JSON text."""
    info = msgspec.inspect.type_info(kind)
    return {"type": json.dumps(info.tag)} | {f.encode_name: json.dumps(_plausible(f.type)) for f in info.fields}


def odd_message(rng):
    """A message, and whether it is binary; mostly wrong in one way or in several."""
    way = rng.integers(0, 10)
    if way == 0:
        return rng.bytes(int(rng.integers(0, 3000))), bool(rng.integers(0, 2))
    fields = fields_of(CLIENT_MESSAGES[rng.integers(0, len(CLIENT_MESSAGES))])
    name = str(rng.choice(list(fields)))
    if way == 1:
        del fields[name]
    elif way == 2:
        fields["extra"] = str(rng.choice(_ODD))
    elif way == 3:
        depth = int(rng.integers(1, 200_000))
        fields[name] = rng.choice(["[", '{"a":']) * depth
    elif way == 4:
        fields[name] = json.dumps("x" * int(rng.integers(200, 900_000)))
    else:
        for wrong in rng.choice(list(fields), int(rng.integers(1, 4))):
            fields[str(wrong)] = str(rng.choice(_ODD))
    text = "{" + ",".join(f'"{key}":{value}' for key, value in fields.items()) + "}"
    data = text.encode("utf-8", "surrogatepass")
    if way == 9:  # cut off, or with a wrong byte
        at = int(rng.integers(0, len(data)))
        data = data[:at] if rng.integers(0, 2) else data[:at] + rng.bytes(1) + data[at + 1 :]
    return data, bool(rng.integers(0, 20) == 0)


def _plausible(kind):
    """A value that a type admits, as a rule."""
    match kind:
        case msgspec.inspect.BoolType():
            return True
        case msgspec.inspect.IntType() | msgspec.inspect.FloatType():
            return max(0, kind.ge or 0)
        case msgspec.inspect.StrType():
            return "torso"
        case msgspec.inspect.LiteralType():
            return kind.values[0]
        case msgspec.inspect.UnionType():
            return _plausible(kind.types[0])
        case msgspec.inspect.StructType():
            return {}
    return [] if "item_type" in type(kind).__struct_fields__ else None
