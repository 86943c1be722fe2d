"""Packs a step into the packets of the streams in, and its outcome into those of the streams out.

From the specification (bitstream-model/README.md, sections 2 and 3) alone. A row is an array of four words; a packet
is the rows of one stream, or None where a segment gives the stream no beat.
"""

import numpy as np

import specification as spec

BODY_STRIPE = (0, 1, 2, 3)
COLLISION_STRIPE = (0, 1, 2, 3, 0, 1, 2)
WARM_STRIPE = (0, 1, 2, 3)


def row(numbers, word=0):
    """Numbers of f32 and, if there are three, a word beside them."""
    words = np.zeros(4, np.uint32)
    words[:len(numbers)] = np.asarray(numbers, np.float32).view(np.uint32)
    if len(numbers) == 3:
        words[3] = word
    return words


def velocity_rows(body, step):
    rows = [row(body.velocity, body.shape), row(body.spin)]
    if spec.WORLD_INERTIA:
        mass = row([body.mass])[0] if step.has(spec.STREAMED_MASSES) else 0
        rows += [row(body.inertia[:3], mass), row(body.inertia[3:])]
    return rows


def collision_rows(collision, step, impulses):
    count = collision.count
    if step.has(spec.PAIR_FRICTION):
        count |= (collision.friction & 0x7FFF) << 16
    points = [row(point) for point in collision.points]
    arms = [row(step.bodies[k].position, k) if k < len(step.bodies) else row(np.zeros(3), k) for k in collision.bodies]
    return [row(collision.normal, count), *arms, *points, *([] if impulses is None else [row(impulses)])]


def pose_rows(body, _step):
    return [row(body.position), row(body.rotation)]


def striped(rows, stripe):
    """The packets of an array: beat i of a group goes to the stream that the stripe names."""
    packets = [[] for _ in range(spec.STREAMS)]
    for index, words in enumerate(rows):
        packets[stripe[index % len(stripe)]].append(words)
    return [np.stack(packet) if packet else None for packet in packets]


def segments(step):
    """Name and packets of each segment of a step, in order."""
    yield "load", striped([words for body in step.bodies for words in velocity_rows(body, step)], BODY_STRIPE)
    for kind in ("contact", "friction"):
        passes, warm = step.passes(kind)
        for number in range(passes):
            is_warm = warm and number == 0
            rows = [words for collision in step.collisions for words in collision_rows(
                collision, step, getattr(collision, f"{kind}_impulses") if is_warm else None)]
            yield f"{kind}{number}", striped(rows, WARM_STRIPE if is_warm else COLLISION_STRIPE)
    yield "poses", striped([words for body in step.bodies for words in pose_rows(body, step)], BODY_STRIPE)


def impulse_rows(impulses, step, order):
    """The impulses of a kind as they leave: through the issue queue with their numbers."""
    rows = [row(impulses[index]) for index in order]
    if spec.QUEUE == 0 or step.has(spec.IN_ORDER):
        return rows
    numbered = []
    for first in range(0, len(rows), 4):
        numbers = np.zeros(4, np.uint32)
        some = order[first:first + 4]
        numbers[:len(some)] = some
        numbered += [*rows[first:first + 4], numbers]
    return numbered


def results(step, outcome):
    """The packets of the streams out."""
    rows = [words for position, rotation, velocity, spin in outcome.results
            for words in (row(position), row(rotation), row(velocity), row(spin))]
    packets = striped(rows, BODY_STRIPE)
    if step.has(spec.IMPULSES_OUT):
        for impulses in (outcome.friction_impulses, outcome.contact_impulses):
            if impulses is not None:
                packets[0] = np.concatenate([np.stack(impulse_rows(impulses, step, outcome.order)), packets[0]])
    return packets


def word_sum(packets):
    """The sum of all words, modulo 2^32."""
    return sum(int(packet.sum(dtype=np.uint64)) for packet in packets if packet is not None) % 2**32
