"""The compiled module. Units are m, s, kg and rad, in the world frame; quaternions are x, y, z, w."""

from collections.abc import Mapping
from types import TracebackType
from typing import Any, Literal, TypedDict, Union

import numpy as np
from numpy.typing import ArrayLike, NDArray
from typing_extensions import Self, Unpack

BODY: np.dtype[np.void]
"""A body: `position`, `orientation`, `linear_velocity`, `angular_velocity`, and the index of its `shape`."""

COLLISION: np.dtype[np.void]
"""A collision: `body_a`, `body_b`, `normal` from B to A, `count`, and four `contacts`, each with a `point` on B and
a `distance`, negative where the bodies overlap."""

Bodies = Union[NDArray[np.void], Mapping[str, NDArray[Any]]]
"""An array with the fields of `BODY` and any others, or a dict of arrays by the same names: float32 or float64, all
alike, of 3 or 4 columns, and uint32 for `shape`. The board rounds float64. Rows lie multiples of 4 bytes apart, 8 for
float64 (`np.dtype(..., align=True)`); the numbers of a row are dense. Nothing is copied."""

class Parameters(TypedDict, total=False):
    """The parameters of a step. The default is Bullet's at 60 steps a second, without damping of spin."""

    time_step: float
    position_drift: float
    """Penetration that the solver leaves alone, m."""
    position_coefficient: float
    """Share of the rest that a step removes."""
    friction: float
    pair_friction: bool
    """Each collision has a friction of its own: `with_friction`."""
    angular_damping: float
    spin_damping: float
    """Share of the spin about the normal that every friction pass takes: 10 % in the thesis, 0 here."""
    gravity: tuple[float, float, float]
    contact_iterations: int
    friction_iterations: int
    integrate: bool
    """Without it the velocities come back as the solver left them, and the poses stay."""
    kinematic: bool
    """Static bodies may move, by the velocity that they come with."""
    order: Literal["automatic", "as-given", "hazard-free", "interleaved"]
    verify_order: bool
    deadline: float
    """Time limit of the step on the board, s."""
    retries: int
    """Repetitions of a step that failed; `submit` ignores it."""
    impulses_out: bool
    """Keep the impulses for `Accelerator.impulses`."""

class Error(RuntimeError):
    """A call that the driver refused or that failed; the bodies are as they were.

    An array that no call can take is a `TypeError` or a `ValueError` instead.
    """

    kind: Literal["input", "open", "again", "failed", "reopen", "cancelled", "sequence", "busy", "panic", "forked"]
    """What to do next: correct the `input`, name another board (`open`), make the call `again`, change the scene
    (`failed`), open the board again (`reopen`, `panic`), nothing (`cancelled`), correct the program (`sequence`,
    `busy`), or open a board in this process (`forked`)."""

class Report:
    """Counts and times of one step."""

    bodies: int
    collisions: int
    """With contact points."""
    cycles: int
    """Clock cycles of the board from start to done."""
    stalls: int
    """Cycles in which a collision waited for a velocity of an earlier one."""
    waits: int
    """Cycles in which the board waited for memory."""
    hazards: int
    seconds: float
    """Time by the board's clock."""
    impulse_sum: float | None
    """Sum of the normal impulses, N s; None where the bitstream does not count it, or not as far."""
    retries: int

class Accelerator:
    """An open board. Other threads run while a call waits; they must not write its arrays meanwhile."""

    def __init__(self, board: str = "auto") -> None:
        """Opens a board: `auto`, `uio[:NODE]`, `devmem`, `emulated[:BUILD]` such as `emulated:float,world`, or
        `socket:PATH`."""
    def set_shapes(self, shapes: ArrayLike) -> None:
        """Loads rows of inverse mass (0 is static) and inverse inertia about x, y and z, in place of earlier ones."""
    def step(
        self,
        bodies: Bodies,
        collisions: NDArray[np.void],
        *,
        impulses: NDArray[np.float32] | None = None,
        **parameters: Unpack[Parameters],
    ) -> Report:
        """Takes one step: the bodies get its results, all at once, or keep their state where it fails.

        `impulses` (n, 6) are the impulses that the step begins with, such as 0.85 of the last ones.
        """
    def submit(
        self,
        bodies: Bodies,
        collisions: NDArray[np.void],
        *,
        impulses: NDArray[np.float32] | None = None,
        **parameters: Unpack[Parameters],
    ) -> None:
        """Starts a step and returns at once. A second one is packed, and starts as soon as the first has ended.

        A step has the values of the arrays at the time of the call, so that the two are of independent worlds.
        """
    def wait(self) -> Report:
        """Ends the oldest step: the bodies of its `submit` get the results."""
    def impulses(self) -> NDArray[np.float32]:
        """The impulses (n, 6) of the last step with `impulses_out`, N s: four along the normal, two of friction."""
    def cancel(self) -> None:
        """Ends the step in work, or else the next one. Any thread may call it at any time."""
    def close(self) -> None:
        """Closes the board, and stops a step in flight."""
    def __enter__(self) -> Self: ...
    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None: ...

def with_friction(count: ArrayLike, friction: ArrayLike) -> NDArray[np.uint32]:
    """The `count` of collisions that have a friction of their own, for `pair_friction`."""
