#!/usr/bin/env python3
"""Counts the product lines of each part, and fails where a part has more than its table says.

usage: lines.py [--write] [TABLE]      docs/architecture.md if no table; --write puts today's counts into it

A row of the table is `| part | lines |` with the part's path in backquotes. A file counts for the longest path that
holds it. A product line is neither blank nor a comment nor of a test: a file below a folder `tests`, named
`tests.rs` or `*_tests.rs`, or an item under `#[cfg(test)]`.

Exit code: 0 no part has grown, 1 a part has grown or is missing, 2 wrong usage.
"""

import re
import sys
from pathlib import Path

from circles import without_tests
from rust_text import rust_files, split

ROW = re.compile(r"^\| `([\w/.-]+)` \| ([\d,]+) \|$", re.MULTILINE)
TEST_FILE = re.compile(r"(^|/)tests/|(^|/)(\w*_)?tests\.rs$")


def product_lines(source: str) -> int:
    # Spaces become tabs first, so that a space stands only where an item of the tests was blanked.
    code = without_tests(split(source)[0].replace(" ", "\t"))[0]
    texts = (line.strip() for line, kept in zip(source.split("\n"), code.split("\n")) if " " not in kept)
    return sum(1 for text in texts if text and not text.startswith("//"))


def main(arguments: list[str]) -> int:
    write = arguments[:1] == ["--write"]
    rest = arguments[1:] if write else arguments
    if len(rest) > 1 or any(argument.startswith("-") for argument in rest):
        print(__doc__.strip())
        return 0 if rest == ["--help"] else 2
    table = Path(rest[0] if rest else "docs/architecture.md")
    text = table.read_text(encoding="utf-8")
    limits = {part: int(number.replace(",", "")) for part, number in ROW.findall(text)}
    root = table.resolve().parent.parent
    counts, homeless = dict.fromkeys(limits, 0), []
    for path in rust_files(root):
        name = str(path.relative_to(root))
        if TEST_FILE.search(name):
            continue
        part = max((part for part in limits if f"{name}/".startswith(f"{part}/")), key=len, default=None)
        if part:
            counts[part] += product_lines(path.read_text(encoding="utf-8"))
        else:
            homeless.append(name)
    for part, count in counts.items():
        print(f"{part:40} {count:7,} of {limits[part]:7,}")
    print(f"{'all':40} {sum(counts.values()):7,} of {sum(limits.values()):7,}")
    if write:
        counted = ROW.sub(lambda row: f"| `{row[1]}` | {counts[row[1]]:,} |", text)
        table.write_text(counted, encoding="utf-8")
        limits = counts
    grown = [part for part in limits if counts[part] > limits[part]]
    for part in grown:
        print(f"{part} has {counts[part] - limits[part]} lines more than {table} says: make it smaller", file=sys.stderr)
    for name in homeless:
        print(f"{name} is in no part of the table in {table}", file=sys.stderr)
    return 1 if grown or homeless or not limits else 0


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
