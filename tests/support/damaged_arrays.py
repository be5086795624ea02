"""Files of arrays that cannot be read."""

_FLAGS_AT = {b"PK\x03\x04": 6, b"PK\x01\x02": 8}
"""Place of the flags after the mark of a header of a ZIP archive."""


def encrypted(data):
    """The bytes of an archive, marked as encrypted."""
    out = bytearray(data)
    for mark, offset in _FLAGS_AT.items():
        at = data.find(mark)
        while at >= 0:
            out[at + offset] |= 1
            at = data.find(mark, at + 1)
    return bytes(out)
