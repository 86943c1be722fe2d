"""Contacts and friction of rigid bodies on an FPGA accelerator, or on its emulated board.

`Accelerator` opens a board and takes steps; arrays of numpy go in, and the same arrays have the results.
"""

from ._driver import BODY, COLLISION, Accelerator, Error, Report, with_friction

__all__ = ["BODY", "COLLISION", "Accelerator", "Error", "Report", "with_friction"]
