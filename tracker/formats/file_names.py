"""Names of files, and names in foreign formats, that are made of other names: no two names get the same one.

File systems ignore the case of letters, store a letter and its accent apart, keep some names for devices and limit the
length. A name that one of them could take for another one ends in a digest of the whole name.
"""

import hashlib
import re
import unicodedata
from collections import Counter
from collections.abc import Sequence

_FOREIGN = r"[^\w.-]"
"""Characters that some formats refuse in names."""
_UNSAFE = r"[^\w .,()+=@#&'!-]"
"""Characters that some file systems refuse in names."""
_DEVICE = re.compile(r"(?:con|prn|aux|nul|com\d|lpt\d) *(?:\.|\Z)", re.IGNORECASE)
"""Names that Windows keeps for devices, with any suffix."""
_DIGEST = re.compile(r"-[0-9a-f]{10}\Z")


def identifier(name: str) -> str:
    """Return a name of letters, digits, `_`, `-` and `.` only; other names may have the same one."""
    return _plain(name, _FOREIGN)


def own_identifier(name: str) -> str:
    """Return an identifier that no other name has on any file system."""
    return _distinct([name], _FOREIGN, Counter({_folded(identifier(name)): 2}))[0]


def identifiers(names: Sequence[str]) -> list[str]:
    """Return an identifier for each name, each once on any file system."""
    return _distinct(names, _FOREIGN)


def file_stems(names: Sequence[str]) -> list[str]:
    """Return a name of a file or folder without suffix for each name, each once on any file system."""
    return _distinct(names, _UNSAFE)


def _distinct(names: Sequence[str], refused: str, others: Counter[str] | None = None) -> list[str]:
    """Return distinct names.

    Args:
        names: to be replaced; what occurs twice gets two names.
        refused: regular expression of the characters to replace.
        others: number of names that file systems take for each one; those of `names` by default.
    """
    plain = [_plain(name, refused) for name in names]
    taken = others or Counter(map(_folded, plain))
    found, seen = list[str](), Counter[str]()
    for name, text in zip(names, plain, strict=True):
        folded = _folded(text)
        # Of names that coincide, the one in small letters alone stays as it is. The result is that of any order.
        is_own = taken[folded] == 1 or (text == name == folded and not seen[name])
        seen[name] += 1
        if not is_own or _DIGEST.search(folded):
            whole = f"{name}\0{seen[name]}".encode("utf-8", "surrogatepass")
            text = f"{text}-{hashlib.sha256(whole).hexdigest()[:10]}"
        found.append(text)
    return found


def _plain(name: str, refused: str) -> str:
    """Return a name that all file systems take, of at most 100 bytes. Other names may have the same one."""
    text = re.sub(refused, "_", unicodedata.normalize("NFC", name))
    text = text.encode()[:100].decode(errors="ignore").strip(" .") or "_"
    return f"_{text}" if _DEVICE.match(text) else text


def _folded(text: str) -> str:
    """Return the same text for names that some file system takes for one."""
    return unicodedata.normalize("NFKC", unicodedata.normalize("NFKC", text).casefold())
