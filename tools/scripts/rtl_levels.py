#!/usr/bin/env python3
"""Counts what makes paths slow in netlists for UltraScale+, part by part.

usage: rtl_levels.py NETLIST...     BLIF files of Yosys, flat

For each part of a netlist, which is the outermost instance that a register is in, without the digits of its name:
the path through the most LUTs that ends at one of its registers or at a pin of a memory or multiplier, with the
carries on it; then how many multipliers and block RAMs have nothing but registers on either side, which a tool can
take into them.

A LUT or a LUT memory is a level; the wide multiplexers behind LUTs are none. Carries are counted in fours of bits.
Paths from and to the ports of a netlist count as well.
"""
import collections
import functools
import re
import sys

REGISTERS = re.compile(r"FD[RSCP]E|SRL")
HARD = re.compile(r"DSP|RAMB")
LEVEL = re.compile(r"LUT|RAM\d+|INV")
CLOCKS = {"C", "CLK", "WCLK", "CLKARDCLK", "CLKBWRCLK"}
# Outputs of the primitives; of LUT memories all that begin with DO.
OUTPUTS = re.compile(r"(O|CO|Q|Q15|Q31|P|PCOUT|ACOUT|BCOUT|DO\w*|SPO|DPO)(\[\d+\])?$")


class Netlist:
    """Drivers of the nets, and the cells that end a path."""

    def __init__(self, path):
        self.drivers, self.ends = {}, []
        self.hard = []
        with open(path, encoding="utf-8") as file:
            text = file.read().replace("\\\n", " ")
        for line in text.splitlines():
            words = line.split()
            if line.startswith(".names") and len(words) == 3:
                self.drivers[words[2]] = ("", [words[1]])
            elif line.startswith((".subckt", ".gate")):
                self.add(words[1], [pin.split("=", 1) for pin in words[2:]])

    def add(self, cell, pins):
        """Takes a cell in."""
        inputs = [net for pin, net in pins if not OUTPUTS.match(pin) and pin not in CLOCKS]
        outputs = [net for pin, net in pins if OUTPUTS.match(pin)]
        if REGISTERS.match(cell) or HARD.match(cell):
            self.ends.append((outputs[0] if outputs else cell, inputs))
            if HARD.match(cell):
                self.hard.append((cell, inputs, outputs))
            return
        if cell.startswith("CARRY"):
            # A bit depends on the bits below.
            for pin, net in pins:
                found = re.match(r"(O|CO)\[(\d)\]", pin)
                if found:
                    top = int(found[2])
                    below = [n for p, n in pins if p in ("CI", "CYINIT")
                             or re.match(r"(S|DI)\[[0-%d]\]" % top, p)]
                    self.drivers[net] = ("CARRY", below)
            return
        for net in outputs:
            self.drivers[net] = (cell, inputs)

    @functools.cache
    def depth(self, net):
        """LUTs and fours of carry bits in front of a net, and the net where the path begins."""
        if net not in self.drivers:
            return 0, 0, net
        cell, inputs = self.drivers[net]
        luts, carries, start = max((self.depth(i) for i in inputs), default=(0, 0, net))
        return luts + bool(LEVEL.match(cell)), carries + (cell == "CARRY"), start

    def registered(self):
        """Kinds of multipliers and memories: how many there are, with registers in front and behind alone."""
        read = {self.source(n) for cell, inputs in self.drivers.values() if cell for n in inputs}
        read |= {self.source(n) for _, inputs, _ in self.hard for n in inputs}
        found = collections.defaultdict(lambda: [0, 0, 0])
        for cell, inputs, outputs in self.hard:
            found[cell][0] += 1
            found[cell][1] += all(self.depth(n)[:2] == (0, 0) for n in inputs)
            found[cell][2] += not read.intersection(outputs)
        return sorted(found.items())

    def source(self, net):
        """The net without other names of it."""
        while self.drivers.get(net, ("x",))[0] == "":
            net = self.drivers[net][1][0]
        return net


def part_of(net):
    """The outermost instance in which a net is."""
    named = "." in net and not net.startswith("$")
    return re.sub(r"\d+", "*", net.split(".")[0]) if named else "(here)"


def main():
    """Prints the tables."""
    if len(sys.argv) < 2:
        sys.exit(__doc__)
    sys.setrecursionlimit(1_000_000)
    for path in sys.argv[1:]:
        netlist = Netlist(path)
        parts = {}
        for end, inputs in netlist.ends:
            for net in inputs:
                found = (*netlist.depth(net), end)
                part = part_of(end)
                if part not in parts or found[:2] > parts[part][:2]:
                    parts[part] = found
        print(path.rsplit("/", 1)[-1].removesuffix(".blif"))
        for part, (luts, carries, start, end) in sorted(parts.items(), key=lambda p: p[1][:2], reverse=True):
            carry = f" and {carries} of carry" if carries else ""
            print(f"  {luts:3} levels{carry:16}  {part:28} {start} -> {end}")
        for cell, (count, front, behind) in netlist.registered():
            print(f"  {count:5} {cell}, {front} with registers in front, {behind} behind")


if __name__ == "__main__":
    main()
