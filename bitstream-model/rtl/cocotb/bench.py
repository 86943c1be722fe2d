"""The accelerator at its pins: clock, reset, register accesses, and rules of AXI that hold in every test."""

import cocotb
from cocotb.clock import Clock
from cocotb.triggers import ClockCycles, RisingEdge

import specification as spec

PERIOD = 4  # ns; nothing depends on it
REGISTER_PINS = ("awaddr awvalid awready wdata wstrb wvalid wready bresp bvalid bready "
                 "araddr arvalid arready rdata rresp rvalid rready").split()
STREAM_PINS = "tdata tkeep tlast tvalid tready".split()


def look_up(dut):
    """Finds each pin by its name, for good.

    cocotbext-axi asks for pins that do not exist, and cocotb then lists all: in Verilator copies that nothing reads.
    Its sources and sinks set their pins at once: they begin between two edges of a clock that runs.
    """
    names = ["aclk", "aresetn", "irq", *(f"s_axi_{name}" for name in REGISTER_PINS)]
    names += [f"{letter}{k}_axis_{name}" for letter in "sm" for k in range(spec.STREAMS) for name in STREAM_PINS]
    for name in names:
        getattr(dut, name)


class Bench:
    """A device after its reset by the pin. `watch` runs as long as the test does."""

    def __init__(self, dut):
        self.dut, self.clock = dut, dut.aclk
        self.in_reset = True  # beats and answers may be withdrawn
        self.answers = {"b": 0, "r": 0}

    @classmethod
    async def begin(cls, dut):
        look_up(dut)
        self = cls(dut)
        cocotb.start_soon(Clock(dut.aclk, PERIOD, "ns").start())
        for channel in ("aw", "w", "ar"):
            getattr(dut, f"s_axi_{channel}valid").value = 0
        dut.s_axi_bready.value = dut.s_axi_rready.value = 0
        for k in range(spec.STREAMS):
            for name in (f"s{k}_axis_tvalid", f"s{k}_axis_tlast", f"m{k}_axis_tready"):
                getattr(dut, name).value = 0
        await self.reset_by_pin()
        cocotb.start_soon(self.watch())
        return self

    async def reset_by_pin(self):
        self.in_reset = True
        self.dut.aresetn.value = 0
        await ClockCycles(self.clock, 4)
        self.dut.aresetn.value = 1
        await ClockCycles(self.clock, 2)
        self.in_reset = False
        await self.until_reset_ends()

    async def reset_by_register(self):
        self.in_reset = True
        await self.write(spec.RESET, 1)
        assert await self.read(spec.RESET) == 1, "a reset takes longer than a read"
        await self.until_reset_ends()
        self.in_reset = False

    async def until_reset_ends(self):
        for _ in range(100):
            if await self.read(spec.RESET) == 0:
                return
        raise AssertionError("the reset does not end")

    def pin(self, name):
        return getattr(self.dut, name)

    async def send(self, channel, wait=0, **payload):
        """A request on one channel, `wait` cycles from now."""
        if wait:
            await ClockCycles(self.clock, wait)
        for name, value in payload.items():
            self.pin(f"s_axi_{name}").value = value
        valid, ready = self.pin(f"s_axi_{channel}valid"), self.pin(f"s_axi_{channel}ready")
        valid.value = 1
        for _ in range(200):
            await RisingEdge(self.clock)
            if ready.value == 1:
                valid.value = 0
                return
        raise AssertionError(f"no {channel}ready")

    async def answer(self, channel, hold=0):
        """Takes an answer, `hold` cycles after it is offered; READY is high from the start if that is 0."""
        valid, ready = self.pin(f"s_axi_{channel}valid"), self.pin(f"s_axi_{channel}ready")
        ready.value = int(hold == 0)
        for _ in range(200):
            await RisingEdge(self.clock)
            if valid.value == 1:
                break
        else:
            raise AssertionError(f"no {channel}valid")
        if hold:
            await ClockCycles(self.clock, hold)
            ready.value = 1
            await RisingEdge(self.clock)
        ready.value = 0
        assert self.pin(f"s_axi_{channel}resp").value == 0, "every access is answered OKAY"
        return self.dut.s_axi_rdata.value if channel == "r" else None

    async def write(self, offset, value, strobes=0b1111, address_after=0, data_after=0, hold=0):
        """A write; the address and the data come so many cycles from now."""
        address = cocotb.start_soon(self.send("aw", address_after, awaddr=offset))
        data = cocotb.start_soon(self.send("w", data_after, wdata=value, wstrb=strobes))
        taken = cocotb.start_soon(self.answer("b", hold))
        for part in (address, data, taken):
            await part

    async def read(self, offset, hold=0):
        address = cocotb.start_soon(self.send("ar", araddr=offset))
        value = await self.answer("r", hold)
        await address
        return value.integer

    async def expect(self, values, context):
        for offset, value in values.items():
            found = await self.read(offset)
            assert found == value, f"{context}: {offset:#05x} reads {found:#010x}, expected {value:#010x}"

    async def watch(self):
        """One answer a request, and no VALID that is withdrawn or payload that changes before its READY."""
        asked = {"aw": 0, "w": 0, "ar": 0}
        offered = {}
        outputs = {"b": ("s_axi_bvalid", "s_axi_bready", ("s_axi_bresp",)),
                   "r": ("s_axi_rvalid", "s_axi_rready", ("s_axi_rdata", "s_axi_rresp"))}
        for k in range(spec.STREAMS):
            outputs[f"m{k}"] = (f"m{k}_axis_tvalid", f"m{k}_axis_tready",
                                tuple(f"m{k}_axis_{name}" for name in ("tdata", "tkeep", "tlast")))
        outputs = {name: (self.pin(valid), self.pin(ready), [self.pin(word) for word in words])
                   for name, (valid, ready, words) in outputs.items()}
        inputs = {name: (self.pin(f"s_axi_{name}valid"), self.pin(f"s_axi_{name}ready")) for name in asked}
        while True:
            await RisingEdge(self.clock)
            if self.in_reset:
                offered = {}
            for name, (valid, ready, words) in outputs.items():
                is_valid = valid.value
                assert is_valid.is_resolvable, f"{name}: VALID is unknown"
                payload = [word.value.binstr for word in words] if is_valid == 1 else None
                if name in offered:
                    assert payload is not None, f"{name}: VALID is withdrawn"
                    assert payload == offered[name], f"{name}: the payload changes before READY"
                offered.pop(name, None)
                if payload is not None:
                    if ready.value != 1:
                        offered[name] = payload
                    elif name in self.answers:
                        self.answers[name] += 1
            assert self.answers["b"] <= min(asked["aw"], asked["w"]), "an answer without a write"
            assert self.answers["r"] <= asked["ar"], "an answer without a read"
            for name, (valid, ready) in inputs.items():
                asked[name] += valid.value == 1 and ready.value == 1
