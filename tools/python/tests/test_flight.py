"""Steps in flight: `submit`, `wait`, two worlds in turn, threads, cancellation."""

import threading

import numpy as np
import pytest

import zynq_pgs
from conftest import SHAPES, pile


def alone(board, worlds, steps):
    """Every world after that many steps of its own."""
    for bodies, collisions in worlds:
        for _ in range(steps):
            board.step(bodies, collisions)
    return [bodies.tobytes() for bodies, _ in worlds]


def test_two_worlds_in_turn_have_the_bits_of_each_alone(board):
    board.set_shapes(SHAPES)
    expected = alone(board, [pile(20, seed) for seed in (1, 2)], 3)
    worlds = [pile(20, seed) for seed in (1, 2)]
    board.submit(*worlds[0])
    for turn in range(1, 6):
        board.submit(*worlds[turn % 2])
        board.wait()
    board.wait()
    assert [bodies.tobytes() for bodies, _ in worlds] == expected


def test_a_step_has_the_values_of_its_submit_and_stores_in_its_bodies(board):
    board.set_shapes(SHAPES)
    bodies, collisions = pile(20)
    before = bodies.tobytes()
    board.submit(bodies, collisions, impulses_out=True)
    assert bodies.tobytes() == before
    bodies["position"][1:] += 100
    collisions["count"] = 0
    board.wait()
    again, collisions = pile(20)
    board.step(again, collisions)
    assert bodies.tobytes() == again.tobytes()
    assert len(board.impulses()) == len(collisions)


def test_calls_that_do_not_fit_are_refused_and_the_step_goes_on(board):
    board.set_shapes(SHAPES)
    world = pile(5)
    for call in (board.wait, lambda: (board.submit(*world), board.step(*world)), lambda: board.set_shapes(SHAPES),
                 lambda: (board.submit(*pile(5)), board.submit(*pile(5)))):
        with pytest.raises(zynq_pgs.Error) as refused:
            call()
        assert refused.value.kind == "sequence"
    assert board.wait().bodies == board.wait().bodies == 6
    board.step(*world)


def test_bodies_that_can_no_longer_be_written_leave_the_step_in_flight(board):
    board.set_shapes(SHAPES)
    bodies, collisions = pile(5)
    board.submit(bodies, collisions)
    bodies.flags.writeable = False
    before = bodies.tobytes()
    with pytest.raises(ValueError, match="read-only"):
        board.wait()
    assert bodies.tobytes() == before
    bodies.flags.writeable = True
    board.wait()
    assert bodies.tobytes() != before


def test_a_second_step_that_is_refused_leaves_the_first_in_flight(board):
    board.set_shapes(SHAPES)
    world, (bodies, collisions) = pile(5), pile(6)
    board.submit(*world)
    bodies["shape"] = 7
    with pytest.raises(zynq_pgs.Error) as refused:
        board.submit(bodies, collisions)
    assert refused.value.kind == "input" and "shape is 7" in str(refused.value)
    assert board.wait().bodies == 6


def test_other_threads_run_while_a_step_is_awaited_and_are_refused(board):
    board.set_shapes(SHAPES)
    bodies, collisions = pile(300)
    seen, done = [], threading.Event()

    def call():
        while not done.is_set():
            try:
                board.impulses()
            except zynq_pgs.Error as error:
                seen.append(error.kind)

    other = threading.Thread(target=call)
    other.start()
    try:
        for _ in range(1000):
            if seen:
                break
            try:
                board.step(bodies, collisions, contact_iterations=60)
            except zynq_pgs.Error as error:
                assert error.kind == "busy", "the other thread was in its call"
    finally:
        done.set()
        other.join()
    assert set(seen) == {"busy"}


def test_a_cancelled_step_changes_nothing_and_the_next_one_runs(board):
    board.set_shapes(SHAPES)
    bodies, collisions = pile(5)
    before = bodies.tobytes()
    board.cancel()
    with pytest.raises(zynq_pgs.Error) as cancelled:
        board.step(bodies, collisions)
    assert cancelled.value.kind == "cancelled" and bodies.tobytes() == before
    board.step(bodies, collisions)
    assert bodies.tobytes() != before


def test_a_cancellation_ends_both_steps_in_flight_and_each_wait_says_so(board):
    board.set_shapes(SHAPES)
    worlds = [pile(20, seed) for seed in (1, 2)]
    before = [bodies.tobytes() for bodies, _ in worlds]
    for world in worlds:
        board.submit(*world)
    board.cancel()
    for text in ("cancelled", "did not start"):
        with pytest.raises(zynq_pgs.Error, match=text) as cancelled:
            board.wait()
        assert cancelled.value.kind == "cancelled"
    assert [bodies.tobytes() for bodies, _ in worlds] == before
    board.step(*worlds[0])
    assert worlds[0][0].tobytes() != before[0]


def test_a_closed_accelerator_refuses_calls(board):
    board.set_shapes(SHAPES)
    bodies, collisions = pile(5)
    before = bodies.tobytes()
    board.submit(bodies, collisions)
    board.close()
    board.cancel()
    with pytest.raises(zynq_pgs.Error, match="closed") as refused:
        board.wait()
    assert refused.value.kind == "sequence" and bodies.tobytes() == before
    assert np.all(bodies["orientation"][:, 3] == 1)
