#!/usr/bin/env python3
"""Takes whole steps of the driver, through registers and DMA, on simulators of the generated Verilog and on
the model, and compares them: bits, stalls, hazards and cycles.

usage: rtl_steps.py PGS INTERLOCKED UNCHECKED FOLDER...

PGS is the program of the command line; INTERLOCKED and UNCHECKED are simulators that `rtlgen simulator`
built; each FOLDER holds a recorded step. Exit code: 0 all equal, 1 something differs.
"""
import json
import subprocess
import sys

# Largest difference of the cycles where the memory's bandwidth makes the streams wait: a share of a step, and
# two exchanges of beats with the simulator, which come every 64 clocks.
CYCLES_TOLERANCE = 0.0002
EXCHANGES = 2 * 64
# Largest difference elsewhere: the start of the hardware takes clocks in which the first beats come.
START = 1
# Seconds that a command may take; a run of 60 steps as given takes a simulator an hour.
LIMIT = 3 * 3600
# Figures that are equal at any bandwidth; where no stream waits, the stalls are equal, too.
EXACT = ("digest", "hazards", "work_cycles")


def pgs(program, verb, *options):
    """The JSON document of a command on an emulated board, and its exit code."""
    command = [program, *verb, "--json", *options]
    ran = subprocess.run(command, capture_output=True, text=True, timeout=LIMIT)
    if ran.returncode not in (0, 1):
        sys.exit(f"{' '.join(command)}: exit code {ran.returncode}\n{ran.stderr}")
    return json.loads(ran.stdout), ran.returncode


def figures(document):
    """The figures of a solved step that two accelerators are compared by."""
    step = document["step"]
    return {
        "digest": document["digest"]["value"],
        "stalls": step["cycles"]["stalls"],
        "hazards": step["hazards"],
        "work_cycles": step["cycles"]["formula"],
        "cycles": step["cycles"]["total"],
    }


def differences(model, hardware, bandwidth):
    """The names of the figures that differ by more than they may."""
    exact = EXACT + ("stalls",) if bandwidth == "unlimited" else EXACT
    names = [name for name in exact if model[name] != hardware[name]]
    cycles = abs(model["cycles"] - hardware["cycles"])
    allowed = START if bandwidth == "unlimited" else max(CYCLES_TOLERANCE * model["cycles"], EXCHANGES)
    return names + (["cycles"] if cycles > allowed else [])


def main():
    if len(sys.argv) < 5:
        sys.exit(__doc__)
    program, interlocked, unchecked, *folders = sys.argv[1:]
    failed = 0
    for folder in folders:
        for hazards, simulator in (("interlocked", interlocked), ("unchecked", unchecked)):
            for bandwidth in ("12.8", "unlimited"):
                verb = ["solve", folder]
                options = ["--board", f"emulated:float,{hazards},bandwidth={bandwidth}"]
                if hazards == "interlocked":
                    verb.append("--compare")
                on_model = (*options, "--accelerator", "model")
                model = figures(pgs(program, verb, *on_model)[0])
                found, code = pgs(program, verb, *options, "--accelerator", f"rtl:{simulator}")
                hardware = figures(found)
                wrong = differences(model, hardware, bandwidth)
                wrong += ["recorded bits"] if code else []
                failed += bool(wrong)
                result = f"differs from {model}: {', '.join(wrong)}" if wrong else "the model's"
                print(f"{folder} {hazards} {bandwidth}: {hardware}: {result}", flush=True)
    for options in (["--order", "as-given"], ["--order", "auto"], ["--order", "auto", "--warm-start"]):
        verb = ["run", "--board", "emulated", "--grid", "5x5x5", "--steps", "60", *options]
        model = pgs(program, verb, "--accelerator", "model")[0]["digest"]["value"]
        hardware = pgs(program, verb, "--accelerator", f"rtl:{interlocked}")[0]["digest"]["value"]
        failed += model != hardware
        print(f"{' '.join(verb)}: {hardware}, model {model}", flush=True)
    return 1 if failed else 0


if __name__ == "__main__":
    sys.exit(main())
