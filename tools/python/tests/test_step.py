"""Steps give the bits and the digests of the driver, in every layout."""

import re

import numpy as np
import pytest

import zynq_pgs
from conftest import FIELDS, GOLDEN, SHAPES, Folder, pile

FOLDERS = [f"pile5_step{step}" for step in range(60, 65)]


def digest(bodies):
    """FNV-1a, 64 bit, over position, orientation and velocities, body by body: as the tool prints it."""
    rows = np.hstack([np.ascontiguousarray(bodies[field]) for field in FIELDS])
    value = 0xCBF29CE484222325
    for byte in rows.astype("<f4").tobytes():
        value = (value ^ byte) * 0x100000001B3 % 2**64
    return f"{value:016x}"


def printed_digests():
    """The digests that `pgs solve` prints, as its own test has them."""
    test = (GOLDEN.parents[1] / "tools/pgs/tests/it/golden.rs").read_text()
    return dict(re.findall(r'\("(\w+)", "([0-9a-f]{16})"\)', test))


@pytest.mark.parametrize("name", FOLDERS)
def test_a_golden_step_has_bullets_bits_and_the_digest_of_the_tool(name):
    folder = Folder(name)
    with zynq_pgs.Accelerator("emulated") as board:
        board.set_shapes(folder.shapes)
        report = board.step(folder.bodies, folder.collisions, order="as-given", **folder.parameters)
    for field, file in FIELDS.items():
        assert folder.bodies[field].tobytes() == folder[f"out_{file}"].tobytes(), field
    assert digest(folder.bodies) == printed_digests()[name]
    assert report.collisions == len(folder.collisions) and report.cycles > report.stalls
    assert report.impulse_sum > 0 and report.retries == 0 and report.seconds > 0


def layouts(bodies):
    """The same bodies in other layouts."""
    wide = np.zeros(len(bodies), [("name", "S3"), ("pad", "S1"), *zynq_pgs.BODY.descr, ("mass", "<f8")])
    for field in zynq_pgs.BODY.names:
        wide[field] = bodies[field]
    yield "every second structure", wide.repeat(2)[::2]
    yield "a structure with other fields", wide
    rows = np.zeros((len(bodies), 13), np.float32)
    columns = dict(zip(FIELDS, (slice(0, 3), slice(3, 7), slice(7, 10), slice(10, 13))))
    for field, column in columns.items():
        rows[:, column] = bodies[field]
    slices = {field: rows[:, column] for field, column in columns.items()}
    yield "columns of one array", slices | {"shape": bodies["shape"].copy()}
    arrays = {field: bodies[field].copy() for field in zynq_pgs.BODY.names}
    arrays["shape"].flags.writeable = False
    yield "arrays", arrays


def test_every_layout_is_changed_in_place_to_the_same_bits(board):
    before, collisions = pile(20)
    board.set_shapes(SHAPES)
    expected = before.copy()
    board.step(expected, collisions)
    assert digest(expected) != digest(before)
    for name, bodies in layouts(before):
        views = {field: bodies[field] for field in FIELDS}
        board.step(bodies, collisions)
        assert digest(bodies) == digest(expected), name
        for field, view in views.items():
            assert view.tobytes() == expected[field].tobytes(), (name, field)


def test_doubles_get_the_results_and_keep_the_digits_of_numbers_that_stay(board):
    bodies, collisions = pile(20)
    board.set_shapes(SHAPES)
    doubles = {field: bodies[field].astype(float) for field in FIELDS} | {"shape": bodies["shape"].copy()}
    doubles["position"][0] = 0.1
    bodies["position"][0] = 0.1
    board.step(bodies, collisions)
    board.step(doubles, collisions)
    for field in FIELDS:
        assert np.array_equal(doubles[field].astype(np.float32), bodies[field]), field
    assert (doubles["position"][0] == 0.1).all(), "the static body"


@pytest.mark.parametrize("number", ["<f4", "<f8"])
def test_structures_with_other_fields_are_taken_if_aligned_and_else_refused(board, number):
    bodies, collisions = pile(20)
    board.set_shapes(SHAPES)
    fields = [(field, number, bodies[field].shape[1]) for field in FIELDS] + [("shape", "<u4"), ("name", "S3")]
    packed, aligned = (np.zeros(len(bodies), np.dtype(fields, align=align)) for align in (False, True))
    for field in zynq_pgs.BODY.names:
        packed[field] = aligned[field] = bodies[field]
    with pytest.raises(ValueError, match=f"stride of the positions.*multiple of {number[2]}"):
        board.step(packed, collisions)
    board.step(bodies, collisions)
    board.step(aligned, collisions)
    for field in FIELDS:
        assert np.array_equal(aligned[field].astype(np.float32), bodies[field]), field


def test_collisions_may_lie_apart(board):
    bodies, collisions = pile(20)
    board.set_shapes(SHAPES)
    apart = bodies.copy()
    board.step(bodies, collisions)
    board.step(apart, collisions.repeat(3)[::3])
    assert apart.tobytes() == bodies.tobytes()


def test_a_step_without_collisions_and_one_without_bodies(board):
    board.set_shapes(SHAPES)
    bodies, none = pile(3)[0], np.zeros(0, zynq_pgs.COLLISION)
    falls = bodies["linear_velocity"][1:, 1].copy()
    board.step(bodies, none, gravity=(0, -6, 0), time_step=0.5)
    assert np.allclose(bodies["linear_velocity"][1:, 1], falls - 3)
    assert board.step(np.zeros(0, zynq_pgs.BODY), none).bodies == 0


def test_impulses_come_out_and_the_next_step_begins_with_them(board):
    board.set_shapes(SHAPES)
    bodies, collisions = pile(20)
    assert board.impulses().shape == (0, 6)
    report = board.step(bodies, collisions, impulses_out=True)
    impulses = board.impulses()
    assert impulses.shape == (len(collisions), 6) and impulses.dtype == np.float32
    assert np.isclose(impulses[:, :4].sum(), report.impulse_sum, rtol=1e-3)
    assert (impulses[:, :4] >= 0).all() and not impulses[:, 1:4].any(), "one point each"
    cold, warm = bodies.copy(), bodies.copy()
    board.step(cold, collisions)
    cycles = board.step(warm, collisions, impulses=0.85 * impulses).cycles
    assert digest(cold) != digest(warm)
    zeros = bodies.copy()
    assert board.step(zeros, collisions, impulses=0 * impulses).cycles == cycles
    assert np.array_equal(board.impulses(), impulses), "of the last step that gave them out"


def test_each_pair_has_a_friction_of_its_own(board):
    """Two spheres slide on the ground, one with friction."""
    board.set_shapes(SHAPES)
    bodies = np.zeros(3, zynq_pgs.BODY)
    bodies["orientation"][:, 3] = 1
    bodies["position"][1:] = (0, 0.5, 0), (5, 0.5, 0)
    bodies["linear_velocity"][1:] = 3, -1, 0
    bodies["shape"][1:] = 1
    collisions = np.zeros(2, zynq_pgs.COLLISION)
    collisions["body_a"], collisions["normal"] = (1, 2), (0, 1, 0)
    collisions["contacts"]["point"][1, 0] = 5, 0, 0
    collisions["count"] = zynq_pgs.with_friction([1, 1], [0.0, 0.5])
    board.step(bodies, collisions, pair_friction=True)
    assert bodies["linear_velocity"][1, 0] == 3 and bodies["linear_velocity"][2, 0] < 2.9
    with pytest.raises(ValueError, match="2 counts and 3 frictions"):
        zynq_pgs.with_friction([1, 1], [0.0, 0.5, 0.5])


def test_a_count_is_a_whole_number_of_32_bits_of_any_type():
    expected = zynq_pgs.with_friction([0, 4], [0.5, 0.25])
    for dtype in (np.uint8, np.uint32, np.int64):
        assert np.array_equal(zynq_pgs.with_friction(np.array([0, 4], dtype), [0.5, 0.25]), expected)
    for error, count in [(OverflowError, -1), (OverflowError, 2**32), (TypeError, 1.7)]:
        for given in ([count], np.array([count])):
            with pytest.raises(error):
                zynq_pgs.with_friction(given, [0.5])
