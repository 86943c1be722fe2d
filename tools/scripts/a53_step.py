#!/usr/bin/env python3
"""Counts a step of the driver on a Cortex-A53, and solvers in software beside it: the tables of docs/worth.md.

usage: a53_step.py PGS PLUGIN [--quick] [FOLDER]

PGS is the aarch64 build, PLUGIN is a53/plugin.c as a library. A step of a scene is the difference of two runs of
`pgs run`; the second has one step more. FOLDER is a step in arrays, solved once, cold. --quick leaves all scenes but
the smallest out. What the driver takes is held against its budget, and what `pgs` prints of it on paper
(tools/pgs/src/a53.rs) against the count.
"""
import json
import re
import subprocess
import sys

CLOCKS = 1.2e6  # a ms (ZCU102: AMD UG1182)
WATTS = 15.0  # of the board (thesis, table 6.11)
CORES = (1, 2, 4)
# GB/s that 1, 2 and 4 cores copy: docs/worth.md, "The model of the processor".
COPIES = {1: 1.96, 2: 3.12, 4: 3.61}
# Bytes that the driver writes a collision, and writes and reads a body (specification, section 2).
OF_COLLISION, OF_BODY = 112, 128
# Parts of the symbols of a group's functions; the first group that fits takes a function.
PARTS = {
    "detection": ["5scene6detect", "6parry3d"],
    "points": ["9last_step5Place7nearest"],
    "order": ["8zynq_pgs5order", "8zynq_pgs4step8ordering"],
    "bodies": ["8zynq_pgs4beat6bodies", "8zynq_pgs6record4body"],
    "results": ["8zynq_pgs4beat7results", "8zynq_pgs4step7results", "8zynq_pgs6record6result", "4beat4deal6Joiner"],
    "commit": ["8zynq_pgs4step8impulses", "8LastStep6commit", "4beat4deal12sum_of_words"],
    "pack": ["8zynq_pgs4beat", "8zynq_pgs6record", "8zynq_pgs5scene", "last_step"],
    "driver": ["8zynq_pgs4step", "8zynq_pgs5board", "8zynq_pgs8axi_dma", "8zynq_pgs13control_block"],
    "validate": ["8zynq_pgs8validate"],
    "lanes": ["15bitstream_model4fast", "11pgs_support"],
}
HOST = ("points", "order", "pack", "bodies", "results", "commit", "driver")
# A first step has no buffers yet, and checks everything once more before it takes them: no later step does.
ONCE = "validate"
# Parts that are told of a body; the others are told of a collision.
OF_BODIES = ("bodies", "results")
# Aarch64 instructions a collision that a step may take at most; packing has the beats of the bodies in it.
BUDGET = {"order": 5, "cold": 148, "warm": 265}


def count(pgs, plugin, arguments):
    """What each group took, [instructions, clocks], and the document that `pgs` printed."""
    groups = [f"group={name}:{part}" for name, parts in PARTS.items() for part in parts]
    command = ["qemu-aarch64", "-d", "plugin", "-D", "/dev/null", "-cpu", "cortex-a53"]
    command += ["-plugin", ",".join([plugin, *groups]), pgs, *arguments, "--threads", "1", "--json"]
    done = subprocess.run(command, capture_output=True, text=True, check=False)
    if done.returncode != 0:
        sys.exit(f"error: pgs {' '.join(arguments)}: {done.stderr.strip()[-300:]}")
    found = {name: [0.0, 0.0] for name in PARTS}
    for name, instructions, clocks in re.findall(r"^a53 (\S+) (\d+) (\d+)", done.stderr, re.M):
        found[name][0] += int(instructions)
        found[name][1] += int(clocks)
    return found, json.loads(done.stdout)


class Step:
    """One step: the work of each group, and what the board takes."""

    def __init__(self, title, work, step):
        self.title, self.work = title, work
        self.bodies, self.collisions, self.board = step["bodies"], step["collisions"], step["modelled_ms"]
        self.passes = step["passes"]
        self.paper = step["host_on_a53_ms"]

    def milliseconds(self, groups, cores):
        """Shared evenly by the cores; packing takes at least as long as copying its bytes."""
        clocks = sum(self.work[name][1] for name in groups) / cores / CLOCKS
        copied = self.collisions * OF_COLLISION + self.bodies * OF_BODY if "pack" in groups else 0
        return max(clocks, copied / COPIES[cores] / 1e6)

    def instructions(self, *groups):
        return sum(self.work[name][0] for name in groups) / self.collisions

    def nanoseconds(self, group):
        """On one core, a collision or a body."""
        return self.work[group][1] / CLOCKS * 1e6 / (self.bodies if group in OF_BODIES else self.collisions)

    def compare(self):
        """Fails where a part that `pgs` prints on paper is off by a tenth, and by a hundredth of the whole."""
        whole = sum(self.work[name][1] for name in HOST) / 4 / CLOCKS
        for name in ("detection", *HOST):
            counted, paper = self.work[name][1] / 4 / CLOCKS, self.paper[name]
            if abs(counted - paper) > max(counted / 10, whole / 100):
                sys.exit(f"error: {self.title}: {name} takes {counted:.3f} ms on four cores by the count, {paper:.3f} ms "
                         "by tools/pgs/src/a53.rs: take the figure of the last table")

    def compare_software(self):
        """The same of the step in software, which has no part that is small beside another one."""
        counted, paper = self.work["lanes"][1] / 4 / CLOCKS, self.paper["software"]
        if abs(counted - paper) > counted / 10:
            sys.exit(f"error: {self.title}: in software {counted:.3f} ms on four cores by the count, {paper:.3f} ms by "
                     "tools/pgs/src/a53.rs: take the figures below the last table")


def scene_step(pgs, plugin, title, arguments, steps):
    """The step behind STEPS steps of a scene."""
    runs = [count(pgs, plugin, ["run", "--board", "emulated", *arguments, "--steps", str(n)]) for n in (steps, steps + 1)]
    (before, _), (behind, document) = runs
    work = {name: [b - a for a, b in zip(before[name], behind[name])] for name in PARTS}
    work["driver"] = [a + b for a, b in zip(work["driver"], work.pop(ONCE))]
    return Step(title, work, document["steps"][-1])


def show(steps):
    """Prints all tables."""
    print("| aarch64 instructions a collision | points by the nearest | order | check and pack | bodies | results | other"
          " | detection |")
    print("|---|---|---|---|---|---|---|---|")
    for step in steps:
        columns = ["points"], ["order"], ["pack"], ["bodies"], ["results", "commit"], ["driver"], ["detection"]
        cells = [step.instructions(*names) for names in columns]
        print(f"| {step.title} | " + " | ".join(f"{cell:,.1f}" for cell in cells) + " |")
    print()
    print("| ms on paper | driver, 1 core | 2 | 4 | board | board + driver, 4 cores | overlapped | solver in lanes, 4 cores"
          " | board + driver faster by | overlapped | search, 4 cores | mJ, board + driver | solver |")
    print("|---|" + "---|" * 12)
    for step in steps:
        host = [step.milliseconds(HOST, cores) for cores in CORES]
        lanes, search = step.milliseconds(["lanes"], 4), step.milliseconds(["detection"], 4)
        serial, overlapped = host[-1] + step.board, max(host[-1], step.board)
        cells = [*host, step.board, serial, overlapped, lanes, lanes / serial, lanes / overlapped, search]
        cells += [serial * WATTS, lanes * WATTS]
        print(f"| {step.title} | " + " | ".join(f"{cell:,.2f}" for cell in cells) + " |")
    print()
    parts = ("detection", *HOST)
    print("| ns on one core | " + " | ".join(f"{name}, a {'body' if name in OF_BODIES else 'collision'}" for name in parts) + " |")
    print("|---|" + "---|" * len(parts))
    for step in steps:
        print(f"| {step.title} | " + " | ".join(f"{step.nanoseconds(name):,.1f}" for name in parts) + " |")
    print()
    for few, many in zip(steps, steps[2:]):
        if few.passes < many.passes and few.collisions == many.collisions:
            first, second = few.nanoseconds("lanes"), many.nanoseconds("lanes")
            a_pass = (second - first) / (many.passes - few.passes)
            print(f"{few.title}, {many.title}: in software {first - few.passes * a_pass:.1f} ns a collision and "
                  f"{a_pass:.1f} ns a collision and pass, on one core")


def hold(title, found, limit):
    """Fails where a count is above its budget."""
    print(f"{title}: {found:.1f} instructions a collision, at most {limit}")
    if found > limit:
        sys.exit(f"error: {title} takes {found:.1f} aarch64 instructions a collision, at most {limit} are budgeted")


def main():
    arguments = [argument for argument in sys.argv[1:] if argument != "--quick"]
    if len(arguments) not in (2, 3):
        sys.exit(__doc__)
    quick, (pgs, plugin, *folder) = "--quick" in sys.argv, arguments
    steps = []
    grids = {"10x10x10": 8, "20x20x20": 4, "36x30x36": 2}
    for grid, before in list(grids.items())[: 1 if quick else None]:
        for passes in (4, 10):
            for warm in (False, True):
                options = ["--grid", grid, "--drop", "0.01", f"--warm-start={str(warm).lower()}"]
                options += ["--contact-iterations", str(passes), "--friction-iterations", str(passes)]
                title = f"{grid}, {passes} + {passes}, {'warm' if warm else 'cold'}"
                steps.append(scene_step(pgs, plugin, title, options, before))
                print(f"{title}: counted", file=sys.stderr)
    for path in folder:
        work, document = count(pgs, plugin, ["solve", path, "--board", "emulated"])
        steps.append(Step(path.rstrip("/").rsplit("/", 1)[-1] + ", cold", work, document["step"]))
    show(steps)
    print()
    for step in steps:
        if step.title.startswith(tuple(grids)):
            step.compare_software()
        if step.title.startswith(tuple(grids)) and "10 + 10" not in step.title:
            step.compare()
        if step.title.startswith("10x10x10, 4"):
            kind = "warm" if "warm" in step.title else "cold"
            hold(f"order, {kind}", step.instructions("order"), BUDGET["order"])
            hold(f"check and pack, {kind}", step.instructions("order", "pack"), BUDGET[kind])


main()
