"""The registers (specification, section 4) by raw pins and by cocotbext-axi's master, and the rules of AXI."""

import os
import random

import cocotb
from cocotb.triggers import ClockCycles, FallingEdge, RisingEdge, Timer
from cocotbext.axi import AxiLiteBus, AxiLiteMaster

import specification as spec
from bench import PERIOD, Bench

SEED = int(os.environ.get("PGS_SEED", "1"))
BODIES, FLAGS = spec.ARGUMENTS["bodies"], spec.ARGUMENTS["flags"]
# Offsets between, behind and above the registers, words of the shape table without a meaning among them.
NOWHERE = (0x014, 0x01C, 0x07C, 0x080, 0x0FC, 0x14C, 0x158, 0x17C, 0x1AC, 0x1BC, 0x1C4, 0x3FC, 0x408, 0x40C,
           0x7F8, 0x800, 0x804, 0xBFC, 0xC00, 0xFFC)


async def start_without_bodies(bench):
    """The shortest step: it ends at once, with error 9."""
    await bench.write(spec.AP_CTRL, spec.START)
    for _ in range(10):
        if await bench.read(spec.ERROR):
            break
    await bench.expect({spec.ERROR: spec.ERROR_ARGUMENT, spec.ERROR_DETAIL: BODIES}, "a start without bodies")


@cocotb.test()
async def every_register_has_its_value_after_a_reset_by_the_pin_and_by_the_register(dut):
    bench = await Bench.begin(dut)
    await bench.expect(spec.after_reset() | dict.fromkeys(spec.RESULTS, 0) | spec.READ_ONLY, "reset by the pin")
    source = random.Random(SEED)
    written = {offset: source.getrandbits(32) | 1 for offset in spec.ARGUMENTS.values()}
    for shape in (0, 1, 31, spec.SHAPES - 1):
        for word in range(2):
            written[spec.SHAPE_TABLE + spec.SHAPE_STRIDE * shape + 4 * word] = source.getrandbits(32) | 1
    written |= {spec.GIE: 1, spec.IER: 7}
    for offset, value in written.items():
        await bench.write(offset, value)
    await bench.expect(written, "written")
    for offset in (spec.GIE, spec.IER, BODIES):
        await bench.write(offset, 0)
    await bench.write(spec.IER, 0xFFFF_FFFF)
    await bench.write(spec.GIE, 0xFFFF_FFFF)
    await bench.expect({spec.IER: 7, spec.GIE: 1}, "fields of three bits and of one")
    await start_without_bodies(bench)
    await bench.reset_by_register()
    await bench.expect(spec.after_reset(), "reset by the register")
    await line_is(bench, 0, "reset by the register")
    # By the pin again, after an error.
    await start_without_bodies(bench)
    await bench.reset_by_pin()
    await bench.expect({spec.ERROR: 0, spec.ERROR_DETAIL: 0, spec.AP_CTRL: spec.IDLE}, "reset by the pin")


@cocotb.test()
async def nothing_but_a_register_that_is_read_and_written_keeps_a_write(dut):
    bench = await Bench.begin(dut)
    kept = {offset: 0x8000_0001 + 0x0101_0101 * k for k, offset in enumerate(spec.ARGUMENTS.values())}
    kept |= {spec.SHAPE_TABLE: 0x3F80_0000, spec.SHAPE_TABLE + 4: 0x4000_0000, spec.GIE: 1, spec.IER: 2}
    for offset, value in kept.items():
        await bench.write(offset, value)
    for offset in (*spec.READ_ONLY, *spec.RESULTS, *NOWHERE):
        await bench.write(offset, 0xFFFF_FFFF)
    await bench.write(spec.RESET, 0xFFFF_FFFE)
    await bench.write(spec.AP_CTRL, 0xFFFF_FFFE)
    await bench.expect(spec.READ_ONLY | dict.fromkeys((*spec.RESULTS, *NOWHERE, spec.RESET), 0) | kept
                       | {spec.AP_CTRL: spec.IDLE}, "written where nothing is kept")


@cocotb.test()
async def an_offset_that_is_no_multiple_of_4_reads_0_and_writes_nothing(dut):
    bench = await Bench.begin(dut)
    kept = {BODIES: 0x1111_1111, spec.SHAPE_TABLE: 0x2222_2222, spec.SHAPE_TABLE + 4: 0x3333_3333, spec.IER: 5}
    for offset, value in kept.items():
        await bench.write(offset, value)
    odd = [offset + k for offset in (*kept, spec.AP_CTRL, spec.RESET, spec.ISR) for k in (1, 2, 3)]
    for offset in odd:
        await bench.write(offset, 0x4444_4445)
    await bench.expect(kept | {spec.AP_CTRL: spec.IDLE, spec.ISR: 0} | dict.fromkeys(odd, 0), "offsets out of line")


@cocotb.test()
async def address_and_data_come_in_any_order_and_each_request_has_one_answer(dut):
    bench = await Bench.begin(dut)
    source = random.Random(SEED)
    offsets = list(spec.ARGUMENTS.values())
    requests = 0
    for first in ("address", "data", "both"):
        for gap in (1, 2, 5):
            for hold in (0, 1, 4):
                offset, value = source.choice(offsets), source.getrandbits(32)
                await bench.write(offset, value, address_after=gap * (first == "data"),
                                  data_after=gap * (first == "address"), hold=hold)
                assert await bench.read(offset, hold=source.choice((0, 1, 6))) == value, (first, gap, hold)
                requests += 1
    # A read and a write at a time.
    write = cocotb.start_soon(bench.write(BODIES, 77, hold=9))
    assert await bench.read(0x100, hold=3) == spec.READ_ONLY[0x100]
    await write
    dut.s_axi_bready.value = dut.s_axi_rready.value = 1
    before = dict(bench.answers)
    await ClockCycles(bench.clock, 12)
    assert bench.answers == before and before["b"] == requests + 1, "an answer too many, or one too few"
    assert await bench.read(BODIES) == 77


@cocotb.test()
async def a_second_request_waits_for_the_answer_to_the_first(dut):
    bench = await Bench.begin(dut)
    first = cocotb.start_soon(bench.write(BODIES, 1, hold=40))
    second = cocotb.start_soon(second_write(bench))
    await first
    await second
    await bench.expect({BODIES: 1, FLAGS: 2}, "two writes, one behind the other")


async def second_write(bench):
    """Offers address and data while the answer to the first write is held back, and takes its own."""
    await ClockCycles(bench.clock, 10)
    parts = [cocotb.start_soon(bench.send("aw", awaddr=FLAGS)), cocotb.start_soon(bench.send("w", 3, wdata=2, wstrb=15))]
    for part in parts:
        await part
    while bench.answers["b"] < 1:
        await RisingEdge(bench.clock)
    await bench.answer("b", hold=2)


@cocotb.test()
async def the_master_of_cocotbext_axi_reads_and_writes_the_registers(dut):
    bench = await Bench.begin(dut)
    await FallingEdge(bench.clock)  # the master sets its pins at once
    master = AxiLiteMaster(AxiLiteBus.from_prefix(dut, "s_axi"), dut.aclk, dut.aresetn, reset_active_level=False)
    source = random.Random(SEED)

    def pauses(seed):
        own = random.Random(seed)
        while True:
            yield own.random() < 0.4

    channels = (master.write_if.aw_channel, master.write_if.w_channel, master.write_if.b_channel,
                master.read_if.ar_channel, master.read_if.r_channel)
    for seed, channel in enumerate(channels):
        channel.set_pause_generator(pauses(SEED + seed))
    written = {offset: source.getrandbits(32) for offset in spec.ARGUMENTS.values()}
    for offset, value in written.items():
        await master.write_dword(offset, value)
    for offset, value in (written | spec.READ_ONLY).items():
        assert await master.read_dword(offset) == value, hex(offset)
    # A burst of the master is a row of accesses, at once.
    block = await master.read(BODIES, 0x70)
    assert block.resp == 0
    for offset, value in written.items():
        if offset < BODIES + 0x70:
            at = offset - BODIES
            assert int.from_bytes(block.data[at:at + 4], "little") == value, hex(offset)
    # It writes single bytes with strobes: without an effect here.
    await master.write(BODIES + 1, b"\xff\xff")
    assert await master.read_dword(BODIES) == written[BODIES]
    del bench


async def line_is(bench, level, context):
    """The interrupt line settles in a few cycles after a write was answered."""
    await ClockCycles(bench.clock, 4)
    assert bench.dut.irq.value == level, context


@cocotb.test()
async def an_interrupt_is_acknowledged_when_its_source_is_off(dut):
    bench = await Bench.begin(dut)
    await bench.write(spec.GIE, 1)
    await bench.write(spec.IER, 7)
    await start_without_bodies(bench)
    await bench.expect({spec.ISR: 7}, "a step with an error")
    await line_is(bench, 1, "a step with an error")
    await bench.write(spec.GIE, 0)
    await line_is(bench, 0, "GIE masks the line")
    await bench.write(spec.GIE, 1)
    await bench.write(spec.IER, 0)
    await line_is(bench, 1, "a pending bit stays")
    await bench.expect({spec.ISR: 7}, "a pending bit stays")
    await bench.write(spec.ISR, 7)
    await bench.expect({spec.ISR: 0}, "acknowledged with IER = 0")
    await line_is(bench, 0, "acknowledged with IER = 0")
    await bench.write(spec.ISR, 5)
    await bench.expect({spec.ISR: 5}, "a written 1 toggles a bit")
    await line_is(bench, 1, "a written 1 toggles a bit")
    # A cause sets its bit only while it is enabled.
    for enabled in (0, spec.CAUSE_DONE, spec.CAUSE_READY, spec.CAUSE_ERROR):
        await bench.reset_by_register()
        await bench.write(spec.IER, enabled)
        await start_without_bodies(bench)
        await bench.expect({spec.ISR: enabled}, f"IER = {enabled}")
        await bench.expect({spec.AP_CTRL: spec.IDLE | spec.DONE | spec.READY}, "done")
        await bench.expect({spec.AP_CTRL: spec.IDLE}, "clear on read")


@cocotb.test()
async def no_ready_changes_when_a_valid_rises_between_two_edges(dut):
    bench = await Bench.begin(dut)
    valids = ("s_axi_awvalid", "s_axi_wvalid", "s_axi_arvalid")
    readies = ("s_axi_awready", "s_axi_wready", "s_axi_arready")
    dut.s_axi_awaddr.value, dut.s_axi_wdata.value, dut.s_axi_wstrb.value = FLAGS, 0, 15
    dut.s_axi_araddr.value = FLAGS
    dut.s_axi_bready.value = dut.s_axi_rready.value = 1

    def levels(names):
        return [bench.pin(name).value.binstr for name in names]

    for risen in (valids, valids[:1], valids[1:2], valids[:2], valids[2:]):
        for value in (1, 0):
            await FallingEdge(bench.clock)
            before = levels(readies)
            for name in risen:
                bench.pin(name).value = value
            await Timer(PERIOD // 4, "ns")
            assert levels(readies) == before, f"{risen} becomes {value}"
            # A request that is offered stays until it is taken; the other half of a write comes then.
            if value == 1:
                await finish_requests(bench, risen)
    outputs = [f"m{k}_axis_tvalid" for k in range(spec.STREAMS)] + ["s_axi_bvalid", "s_axi_rvalid"]
    await FallingEdge(bench.clock)
    before = levels(outputs)
    for k in range(spec.STREAMS):
        bench.pin(f"m{k}_axis_tready").value = 1
    dut.s_axi_bready.value = dut.s_axi_rready.value = 0
    await Timer(PERIOD // 4, "ns")
    assert levels(outputs) == before, "a VALID follows a READY"


async def finish_requests(bench, names):
    """Lowers each VALID after its handshake, offers the half of a write that is missing, waits for the answers."""
    names = set(names)
    if names & {"s_axi_awvalid", "s_axi_wvalid"}:
        names |= {"s_axi_awvalid", "s_axi_wvalid"}
    for name in names:
        bench.pin(name).value = 1
    left = set(names)
    for _ in range(20):
        await RisingEdge(bench.clock)
        for name in sorted(left):
            if bench.pin(name.replace("valid", "ready")).value == 1:
                bench.pin(name).value = 0
                left.discard(name)
    assert not left, f"no READY: {left}"


@cocotb.test()
async def a_write_without_all_strobes_writes_nothing_and_starts_nothing(dut):
    bench = await Bench.begin(dut)
    kept = {BODIES: 0x1234_5678, spec.SHAPE_TABLE: 0x3F80_0000, spec.IER: 7, spec.GIE: 0}
    for offset, value in kept.items():
        await bench.write(offset, value)
    for strobes in (0b0000, 0b0001, 0b0111, 0b1110, 0b1010):
        for offset in (*kept, spec.ISR, spec.RESET):
            await bench.write(offset, ~kept.get(offset, 0) & 0xFFFF_FFFF, strobes=strobes)
        await bench.expect(kept | {spec.ISR: 0, spec.RESET: 0}, f"strobes {strobes:04b}")
    await bench.write(BODIES, 0)
    for strobes in (0b0000, 0b0001, 0b0111):
        await bench.write(spec.AP_CTRL, spec.START, strobes=strobes)
        await bench.expect({spec.AP_CTRL: spec.IDLE, spec.ERROR: 0}, f"a start with strobes {strobes:04b}")
    await start_without_bodies(bench)


async def put(bench, stream, beats, last=True, keep=0xFFFF):
    """Beats on a stream in, as numbers of 128 bits."""
    pins = {name: bench.pin(f"s{stream}_axis_{name}") for name in ("tdata", "tkeep", "tlast", "tvalid", "tready")}
    for index, beat in enumerate(beats):
        pins["tdata"].value, pins["tkeep"].value = beat, keep
        pins["tlast"].value, pins["tvalid"].value = int(last and index == len(beats) - 1), 1
        for _ in range(200):
            await RisingEdge(bench.clock)
            if pins["tready"].value == 1:
                break
        else:
            raise AssertionError(f"stream {stream} takes no beat")
    pins["tvalid"].value = 0


@cocotb.test()
async def an_offered_beat_outlives_an_error_and_only_a_reset_withdraws_it(dut):
    """8 static bodies, no collision: the results of the first poses wait at the pins when a bad beat comes."""
    bodies = 8
    for end in ("taken", "reset"):
        bench = await Bench.begin(dut) if end == "taken" else bench
        await bench.write(BODIES, bodies)
        await bench.write(spec.AP_CTRL, spec.START)
        # A velocity record is two beats, with world inertia four; all words 0: shape 0 is static.
        beats = bodies if spec.WORLD_INERTIA else bodies // 2
        loads = [cocotb.start_soon(put(bench, k, [0] * beats)) for k in range(spec.STREAMS)]
        for load in loads:
            await load
        poses = [cocotb.start_soon(put(bench, k, [0x3F80_0000 + k + 4 * i for i in range(3)], last=False))
                 for k in range(spec.STREAMS)]
        for pose in poses:
            await pose
        valids = [bench.pin(f"m{k}_axis_tvalid") for k in range(spec.STREAMS)]
        for _ in range(2000):
            await RisingEdge(bench.clock)
            if all(valid.value == 1 for valid in valids):
                break
        else:
            raise AssertionError("no results")
        await put(bench, 1, [0], keep=0xFFF0)
        while await bench.read(spec.AP_CTRL) & spec.DONE == 0:
            pass
        await bench.expect({spec.ERROR: spec.ERROR_TKEEP | 1 << 8, spec.ERROR_DETAIL: 3}, "TKEEP")
        # From here on `watch` fails if a beat is withdrawn.
        await ClockCycles(bench.clock, 20)
        assert all(valid.value == 1 for valid in valids), "the offered beats stay"
        if end == "taken":
            for k, valid in enumerate(valids):
                bench.pin(f"m{k}_axis_tready").value = 1
                await RisingEdge(bench.clock)
                assert valid.value == 1
                for _ in range(10):
                    await RisingEdge(bench.clock)
                    assert valid.value == 0, "an error lets no further beat go"
                bench.pin(f"m{k}_axis_tready").value = 0
        await bench.reset_by_register()
        assert all(valid.value == 0 for valid in valids), "RESET withdraws the beats"
        await bench.expect(spec.after_reset(), "after the error")
