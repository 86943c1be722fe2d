"""Random steps, and the golden folders."""

from math import sqrt
from pathlib import Path

import numpy as np

import specification as spec
from solver import Body, Collision, Step

SUBNORMAL = np.float32(2.0**-130)
ARGUMENTS = ("time_step", "position_drift", "position_coefficient", "friction", "angular_damping",
             "gravity_x", "gravity_y", "gravity_z")


def numbers(source, count, scale=1.0):
    """Random words of f32; a few are zeros of either sign or subnormal."""
    values = [source.gauss(0, scale) for _ in range(count)]
    for index in range(count):
        if source.random() < 0.04:
            values[index] = source.choice((0.0, -0.0, SUBNORMAL, -SUBNORMAL))
    return np.array(values, np.float32)


def directions(source, count):
    """A random vector of length 1; one in six lies along an axis."""
    values = [source.gauss(0, 1) for _ in range(count)]
    if source.random() < 1 / 6:
        axis = source.randrange(count)
        values = [float(index == axis) * source.choice((1, -1)) for index in range(count)]
    length = sqrt(sum(value * value for value in values))
    return np.array([value / length for value in values], np.float32)


def garbage(source, count):
    """Words of any bits, NaN among them."""
    return np.array([source.getrandbits(32) for _ in range(count)], np.uint32).view(np.float32)


def inertia_of(source, is_static):
    """The inverse inertia about world axes: a number, or xx, yy, zz, xy, xz, yz of a positive matrix."""
    if not spec.WORLD_INERTIA:
        return np.float32(source.uniform(0.5, 10))
    if is_static:
        return np.zeros(6, np.float32)
    factor = np.array([[source.gauss(0, 1) for _ in range(3)] for _ in range(3)])
    matrix = factor @ factor.T + np.eye(3)
    return np.array([matrix[0, 0], matrix[1, 1], matrix[2, 2], matrix[0, 1], matrix[0, 2], matrix[1, 2]], np.float32)


def random_step(source, size=None):
    """A step and its shape table, {shape: (mass, inertia)}; `size`: numbers of bodies and collisions."""
    flags = 0
    for flag, chance in ((spec.INTEGRATE, 0.5), (spec.KINEMATIC, 0.5),
                         (spec.PAIR_FRICTION, 0.5), (spec.WARM_START, 0.4), (spec.IMPULSES_OUT, 0.6),
                         (spec.STREAMED_MASSES, 0.5 * spec.WORLD_INERTIA), (spec.IN_ORDER, 0.3)):
        flags |= flag * (source.random() < chance)
    table = {0: (np.float32(0), np.float32(0))}
    for shape in source.sample(range(1, spec.SHAPES), 2):
        table[shape] = (np.float32(source.uniform(0.1, 4)), inertia_of(source, False))
    count, collisions = size or (source.choice((1, 2, 4, 6, 8, 10, 12, 12)),
                                 source.choice((0, 1, 2, 3, 5, 8, 9, 10, 13, 20, 40)))
    bodies = [random_body(source, table, flags) for _ in range(count)]
    pairs = [(a, b) for a in range(len(bodies)) for b in range(len(bodies))
             if a != b and (bodies[a].moves or bodies[b].moves)]
    collisions = [random_collision(source, bodies, source.choice(pairs)) for _ in range(collisions if pairs else 0)]
    arguments = {
        "contact_iterations": source.choice((0, 1, 1, 2, 3)), "friction_iterations": source.choice((0, 1, 1, 2)),
        "time_step": np.float32(source.uniform(0.002, 0.05)), "position_drift": np.float32(source.uniform(0, 0.02)),
        "position_coefficient": np.float32(source.uniform(0.05, 0.5)), "friction": np.float32(source.uniform(0, 1)),
        "angular_damping": np.float32(source.uniform(0.9, 1)), "spin_damping": np.float32(source.uniform(0, 0.3)),
        **{f"gravity_{axis}": np.float32(source.uniform(-10, 10)) for axis in "xyz"},
    }
    return Step(bodies, collisions, arguments, flags), table


def random_body(source, table, flags):
    shape = source.choice(list(table))
    mass, inertia = table[shape]
    if spec.WORLD_INERTIA:
        if flags & spec.STREAMED_MASSES:
            mass, shape = np.float32(source.choice((0, source.uniform(0.1, 4)))), source.getrandbits(32)
        inertia = inertia_of(source, mass == 0)
    velocity, spin = (numbers(source, 3, scale) for scale in (2, source.choice((1e-4, 1, 30))))
    if mass == 0:
        choice = source.randrange(3)
        if choice == 0:
            velocity, spin = np.zeros(3, np.float32), np.zeros(3, np.float32)
        elif choice == 1 and not flags & spec.KINEMATIC:
            velocity, spin = garbage(source, 3), garbage(source, 3)
    return Body(numbers(source, 3, 2), directions(source, 4), velocity, spin, mass, inertia, shape)


def random_collision(source, bodies, pair):
    count = source.choice((0, 1, 2, 3, 4, 4))
    points = garbage(source, 16).reshape(4, 4)
    center = (bodies[pair[0]].position + bodies[pair[1]].position) / 2
    for point in points[:count]:
        point[:3] = center + numbers(source, 3, 0.3)
        point[3] = source.uniform(-0.1, 0.05)
    friction = np.array([source.uniform(0, 1.5)], np.float16).view(np.uint16)[0]
    return Collision(pair, directions(source, 3), count, points, int(friction),
                     np.abs(numbers(source, 4, 0.2)), numbers(source, 2, 0.1))


def golden(folder, flags):
    """The step of a golden folder, its shape table, and the recorded results."""
    def load(name):
        return np.load(Path(folder) / f"{name}.npy")

    masses, inertias = load("body_inv_mass"), load("body_inv_inertia")
    shapes, table = {}, {}
    for mass, inertia in zip(masses, inertias):
        shape = shapes.setdefault((mass, inertia[0]), len(shapes))
        table[shape] = (mass, inertia[0])
    bodies = []
    for position, rotation, velocity, spin, mass, inertia in zip(*(load(f"body_{name}") for name in (
            "pos", "quat", "linvel", "angvel", "inv_mass", "inv_inertia"))):
        assert np.all(inertia == inertia[0]), "cubes"
        matrix = np.array([*inertia, 0, 0, 0], np.float32)
        bodies.append(Body(position, rotation, velocity, spin, mass, matrix if spec.WORLD_INERTIA else inertia[0],
                           shapes[(mass, inertia[0])]))
    collisions = [Collision(tuple(int(k) for k in pair), normal, int(count), points) for pair, normal, count, points
                  in zip(*(load(f"contact_{name}") for name in ("bodies", "normal", "npoints", "points")))]
    arguments = dict(zip(ARGUMENTS, load("params")), spin_damping=np.float32(0.1))
    arguments.update(zip(("contact_iterations", "friction_iterations"), (int(count) for count in load("iterations"))))
    results = list(zip(*(load(f"out_{name}") for name in ("pos", "quat", "linvel", "angvel"))))
    return Step(bodies, collisions, arguments, flags), table, results
