"""Many small worlds in one step of the board."""

import numpy as np
import pytest

from conftest import GOLDEN, SHAPES, pile
from zynq_pgs.env import PushBalls

WORLDS, BODIES = 200, 20


def side_by_side(worlds):
    """All worlds as one: the first collision of each, then the second of each."""
    place = np.concatenate([np.arange(len(collisions)) for _, collisions in worlds])
    merged = np.concatenate([collisions for _, collisions in worlds])
    shift = np.repeat(np.arange(len(worlds)) * BODIES, [len(collisions) for _, collisions in worlds])
    merged["body_a"] += shift.astype(np.uint32)
    merged["body_b"] += shift.astype(np.uint32)
    return np.concatenate([bodies for bodies, _ in worlds]), merged[np.argsort(place, kind="stable")]


def test_two_hundred_worlds_in_one_step_have_the_bits_of_a_step_of_their_own(board, capsys):
    board.set_shapes(SHAPES)
    worlds = [pile(BODIES - 1, seed) for seed in range(WORLDS)]
    bodies, collisions = side_by_side(worlds)
    assert len(bodies) == WORLDS * BODIES
    together = board.step(bodies, collisions, order="as-given")
    alone = [board.step(*world, order="as-given") for world in worlds]
    for world, (expected, _) in enumerate(worlds):
        assert bodies[world * BODIES:][:BODIES].tobytes() == expected.tobytes(), world
    cheapest = sum(board.step(*pile(BODIES - 1, seed)).cycles for seed in range(WORLDS))
    cycles, stalls = (sum(getattr(report, of) for report in alone) for of in ("cycles", "stalls"))
    with capsys.disabled():
        print(f"\n{WORLDS} worlds of {BODIES} bodies, {len(collisions)} collisions: {together.cycles:,} cycles in one step"
              f" ({together.stalls:,} stalled); in {WORLDS} steps {cycles:,} ({stalls:,} stalled), and {cheapest:,} in the"
              " board's own order")
    page = (GOLDEN.parents[1] / "docs/engines.md").read_text()
    assert all(f"{figure:,}" in page for figure in (together.cycles, cheapest)), "docs/engines.md has other figures"
    assert together.cycles * 5 < cheapest <= cycles and together.stalls * 10 < stalls


def play(env, seed, actions):
    """All that an environment answers."""
    answers = [env.reset(seed=seed)[0]]
    for action in actions:
        observations, rewards, terminated, truncated, _ = env.step(action)
        answers.append(np.column_stack([observations, rewards, terminated, truncated]))
    return answers


def test_each_world_of_the_environment_is_the_same_alone():
    actions = np.random.default_rng(5).uniform(-1, 1, (60, 4, 2))
    together = play(PushBalls(4, board="emulated"), 7, actions)
    for world in range(4):
        alone = play(PushBalls(1, board="emulated"), 7 + world, actions[:, world:world + 1])
        assert all(np.array_equal(one[0], all_[world]) for one, all_ in zip(alone, together)), world


def test_a_list_has_a_seed_for_each_world():
    env = PushBalls(3, board="emulated")
    from_seven, given = env.reset(seed=7)[0], env.reset(seed=[9, 7, 8])[0]
    assert np.array_equal(given, from_seven[[2, 0, 1]])
    with pytest.raises(ValueError, match="2 seeds for 3 worlds"):
        env.reset(seed=[1, 2])


@pytest.mark.parametrize("balls", [1, 17])
def test_a_number_of_balls_that_the_grid_cannot_take_is_refused_and_closes(balls):
    with pytest.raises(ValueError, match=f"{balls} balls"):
        PushBalls(2, balls=balls, board="emulated")
    PushBalls.__new__(PushBalls).close()


def test_a_push_towards_the_second_ball_moves_it_and_ends_the_episode_at_the_goal():
    env = PushBalls(1, balls=2, board="emulated")
    env.reset(seed=1)
    env._state["position"][0, :, ::2], env._goal[0] = [(-3, 0), (-1, 0)], (3, 0)
    total, ended = 0, False
    for _ in range(299):
        observations, reward, terminated, truncated, info = env.step([(1, 0)])
        total, ended = total + reward[0], terminated[0]
        if ended:
            break
    assert ended and not truncated[0] and total > 2.9
    assert np.linalg.norm(info["final_obs"][0, -2:]) < 1 and observations.shape == (1, 10)
    assert not env._steps.any(), "another episode has begun"


def test_an_episode_is_truncated_after_its_limit():
    env = PushBalls(3, board="emulated")
    env.reset(seed=1)
    env._goal[:] = 100
    steps = [env.step(np.zeros((3, 2))) for _ in range(300)]
    assert all(step[3].all() == (number == 299) for number, step in enumerate(steps))
    assert steps[-1][4]["_final_obs"].all() and not any(step[2].any() for step in steps)


def test_gymnasium_takes_the_environment():
    wrappers = pytest.importorskip("gymnasium.wrappers.vector")
    env = wrappers.RecordEpisodeStatistics(PushBalls(5, board="emulated"))
    observations, _ = env.reset(seed=3)
    env.action_space.seed(3)
    for _ in range(300):
        assert observations in env.observation_space
        observations, rewards, terminated, truncated, info = env.step(env.action_space.sample())
        assert rewards.shape == terminated.shape == truncated.shape == (5,)
    assert info["episode"]["l"].max() == 300
    env.close()
