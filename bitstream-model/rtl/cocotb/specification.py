"""Constants of the interface, typed from its specification (bitstream-model/README.md) and from nothing else.

The build under test is told by the environment: PGS_INERTIA (isotropic or world), PGS_BODIES, PGS_COLLISIONS and
PGS_QUEUE are the options that `rtlgen generate` got.
"""

import os
import struct

WORLD_INERTIA = os.environ["PGS_INERTIA"] == "world"
BODIES, COLLISIONS, QUEUE = (int(os.environ[name]) for name in ("PGS_BODIES", "PGS_COLLISIONS", "PGS_QUEUE"))

STREAMS = 4
BEAT = 16  # bytes

# Section 4: registers.
AP_CTRL, GIE, IER, ISR = 0x000, 0x004, 0x008, 0x00C
START, DONE, IDLE, READY = 1, 2, 4, 8
CAUSE_DONE, CAUSE_READY, CAUSE_ERROR = 1, 2, 4

ARGUMENTS = {
    "bodies": 0x010, "collisions": 0x018, "contact_iterations": 0x020, "friction_iterations": 0x028, "flags": 0x030,
    "time_step": 0x038, "position_drift": 0x040, "position_coefficient": 0x048, "friction": 0x050,
    "angular_damping": 0x058, "gravity_x": 0x060, "gravity_y": 0x068, "gravity_z": 0x070, "spin_damping": 0x078,
}
INTEGRATE, KINEMATIC, PAIR_FRICTION, WARM_START, IMPULSES_OUT, STREAMED_MASSES, IN_ORDER = (1 << k for k in range(7))

ERROR, ERROR_DETAIL, CYCLES_LO, CYCLES_HI, WORK_CYCLES, WAIT_CYCLES = 0x180, 0x184, 0x188, 0x18C, 0x190, 0x194
HAZARDS, SUM_RECEIVED, SUM_SENT, IMPULSE_SUM_LO, IMPULSE_SUM_HI = 0x198, 0x19C, 0x1A0, 0x1A4, 0x1A8
RESET = 0x1C0
SHAPES, SHAPE_TABLE, SHAPE_STRIDE = 64, 0x400, 16

# Section 9: fill and hazard window of a pass in cycles.
CONTACT_FILL, FRICTION_FILL = (388, 328) if WORLD_INERTIA else (374, 314)
CONTACT_WINDOW, FRICTION_WINDOW = 324, 190
INTEGRATION = 264
INTERVAL = 2  # cycles an issue

BODY_BYTES, COLLISION_BYTES = 24 + 24 * WORLD_INERTIA, 16
READ_ONLY = {
    0x100: 0x50475331,  # IDENTIFICATION
    0x104: 2 << 16,  # VERSION
    0x108: 1,  # PROFILE: float
    0x10C: 1 | WORLD_INERTIA << 1,  # FEATURES
    0x110: STREAMS | STREAMS << 8,  # CHANNELS
    0x114: 0x4444, 0x118: 0x4444,  # widths: 128 bits
    0x11C: INTERVAL | 1 << 16,  # ISSUE
    0x120: CONTACT_FILL | CONTACT_WINDOW << 16,
    0x124: FRICTION_FILL | FRICTION_WINDOW << 16,
    0x128: 275_000,  # CLOCK_KHZ
    0x12C: BODIES, 0x130: COLLISIONS, 0x134: SHAPES,
    0x138: BODIES * BODY_BYTES + COLLISIONS * COLLISION_BYTES,
    0x13C: BODY_BYTES | COLLISION_BYTES << 16,
    0x140: 26 | 40 << 8,  # DMA
    0x144: 0,  # NUMBERS: f32 everywhere
    0x148: QUEUE,
    0x150: 0x5000, 0x154: 0x400,  # the fence: 64 MiB from 0x5000_0000 on
}
RESULTS = (ERROR, ERROR_DETAIL, CYCLES_LO, CYCLES_HI, WORK_CYCLES, WAIT_CYCLES, HAZARDS, SUM_RECEIVED, SUM_SENT,
           IMPULSE_SUM_LO, IMPULSE_SUM_HI)


def bits(number):
    """The word of an f32."""
    return struct.unpack("<I", struct.pack("<f", number))[0]


SPIN_DAMPING_AFTER_RESET = bits(0.1)

# Error codes.
(ERROR_INDEX, ERROR_COUNT, ERROR_TLAST_EARLY, ERROR_TLAST_MISSING, ERROR_SHAPE, ERROR_CAPACITY, ERROR_STATIC,
 ERROR_SELF, ERROR_ARGUMENT, ERROR_TKEEP) = range(1, 11)


def after_reset():
    """Every register that a reset sets, and its value."""
    values = dict.fromkeys((GIE, IER, ISR, ERROR, ERROR_DETAIL, RESET), 0)
    values.update(dict.fromkeys(ARGUMENTS.values(), 0))
    values[AP_CTRL] = IDLE
    values[ARGUMENTS["spin_damping"]] = SPIN_DAMPING_AFTER_RESET
    for shape in (0, 1, 31, SHAPES - 1):
        for word in range(4):
            values[SHAPE_TABLE + SHAPE_STRIDE * shape + 4 * word] = 0
    return values
