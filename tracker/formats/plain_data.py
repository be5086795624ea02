"""Parse YAML, XML and JSON of OpenCV and others to plain data: dicts, lists, numbers, text.

A matrix of OpenCV's FileStorage becomes a list of rows in all three.
"""

import json
import re
from collections import Counter
from collections.abc import Sequence
from typing import Any, ClassVar, TypeGuard
from xml.etree import ElementTree

import yaml

from tracker.formats.text_files import LOST, MAX_NESTING, TextKind, refuse_lost
from tracker.validation import quoted

_OPENCV_HEADER = re.compile(r"\A\s*%YAML[: ][^\n]*\n")
"""OpenCV writes `%YAML:1.0`, which is not YAML."""
_FLOAT = re.compile(
    r"^[-+]?(?:[0-9][0-9_]*\.[0-9_]*(?:[eE][-+]?[0-9]+)?|\.[0-9]+(?:[eE][-+]?[0-9]+)?|[0-9]+[eE][-+]?[0-9]+"
    r"|\.(?:inf|Inf|INF)|\.(?:nan|NaN|Nan|NAN))$"
)
"""With the numbers such as 1e-5 that YAML 1.1 takes for text."""


_INT = re.compile(r"^[-+]?(?:0b[01_]+|0x[0-9a-fA-F_]+|0[0-7_]+|(?:0|[1-9][0-9_]*))$")
"""Without numbers to the base 60 of YAML 1.1 such as 1:30:00: thousands of digits take seconds, and none means one."""


class _Loader(yaml.CSafeLoader if yaml.__with_libyaml__ else yaml.SafeLoader):  # pyrefly: ignore[invalid-inheritance]
    """Plain YAML, with OpenCV's tag, and each key once."""

    def construct_mapping(self, node: yaml.MappingNode, deep: bool = False) -> dict[Any, Any]:
        """Return a mapping; a key that is there twice is a `ValueError`."""
        _once([(getattr(key, "value", ""), None) for key, _ in node.value if isinstance(key, yaml.ScalarNode)])
        return dict(super().construct_mapping(node, deep))

    yaml_implicit_resolvers: ClassVar[dict[str, list[tuple[str, re.Pattern[str]]]]] = {
        first: [(tag, pattern) for tag, pattern in rules if not tag.endswith((":int", ":float"))]
        for first, rules in yaml.SafeLoader.yaml_implicit_resolvers.items()
    }


for _tag in ("opencv-matrix", "opencv-nd-matrix"):
    _Loader.add_constructor(f"tag:yaml.org,2002:{_tag}", lambda loader, node: loader.construct_mapping(node, deep=True))
_Loader.add_implicit_resolver("tag:yaml.org,2002:float", _FLOAT, list("-+0123456789."))
_Loader.add_implicit_resolver("tag:yaml.org,2002:int", _INT, list("-+0123456789"))


def parse_yaml(text: str, source: str, kind: TextKind) -> Any:
    """Parse YAML text; `source` names it in messages.

    Raises:
        TrackerError: of the kind's type; the text is not YAML, or uses references or deep nesting.
    """
    where = f"{kind.name} {source}"
    text = _OPENCV_HEADER.sub("", text)
    try:
        depth = 0
        # The events come without recursion, the data with it.
        for event in yaml.parse(text, Loader=_Loader):
            depth += isinstance(event, yaml.CollectionStartEvent) - isinstance(event, yaml.CollectionEndEvent)
            if depth > MAX_NESTING or isinstance(event, yaml.AliasEvent):
                raise kind.error(f"{where}: expected plain data, found references or deep nesting; {kind.remedy}")
        data = _with_matrices(yaml.load(text, Loader=_Loader))
        if LOST in text:
            refuse_lost(data, where, kind)
        return data
    except (yaml.YAMLError, ValueError, OverflowError) as error:
        mark = getattr(error, "problem_mark", None)
        place = "" if mark is None else f" at line {mark.line + 1}"
        problem = (getattr(error, "problem", None) or str(error).splitlines()[0])[:200]
        raise kind.error(f"{where} is not valid YAML: {problem}{place}; {kind.remedy}") from error


def parse_json(text: str, source: str, kind: TextKind) -> Any:
    """Parse JSON text; `source` names it in messages.

    Raises:
        TrackerError: of the kind's type; the text is not JSON.
    """
    try:
        data = _with_matrices(json.loads(text, object_pairs_hook=_once))
    except (ValueError, RecursionError) as error:
        raise kind.error(f"{kind.name} {source} is not valid JSON: {error}; {kind.remedy}") from error
    if LOST in text:
        refuse_lost(data, f"{kind.name} {source}", kind)
    return data


def _once(pairs: Sequence[tuple[str, Any]]) -> dict[str, Any]:
    """Return pairs of keys and values as a dict.

    Raises:
        ValueError: a key is there twice, of which JSON and YAML would keep the last one.
    """
    found = dict(pairs)
    if len(found) < len(pairs):
        twice = Counter(key for key, _ in pairs).most_common(1)[0][0]
        raise ValueError(f"the key {quoted(twice)} is there twice")
    return found


def parse_xml(text: str, source: str, kind: TextKind) -> ElementTree.Element:
    """Parse XML text; `source` names it in messages.

    Raises:
        TrackerError: of the kind's type; the text is not XML.
    """
    try:
        root = ElementTree.fromstring(text)
        for element in root.iter() if LOST in text else ():
            refuse_lost({element.tag: [element.text, *element.attrib.values()]}, f"{kind.name} {source}", kind)
        return root
    except (ElementTree.ParseError, ValueError) as error:  # a declared encoding is no business of text
        raise kind.error(f"{kind.name} {source} is not valid XML: {error}; {kind.remedy}") from error


def storage_data(root: ElementTree.Element) -> Any:
    """Return the content of OpenCV's XML (`<opencv_storage>`) as plain data."""
    return _with_matrices(_element_data(root, 0))


def _element_data(element: ElementTree.Element, depth: int) -> Any:
    inner = list(element)
    if depth > MAX_NESTING:
        return None
    if inner and all(child.tag == "_" for child in inner):
        return [_element_data(child, depth + 1) for child in inner]
    if inner:
        return {child.tag: _element_data(child, depth + 1) for child in inner}
    words = re.findall(r'"([^"]*)"|(\S+)', element.text or "")
    values = [_number(bare) if bare else quoted for quoted, bare in words]
    return values[0] if len(values) == 1 and element.tag != "data" else values


def _number(text: str) -> float | str:
    try:
        return float(text)
    except ValueError:
        return text


def _with_matrices(data: Any, depth: int = 0) -> Any:
    """Replace OpenCV's matrices, dicts of rows, cols and data, by lists of rows."""
    if depth > MAX_NESTING:
        return None
    if isinstance(data, list):
        return [_with_matrices(value, depth + 1) for value in data]
    if not isinstance(data, dict):
        return data
    rows, columns, values = data.get("rows"), data.get("cols"), data.get("data")
    if isinstance(values, list):
        if "sizes" in data and "dt" in data:  # of one dimension, in OpenCV 5
            return values
        if _is_count(rows) and _is_count(columns) and rows * columns == len(values):
            return [values[i : i + int(columns)] for i in range(0, len(values), int(columns))]
    return {str(key): _with_matrices(value, depth + 1) for key, value in data.items()}


def _is_count(value: Any) -> TypeGuard[float]:
    return isinstance(value, int | float) and 0 < value < 1000
