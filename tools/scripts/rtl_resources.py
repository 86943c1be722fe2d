#!/usr/bin/env python3
"""Prints what a build of the accelerator takes of the XCZU9EG, part by part.

usage: rtl_resources.py [--brams LIMIT] STAT...
       rtl_resources.py --rule WITH WITHOUT STAT...

Each STAT is what Yosys' `stat -json` says of a synthesis that keeps the hierarchy. The first one has the
module `pgs_top` without the modules of the others. With `--rule`, it prints what the rule of the smallest
normal number takes: the folders WITH and WITHOUT have `fmul.json` and `fdiv.json`.

Exit code: 0 done, 1 the build is over a limit.
"""
import argparse
import json
import sys

# LUTs of a cell that holds memory.
LUT_MEMORY = {
    "SRL16E": 1, "SRLC16E": 1, "SRLC32E": 1, "RAM32X1S": 1, "RAM64X1S": 1, "RAM128X1S": 2, "RAM256X1S": 4,
    "RAM512X1S": 8, "RAM32X1D": 2, "RAM64X1D": 2, "RAM128X1D": 4, "RAM256X1D": 8, "RAM32M": 4, "RAM64M": 4,
    "RAM32M16": 8, "RAM64M8": 8,
}
# Yosys has inverters of its own, which take a LUT unless the tool after it moves them into another one.
LUT_LOGIC = {"LUT1", "LUT2", "LUT3", "LUT4", "LUT5", "LUT6", "INV"}
FLIP_FLOPS = {"FDRE", "FDSE", "FDCE", "FDPE"}
BLOCK_RAMS = {"RAMB18E2": 0.5, "RAMB36E2": 1}
# Beside the LUTs, in the same slices.
FREE = {"CARRY4", "CARRY8", "MUXF7", "MUXF8", "MUXF9", "GND", "VCC"}

LUT, MEMORY, FF, DSP, BRAM = range(5)
NAMES = ("LUT", "of memory", "FF", "DSP", "BRAM36")
DEVICE = (274_080, None, 548_160, 2_520, 912)
# Tables 6.4 and 6.8 of the thesis, percent of the device; with its DMA engines.
THESIS = {"6.4": (47, None, 32, 42, 70), "6.8": (49, None, 29, 42, 48)}
# For `float` with isotropic inertia and with world inertia, and for `half`.
LIMITS = {
    "float": {LUT: 132_000, FF: 110_000, DSP: 380},
    "world": {LUT: 150_000, FF: 130_000, DSP: 380},
    "half": {LUT: 115_000, FF: 90_000, DSP: 200},
}

# The part of a module and of all below it, unless one of them is a part of its own.
PARTS = {
    "solver": "solver: contact, friction, integration",
    "receiver": "streams",
    "sender": "streams",
    "finder": "finder with last uses, issue",
    "issue": "finder with last uses, issue",
    "queue": "issue queue",
    "issue_numbers": "issue queue",
    "true_dual_port": "velocities",
    "impulses": "impulses",
    "body_shapes": "shapes",
    "world_bodies": "masses and inertias",
    "half_finder": "finder with last uses, issue",
    "half_issue": "finder with last uses, issue",
    "two_banks": "velocities",
    "half_impulses": "impulses",
    "half_shapes": "shapes",
    "control_block": "control block",
}
REST = "sequence, load, constants, registers"
ORDER = [*dict.fromkeys(PARTS.values()), REST]


def modules_of(path):
    """The modules of a file. Yosys 0.23 writes a tree of text into the JSON behind them."""
    with open(path, encoding="utf-8") as file:
        text = file.read()
    start = text.index("{", text.index('"modules":'))
    return json.JSONDecoder().raw_decode(text, start)[0]


def plain(name):
    """The name of a module as the Verilog has it, without its parameters and the prefix of all modules."""
    return (name.split("\\")[1] if "\\" in name else name).removeprefix("pgs_")


def cost(cell):
    """What a cell of the device takes, or None."""
    taken = [0, 0, 0, 0, 0]
    if cell in LUT_MEMORY:
        taken[LUT] = taken[MEMORY] = LUT_MEMORY[cell]
    elif cell in LUT_LOGIC:
        taken[LUT] = 1
    elif cell in FLIP_FLOPS:
        taken[FF] = 1
    elif cell == "DSP48E2":
        taken[DSP] = 1
    elif cell in BLOCK_RAMS:
        taken[BRAM] = BLOCK_RAMS[cell]
    elif cell not in FREE:
        return None
    return taken


def add_up(modules, name, part, parts):
    """Adds the cells of a module and of all below it to their parts."""
    for cell, count in modules[name]["num_cells_by_type"].items():
        if isinstance(count, dict):
            count = count["count"]
        inner = cell if cell in modules else "\\" + cell
        if inner in modules:
            # The parts of a part are its own.
            inner_part = PARTS.get(plain(inner), part) if part == REST else part
            for _ in range(count):
                add_up(modules, inner, inner_part, parts)
        else:
            taken = cost(cell)
            if taken is None:
                sys.exit(f"error: unknown cell {cell} in {plain(name)}")
            if plain(name) == "ram_tile" and cell in FLIP_FLOPS:
                continue  # the output registers of its blocks
            row = parts.setdefault(part, [0] * 5)
            for i, one in enumerate(taken):
                row[i] += one * count


def instances(modules, name, wanted):
    """How often a module is below another one, or is it."""
    if plain(name) == wanted:
        return 1
    found = 0
    for cell, count in modules[name]["num_cells_by_type"].items():
        if isinstance(count, dict):
            count = count["count"]
        inner = cell if cell in modules else "\\" + cell
        if inner in modules:
            found += count * instances(modules, inner, wanted)
    return found


def print_rule(folders, modules):
    """Prints the cost of the rule of the smallest normal number, in each unit and in all of them."""
    print(line("smallest normal number, LUT (FF)", ("with", "without", "a unit", "units", "in all")))
    total = [0, 0]
    for operator in ("fmul", "fdiv"):
        taken = []
        for folder in folders:
            parts = {}
            add_up(modules_of(f"{folder}/pgs_{operator}.json"), "\\pgs_" + operator, operator, parts)
            taken.append(parts[operator])
        units = instances(modules, "\\pgs_top", operator)
        more = [taken[0][i] - taken[1][i] for i in (LUT, FF)]
        total = [sum_ + units * one for sum_, one in zip(total, more)]
        print(line(operator, (
            *(f"{row[LUT]:,} ({row[FF]:,})" for row in taken), f"{more[0]} ({more[1]})", units,
            f"{units * more[0]:,} ({units * more[1]:,})")))
    print(line("sum", ("", "", "", "", f"{total[0]:,} ({total[1]:,})")))


def line(label, values):
    """A line of the table."""
    return f"{label:<38}" + "".join(f"{value:>12}" for value in values)


def main():
    """Reads the statistics and prints the table."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawTextHelpFormatter)
    parser.add_argument("--brams", type=float, default=DEVICE[BRAM], metavar="LIMIT")
    parser.add_argument("--rule", nargs=2, metavar=("WITH", "WITHOUT"))
    parser.add_argument("stats", nargs="+", metavar="STAT")
    args = parser.parse_args()
    modules = {}
    for path in reversed(args.stats):
        for name, module in modules_of(path).items():
            # The modules that Yosys knows as black boxes have no cells.
            if name not in modules or module["num_cells"]:
                modules[name] = module
    if args.rule:
        print_rule(args.rule, modules)
        return
    parts = {}
    add_up(modules, "\\pgs_top", REST, parts)
    sums = [sum(row[i] for row in parts.values()) for i in range(5)]

    print(line("part", NAMES))
    for part in ORDER:
        if part in parts:
            print(line(part, (f"{value:,}" for value in parts[part])))
    print(line("sum", (f"{value:,}" for value in sums)))
    print(line("XCZU9EG", (f"{value:,}" if value else "" for value in DEVICE)))
    print(line("share", (f"{100 * value / all_:.1f} %" if all_ else "" for value, all_ in zip(sums, DEVICE))))
    half = any(plain(name) == "half_core" for name in modules)
    table = "6.8" if half else "6.4"
    print(line(f"thesis, table {table}, with DMA engines", (f"{value} %" if value else "" for value in THESIS[table])))

    build = "half" if half else "world" if PARTS["world_bodies"] in parts else "float"
    limits = {**LIMITS[build], BRAM: args.brams}
    over = [f"{sums[i]:,} {NAMES[i]}, limit {limit:,}" for i, limit in limits.items() if sums[i] > limit]
    if over:
        sys.exit("error: " + "; ".join(over))


if __name__ == "__main__":
    main()
