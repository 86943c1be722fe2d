#!/usr/bin/env python3
"""Prints the crates that a build contains, with the texts of their licences.

usage: licences.py TARGET PACKAGE...     for example aarch64-unknown-linux-gnu pgs zynq-pgs-c

The crates are those that cargo links, without the crates of this repository; the texts come from the
sources that cargo has fetched.

Exit code: 0 done, 1 a crate has no text and no licence, 2 wrong usage.
"""

import json
import subprocess
import sys
from pathlib import Path

# The beginnings of the names of files with a licence or a notice.
NAMES = ("licen", "copying", "copyright", "notice", "unlicense")


def crates(target, names):
    """The crates from a registry that the packages contain, by name."""
    command = ["cargo", "metadata", "--format-version=1", "--locked", "--filter-platform", target]
    metadata = json.loads(subprocess.run(command, check=True, stdout=subprocess.PIPE).stdout)
    packages = {package["id"]: package for package in metadata["packages"]}
    nodes = {node["id"]: node for node in metadata["resolve"]["nodes"]}
    waiting = [package["id"] for package in packages.values() if package["name"] in names]
    seen = set()
    while waiting:
        identity = waiting.pop()
        if identity in seen:
            continue
        seen.add(identity)
        for dependency in nodes[identity]["deps"]:
            if any(kind["kind"] is None for kind in dependency["dep_kinds"]):
                waiting.append(dependency["pkg"])
    found = (packages[identity] for identity in seen)
    return sorted((crate for crate in found if crate["source"]), key=lambda crate: crate["name"])


def texts(crate):
    """The names and texts of a crate's licence files."""
    folder = Path(crate["manifest_path"]).parent
    files = (path for path in folder.iterdir() if path.is_file() and path.name.lower().startswith(NAMES))
    return [(path.name, path.read_text(errors="replace").strip()) for path in sorted(files)]


def main(arguments):
    if len(arguments) < 2 or arguments[0].startswith("-"):
        print(__doc__, file=sys.stderr)
        return 2
    target, *names = arguments
    # Crates of one author share their texts.
    by_text = {}
    print("Crates in this package, with their licences; the texts follow.\n")
    for crate in crates(target, names):
        label = f"{crate['name']} {crate['version']}"
        if not crate["license"] and not texts(crate):
            print(f"error: {label} has no licence", file=sys.stderr)
            return 1
        print(f"{label}: {crate['license']}")
        for name, text in texts(crate):
            by_text.setdefault(text, []).append(f"{label}, {name}")
    for text, places in by_text.items():
        print("\n" + "=" * 80 + "\n" + "\n".join(places) + "\n\n" + text)
    return 0


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
