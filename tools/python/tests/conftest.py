"""The boards and scenes of the tests."""

import pathlib

import numpy as np
import pytest

import zynq_pgs

GOLDEN = pathlib.Path(__file__).parents[3] / "tests/golden"


@pytest.fixture
def board():
    """An emulated board that is closed at the end."""
    with zynq_pgs.Accelerator("emulated:float,world,threads=1") as board:
        yield board


class Folder:
    """A step in a folder of arrays, as `pgs solve` reads it."""

    def __init__(self, name):
        self.path = GOLDEN / name
        rows = np.column_stack([self["body_inv_mass"], self["body_inv_inertia"]])
        self.shapes, shape = np.unique(rows, axis=0, return_inverse=True)
        self.bodies = np.zeros(len(rows), zynq_pgs.BODY)
        for field, file in FIELDS.items():
            self.bodies[field] = self[f"body_{file}"]
        self.bodies["shape"] = shape.reshape(-1)
        self.collisions = np.zeros(len(self["contact_bodies"]), zynq_pgs.COLLISION)
        self.collisions["body_a"], self.collisions["body_b"] = self["contact_bodies"].T
        self.collisions["normal"], self.collisions["count"] = self["contact_normal"], self["contact_npoints"]
        self.collisions["contacts"]["point"] = self["contact_points"][..., :3]
        self.collisions["contacts"]["distance"] = self["contact_points"][..., 3]
        names = ["time_step", "position_drift", "position_coefficient", "friction", "angular_damping"]
        params = self["params"].tolist()
        contact, friction = self["iterations"].tolist()
        self.parameters = dict(zip(names, params), gravity=params[5:8], contact_iterations=contact,
                               friction_iterations=friction, spin_damping=0.1)

    def __getitem__(self, name):
        return np.load(self.path / f"{name}.npy")


FIELDS = {"position": "pos", "orientation": "quat", "linear_velocity": "linvel", "angular_velocity": "angvel"}


def pile(count, seed=1):
    """A world of `count` spheres of radius 0.5 in a heap on the ground, which is body 0: bodies and collisions."""
    random = np.random.default_rng(seed)
    bodies = np.zeros(count + 1, zynq_pgs.BODY)
    bodies["orientation"] = 0, 0, 0, 1
    bodies["position"][1:] = random.uniform([-1, 0.4, -1], [1, 3, 1], (count, 3))
    bodies["linear_velocity"][1:] = random.uniform(-1, 1, (count, 3))
    bodies["shape"][1:] = 1
    a, b = np.triu_indices(count, 1)
    between = bodies["position"][a + 1] - bodies["position"][b + 1]
    distance = np.linalg.norm(between, axis=1)
    near = distance < 1
    low = np.flatnonzero(bodies["position"][1:, 1] < 0.6)
    collisions = np.zeros(near.sum() + len(low), zynq_pgs.COLLISION)
    pairs, ground = collisions[:near.sum()], collisions[near.sum():]
    pairs["body_a"], pairs["body_b"] = a[near] + 1, b[near] + 1
    pairs["normal"] = between[near] / distance[near, None]
    pairs["contacts"]["point"][:, 0] = bodies["position"][b[near] + 1] + 0.5 * pairs["normal"]
    pairs["contacts"]["distance"][:, 0] = distance[near] - 1
    ground["body_a"], ground["normal"] = low + 1, (0, 1, 0)
    ground["contacts"]["point"][:, 0] = bodies["position"][low + 1] * (1, 0, 1)
    ground["contacts"]["distance"][:, 0] = bodies["position"][low + 1, 1] - 0.5
    collisions["count"] = 1
    return bodies, collisions


SHAPES = [(0, 0, 0, 0), (1, 10, 10, 10)]
