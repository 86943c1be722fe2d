"""Whole steps: golden folders, random steps, faults in packets, resets in the middle. Beside each stands the solver."""

import logging
import os
import random
from pathlib import Path

import cocotb
import numpy as np
from cocotb.triggers import ClockCycles, FallingEdge, First, RisingEdge
from cocotbext.axi import AxiStreamBus, AxiStreamFrame, AxiStreamSink, AxiStreamSource

import records
import specification as spec
from bench import Bench
from scenes import golden, random_collision, random_step
from solver import as_bits, plan, same_results, solve

SEED = int(os.environ.get("PGS_SEED", "1"))
SCENES = int(os.environ.get("PGS_SCENES", "3"))
CYCLES = int(os.environ.get("PGS_CYCLES", "2200"))
GOLDEN = Path(os.environ.get("PGS_GOLDEN", "tests/golden"))
# Everything, in either build: hours. Or else the parts that a build does not share with the other.
FULL = bool(os.environ.get("PGS_FULL"))


class Board:
    """The accelerator between four sources and four sinks, in the place of the DMA cores."""

    @classmethod
    async def begin(cls, dut):
        self = cls()
        logging.getLogger("cocotb.pgs_top").setLevel(logging.WARNING)
        self.dut, self.bench = dut, await Bench.begin(dut)
        await FallingEdge(dut.aclk)
        self.sources, self.sinks = ([kind(AxiStreamBus.from_prefix(dut, f"{letter}{k}_axis"), dut.aclk)
                                     for k in range(spec.STREAMS)]
                                    for letter, kind in (("s", AxiStreamSource), ("m", AxiStreamSink)))
        await self.bench.write(spec.GIE, 1)
        await self.bench.write(spec.IER, spec.CAUSE_DONE)
        return self

    def pause(self, source):
        """Random pauses on every stream, or with None nowhere."""
        def pauses(seed, chance):
            own = random.Random(seed)
            while True:
                yield own.random() < chance

        for stream in (*self.sources, *self.sinks):
            stream.clear_pause_generator()
            stream.pause = False
            if source is not None:
                stream.set_pause_generator(pauses(source.random(), source.choice((0, 0.1, 0.5, 0.9))))

    async def prepare(self, step, table):
        for shape, words in table.items():
            for word, value in enumerate(words[:1] if spec.WORLD_INERTIA else words):
                await self.bench.write(spec.SHAPE_TABLE + spec.SHAPE_STRIDE * shape + 4 * word, spec.bits(value))
        values = {"bodies": len(step.bodies), "collisions": len(step.collisions), "flags": step.flags, **step.arguments}
        for name, offset in spec.ARGUMENTS.items():
            value = values[name]
            await self.bench.write(offset, value if isinstance(value, int) else spec.bits(value))

    async def start(self, step, change=lambda name, stream, packet: packet):
        """Starts a prepared step, then its packets, each as `change` makes it of the right one."""
        await self.bench.write(spec.AP_CTRL, spec.START)
        for name, packets in records.segments(step):
            for stream, packet in enumerate(packets):
                packet = change(name, stream, packet)
                for rows in packet if isinstance(packet, list) else [packet]:
                    if rows is not None:
                        frame = rows if isinstance(rows, AxiStreamFrame) else AxiStreamFrame(rows.tobytes())
                        self.sources[stream].send_nowait(frame)

    async def until_done(self, limit):
        if self.dut.irq.value != 1:
            first = await First(RisingEdge(self.dut.irq), ClockCycles(self.dut.aclk, limit))
            assert self.dut.irq.value == 1, f"no end of the step after {limit} cycles: {first}"
        await ClockCycles(self.dut.aclk, 4)
        assert await self.bench.read(spec.AP_CTRL) == spec.IDLE | spec.DONE | spec.READY
        await self.bench.write(spec.ISR, spec.CAUSE_DONE)
        await self.bench.expect({spec.ISR: 0, spec.AP_CTRL: spec.IDLE}, "acknowledged")

    async def reset(self, by_pin=False):
        """The accelerator and, as a driver does it, the cores at its streams."""
        self.bench.in_reset = True
        for stream in (*self.sources, *self.sinks):
            stream.assert_reset(True)
            stream.clear()
        await (self.bench.reset_by_pin() if by_pin else self.bench.reset_by_register())
        for stream in (*self.sources, *self.sinks):
            stream.assert_reset(False)
        await self.bench.write(spec.GIE, 1)
        await self.bench.write(spec.IER, spec.CAUSE_DONE)

    async def run(self, step, table, context, exact_stalls, recorded=None):
        """A step from the registers to the last beat, compared with the solver; the cycles that it took."""
        outcome = solve(step)
        await self.prepare(step, table)
        await self.start(step)
        await self.until_done(20 * (outcome.work + outcome.stalls) + 20_000)
        await self.bench.expect({spec.ERROR: 0, spec.ERROR_DETAIL: 0}, context)
        expected = records.results(step, outcome)
        found = []
        for stream, sink in enumerate(self.sinks):
            frames = [sink.recv_nowait(compact=False) for _ in range(sink.count())]
            assert len(frames) == 1, f"{context}: {len(frames)} packets on stream {stream}"
            assert all(frames[0].tkeep), f"{context}: TKEEP of stream {stream}"
            found.append(np.frombuffer(bytes(frames[0].tdata), np.uint32).reshape(-1, 4))
        if recorded is not None:
            compare_recorded(found, recorded, context)
        compare_packets(found, expected, step, context)
        await self.compare_counters(step, outcome, found, context, exact_stalls)

    async def compare_counters(self, step, outcome, found, context, exact_stalls):
        read = self.bench.read
        received = records.word_sum([packet for _, packets in records.segments(step) for packet in packets])
        impulse_sum = outcome.impulse_sum
        await self.bench.expect({spec.WORK_CYCLES: outcome.work, spec.SUM_RECEIVED: received,
                                 spec.SUM_SENT: records.word_sum(found), spec.CYCLES_HI: 0,
                                 spec.IMPULSE_SUM_LO: impulse_sum % 2**32, spec.IMPULSE_SUM_HI: impulse_sum >> 32},
                                context)
        stalls = await read(spec.CYCLES_LO) - outcome.work - await read(spec.WAIT_CYCLES)
        hazards = await read(spec.HAZARDS)
        # In the order of the stream the time at which beats come decides who stalls.
        if exact_stalls or (spec.QUEUE > 0 and not step.has(spec.IN_ORDER)):
            assert (stalls, hazards) == (outcome.stalls, outcome.hazards), \
                f"{context}: stalls, hazards {stalls, hazards}, expected {outcome.stalls, outcome.hazards}"
        assert stalls >= 0, f"{context}: {stalls} stalls"


def compare_packets(found, expected, step, context):
    """Bit by bit; the rotations of bodies that turned within the sine's unit in the last place."""
    for stream, (mine, theirs) in enumerate(zip(found, expected)):
        assert mine.shape == theirs.shape, f"{context}: {len(mine)} beats on stream {stream}, expected {len(theirs)}"
        for beat in np.flatnonzero(np.any(mine != theirs, axis=1)):
            words = [mine[beat].view(np.float32), theirs[beat].view(np.float32)]
            near = stream == 1 and step.has(spec.INTEGRATE) and same_results(
                [None, words[0]], [None, words[1]])
            assert near, f"{context}: stream {stream}, beat {beat}: {words[0]}, expected {words[1]}"


def compare_recorded(found, recorded, context):
    """The words of Bullet: position, rotation, velocity and spin are a stream each."""
    for stream, packet in enumerate(found):
        theirs = np.stack([result[stream] for result in recorded]).astype(np.float32).view(np.uint32)
        assert np.array_equal(packet[-len(recorded):, :theirs.shape[1]], theirs), f"{context}: not Bullet's bits"


def cycles_of(step):
    _, work, stalls, _ = plan(step)
    return work + stalls


def some_step(source):
    """A random step, made short enough, and its shape table."""
    step, table = random_step(source)
    while cycles_of(step) > CYCLES:
        passes = [name for name in ("contact_iterations", "friction_iterations") if step.arguments[name] > 1]
        change = source.choice([*passes, "collisions"])
        if change != "collisions":
            step.arguments[change] -= 1
        elif len(step.collisions) > 1:
            step.collisions.pop()
        elif not passes:
            break
    return step, table


def folders():
    return sorted(folder for folder in GOLDEN.iterdir() if folder.is_dir())


@cocotb.test(skip=spec.WORLD_INERTIA)
async def the_solver_has_the_bits_of_bullet(_dut):
    for folder in folders():
        step, _, recorded = golden(folder, spec.INTEGRATE | spec.IN_ORDER)
        for body, (mine, theirs) in enumerate(zip(solve(step).results, recorded)):
            for found, words in zip(mine, theirs):
                assert np.array_equal(as_bits(found), as_bits(words)), f"{folder.name}: body {body}"
        print(f"folder {folder.name}: the solver has Bullet's bits", flush=True)


@cocotb.test(skip=spec.WORLD_INERTIA and not FULL)
async def golden_folders_have_the_bits_of_bullet_with_pauses_on_all_streams(dut):
    """A pile takes 200,000 cycles, nearly all of them stalls."""
    board = await Board.begin(dut)
    source = random.Random(SEED)
    for folder in folders():
        step, table, recorded = golden(folder, spec.INTEGRATE | spec.IN_ORDER)
        if not FULL and cycles_of(step) > 2 * CYCLES:
            continue
        board.pause(source)
        await board.run(step, table, folder.name, exact_stalls=False, recorded=recorded)
        print(f"folder {folder.name}, {len(step.collisions)} collisions: 0 differ", flush=True)


@cocotb.test()
async def random_steps_equal_the_solver_bit_by_bit_and_cycle_by_cycle(dut):
    board = await Board.begin(dut)
    for number in range(SCENES):
        source = random.Random(f"{SEED} {number}")
        step, table = some_step(source)
        paused = source.random() < (0.4 if step.has(spec.IN_ORDER) else 0.75)
        board.pause(source if paused else None)
        context = f"scene {number} of seed {SEED}"
        await board.run(step, table, context, exact_stalls=not paused)
        print(f"{context}: {len(step.bodies)} bodies, {len(step.collisions)} collisions, flags {step.flags:07b}, "
              f"{cycles_of(step)} cycles: 0 differ", flush=True)


@cocotb.test(skip=not FULL)
async def a_collision_whose_bodies_are_always_busy_issues_when_its_patience_ends(dut):
    """Collision 2 needs both moving bodies, and each of the others one: without patience it would be the last."""
    board = await Board.begin(dut)
    source = random.Random(SEED)
    while True:
        step, table = random_step(source, (3, 15))
        if [body.moves for body in step.bodies] == [False, True, True]:
            break
    for index in range(len(step.collisions)):
        pair = (1, 2) if index == 2 else (0, 1 + index % 2)
        collision = random_collision(source, step.bodies, pair)
        while collision.count == 0:
            collision = random_collision(source, step.bodies, pair)
        step.collisions[index] = collision
    step.arguments.update(contact_iterations=1, friction_iterations=1)
    step.flags = spec.IMPULSES_OUT
    order = plan(step)[0]
    assert 2 < order.index(2) < len(order) - 1, order
    await board.run(step, table, "patience", exact_stalls=True)
    print(f"scene of patience, order {order}: 0 differ", flush=True)


def short_step(source):
    """A step of five bodies, some of them static, three collisions and one contact pass, and its shape table."""
    while True:
        step, table = random_step(source, (5, 3))
        if sum(body.moves for body in step.bodies) == 3:
            step.flags = (step.flags | spec.INTEGRATE) & ~spec.WARM_START
            step.arguments.update(contact_iterations=1, friction_iterations=0)
            return step, table


def spoil_packet(segment, stream, kind):
    """Changes one packet: an early TLAST on its beat 1, a missing one, or a beat 1 with invalid bytes."""
    def change(name, at, packet):
        if (name, at) != (segment, stream):
            return packet
        if kind == "early":
            return [packet[:2], packet[2:]]
        if kind == "missing":
            return [np.concatenate([packet, packet[:1]])]
        keep = [1] * spec.BEAT * len(packet)
        keep[spec.BEAT + 5] = 0
        return [AxiStreamFrame(packet.tobytes(), tkeep=keep)]
    return change


def faults(step, source):
    """Name, a change of the step or of a packet, and the error's code, stream and detail."""
    beats = {name: packets for name, packets in records.segments(step)}
    for segment in ("load", "contact0", "poses"):
        for kind, code in (("early", spec.ERROR_TLAST_EARLY), ("missing", spec.ERROR_TLAST_MISSING),
                           ("keep", spec.ERROR_TKEEP)):
            stream = source.choice([k for k in range(spec.STREAMS) if len(beats[segment][k]) > 2])
            detail = len(beats[segment][stream]) - 1 if kind == "missing" else 1
            yield f"{segment}, {kind}", None, spoil_packet(segment, stream, kind), code, stream, detail
    moving = [k for k, body in enumerate(step.bodies) if body.moves]
    still = [k for k, body in enumerate(step.bodies) if not body.moves]
    place = source.randrange(3)
    for name, code, values in (("index", spec.ERROR_INDEX, {"bodies": (moving[0], 5)}),
                               ("index above", spec.ERROR_INDEX, {"bodies": (0x8000_0000, moving[0])}),
                               ("count", spec.ERROR_COUNT, {"count": 5}),
                               ("self", spec.ERROR_SELF, {"bodies": (moving[1], moving[1])}),
                               ("two statics", spec.ERROR_STATIC, {"bodies": tuple(still[:2])})):
        if name != "two statics" or len(still) > 1:
            yield name, (step.collisions[place], values), None, code, 0, place
    if not step.has(spec.STREAMED_MASSES):
        yield "shape", (step.bodies[3], {"shape": spec.SHAPES}), None, spec.ERROR_SHAPE, 0, 3
    for name, value, code, detail in (
            ("bodies", 0, spec.ERROR_ARGUMENT, spec.ARGUMENTS["bodies"]),
            ("bodies", spec.BODIES + 1, spec.ERROR_ARGUMENT, spec.ARGUMENTS["bodies"]),
            ("contact_iterations", 256, spec.ERROR_ARGUMENT, spec.ARGUMENTS["contact_iterations"]),
            ("friction_iterations", 0xFFFF_FF00, spec.ERROR_ARGUMENT, spec.ARGUMENTS["friction_iterations"]),
            ("collisions", spec.COLLISIONS + 1, spec.ERROR_CAPACITY,
             5 * spec.BODY_BYTES + (spec.COLLISIONS + 1) * spec.COLLISION_BYTES)):
        yield f"{name} = {value}", (spec.ARGUMENTS[name], value), None, code, 0, detail


@cocotb.test(skip=not FULL)
async def a_fault_in_a_packet_or_argument_is_told_and_the_step_behind_the_reset_is_right(dut):
    board = await Board.begin(dut)
    source = random.Random(SEED)
    step, table = short_step(source)
    limit = 20_000
    for number, (name, change, packets, code, stream, detail) in enumerate(faults(step, source)):
        context = f"fault {name}"
        board.pause(source if number % 3 == 0 else None)
        await board.prepare(step, table)
        if change is not None and isinstance(change[0], int):
            await board.bench.write(*change)
            await board.bench.write(spec.AP_CTRL, spec.START)
        elif change is not None:
            record, values = change
            right = {key: getattr(record, key) for key in values}
            vars(record).update(values)
            await board.start(step)
            vars(record).update(right)
        else:
            await board.start(step, packets)
        await board.until_done(limit)
        await board.bench.expect({spec.ERROR: code | stream << 8, spec.ERROR_DETAIL: detail}, context)
        # A start does nothing before the reset.
        await board.bench.write(spec.AP_CTRL, spec.START)
        await board.bench.expect({spec.AP_CTRL: spec.IDLE, spec.ERROR: code | stream << 8}, context)
        await board.reset(by_pin=number % 4 == 1)
        await board.bench.expect({spec.ERROR: 0, spec.ERROR_DETAIL: 0, spec.ISR: 0}, context)
        if number % 3 == 2:
            board.pause(None)
            await board.run(step, table, f"behind {context}", exact_stalls=True)
    print(f"faults: {number + 1}, each told by its code, stream and detail", flush=True)


@cocotb.test(skip=not spec.WORLD_INERTIA and not FULL)
async def a_reset_in_the_middle_of_each_part_of_a_step_leaves_no_trace(dut):
    board = await Board.begin(dut)
    source = random.Random(SEED)
    for number, part in enumerate(("load", "contact", "friction", "integration")):
        step, table = short_step(source)
        step.arguments.update(friction_iterations=1)
        step.flags |= spec.IMPULSES_OUT
        outcome = solve(step)
        integrates = outcome.work + outcome.stalls - spec.INTEGRATION
        begin, end = {"load": (0, 12), "contact": (40, spec.CONTACT_FILL),
                      "friction": (integrates - spec.FRICTION_FILL + 40, integrates),
                      "integration": (integrates, integrates + spec.INTEGRATION)}[part]
        board.pause(source if part == "load" else None)
        await board.prepare(step, table)
        await board.start(step)
        await ClockCycles(dut.aclk, source.randrange(begin, end))
        assert not await board.bench.read(spec.AP_CTRL) & spec.DONE, f"{part}: too late"
        await board.reset(by_pin=number % 2 == 1)
        await board.bench.expect({spec.AP_CTRL: spec.IDLE, spec.ERROR: 0, spec.ISR: 0}, part)
        board.pause(None)
        await board.run(step, table, f"behind a reset in {part}", exact_stalls=True)
        print(f"scene behind a reset in {part}: 0 differ", flush=True)
