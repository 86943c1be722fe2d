#!/usr/bin/env python3
"""MuJoCo with the board as the solver of its free bodies.

usage: board_solver.py [--model FILE] [--steps N] [--board TEXT]

Runs the model (without --model, boxes, spheres and capsules fall on a plane, beside a pendulum) for N steps (400) on
MuJoCo's own solver and with the board, and prints both: mean height, energy, deepest contact.

Needs the package zynq-pgs (tools/python), and mujoco and numpy from PyPI.

Exit code: 0 done, 2 wrong usage, 77 skipped: a package is missing.
"""
import argparse
import sys

try:
    import mujoco
    import numpy as np
    import zynq_pgs
except ImportError as error:
    print(f"skipped: {error}: pip install mujoco numpy, and build tools/python", file=sys.stderr)
    sys.exit(77)

POINTS = 4
# Penetration that the solver leaves alone, m, and the share of the rest that a step removes.
DRIFT, COEFFICIENT = 0.001, 0.1
JOINTED = -1


class BoardSolver:
    """Steps a model: MuJoCo detects, the board solves the contacts of free bodies, MuJoCo solves everything else.

    A body goes to the board if its one joint is free, no body hangs on it and no equality or tendon holds it. Bodies that
    touch, directly or through others, a body that MuJoCo keeps stay with MuJoCo for that step. Each pair has the
    friction of its contacts; friction against rolling and torsion is left out.
    """

    def __init__(self, model, board="emulated:float,world,threads=1", iterations=10):
        self.model = model
        self.options = {"contact_iterations": iterations, "friction_iterations": iterations, "pair_friction": True,
                        "integrate": False, "spin_damping": 0, "position_drift": 0}
        bodies = np.arange(model.nbody)
        free = (model.body_jntnum == 1) & (model.body_parentid == 0) & ~np.isin(bodies, model.body_parentid[1:])
        free[free] = model.jnt_type[model.body_jntadr[free]] == mujoco.mjtJoint.mjJNT_FREE
        # Equalities and tendons name bodies, or sites, joints and geometries of bodies.
        kinds, wraps = mujoco.mjtObj, mujoco.mjtWrap
        named = {kinds.mjOBJ_BODY: bodies, kinds.mjOBJ_SITE: model.site_bodyid, kinds.mjOBJ_JOINT: model.jnt_bodyid,
                 wraps.mjWRAP_SITE: model.site_bodyid, wraps.mjWRAP_JOINT: model.jnt_bodyid,
                 wraps.mjWRAP_SPHERE: model.geom_bodyid, wraps.mjWRAP_CYLINDER: model.geom_bodyid}
        ends = [(kinds(kind), end) for kind, *pair in zip(model.eq_objtype, model.eq_obj1id, model.eq_obj2id) for end in pair]
        ends += [(wraps(kind), end) for kind, end in zip(model.wrap_type, model.wrap_objid)]
        free[[named[kind][end] for kind, end in ends if kind in named and end >= 0]] = False
        self.free = np.flatnonzero(free)
        self.dofs = model.body_dofadr[self.free, None] + np.arange(6)
        # The number of each body on the board: 0 is everything that is fixed to the world.
        self.place = np.where(model.body_weldid == 0, 0, JOINTED)
        self.place[self.free] = 1 + np.arange(len(self.free))
        self.bodies = np.zeros(1 + len(self.free), zynq_pgs.BODY)
        self.bodies["shape"] = np.arange(len(self.bodies))
        self.bodies["orientation"][0] = 0, 0, 0, 1
        self.board = zynq_pgs.Accelerator(board)
        shapes = np.zeros((len(self.bodies), 4))
        shapes[1:, 0], shapes[1:, 1:] = 1 / model.body_mass[self.free], 1 / model.body_inertia[self.free]
        self.board.set_shapes(shapes)
        self.cycles = self.on_board = 0

    def step(self, data):
        """Takes one step of the model."""
        model, time_step = self.model, self.model.opt.timestep
        mujoco.mj_step1(model, data)
        start, before = data.qpos.copy(), data.qvel.copy()
        collisions, left = self._collisions(data)
        mujoco.mj_step2(model, data)
        # Velocities after forces and before contacts, of the frame in the world and about the body's axes.
        velocity = (before + time_step * data.qacc_smooth)[self.dofs]
        axes = data.xmat[self.free].reshape(-1, 3, 3)
        spin = np.einsum("bij,bj->bi", axes, velocity[:, 3:])
        to_centre = data.xipos[self.free] - data.xpos[self.free]
        moving = self.bodies[1:]
        moving["position"] = data.xipos[self.free]
        quaternion = np.zeros(4)
        for body, axes_of_inertia in zip(moving, data.ximat[self.free]):
            mujoco.mju_mat2Quat(quaternion, axes_of_inertia)
            body["orientation"] = quaternion[[1, 2, 3, 0]]
        moving["linear_velocity"] = velocity[:, :3] + np.cross(spin, to_centre)
        moving["angular_velocity"] = spin
        report = self.board.step(self.bodies, collisions, time_step=time_step, position_coefficient=time_step, **self.options)
        spin = moving["angular_velocity"].astype(float)
        velocity[:, :3] = moving["linear_velocity"] - np.cross(spin, to_centre)
        velocity[:, 3:] = np.einsum("bji,bj->bi", axes, spin)
        taken = ~left[1:]
        data.qvel[self.dofs[taken]] = velocity[taken]
        data.qpos[:] = start
        mujoco.mj_integratePos(model, data.qpos, data.qvel, time_step)
        self.cycles, self.on_board = report.cycles, int(taken.sum())

    def _collisions(self, data):
        """The collisions of the board, and which of its bodies MuJoCo keeps in this step."""
        contacts = [contact for contact in data.contact[: data.ncon] if contact.exclude == 0]
        # A flexible body has no geometry, and stays with MuJoCo.
        pairs = [np.where(contact.geom < 0, JOINTED, self.place[self.model.geom_bodyid[contact.geom]]) for contact in contacts]
        left = self._touching(pairs)
        groups = {}
        for contact, (body_b, body_a) in zip(contacts, pairs):
            # MuJoCo's normal leads from the first geometry to the second: the second is body A.
            if body_a != JOINTED != body_b and not left[body_a] and not left[body_b]:
                key = (body_a, body_b, *np.round(contact.frame[:3], 3))
                groups.setdefault(key, []).append(contact)
        parts = [(key[:2], some[at:at + POINTS]) for key, some in groups.items() for at in range(0, len(some), POINTS)]
        found = np.zeros(len(parts), zynq_pgs.COLLISION)
        frictions = np.zeros(len(parts))
        for row, (bodies, some) in enumerate(parts):
            normal = some[0].frame[:3]
            found[row]["body_a"], found[row]["body_b"] = bodies
            found[row]["normal"], found[row]["count"] = normal / np.linalg.norm(normal), len(some)
            frictions[row] = max(contact.friction[0] if contact.dim > 1 else 0 for contact in some)
            for point, contact in zip(found[row]["contacts"], some):
                # The point lies half way between the surfaces. Its distance becomes a velocity.
                point["point"] = contact.pos - 0.5 * contact.dist * contact.frame[:3]
                deep = COEFFICIENT * min(contact.dist + DRIFT, 0)
                point["distance"] = (contact.dist if contact.dist > 0 else deep) / self.model.opt.timestep
        found["count"] = zynq_pgs.with_friction(found["count"], frictions)
        return found, left

    def _touching(self, pairs):
        """Which bodies of the board touch a body that MuJoCo keeps, directly or through others."""
        left, more = np.zeros(len(self.bodies), bool), True
        while more:
            more = False
            for one, other in pairs:
                kept = [body == JOINTED or (body > 0 and left[body]) for body in (one, other)]
                for body, beside in ((one, kept[1]), (other, kept[0])):
                    if beside and body > 0 and not left[body]:
                        left[body] = more = True
        return left


def scene(count=60):
    """A model of boxes, spheres and capsules of four masses over a plane, and a pendulum beside them."""
    random = np.random.default_rng(1)
    kinds = [("sphere", "0.3"), ("capsule", "0.2 0.3"), ("box", "0.3 0.2 0.25")]
    bodies = []
    for number in range(count):
        shape, size = kinds[number % len(kinds)]
        x, y = (0.8 * (number // 4**axis % 4) - 1.2 + random.uniform(-0.1, 0.1) for axis in (0, 1))
        bodies.append(
            f'<body pos="{x:.4f} {y:.4f} {0.6 + 0.8 * (number // 16)}"><freejoint/><geom type="{shape}" size="{size}" '
            f'mass="{1 + number % 4}" friction="{0.4 + 0.1 * (number % 4):.1f}"/></body>')
    return ('<mujoco><option timestep="0.005"/><worldbody><geom type="plane" size="20 20 .1" friction="0.3"/>'
            '<body pos="6 0 2"><joint axis="0 1 0" damping="20"/><geom type="capsule" fromto="0 0 0 1 0 0" size="0.1"/></body>'
            + "".join(bodies) + "</worldbody></mujoco>")


def figures(model, data):
    """Mean height, m, kinetic energy, J, and the deepest contact, mm."""
    mujoco.mj_forward(model, data)
    mujoco.mj_energyVel(model, data)
    deepest = max((-contact.dist for contact in data.contact[: data.ncon]), default=0)
    return data.xipos[1:, 2].mean(), data.energy[1], 1000 * deepest


def main():
    """Runs the model on both solvers."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawTextHelpFormatter)
    parser.add_argument("--model", metavar="FILE", help="MuJoCo's XML or MJB")
    parser.add_argument("--steps", type=int, default=400, metavar="N")
    parser.add_argument("--board", default="emulated:float,world,threads=1", metavar="TEXT")
    args = parser.parse_args()
    model = (mujoco.MjModel.from_xml_path(args.model) if args.model else mujoco.MjModel.from_xml_string(scene()))
    solver, own, board = BoardSolver(model, args.board), mujoco.MjData(model), mujoco.MjData(model)
    for _ in range(args.steps):
        mujoco.mj_step(model, own)
        solver.step(board)
    for name, data in (("MuJoCo", own), ("board", board)):
        print("{:8} mean height {:.3f} m, kinetic energy {:.4f} J, deepest contact {:.2f} mm".format(name, *figures(model, data)))
    print(f"the last step: {solver.on_board} of {model.nbody - 1} bodies on the board, {solver.cycles:,} cycles")


if __name__ == "__main__":
    main()
