"""Drops a hundred balls into a box on the emulated board, and draws the heap. usage: pile.py [PICTURE]"""
import sys

import numpy as np
import zynq_pgs

RADIUS, STEPS = 0.4, 240
WALLS = np.array([(0, 1, 0), (1, 0, 0), (-1, 0, 0), (0, 0, 1), (0, 0, -1)], np.float32)  # their normals
FROM_ORIGIN = np.array([0, -2, -2, -2, -2], np.float32)  # along the normals, m

bodies = np.zeros(101, zynq_pgs.BODY)  # body 0 is the box, the others are balls
bodies["orientation"][:, 3] = 1
bodies["shape"][1:] = 1
balls = bodies["position"][1:]  # a view: each step moves it
balls[:] = np.stack(np.unravel_index(np.arange(100), (4, 7, 4)), 1) * (0.95, 0.9, 0.95) + (-1.4, 0.5, -1.4)
balls += np.random.default_rng(1).uniform(-0.03, 0.03, balls.shape)

def collisions():
    """The balls that touch a wall, where B is the box, and the balls that touch each other."""
    near = balls @ WALLS.T - FROM_ORIGIN - RADIUS
    ball, wall = np.nonzero(near < 0)
    a, b = np.triu_indices(len(balls), 1)
    between = balls[a] - balls[b]
    apart = np.linalg.norm(between, axis=1)
    a, b, between, apart = (of[apart < 2 * RADIUS] for of in (a, b, between, apart))
    found = np.zeros(len(ball) + len(a), zynq_pgs.COLLISION)
    found["count"], found["body_a"] = 1, np.concatenate([ball, a]) + 1
    found["body_b"][len(ball):] = b + 1
    found["normal"] = np.concatenate([WALLS[wall], between / apart[:, None]])
    found["contacts"]["distance"][:, 0] = np.concatenate([near[ball, wall], apart - 2 * RADIUS])
    depth = RADIUS + found["contacts"]["distance"][:, :1]
    found["contacts"]["point"][:, 0] = balls[found["body_a"] - 1] - depth * found["normal"]
    return found

with zynq_pgs.Accelerator("emulated") as board:
    board.set_shapes([(0, 0, 0, 0), (1, *[2.5 / RADIUS**2] * 3)])  # inverse mass and inertia: the box, a ball of 1 kg
    cycles = [board.step(bodies, collisions(), gravity=(0, -9.81, 0)).cycles for _ in range(STEPS)]
    print(f"{STEPS} steps, the last one of {len(collisions())} collisions in {cycles[-1]:,} cycles")

if len(sys.argv) > 1:
    import matplotlib.pyplot as plt
    axes = plt.figure(figsize=(5, 4)).add_subplot(aspect="equal", xlim=(-2.5, 2.5), ylim=(-0.2, 4.2), xlabel="x, m", ylabel="y, m")
    for x, y, z in balls[np.argsort(balls[:, 2])]:
        axes.add_patch(plt.Circle((x, y), RADIUS, facecolor=plt.cm.viridis(y / 4), edgecolor="white", alpha=0.75 + z / 10))
    axes.plot([-2, -2, 2, 2], [4, 0, 0, 4], "k")
    plt.savefig(sys.argv[1], dpi=70)
