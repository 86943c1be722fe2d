#!/usr/bin/env python3
"""Lists runs of six and more equal lines of product code, and fails for one that has no reason.

usage: duplicates.py [FOLDER]      this folder, if none is given

Blank lines, comments, `use`, lone punctuation and tests do not count. A pair of files is one row, with its
longest run. REASONS says why a pair stays; a reason whose pair has gone is told. More than 20 pairs fail, too.

Exit code: 0 every run has a reason, 1 one has none or there are too many, 2 wrong usage.
"""

import re
import sys
from collections import defaultdict
from pathlib import Path

from circles import without_tests
from lines import TEST_FILE
from rust_text import rust_files, split

RUN, MOST = 6, 20
PASSED_OVER = re.compile(r"[\W_]*|//.*|(pub(\(\w+\))? )?(use|mod) .*;")
REASONS: dict[tuple[str, str], str] = {
    (
        "bitstream-model/interface/src/number.rs",
        "bitstream-model/interface/src/number.rs",
    ): "two formats with the same two values: words of a stream, and operators",
    (
        "bitstream-model/src/accelerator/mod.rs",
        "bitstream-model/src/external/mod.rs",
    ): "one signature: the model, and the simulator in its place",
    (
        "bitstream-model/src/accelerator/solver.rs",
        "bitstream-model/src/accelerator/solver.rs",
    ): "the heads of the two kinds of pass, as in the specification",
    (
        "bitstream-model/src/axi_dma/mod.rs",
        "bitstream-model/src/axi_dma/mover.rs",
    ): "one signature: the core, and its channel",
    (
        "bitstream-model/src/axi_dma/mover.rs",
        "bitstream-model/src/axi_dma/mover.rs",
    ): "how a transfer ends in both modes: what follows differs, and a function would return four outcomes",
    (
        "bitstream-model/src/memory/external.rs",
        "bitstream-model/src/memory/mod.rs",
    ): "one signature: memory, and memory outside the board",
    (
        "bitstream-model/support/src/lanes/x86.rs",
        "bitstream-model/support/src/lanes/x86.rs",
    ): "the head of one operation for each of two sets of instructions",
    (
        "src/platform/linux/uio_window.rs",
        "src/platform/memory/reserved.rs",
    ): "two public types with an address and a length",
    ("src/scene/body.rs", "src/scene/body.rs"): "a list and an array of bodies: a trait has no way to say either",
    (
        "src/scene/collision.rs",
        "tools/capi/src/collision.rs",
    ): "C has the driver's layout, which a test compares word by word",
    (
        "src/scene/collisions.rs",
        "src/step/last_step.rs",
    ): "two views of collisions with impulses: a trait hands on no methods",
    ("src/step/ordering.rs", "src/step/ordering.rs"): "two signatures: the order as asked for, and the cheapest",
    ("src/step/pack.rs", "src/step/written.rs"): "the fields of a packed step, from two sources",
    ("src/step/written.rs", "src/step/written.rs"): "a public function of the accelerator and of a step in flight",
    ("tools/pgs/src/verbs/run/mod.rs", "tools/pgs/src/verbs/solve.rs"): "the groups of options that two verbs have",
    (
        "tools/rtlgen/src/equations/contact.rs",
        "tools/rtlgen/src/equations/friction.rs",
    ): "the inputs of the two kinds of pass",
}


def lines_of(path: Path) -> list[tuple[int, str]]:
    source = path.read_text(encoding="utf-8")
    code = without_tests(split(source)[0].replace(" ", "\t"))[0].split("\n")
    numbered = enumerate(zip(source.split("\n"), code), 1)
    texts = ((number, line.strip()) for number, (line, kept) in numbered if " " not in kept)
    return [(number, text) for number, text in texts if not PASSED_OVER.fullmatch(text)]


def runs(files: dict[str, list[tuple[int, str]]]) -> dict[tuple[str, str], tuple[int, int, int]]:
    """The longest run of each pair of files: its counted lines, and its first line in either."""
    places, longest = defaultdict(list), {}
    for name, lines in files.items():
        for at in range(len(lines) - RUN + 1):
            places[tuple(text for _, text in lines[at : at + RUN])].append((name, at))
    for found in places.values():
        for place, (one, at) in enumerate(found):
            for other, there in found[place + 1 :]:
                length = 0
                for (_, left), (_, right) in zip(files[one][at:], files[other][there:]):
                    if left != right or (one == other and at + length >= there):
                        break
                    length += 1
                if length >= RUN:
                    row = (length, files[one][at][0], files[other][there][0])
                    longest[one, other] = max(row, longest.get((one, other), row))
    return longest


def main(arguments: list[str]) -> int:
    if len(arguments) > 1 or any(argument.startswith("-") for argument in arguments):
        print(__doc__.strip())
        return 0 if arguments == ["--help"] else 2
    root = Path(arguments[0] if arguments else ".")
    names = {str(path.relative_to(root)): path for path in rust_files(root)}
    found = runs({name: lines_of(path) for name, path in names.items() if not TEST_FILE.search(name)})
    for (one, other), (length, at, there) in sorted(found.items(), key=lambda row: -row[1][0]):
        print(f"{length:3} lines {one}:{at} ~ {other}:{there}  {REASONS.get((one, other), 'no reason given')}")
    unexplained = found.keys() - REASONS.keys()
    for one, other in sorted(unexplained):
        print(f"{one} and {other} share a run: share the code, or say in REASONS why not", file=sys.stderr)
    for one, other in sorted(REASONS.keys() - found.keys() if not arguments else []):
        print(f"{one} and {other} share no run any more: remove the reason", file=sys.stderr)
    if len(found) > MOST:
        print(f"{len(found)} pairs share runs, at most {MOST} may", file=sys.stderr)
    return 1 if unexplained or len(found) > MOST else 0


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
