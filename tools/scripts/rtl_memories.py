#!/usr/bin/env python3
"""Counts the block RAM of a build by the shapes of UltraScale's blocks (UG573), without a tool's choice.

usage: rtl_memories.py [--brams LIMIT] DESIGN

DESIGN is what Yosys' `write_json` says of the design after `proc`. A memory counts if its Verilog asks for block
RAM. One that is deeper than a block would leave the choice of a shape to a tool: that is an error.

Exit code: 0 done, 1 a memory is too deep for a block, or the sum is over the limit.
"""
import argparse
import json
import sys

# Words and bits of a whole block, and of half of one, from the widest on.
WHOLE = ((1024, 36), (2048, 18), (4096, 9), (8192, 4), (16384, 2), (32768, 1))
HALF = ((1024, 18), (2048, 9), (4096, 4), (8192, 2), (16384, 1))


def widest(shapes, words):
    """The bits of the widest shape that is deep enough, or 0."""
    return next((bits for depth, bits in shapes if depth >= words), 0)


def blocks(words, bits):
    """The blocks side by side that hold a memory, and the bits of each."""
    wide, narrow = widest(WHOLE, words), widest(HALF, words)
    if wide == 0:
        return None, 0
    columns, rest = divmod(bits, wide)
    return columns + (0 if rest == 0 else 0.5 if rest <= narrow else 1), wide


def memories(modules, name, path, found):
    """Adds the block memories of a module and of all below it to the counts, by place and shape."""
    module = modules[name]
    for memory in module.get("memories", {}).values():
        if memory["attributes"].get("ram_style") == "block":
            key = (path, memory["size"], memory["width"])
            found[key] = found.get(key, 0) + 1
    for cell, what in module["cells"].items():
        if what["type"] in modules:
            # An instance's place is the nearest name that is not one of many alike.
            plain = not cell.startswith("g_") and what["type"].split("\\")[-1] not in ("pgs_ram_lane", "pgs_ram_tile")
            memories(modules, what["type"], cell if plain and "." not in cell else path, found)


def main():
    parser = argparse.ArgumentParser()
    parser.add_argument("--brams", type=float, default=880)
    parser.add_argument("design")
    arguments = parser.parse_args()
    with open(arguments.design, encoding="utf-8") as file:
        modules = json.load(file)["modules"]
    top = next(name for name, module in modules.items() if "top" in module["attributes"])
    found = {}
    memories(modules, top, top, found)
    total = 0
    print("| memory | words | bits | of this shape | bits of a block | BRAM36 |\n|---|---|---|---|---|---|")
    for (path, words, bits), count in sorted(found.items(), key=lambda item: (item[0][0], -item[0][2])):
        each, wide = blocks(words, bits)
        if each is None:
            sys.exit(f"error: {path} has {words:,} words, more than a block of any shape")
        total += each * count
        print(f"| {path} | {words:,} | {bits} | {count} | {wide} | {each * count:g} |")
    print(f"| **sum** | | | | | **{total:g}** |")
    if total > arguments.brams:
        sys.exit(f"error: {total:g} BRAM36, and at most {arguments.brams:g} may be taken")


if __name__ == "__main__":
    main()
