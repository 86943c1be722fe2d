#!/usr/bin/env python3
"""Counts the registers that each clock enable of a design drives.

usage: rtl_enables.py MOST FILE     RTLIL of Yosys, flat but for the modules pgs_delay

A delay of more than two slots is LUT memory, which takes the enable once a bit, however long it is;
a register in it counts as well. Fails if an enable drives more than MOST.
"""
import collections
import re
import sys

REGISTERS = re.compile(r"\$(s|a|al)?dffc?e$")


def modules(path):
    """Each module: cells, as kind, parameter WIDTH and connections; and widths of wires."""
    found, cell = {}, None
    with open(path, encoding="utf-8") as file:
        for line in file:
            words = line.split()
            if not words:
                continue
            if words[0] == "module":
                cells, wires = found.setdefault(words[1], ([], {}))
            elif words[0] == "wire":
                wires[words[-1]] = int(words[words.index("width") + 1]) if "width" in words else 1
            elif words[0] == "cell":
                cell = [words[1], 0, {}]
                cells.append(cell)
            elif words[0] == "parameter" and words[1] == "\\WIDTH" and cell:
                cell[1] = int(words[2])
            elif words[0] == "connect" and cell:
                cell[2][words[1]] = " ".join(words[2:])
            elif words[0] == "end":
                cell = None
    return found


def main():
    """Prints the largest fan-outs."""
    if len(sys.argv) != 3:
        sys.exit(__doc__)
    most, found = int(sys.argv[1]), modules(sys.argv[2])
    delays = {}
    for name, (cells, wires) in found.items():
        if "pgs_delay" in name:
            width = wires["\\q"]
            bits = [cell[1] for cell in cells if REGISTERS.match(cell[0])]
            delays[name] = sum(b if b <= 2 * width else width for b in bits)
            delays[name] += width * any(cell[0].startswith("$mem") for cell in cells)
    driven = collections.Counter()
    for name, (cells, _) in found.items():
        if name in delays:
            continue
        for kind, width, pins in cells:
            if REGISTERS.match(kind):
                driven[pins["\\EN"]] += width
            elif kind in delays:
                driven[pins["\\enable"]] += delays[kind]
    # Where the enable is a constant, no net drives it.
    nets = {net: count for net, count in driven.items() if net.startswith("\\")}
    driven = collections.Counter(nets)
    print("registers that a clock enable drives, the most:")
    for net, count in driven.most_common(5):
        print(f"  {count:5}  {net.removeprefix(chr(92))}")
    if not delays or driven.most_common(1)[0][1] > most:
        sys.exit(f"error: a clock enable drives more than {most} registers")


if __name__ == "__main__":
    main()
