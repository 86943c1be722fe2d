#!/usr/bin/env python3
"""Prints which rooms of a crate use which, and fails where two use each other, directly or through others.

usage: circles.py [--files] [FOLDER...]      source folders of crates; src and bitstream-model/src if none

--files prints the circles of files instead: an arrow leads to the file that has the named item, through
every `use` that passes it on. A file and the modules inside of it make no circle.

A room is a module directly below lib.rs: a folder or a file. An arrow is a path `crate::room::...`,
`super::...` or `self::...` that leads from a file of one room into another room. A name that lib.rs
re-exports is in the room that lib.rs takes it from, so that `crate::Name` is an arrow to that room; lib.rs
itself is no room, as it names every room. Tests are left out: items under `#[cfg(test)]`, folders
`tests`, files `tests.rs` and `*_tests.rs`.

Exit code: 0 no circle, 1 a circle or a path that leads nowhere, 2 wrong usage.
"""

import re
import sys
from collections import defaultdict
from pathlib import Path
from typing import Iterator, NamedTuple

from rust_text import rust_files, split

OPEN, CLOSE = "([{", ")]}"
# An item that ends with its braces; every other item ends with a semicolon or a comma.
BRACED_ITEM = re.compile(
    r"(?:pub\b\s*(?:\([^)]*\)\s*)?)?(?:(?:const|async|unsafe|default)\s+|extern\s+)*"
    r"(?:fn|mod|impl|struct|enum|union|trait|extern|macro_rules!)"
)
PLAIN_ITEM = re.compile(r"(?:pub\b\s*(?:\([^)]*\)\s*)?)?(?:use|const|static|type|let)\b")
ATTRIBUTE = re.compile(r"#(!?)\[")
TOKEN = re.compile(r"\buse\b|\bmod\s+(\w+)\s*\{|[{}]|\b(?:crate|super|self)(?:\s*::\s*\w+)+")


class Arrow(NamedTuple):
    source: str
    target: str
    place: str


def shown(path: Path) -> str:
    """A path as messages show it: below the working folder where it lies there."""
    return str(path.relative_to(Path.cwd()) if path.is_relative_to(Path.cwd()) else path)


def closing(code: str, at: int) -> int:
    """The index behind the bracket that closes the one at `at`."""
    depth = 0
    for index in range(at, len(code)):
        if code[index] in OPEN:
            depth += 1
        elif code[index] in CLOSE:
            depth -= 1
            if depth == 0:
                return index + 1
    return len(code)


def end_of_item(code: str, at: int) -> int:
    """The index behind the item, field, arm or statement that begins at `at`."""
    braced, plain = BRACED_ITEM.match(code, at), PLAIN_ITEM.match(code, at)
    index = at
    while index < len(code):
        letter = code[index]
        if letter in CLOSE:
            return index
        if letter == ";" or (letter == "," and not braced and not plain):
            return index + 1
        if letter in OPEN:
            index = closing(code, index)
            if letter == "{" and not plain:
                return index
        else:
            index += 1
    return index


def is_for_tests(attribute: str) -> bool:
    """Whether `cfg(...)` holds in tests alone: it names `test`, and neither `not` nor `any`."""
    return bool(
        re.search(r"\bcfg\s*\(", attribute)
        and re.search(r"\b(?:test|doctest)\b", attribute)
        and not re.search(r"\b(?:not|any)\s*\(", attribute)
    )


def without_tests(code: str) -> tuple[str, set[str]]:
    """The code with test items blanked, and the names of modules in other files that are for tests."""
    kept, modules = list(code), set()
    at = 0
    while found := ATTRIBUTE.search(code, at):
        end = closing(code, found.end() - 1)
        at = end
        if not is_for_tests(code[found.start() : end]):
            continue
        if found.group(1):
            return "", modules
        begin = end + len(code[end:]) - len(code[end:].lstrip())
        while other := ATTRIBUTE.match(code, begin):
            begin = closing(code, other.end() - 1)
            begin += len(code[begin:]) - len(code[begin:].lstrip())
        at = end_of_item(code, begin)
        if module := re.match(r"(?:pub\b\s*(?:\([^)]*\)\s*)?)?mod\s+(\w+)\s*;", code[begin:at]):
            modules.add(module.group(1))
        kept[found.start() : at] = re.sub(r"[^\n]", " ", code[found.start() : at])
    return "".join(kept), modules


def leaves(tree: str) -> Iterator[tuple[list[str], str]]:
    """The paths of a `use` tree, each with the name that it gets."""
    tree = tree.strip()
    brace = tree.find("{")
    if brace >= 0:
        prefix = [part.strip() for part in tree[:brace].split("::") if part.strip()]
        inner, depth, piece = tree[brace + 1 : closing(tree, brace) - 1], 0, ""
        for letter in inner + ",":
            depth += (letter in OPEN) - (letter in CLOSE)
            if letter == "," and depth == 0:
                if piece.strip():
                    for path, name in leaves(piece):
                        yield prefix + path, name if path != ["self"] else prefix[-1]
                piece = ""
            else:
                piece += letter
        return
    path, _, alias = re.sub(r"\s+as\s+", "\0", tree).partition("\0")
    parts = [part.strip() for part in path.split("::") if part.strip()]
    yield parts, alias.strip() or parts[-1]


class Crate:
    def __init__(self, folder: Path):
        self.folder = folder
        self.code: dict[Path, str] = {}
        # Modules of tests, by their path below the crate.
        tests: set[tuple[str, ...]] = set()
        for path in rust_files(folder):
            code, modules = without_tests(split(path.read_text(encoding="utf-8"))[0])
            self.code[path] = code
            tests |= {(*self.module(path), name) for name in modules}
        for path in list(self.code):
            module = self.module(path)
            named = any(part == "tests" or part.endswith("_tests") for part in module)
            if named or any(module[:length] in tests for length in range(1, len(module) + 1)):
                del self.code[path]
        self.rooms = {self.module(path)[0] for path in self.code if self.module(path)}
        self.re_exports = dict(self.find_re_exports())

    def module(self, path: Path) -> tuple[str, ...]:
        parts = path.relative_to(self.folder).with_suffix("").parts
        return parts[:-1] if parts[-1] in ("mod", "lib", "main") else parts

    def find_re_exports(self) -> Iterator[tuple[str, str | None]]:
        """Names in lib.rs and the rooms that they come from; None where another crate has them."""
        code = self.code.get(self.folder / "lib.rs", "")
        for found in re.finditer(r"\buse\b([^;]*);", code):
            for path, name in leaves(found.group(1)):
                path = path[1:] if path[0] in ("crate", "self") else path
                yield name, path[0] if path[0] in self.rooms else None
        # An exported macro is at the top wherever it stands.
        for path, code in self.code.items():
            for found in re.finditer(r"\bmacro_rules!\s*(\w+)", code):
                if self.module(path):
                    yield found.group(1), self.module(path)[0]

    def target(self, module: tuple[str, ...], path: list[str]) -> str | None:
        """The room that a path leads to from a module; None outside the crate. KeyError: nowhere."""
        if path[0] == "crate":
            absolute = path[1:]
        else:
            ups = 0
            while ups < len(path) and path[ups] in ("super", "self"):
                ups += 1
            levels = path[:ups].count("super")
            if levels > len(module):
                raise KeyError("::".join(path))
            absolute = [*module[: len(module) - levels], *path[ups:]]
        if not absolute or absolute[0] in self.rooms:
            return absolute[0] if absolute else None
        return self.re_exports[absolute[0]]

    def paths(self, file: Path) -> Iterator[tuple[tuple[str, ...], list[str], int]]:
        """Every path of a file, with the module it stands in and its line."""
        code = re.sub(r"\bpub\s*\(\s*in\b[^)]*\)", lambda it: " " * len(it.group()), self.code[file])
        module, depth, inner = self.module(file), 0, []
        at = 0
        while token := TOKEN.search(code, at):
            at = token.end()
            line = code.count("\n", 0, token.start()) + 1
            here = (*module, *(name for name, _ in inner))
            if token.group().startswith("mod"):
                inner.append((token.group(1), depth))
                depth += 1
            elif token.group() == "{":
                depth += 1
            elif token.group() == "}":
                depth -= 1
                if inner and inner[-1][1] == depth:
                    inner.pop()
            elif token.group() == "use":
                # `impl Trait + use<'a>` captures lifetimes.
                if code[at:].lstrip().startswith("<"):
                    continue
                end = code.find(";", at)
                for path, _ in leaves(code[at:end]):
                    if path[0] in ("crate", "super", "self"):
                        yield here, path, line
                at = end
            else:
                yield here, [part.strip() for part in token.group().split("::")], line

    def arrows(self) -> Iterator[Arrow]:
        for file in self.code:
            module = self.module(file)
            if not module:
                continue
            for here, path, line in self.paths(file):
                place = f"{shown(file)}:{line}"
                try:
                    target = self.target(here, path)
                except KeyError:
                    yield Arrow(module[0], "?" + "::".join(path), place)
                    continue
                if target and target != module[0]:
                    yield Arrow(module[0], target, place)


    def files(self) -> dict[str, set[str]]:
        """The files that each file uses, by their paths below the crate."""
        files = {self.module(path): path for path in self.code}
        passed_on: dict[tuple[str, ...], dict[str, list[str]]] = defaultdict(dict)
        for module, path in files.items():
            for found in re.finditer(r"\buse\b([^;<]*);", self.code[path]):
                for names, name in leaves(found.group(1)):
                    passed_on[module][name] = names

        def home(module: tuple[str, ...], names: list[str], seen: int = 0) -> tuple[str, ...] | None:
            ups = 0
            while ups < len(names) and names[ups] in ("super", "self", "crate"):
                ups += 1
            levels = names[:ups].count("super")
            base = () if names[0] == "crate" else module[: len(module) - levels]
            rest = names[ups:]
            while rest and (*base, rest[0]) in files:
                base, rest = (*base, rest[0]), rest[1:]
            further = passed_on[base].get(rest[0]) if rest else None
            if further and further != names and seen < 9:
                return home(base, [*further, *rest[1:]], seen + 1)
            return base if base in files else None

        uses: dict[str, set[str]] = {}
        for module, path in files.items():
            found = {home(here, names) for here, names, _ in self.paths(path)}
            apart = {
                other
                for other in found
                if other is not None and other[: len(module)] != module and module[: len(other)] != other
            }
            uses["/".join(module)] = {"/".join(other) for other in apart}
        return uses


def circles(uses: dict[str, set[str]]) -> list[list[str]]:
    """The rooms that reach each other, by groups."""

    def reached(room: str) -> set[str]:
        seen, open_rooms = set(), [room]
        while open_rooms:
            for other in uses.get(open_rooms.pop(), ()):
                if other not in seen:
                    seen.add(other)
                    open_rooms.append(other)
        return seen

    reach = {room: reached(room) for room in uses}
    groups = []
    for room in sorted(uses):
        group = sorted(other for other in reach[room] if room in reach.get(other, ()))
        if group and group not in groups:
            groups.append(group)
    return groups


def check(folder: Path) -> bool:
    """Prints the arrows of a crate; whether it has no circle."""
    crate = Crate(folder)
    places: dict[tuple[str, str], list[str]] = defaultdict(list)
    lost = []
    for arrow in crate.arrows():
        if arrow.target.startswith("?"):
            lost.append(arrow)
        else:
            known = places[arrow.source, arrow.target]
            if arrow.place not in known:
                known.append(arrow.place)
    uses: dict[str, set[str]] = {room: set() for room in crate.rooms}
    for source, target in places:
        uses[source].add(target)
    print(f"{shown(folder)}: {len(crate.rooms)} rooms, {len(places)} arrows")
    for room in sorted(uses):
        targets = ", ".join(f"{target} {len(places[room, target])}" for target in sorted(uses[room]))
        print(f"  {room} -> {targets or 'nothing'}")
    for arrow in lost:
        print(f"{arrow.place}: {arrow.target[1:]} leads to no room, and lib.rs does not re-export it")
    groups = circles(uses)
    for group in groups:
        print(f"circle of {len(group)}: {', '.join(group)}; by the arrows that fewest places make:")
        inside = [pair for pair in places if pair[0] in group and pair[1] in group]
        for source, target in sorted(inside, key=lambda pair: (len(places[pair]), pair))[:20]:
            lines = places[source, target]
            more = f" and {len(lines) - 4} more" if len(lines) > 4 else ""
            print(f"  {source} -> {target}: {' '.join(lines[:4])}{more}")
    return not groups and not lost


def check_files(folder: Path) -> bool:
    """Prints the circles of a crate's files; whether it has none."""
    uses = Crate(folder).files()
    groups = circles(uses)
    for group in groups:
        print(f"{shown(folder)}: circle of {len(group)} files: {', '.join(group)}")
        for file in group:
            print(f"  {file} -> {', '.join(sorted(uses[file] & set(group)))}")
    return not groups


def main(arguments: list[str]) -> int:
    if "--help" in arguments or "-h" in arguments:
        print(__doc__.strip())
        return 0
    of_files = "--files" in arguments
    arguments = [argument for argument in arguments if argument != "--files"]
    repository = Path(__file__).resolve().parents[2]
    folders = [Path(name) for name in arguments or ("src", "bitstream-model/src")]
    passed = True
    for folder in folders:
        base = folder if arguments else repository / folder
        if not (base / "lib.rs").exists():
            print(f"{folder}: no lib.rs", file=sys.stderr)
            return 2
        passed &= check_files(base) if of_files else check(base)
    if not passed:
        print("expected no circle: move the shared type down, or the caller up", file=sys.stderr)
    return int(not passed)


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
