#!/usr/bin/env python3
"""Writes the contacts of a MuJoCo scene as a step for `pgs solve`.

usage: step_folder.py --out FOLDER [--model FILE] [--steps N] [--iterations N]

MuJoCo takes N steps of the model (200; without --model, 60 boxes, spheres and capsules fall on a plane) and
detects its contacts. The folder then has one step with these bodies and contacts, as `pgs solve` reads it:

    step_folder.py --out contacts
    pgs solve contacts --board emulated:float,world

Free bodies only: a body with another joint is refused, because its joint is not part of the step. The
contacts of a pair of bodies that share a normal become one collision, up to four points each. A step has one
friction: the largest of the contacts. Gravity is a part of the step, as in MuJoCo's.

Needs the packages mujoco and numpy from PyPI.

Exit code: 0 done, 1 a model that is no set of free bodies, 2 wrong usage, 77 skipped: a package is missing.
"""
import argparse
import pathlib
import sys

try:
    import mujoco
    import numpy as np
except ImportError as error:
    print(f"skipped: {error}: pip install mujoco numpy", file=sys.stderr)
    sys.exit(77)

POINTS = 4
# Penetration that the solver leaves alone, m, and the share of the rest that a step removes.
DRIFT, COEFFICIENT = 0.001, 0.2


def pile(count=60):
    """A model of boxes, spheres and capsules of four masses over a plane."""
    random = np.random.default_rng(1)
    kinds = [("sphere", "0.3"), ("capsule", "0.2 0.3"), ("box", "0.3 0.2 0.25")]
    bodies = []
    for number in range(count):
        shape, size = kinds[number % len(kinds)]
        x, y = (0.8 * (number // 4**axis % 4) - 1.2 + random.uniform(-0.1, 0.1) for axis in (0, 1))
        bodies.append(
            f'<body pos="{x:.4f} {y:.4f} {0.6 + 0.8 * (number // 16)}"><freejoint/>'
            f'<geom type="{shape}" size="{size}" mass="{1 + number % 4}" friction="0.6"/></body>')
    return ('<mujoco><option timestep="0.005"/><worldbody><geom type="plane" size="20 20 .1" friction="0.6"/>'
            + "".join(bodies) + "</worldbody></mujoco>")


def bodies_of(model, data):
    """The arrays of the bodies; body 0 is the world, static and at rest."""
    count = model.nbody
    arrays = {
        "body_pos": np.array(data.xipos),
        "body_quat": np.zeros((count, 4)),
        "body_linvel": np.zeros((count, 3)),
        "body_angvel": np.zeros((count, 3)),
        "body_inv_mass": np.zeros(count),
        "body_inv_inertia": np.zeros((count, 3)),
    }
    quaternion, velocity = np.zeros(4), np.zeros(6)
    for body in range(count):
        # Axes of the inertia; w comes last in the folder, and first in MuJoCo.
        mujoco.mju_mat2Quat(quaternion, data.ximat[body])
        arrays["body_quat"][body] = quaternion[[1, 2, 3, 0]]
        if body == 0:
            continue
        # At the centre of mass, in the axes of the world.
        mujoco.mj_objectVelocity(model, data, mujoco.mjtObj.mjOBJ_BODY, body, velocity, 0)
        arrays["body_linvel"][body], arrays["body_angvel"][body] = velocity[3:], velocity[:3]
        arrays["body_inv_mass"][body] = 1 / model.body_mass[body]
        arrays["body_inv_inertia"][body] = 1 / model.body_inertia[body]
    return arrays


def collisions_of(model, data):
    """The arrays of the collisions, and the largest friction."""
    groups, friction = {}, 0.0
    for contact in data.contact[: data.ncon]:
        # MuJoCo's normal leads from the first geometry to the second: the second is body A.
        body_b, body_a = (int(model.geom_bodyid[geom]) for geom in (contact.geom1, contact.geom2))
        normal = np.array(contact.frame[:3])
        # The point lies half way between the surfaces.
        point = contact.pos - 0.5 * contact.dist * normal
        groups.setdefault((body_a, body_b, *np.round(normal, 3)), []).append((normal, *point, contact.dist))
        friction = max(friction, contact.friction[0])
    records = []
    for (body_a, body_b, *_), contacts in groups.items():
        for first in range(0, len(contacts), POINTS):
            some = contacts[first:first + POINTS]
            points = np.zeros((POINTS, 4))
            points[:len(some)] = [contact[1:] for contact in some]
            records.append((body_a, body_b, some[0][0], len(some), points))
    count = len(records)
    arrays = {
        "contact_bodies": np.array([record[:2] for record in records]).reshape(count, 2),
        "contact_normal": np.array([record[2] for record in records]).reshape(count, 3),
        "contact_npoints": np.array([record[3] for record in records]),
        "contact_points": np.array([record[4] for record in records]).reshape(count, POINTS, 4),
    }
    return arrays, friction


def main():
    """Steps the model and writes the folder."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawTextHelpFormatter)
    parser.add_argument("--out", type=pathlib.Path, required=True, metavar="FOLDER")
    parser.add_argument("--model", metavar="FILE", help="MuJoCo's XML or MJB")
    parser.add_argument("--steps", type=int, default=200, metavar="N")
    parser.add_argument("--iterations", type=int, default=10, metavar="N", help="of each kind (10)")
    args = parser.parse_args()
    model = (mujoco.MjModel.from_xml_path(args.model) if args.model
             else mujoco.MjModel.from_xml_string(pile()))
    free = model.jnt_type == mujoco.mjtJoint.mjJNT_FREE
    if model.nv != 6 * (model.nbody - 1) or not free.all():
        sys.exit("error: a body is not free: joints are no part of a step; leave these bodies out")
    data = mujoco.MjData(model)
    for _ in range(args.steps):
        mujoco.mj_step(model, data)
    mujoco.mj_forward(model, data)

    collisions, friction = collisions_of(model, data)
    arrays = bodies_of(model, data) | collisions
    gravity = np.array(model.opt.gravity)
    # A step adds gravity after it has moved the bodies, MuJoCo before.
    arrays["body_linvel"][1:] += gravity * model.opt.timestep
    arrays["params"] = np.array([model.opt.timestep, DRIFT, COEFFICIENT, friction, 1, *gravity])
    arrays["iterations"] = np.array([args.iterations] * 2)
    args.out.mkdir(parents=True, exist_ok=True)
    for name, values in arrays.items():
        integer = name in ("iterations", "contact_bodies", "contact_npoints")
        np.save(args.out / f"{name}.npy", np.ascontiguousarray(values, "<u4" if integer else "<f4"))
    print(f"{args.out}: {model.nbody} bodies, {data.ncon} contacts in {len(collisions['contact_npoints'])} "
          f"collisions, friction {friction:g}")


if __name__ == "__main__":
    main()
