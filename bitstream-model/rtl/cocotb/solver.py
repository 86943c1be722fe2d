"""A step as the specification has it (bitstream-model/README.md, sections 1, 7, 8 and 9), in numpy's float32.

`solve` gives the bits of the results and of the impulses, and the counters. Every operation rounds on its own and
flushes subnormal operands and results. Sine and cosine are the correctly rounded ones; the specification allows one
unit in the last place, so that a step which integrates turning bodies is compared by `same_results`.
"""

from dataclasses import dataclass, field
from math import ceil, cos, floor, sin

import numpy as np

import specification as spec

SMALLEST_NORMAL = np.float32(2.0**-126)


def flush(array):
    return np.where(np.abs(array) < SMALLEST_NORMAL, np.copysign(np.float32(0), array), array)


class Number:
    """A float32, or a vector of them; a sum, product or quotient of components rounds and flushes each.

    `words` are the bits as they came: a number that no operation touches keeps a subnormal one.
    """

    __slots__ = ("array", "words")

    def __init__(self, words):
        self.words = np.asarray(words, np.float32)
        self.array = flush(self.words)

    def __add__(self, other):
        return Number(flush(self.array + other.array))

    def __sub__(self, other):
        return Number(flush(self.array - other.array))

    def __mul__(self, other):
        return Number(flush(self.array * other.array))

    def __truediv__(self, other):
        return Number(flush(self.array / other.array))

    def __neg__(self):
        return Number(-self.words)

    def __gt__(self, other):
        return bool(self.array > other.array)

    def __lt__(self, other):
        return bool(self.array < other.array)

    def __getitem__(self, index):
        return Number(self.words[index])

    def is_zero(self):
        return bool(np.all(self.array == 0))


ZERO, ONE, HALF = Number(0), Number(1), Number(0.5)
NEAR = Number(0.95)  # cosine from which on the spin is damped
STEEP = Number(np.sqrt(0.5))
TURN_LIMIT = Number(0.25) * Number(3.1415925)
SLOW, SERIES = Number(0.001), Number(0.020833334)


def vector(x, y, z):
    return Number(np.stack([x.words, y.words, z.words]))


def dot(a, b):
    product = a * b
    return (product[0] + product[1]) + product[2]


def cross(a, b):
    return a[[1, 2, 0]] * b[[2, 0, 1]] - a[[2, 0, 1]] * b[[1, 2, 0]]


def root(a):
    return Number(flush(np.sqrt(a.array)))


def unit(v):
    return v * (ONE / root(dot(v, v)))


def larger(a, b):
    return a if a > b else b


def smaller(a, b):
    return a if a < b else b


def turned(v, inertia):
    """v*K; a matrix has the order xx, yy, zz, xy, xz, yz."""
    if inertia.array.ndim == 0:
        return v * inertia
    rows = ((0, 3, 4), (3, 1, 5), (4, 5, 2))
    return vector(*(dot(inertia[list(row)], v) for row in rows))


@dataclass
class Body:
    """A body in a step; `inertia` is a number, or with world inertia six."""

    position: np.ndarray
    rotation: np.ndarray
    velocity: np.ndarray
    spin: np.ndarray
    mass: np.float32
    inertia: np.ndarray
    shape: int = 0

    @property
    def moves(self):
        return bool(self.mass != 0)


@dataclass
class Collision:
    """Two bodies, the normal, up to four points with distances, its friction (bits of a binary16), impulses."""

    bodies: tuple
    normal: np.ndarray
    count: int
    points: np.ndarray  # 4 x 4: x, y, z, distance
    friction: int = 0
    contact_impulses: np.ndarray = field(default_factory=lambda: np.zeros(4, np.float32))
    friction_impulses: np.ndarray = field(default_factory=lambda: np.zeros(2, np.float32))


@dataclass
class Step:
    """All that a step is made of; arguments have the names of the registers."""

    bodies: list
    collisions: list
    arguments: dict
    flags: int

    def has(self, flag):
        return bool(self.flags & flag)

    def number(self, name):
        return Number(np.float32(self.arguments.get(name, 0)))

    def passes(self, kind):
        """Passes of a kind, warm one included, and whether the first of them is warm."""
        count = self.arguments[f"{kind}_iterations"] if self.collisions else 0
        warm = self.has(spec.WARM_START) and count > 0
        return count + warm, warm


class Row:
    """A constraint row between two moving states (section 7: row and apply)."""

    def __init__(self, t, arm_a, arm_b, a, b):
        self.a, self.b, self.t = a, b, t
        self.aA, self.aB = cross(arm_a, t), -cross(arm_b, t)
        self.turned_a, self.turned_b = turned(self.aA, a.inertia), turned(self.aB, b.inertia)
        self.J = -ONE / (((a.mass + dot(self.turned_a, self.aA)) + b.mass) + dot(self.turned_b, self.aB))
        self.e = ((dot(t, a.v) + dot(self.aA, a.w)) + dot(-t, b.v)) + dot(self.aB, b.w)

    def apply(self, impulse):
        for body, t, turning in ((self.a, self.t, self.turned_a), (self.b, -self.t, self.turned_b)):
            body.push((t * body.mass) * impulse, turning * impulse)


class Moving:
    """A body's velocities on chip, and the properties that the passes need."""

    def __init__(self, body, kinematic):
        self.moves = body.moves
        stays = not self.moves and not kinematic
        self.v, self.w = (Number(np.zeros(3) if stays else words) for words in (body.velocity, body.spin))
        self.mass = Number(body.mass)
        self.inertia = Number(body.inertia if self.moves else np.zeros_like(body.inertia))

    def push(self, linear, angular):
        if self.moves:
            self.v, self.w = self.v + linear, self.w + angular


def tangents(n):
    zero = Number(0)
    x, y, z = n[0], n[1], n[2]
    if Number(np.abs(z.array)) > STEEP:
        s = y * y + z * z
        k = ONE / root(s)
        t0 = vector(zero, -z * k, y * k)
        return t0, vector(s * k, -x * t0[2], x * t0[1])
    s = x * x + y * y
    k = ONE / root(s)
    t0 = vector(-y * k, x * k, zero)
    return t0, vector(-z * t0[1], z * t0[0], s * k)


class Solver:
    """The state of a step between its passes."""

    def __init__(self, step):
        self.step = step
        self.states = [Moving(body, step.has(spec.KINEMATIC)) for body in step.bodies]
        self.normal = [[ZERO] * 4 for _ in step.collisions]
        self.tangential = [[ZERO] * 2 for _ in step.collisions]
        self.per_second = ONE / step.number("time_step")

    def contact(self, index, warm):
        collision = self.step.collisions[index]
        a, b = (self.states[k] for k in collision.bodies)
        n, impulses = Number(collision.normal), self.normal[index]
        positions = [Number(self.step.bodies[k].position) for k in collision.bodies]
        for i in range(collision.count):
            x, distance = Number(collision.points[i, :3]), Number(collision.points[i, 3])
            row = Row(n, x - positions[0], x - positions[1], a, b)
            if row.J.is_zero():
                continue
            if warm:
                u = Number(collision.contact_impulses[i])
                impulse = u
            else:
                bias = ((distance + self.step.number("position_drift")) * self.step.number("position_coefficient")) \
                    * self.per_second
                u = larger(impulses[i] + (row.e + bias) * row.J, ZERO)
                impulse = u - impulses[i]
            impulses[i] = u
            row.apply(impulse)

    def friction(self, index, warm):
        collision = self.step.collisions[index]
        if collision.count == 0:
            return
        a, b = (self.states[k] for k in collision.bodies)
        pA, pB = (Number(self.step.bodies[k].position) for k in collision.bodies)
        q = -Number(collision.normal)
        c = Number(collision.points[0, :3])
        for i in range(1, collision.count):
            c = c + Number(collision.points[i, :3])
        c = c * (ONE / Number(collision.count))
        mu = self.step.number("friction")
        if self.step.has(spec.PAIR_FRICTION):
            mu = Number(np.array([collision.friction], np.uint16).view(np.float16).astype(np.float32)[0])
        L = self.normal[index]
        limit = mu * (((L[0] + L[1]) + L[2]) + L[3])
        impulses = self.tangential[index]
        for k, t in enumerate(tangents(q)):
            row = Row(t, c - pA, c - pB, a, b)
            if row.J.is_zero():
                continue
            if warm:
                u = Number(collision.friction_impulses[k])
                impulse = u
            else:
                u = smaller(larger(impulses[k] + row.e * row.J, -limit), limit)
                impulse = u - impulses[k]
            impulses[k] = u
            row.apply(impulse)
        if warm:
            return
        if not a.moves or not b.moves or dot(unit(pB - pA), unit(c - pA)) > NEAR:
            s = self.step.number("spin_damping")
            changes = [q * (dot(q, body.w) * s) for body in (a, b)]
            for body, change in zip((a, b), changes):
                if body.moves:
                    body.w = body.w - change

    def integrate(self, index):
        """The result of a body: position, rotation, velocity, spin, as words of f32."""
        step, body, state = self.step, self.step.bodies[index], self.states[index]
        v, w = state.v, state.w
        turns = state.moves or (step.has(spec.KINEMATIC) and not (v.is_zero() and w.is_zero()))
        if not (step.has(spec.INTEGRATE) and turns):
            return body.position, body.rotation, v.words, w.words
        dt = step.number("time_step")
        if state.moves:
            w = w * step.number("angular_damping")
        a = root(dot(w, w))
        if a * dt > TURN_LIMIT:
            a = TURN_LIMIT / dt
        if a < SLOW:
            h = w * (HALF * dt - ((((dt * dt) * dt) * SERIES) * a) * a)
        else:
            h = w * (Number(sin(float(((HALF * a) * dt).array))) / a)
        r = product(h, Number(cos(float(((a * dt) * HALF).array))), Number(body.rotation))
        square = r * r
        r = r * (ONE / root(((square[0] + square[1]) + square[2]) + square[3]))
        position = Number(body.position) + v * dt
        if state.moves:
            v = v + vector(*(step.number(f"gravity_{axis}") for axis in "xyz")) * dt
        return position.words, r.words, v.words, w.words


def product(h, c, q):
    """The quaternion (h, c) * q."""
    x, y, z, w = (q[k] for k in range(4))
    return Number(np.stack([part.array for part in (
        ((c * x + h[0] * w) + h[1] * z) - h[2] * y,
        ((c * y + h[1] * w) + h[2] * x) - h[0] * z,
        ((c * z + h[2] * w) + h[0] * y) - h[1] * x,
        ((c * w - h[0] * x) - h[1] * y) - h[2] * z)]))


class Issue:
    """The order in which the collisions of a pass enter the pipeline, its idle slots, and who met a hazard."""

    def __init__(self, step, window):
        """`window` in cycles: of this kind of pass, which the issue queue does not look at."""
        self.step = step
        self.order, self.idle, self.met = [], 0, set()
        self.last = {}  # body -> slot of its last issue
        self.slot = 0
        if spec.QUEUE == 0 or step.has(spec.IN_ORDER):
            self.window = ceil(window / spec.INTERVAL)
            self.in_order()
        else:
            self.window = ceil(max(spec.CONTACT_WINDOW, spec.FRICTION_WINDOW) / spec.INTERVAL)
            self.by_queue()

    def moving(self, index):
        collision = self.step.collisions[index]
        return {k for k in collision.bodies if self.step.bodies[k].moves} if collision.count else set()

    def is_free(self, index):
        return all(self.slot - self.last.get(body, -self.window) >= self.window for body in self.moving(index))

    def enter(self, index):
        self.order.append(index)
        self.last.update(dict.fromkeys(self.moving(index), self.slot))

    def in_order(self):
        for index in range(len(self.step.collisions)):
            while not self.is_free(index):
                self.met.add(index)
                self.idle += 1
                self.slot += 1
            self.enter(index)
            self.slot += 1

    def by_queue(self):
        count = len(self.step.collisions)
        queue, coming = list(range(min(spec.QUEUE, count))), min(spec.QUEUE, count)
        patience = 0  # slots in which the oldest one did not issue
        while queue:
            oldest = queue[0]
            free = [index for index in queue if self.is_free(index)]
            if patience == 0 and oldest not in free:
                self.met.add(oldest)
            if patience >= 4 * self.window:
                free = [index for index in free if index == oldest or not self.moving(index) & self.moving(oldest)]
            patience += 1
            if free:
                self.enter(free[0])
                queue.remove(free[0])
                if coming < count:
                    queue.append(coming)
                    coming += 1
                if free[0] == oldest:
                    patience = 0
            else:
                self.idle += 1
            self.slot += 1


@dataclass
class Outcome:
    """Words of the results and impulses, and the counters of a step that takes no wait."""

    results: list  # of each body: position, rotation, velocity, spin
    contact_impulses: list  # rows of four words by collision; None without a pass of the kind
    friction_impulses: list
    order: list  # collisions as they issue
    work: int
    stalls: int
    hazards: int
    impulse_sum: int


KINDS = {"contact": (spec.CONTACT_WINDOW, spec.CONTACT_FILL), "friction": (spec.FRICTION_WINDOW, spec.FRICTION_FILL)}


def plan(step):
    """The order of the collisions, WORK_CYCLES, stalls, and HAZARDS (sections 8 and 9)."""
    count, bodies = len(step.collisions), len(step.bodies)
    queued = spec.QUEUE > 0 and not step.has(spec.IN_ORDER)
    filling = min(spec.QUEUE, count) if queued else 0
    work = (bodies if spec.WORLD_INERTIA else ceil(bodies / 2)) + bodies + spec.INTEGRATION
    stalls = hazards = 0
    order = list(range(count))
    for kind, (window, fill) in KINDS.items():
        passes, _ = step.passes(kind)
        if passes:
            issue = Issue(step, window)
            order = issue.order
            work += passes * ((filling + count) * spec.INTERVAL + fill)
            stalls += passes * issue.idle * spec.INTERVAL
            hazards += passes * len(issue.met)
    return order, work, stalls, hazards


def solve(step):
    solver = Solver(step)
    order, work, stalls, hazards = plan(step)
    for kind, solve_one in (("contact", solver.contact), ("friction", solver.friction)):
        passes, warm = step.passes(kind)
        for number in range(passes):
            for index in order:
                solve_one(index, warm and number == 0)
    contacts, frictions = (step.passes(kind)[0] > 0 for kind in KINDS)
    impulse_sum = 0
    if contacts:
        for L in solver.normal:
            impulse_sum += floor(float((((L[0] + L[1]) + L[2]) + L[3]).array) * 2**20)
    return Outcome(
        results=[solver.integrate(index) for index in range(len(step.bodies))],
        contact_impulses=[[x.words for x in L] for L in solver.normal] if contacts else None,
        friction_impulses=[[*(x.words for x in G), ZERO.words, ZERO.words] for G in solver.tangential]
        if frictions else None,
        order=order, work=work, stalls=stalls, hazards=hazards, impulse_sum=impulse_sum)


def as_bits(words):
    return np.asarray(words, np.float32).view(np.uint32)


def same_results(found, expected):
    """Whether two results are the same bits. The rotation may differ by two units of the greatest component."""
    exact = all(np.array_equal(as_bits(a), as_bits(b)) for k, (a, b) in enumerate(zip(found, expected)) if k != 1)
    return exact and bool(np.all(np.abs(found[1] - np.asarray(expected[1])) <= np.float32(2.0**-23)))
