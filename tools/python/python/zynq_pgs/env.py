"""Many small worlds in one step of the board, by the interface of gymnasium's vector environments.

The worlds have no collision in common, and the board gets the first collision of each world, then the second of each, and
so on: neighbours in the pipeline are of different worlds and wait for no velocity of each other. Within a world
the order stays, so that each world has the bits of a step of its own.
"""

from __future__ import annotations

from typing import Any

import numpy as np

from . import BODY, COLLISION, Accelerator

try:
    from gymnasium.spaces import Box
    from gymnasium.vector import AutoresetMode, VectorEnv
    from gymnasium.vector.utils import batch_space
except ImportError:  # The environment works by itself.
    VectorEnv = object

RADIUS, HALF, GOAL = 0.5, 5.0, 1.0  # of a ball, of the square field, of the goal, m
FORCE, LIMIT = 10.0, 300  # of an action of 1, N; steps of an episode
WALLS = np.array([(0, 1, 0), (1, 0, 0), (-1, 0, 0), (0, 0, 1), (0, 0, -1)], np.float32)
TO_WALL = np.array([0, HALF, HALF, HALF, HALF], np.float32)


class PushBalls(VectorEnv):
    """Balls on a square field: the first one is pushed, and has to bring the second one to a goal.

    An action (2) is the force on the first ball along x and z, from -1 to 1. An observation has x, z and the velocity
    along them of each ball, and the way (2) from the second ball to the goal. The reward is the way that the second ball
    came closer, m. An episode terminates at the goal, and is truncated after 300 steps; its world begins anew in the
    same step, and `info` has the last observations as `final_obs`.
    """

    def __init__(self, num_envs: int = 64, balls: int = 6, board: str = "auto") -> None:
        if not 2 <= balls <= 16:
            raise ValueError(f"found {balls} balls: give 2 to 16, one for each place of the grid")
        self.num_envs, self.balls = num_envs, balls
        self.board = Accelerator(board)
        self.board.set_shapes([(0, 0, 0, 0), (1, *[2.5 / RADIUS**2] * 3)])
        # The field is body 0, the same for all worlds.
        self.bodies = np.zeros(1 + num_envs * balls, BODY)
        self.bodies["orientation"][:, 3] = 1
        self.bodies["shape"][1:] = 1
        self._state = self.bodies[1:].reshape(num_envs, balls)
        self._goal = np.zeros((num_envs, 2), np.float32)
        self._steps = np.zeros(num_envs, int)
        self._random = [np.random.default_rng() for _ in range(num_envs)]
        self._pairs = np.triu_indices(balls, 1)
        if VectorEnv is not object:
            self.metadata = {"autoreset_mode": AutoresetMode.SAME_STEP}
            self.single_observation_space = Box(-np.inf, np.inf, (4 * balls + 2,), np.float32)
            self.single_action_space = Box(-1, 1, (2,), np.float32)
            self.observation_space = batch_space(self.single_observation_space, num_envs)
            self.action_space = batch_space(self.single_action_space, num_envs)

    def reset(self, *, seed: int | list[int] | None = None, options: dict[str, Any] | None = None):
        """Begins every world anew; the world of index k has the seed `seed + k`, or `seed[k]` of a list."""
        if seed is not None:
            seeds = [seed + world for world in range(self.num_envs)] if np.ndim(seed) == 0 else seed
            if len(seeds) != self.num_envs:
                raise ValueError(f"found {len(seeds)} seeds for {self.num_envs} worlds")
            self._random = [np.random.default_rng(one) for one in seeds]
        self._begin(np.arange(self.num_envs))
        return self._observe(), {}

    def step(self, actions):
        """Takes one step of all worlds, in one step of the board."""
        force = FORCE * np.clip(np.asarray(actions, np.float32).reshape(self.num_envs, 2), -1, 1)
        before = self._way()
        self._state["linear_velocity"][:, 0, ::2] += force / 60
        report = self.board.step(self.bodies, self._collisions(), order="as-given", time_step=1 / 60)
        self._steps += 1
        way = self._way()
        reward, terminated = before - way, way < GOAL
        truncated = ~terminated & (self._steps >= LIMIT)
        observations, ended = self._observe(), terminated | truncated
        info: dict[str, Any] = {"cycles": report.cycles}
        if ended.any():
            info |= {"final_obs": observations, "_final_obs": ended}
            self._begin(np.flatnonzero(ended))
            observations = self._observe()
        return observations, reward, terminated, truncated, info

    def close(self, **_: Any) -> None:
        """Closes the board."""
        board = getattr(self, "board", None)  # None where no board was opened.
        if board is not None:
            board.close()

    def _begin(self, worlds):
        """Puts the balls of some worlds on places of a grid of their own, at rest."""
        places = np.stack(np.meshgrid([-3, -1, 1, 3], [-3, -1, 1, 3]), -1).reshape(-1, 2)
        for world in worlds:
            random, state = self._random[world], self._state[world]
            place = random.permutation(places)[: self.balls] + random.uniform(-0.3, 0.3, (self.balls, 2))
            state["position"] = np.insert(place, 1, RADIUS, axis=1)
            state["orientation"] = 0, 0, 0, 1
            state["linear_velocity"] = state["angular_velocity"] = 0
            self._goal[world] = random.uniform(-4, 4, 2)
        self._steps[worlds] = 0

    def _way(self):
        """From the second ball to the goal, m."""
        return np.linalg.norm(self._goal - self._state["position"][:, 1, ::2], axis=1)

    def _observe(self):
        of_balls = [self._state[field][..., ::2] for field in ("position", "linear_velocity")]
        flat = np.concatenate(of_balls, axis=2).reshape(self.num_envs, -1)
        return np.hstack([flat, self._goal - self._state["position"][:, 1, ::2]])

    def _collisions(self):
        """The collisions of all worlds: a row for each place of a world, a column for each world."""
        position = self._state["position"].swapaxes(0, 1)
        a, b = self._pairs
        index = 1 + np.arange(self.num_envs * self.balls, dtype=np.uint32).reshape(self.num_envs, self.balls).T
        between = position[a] - position[b]
        apart = np.maximum(np.linalg.norm(between, axis=2), 1e-6)
        to_wall = position @ WALLS.T + TO_WALL - RADIUS  # balls, worlds, walls
        walls = self.balls * len(WALLS)
        all_ = np.zeros((walls + len(a), self.num_envs), COLLISION)
        all_["body_a"] = np.concatenate([index.repeat(len(WALLS), 0), index[a]])
        all_["body_b"][walls:] = index[b]
        all_["normal"][:walls] = np.tile(WALLS, (self.balls, 1))[:, None]
        all_["normal"][walls:] = between / apart[..., None]
        distance = all_["contacts"]["distance"][..., 0]
        distance[:walls] = to_wall.swapaxes(1, 2).reshape(walls, self.num_envs)
        distance[walls:] = apart - 2 * RADIUS
        centre = np.concatenate([position.repeat(len(WALLS), 0), position[a]])
        all_["contacts"]["point"][:, :, 0] = centre - (RADIUS + distance)[..., None] * all_["normal"]
        all_["count"] = 1
        return all_[distance < 0]
