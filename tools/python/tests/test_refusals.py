"""A bad array or argument is refused by name and leaves the data as they were."""

import os

import numpy as np
import pytest

import zynq_pgs
from conftest import SHAPES, pile


def arrays(bodies):
    return {field: bodies[field].copy() for field in zynq_pgs.BODY.names}


def changed(field, change):
    """Bodies with one array changed."""

    def make(bodies):
        given = arrays(bodies)
        given[field] = change(given[field])
        return given

    return make


def read_only(array):
    array.flags.writeable = False
    return array


def misaligned(array):
    bytes_ = np.zeros(array.nbytes + 1, np.uint8)
    moved = np.ndarray(array.shape, array.dtype, bytes_, offset=1)
    moved[:] = array
    return moved


def overlapping(bodies):
    memory = np.zeros((len(bodies), 13), np.float32)
    return arrays(bodies) | {"position": memory[:, 0:3], "linear_velocity": memory[:, 2:5]}


BAD_BODIES = {
    "f8": (changed("orientation", lambda a: a.astype(float)), TypeError, "orientation.*float64, expected float32"),
    "f4": (changed("position", lambda a: a.astype(float)), TypeError, "orientation.*float32, expected float64"),
    "f2": (changed("position", lambda a: a.astype(np.float16)), TypeError, "position.*float16, expected float32"),
    "big-endian": (changed("position", lambda a: a.astype(">f4")), TypeError, "position.*>f4"),
    "list": (changed("orientation", lambda a: a.tolist()), TypeError, "orientation.*list"),
    "signed": (changed("shape", lambda a: a.astype(np.int32)), TypeError, "shape.*int32, expected uint32"),
    "columns": (changed("orientation", lambda a: a[:, :3]), ValueError, r"orientation.*\(n, 4\)"),
    "flat": (changed("position", lambda a: a.reshape(-1)), ValueError, "position.*shape"),
    "two shapes": (changed("shape", lambda a: a[:, None]), ValueError, r"shape.*\(n,\)"),
    "read-only": (changed("linear_velocity", read_only), ValueError, "linear_velocity.*read-only"),
    "fortran": (changed("position", np.asfortranarray), ValueError, "position.*lie apart"),
    "backwards": (changed("position", lambda a: a[::-1]), ValueError, "position.*backwards"),
    "misaligned": (changed("position", misaligned), ValueError, "positions"),
    "one row for all": (
        changed("position", lambda a: np.lib.stride_tricks.as_strided(a, a.shape, (0, 4))), ValueError, "stride"),
    "fewer": (changed("shape", lambda a: a[1:]), ValueError, "one number"),
    "overlapping": (overlapping, ValueError, "share bytes"),
    "plain array": (lambda bodies: np.zeros((6, 13), np.float32), TypeError, "structured array or a dict"),
    "missing": (lambda bodies: {"position": bodies["position"]}, TypeError, "orientation"),
    "nothing": (lambda bodies: None, TypeError, "dict of arrays"),
}


@pytest.mark.parametrize("name", BAD_BODIES)
@pytest.mark.parametrize("call", ["step", "submit"])
def test_bad_bodies_are_refused_and_keep_their_values(board, name, call):
    make, error, text = BAD_BODIES[name]
    board.set_shapes(SHAPES)
    bodies, collisions = pile(5)
    given = make(bodies)
    values = {field: np.array(array) for field, array in given.items()} if isinstance(given, dict) else {}
    with pytest.raises(error, match=text):
        getattr(board, call)(given, collisions)
    for field, array in values.items():
        assert np.array_equal(given[field], array)
    board.step(bodies, collisions)


def test_bad_collisions_and_impulses_are_refused(board):
    board.set_shapes(SHAPES)
    bodies, collisions = pile(5)
    before = bodies.tobytes()
    for error, text, given in [
        (TypeError, "dtype", collisions.view(np.uint32)),
        (TypeError, "tuple", tuple(collisions)),
        (ValueError, "shape", collisions[None]),
        (ValueError, "backwards", collisions[::-1]),
    ]:
        with pytest.raises(error, match=f"collisions.*{text}"):
            board.step(bodies, given)
    for error, given in [
        (ValueError, np.zeros((len(collisions) + 1, 6), np.float32)),
        (ValueError, np.zeros((len(collisions), 5), np.float32)),
        (TypeError, np.zeros((len(collisions), 6))),
    ]:
        with pytest.raises(error, match="impulses"):
            board.step(bodies, collisions, impulses=given)
    memory = np.zeros(40, zynq_pgs.COLLISION)
    inside = memory.view(np.uint8)[:56 * 6].view(zynq_pgs.BODY)
    with pytest.raises(ValueError, match="share bytes"):
        board.step(inside, memory[:3])
    assert bodies.tobytes() == before


@pytest.mark.parametrize("keywords, error, text", [
    ({"timestep": 0.1}, TypeError, "timestep: a step has no such"),
    ({"time_step": "fast"}, TypeError, "time_step: must be real number"),
    ({"gravity": (0, 1)}, ValueError, "gravity: .*length"),
    ({"integrate": 2}, TypeError, "integrate: .*bool"),
    ({"order": "best"}, ValueError, "as-given"),
    ({"deadline": 0}, ValueError, "deadline"),
    ({"contact_iterations": -1}, OverflowError, "contact_iterations: out of range"),
])
def test_a_bad_parameter_is_refused_by_name(board, keywords, error, text):
    board.set_shapes(SHAPES)
    bodies, collisions = pile(5)
    before = bodies.tobytes()
    with pytest.raises(error, match=text):
        board.step(bodies, collisions, **keywords)
    assert bodies.tobytes() == before


def test_the_drivers_refusal_has_its_text_and_kind(board):
    bodies, collisions = pile(5)
    with pytest.raises(zynq_pgs.Error, match="shapes") as refused:
        board.step(bodies, collisions)
    assert refused.value.kind == "input"
    board.set_shapes(SHAPES)
    before = bodies.tobytes()
    for field, value, text in [("position", np.nan, "body 2"), ("shape", 9, "body 2: its shape is 9")]:
        bad = bodies.copy()
        bad[field][2] = value
        with pytest.raises(zynq_pgs.Error, match=text) as refused:
            board.step(bad, collisions)
        assert refused.value.kind == "input"
    with pytest.raises(ValueError, match="length 4.*got 3"):
        board.set_shapes([(1, 1, 1)])
    board.step(bodies, collisions)
    assert bodies.tobytes() != before


@pytest.mark.parametrize("text, kind", [("fpga", "open"), ("emulated:float2", "open"), ("socket:/nowhere", "open")])
def test_a_board_that_cannot_be_opened_is_named(text, kind):
    with pytest.raises(zynq_pgs.Error) as refused:
        zynq_pgs.Accelerator(text)
    assert refused.value.kind == kind and text.split(":")[-1] in str(refused.value)
    with pytest.raises(ValueError, match="nul"):
        zynq_pgs.Accelerator("emulated\0")


def test_a_forked_child_is_refused(board):
    board.set_shapes(SHAPES)
    bodies, collisions = pile(5)
    child = os.fork()
    if child == 0:
        code = 1
        try:
            board.step(bodies, collisions)
        except zynq_pgs.Error as error:
            code = 0 if error.kind == "forked" else 2
        finally:
            os._exit(code)
    assert os.waitstatus_to_exitcode(os.waitpid(child, 0)[1]) == 0
    board.step(bodies, collisions)
