"""Hash the source that a compiled kernel depends on: a cached kernel is valid while that source is the same."""

import ast
import hashlib
from collections.abc import Iterable, Iterator
from pathlib import Path
from typing import NamedTuple

_DEFINES = (ast.FunctionDef, ast.AsyncFunctionDef, ast.ClassDef)
_REST = "<statements>"
"""Name of the module-level statements that are not plain definitions."""
_WHOLE = "*"
"""Name of a whole module."""


class UnknownSourceError(Exception):
    """The source of a kernel cannot be followed; the kernel needs numba's ordinary cache."""


class _Module(NamedTuple):
    """The module-level names of a source file."""

    definitions: dict[str, list[ast.stmt]]
    """Statements that define each name, without docstrings. Other statements are under `_REST`."""
    imports: dict[str, tuple[str, str]]
    """Module and name of each imported name; the name of a module is `_WHOLE`."""
    kernels: tuple[str, ...]
    """Names of the functions with an `njit` decorator."""


_Place = tuple[str, str]
"""Module and name."""


class _Node(NamedTuple):
    """One place of the sources."""

    text: bytes
    """Its contribution to a key."""
    names: tuple[_Place, ...]
    """The places that it names."""


class KernelKeys:
    """Compute the keys of the kernels of one package.

    The key of a kernel is a hash of its definition and of all definitions that it reaches: functions, constants,
    compiler options, NamedTuples of its arguments. Comments, docstrings and layout do not change it. Numba itself
    compares only a kernel's own file, although it compiles kernels of other files into it.
    """

    def __init__(self, package: Path, environment: str = "") -> None:
        """Set up for a package; no file is read yet.

        Args:
            package: folder of the package, named like it.
            environment: versions and options that compiled code depends on.
        """
        self._package, self._environment = package, environment
        self._modules: dict[str, _Module] = {}
        self._nodes: dict[_Place, _Node] = {}

    def key(self, module: str, name: str) -> str:
        """Return the key of the kernel `name` of the module with the dotted name `module`.

        Raises:
            UnknownSourceError: the source cannot be followed (star imports, syntax errors, missing names).
        """
        if not self._is_own(module) or name not in self._module(module).definitions:
            raise UnknownSourceError(f"{module}.{name}")
        texts = hashlib.sha256(self._environment.encode())
        for place in sorted(self._reached(module, name)):
            texts.update(self._node(place).text)
        return texts.hexdigest()[:20]

    def kernels(self) -> Iterator[tuple[str, str]]:
        """Yield module and name of each kernel of the package."""
        for path in sorted(self._package.rglob("*.py")):
            if b"njit" in path.read_bytes():
                parts = (self._package.name, *path.relative_to(self._package).with_suffix("").parts)
                module = ".".join(parts).removesuffix(".__init__")
                yield from ((module, name) for name in self._module(module).kernels)

    def _reached(self, module: str, name: str) -> set[_Place]:
        """Return module and name of all definitions that a name reaches, itself among them."""
        reached: set[_Place] = set()
        left = [(module, name)]
        while left:
            place = left.pop()
            if place not in reached:
                reached.add(place)
                left += self._node(place).names
        return reached

    def _node(self, place: _Place) -> _Node:
        """Return what a module and name stand for; read once, because most kernels reach the same helpers."""
        if place not in self._nodes:
            dumps, names = self._define(*place)
            self._nodes[place] = _Node(repr((place, dumps)).encode(), tuple(dict.fromkeys(names)))
        return self._nodes[place]

    def _define(self, module: str, name: str) -> tuple[tuple[str, ...], list[_Place]]:
        """Return dumps of the statements that define a name, and the names in them."""
        if not self._is_own(module):
            return (), []
        source = self._module(module)
        if name in source.imports:
            return source.imports[name], [source.imports[name]]
        if name == _WHOLE:
            return (), [(module, other) for other in source.definitions]
        if name not in source.definitions:
            raise UnknownSourceError(f"{module}.{name}")
        statements = source.definitions[name]
        dumps = tuple(ast.dump(s) for s in statements)
        return dumps, [(module, _REST), *self._named_in(statements, module, source)]

    def _named_in(self, statements: Iterable[ast.stmt], module: str, source: _Module) -> Iterator[tuple[str, str]]:
        """Yield module and name of all module-level names in statements, and of local names equal to one."""
        for node in (n for s in statements for n in ast.walk(s)):
            if isinstance(node, ast.Attribute) and isinstance(node.value, ast.Name):
                target, what = source.imports.get(node.value.id, ("", ""))
                if what == _WHOLE and self._is_own(target):
                    yield target, node.attr
            if isinstance(node, ast.Name) and node.id in source.imports:
                target, what = source.imports[node.id]
                if what != _WHOLE or not self._is_own(target):
                    yield module, node.id
            elif isinstance(node, ast.Name) and node.id in source.definitions:
                yield module, node.id

    def _is_own(self, module: str) -> bool:
        return module.split(".")[0] == self._package.name

    def _path(self, module: str) -> Path | None:
        base = self._package.joinpath(*module.split(".")[1:])
        return next((p for p in (base.with_suffix(".py"), base / "__init__.py") if p.is_file()), None)

    def _module(self, name: str) -> _Module:
        if name not in self._modules:
            path = self._path(name)
            if path is None:
                raise UnknownSourceError(name)
            try:
                tree = ast.parse(path.read_bytes())
                _Plain().visit(tree)
            except (SyntaxError, ValueError, OSError) as problem:
                raise UnknownSourceError(name) from problem
            self._modules[name] = self._read(tree, name)
        return self._modules[name]

    def _read(self, tree: ast.Module, name: str) -> _Module:
        kernels = tuple(s.name for s in tree.body if isinstance(s, ast.FunctionDef) and _is_kernel(s))
        module = _Module({_REST: []}, {}, kernels)
        for statement in tree.body:
            if isinstance(statement, ast.Import | ast.ImportFrom):
                module.imports.update(self._imported(statement, name))
                continue
            names = _assigned(statement)
            for one in names:
                module.definitions.setdefault(one, []).append(statement)
            if not names:
                module.definitions[_REST].append(statement)
        return module

    def _imported(self, statement: ast.Import | ast.ImportFrom, module: str) -> Iterator[tuple[str, tuple[str, str]]]:
        for alias in statement.names:
            if isinstance(statement, ast.Import):
                whole = alias.name if alias.asname else alias.name.split(".")[0]
                if self._is_own(whole):
                    raise UnknownSourceError(f"{module}: import {alias.name}")
                yield alias.asname or whole, (whole, _WHOLE)
                continue
            source = statement.module or ""
            if alias.name == "*":
                raise UnknownSourceError(f"{module}: from {source} import *")
            if self._is_own(source) or statement.level:
                if statement.level:
                    raise UnknownSourceError(f"{module}: relative import of {alias.name}")
                if self._path(f"{source}.{alias.name}") is not None:
                    yield alias.asname or alias.name, (f"{source}.{alias.name}", _WHOLE)
                    continue
            yield alias.asname or alias.name, (source, alias.name)


def _is_kernel(function: ast.FunctionDef) -> bool:
    return any(isinstance(n, ast.Name) and n.id == "njit" for d in function.decorator_list for n in ast.walk(d))


def _assigned(statement: ast.stmt) -> list[str]:
    """Return the names that a module-level statement defines; none if it is not a plain definition."""
    if isinstance(statement, _DEFINES):
        return [statement.name]
    targets: list[ast.expr] = []
    if isinstance(statement, ast.Assign):
        targets = statement.targets
    elif isinstance(statement, ast.AnnAssign):
        targets = [statement.target]
    flat = [e for t in targets for e in (t.elts if isinstance(t, ast.Tuple) else [t])]
    return [e.id for e in flat if isinstance(e, ast.Name)] if all(isinstance(e, ast.Name) for e in flat) else []


class _Plain(ast.NodeTransformer):
    """Remove docstrings and turn quoted annotations into expressions."""

    def visit(self, node: ast.AST) -> ast.AST:
        super().visit(node)
        if isinstance(node, ast.Module | ast.ClassDef | ast.FunctionDef | ast.AsyncFunctionDef):
            node.body = [s for s in node.body if not _is_text(s)] or [ast.Pass()]
        for field in ("annotation", "returns"):
            text = getattr(node, field, None)
            if isinstance(text, ast.Constant) and isinstance(text.value, str):
                setattr(node, field, ast.parse(text.value, mode="eval").body)
        return node


def _is_text(statement: ast.stmt) -> bool:
    return isinstance(statement, ast.Expr) and isinstance(statement.value, ast.Constant)
