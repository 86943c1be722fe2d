#!/usr/bin/env python3
"""Reads the Verilog in the current folder, listed in pgs.f, with slang, and prints its errors and warnings.

usage: rtl_slang.py TOP

Needs pyslang from PyPI. Exit code: 0 no error and no warning, 1 else.
"""

import sys

from pyslang.driver import Driver


def main():
    """The program of slang, as its own driver runs it."""
    if len(sys.argv) != 2:
        sys.exit(__doc__)
    driver = Driver()
    driver.addStandardArgs()
    with open("pgs.f", encoding="utf-8") as file:
        sources = " ".join(file.read().split())
    read = (driver.parseCommandLine(f"slang --top {sys.argv[1]} -I . -Wextra -Werror {sources}")
            and driver.processOptions() and driver.parseAllSources())
    if read:
        driver.reportCompilation(driver.createCompilation(), True)
        read = driver.reportDiagnostics(True)
    sys.exit(0 if read else 1)


if __name__ == "__main__":
    main()
