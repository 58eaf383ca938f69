"""Executes an image for the NUCLEO-H743ZI2, instruction by instruction, over a model of the registers it uses.

It boots, is given a recorded run's frames at their times, and must send what the recorded node sent: every frame, in order,
for each identifier. Shows that clocks, vectors, memory, CAN driver, timers and, in the camera, the read-out are programmed as this
model has them, which is read from RM0433; it is no silicon. By hand, never needed to build or run:
    python3 -m venv target/oracle && target/oracle/bin/pip install unicorn pillow
    cargo xtask build nucleo-h743 && cargo run --release -- seal --path straight --frame-loss 0 --out target/run
    target/oracle/bin/python scripts/nucleo_h743_replay.py controller target/run
    target/oracle/bin/python scripts/nucleo_h743_replay.py camera target/run
"""

import collections
import pathlib
import struct
import sys

import unicorn.arm_const as arm
from PIL import Image
from unicorn import UC_ARCH_ARM, UC_HOOK_CODE, UC_MODE_MCLASS, UC_MODE_THUMB, Uc

ROOT = pathlib.Path(__file__).parents[1]
RCC, PWR, SYSCFG, I2C2, TIM2, TIM5 = 0x58024400, 0x58024800, 0x58000400, 0x40005800, 0x40000000, 0x40000C00
FDCAN, MESSAGES, DCMI, DMA1 = 0x4000A000, 0x4000AC00, 0x48020000, 0x40020000
PERIPHERALS = [
    (0x40000000, 0x100000),
    (0x48020000, 0x10000),
    (0x52000000, 0x10000),
    (0x58000000, 0x100000),
    (0xE0000000, 0x100000),
]
HALF = 0.0025  # s, from one timer event to the next
READ_OUT = 0.012  # s, from an exposure to the image
RETURN = 0x1000  # where handlers return to
LONGEST = 200_000_000  # instructions of a handler: twice those of vision with a grey view of a bend's start
CAMERA = 0x20


class Board:
    """The microcontroller: memory as link.x has it, registers as far as they answer anything but what was written."""

    def __init__(self, image, parameters):
        self.registers = collections.defaultdict(int)
        self.arrived, self.get, self.sent, self.event = collections.deque(), 0, [], 0
        self.cpu = cpu = Uc(UC_ARCH_ARM, UC_MODE_THUMB | UC_MODE_MCLASS)
        cpu.ctl_set_cpu_model(arm.UC_CPU_ARM_CORTEX_M7)
        # Flash erased; RAM with something in it, for power-up leaves it so.
        for start, length, filling in [(0x08000000, 0x200000, 0xFF), (0x20000000, 0x20000, 0xA5), (0x24000000, 0x80000, 0xA5)]:
            cpu.mem_map(start, length)
            cpu.mem_write(start, bytes([filling]) * length)
        cpu.mem_map(RETURN, 0x1000)
        for start, length in PERIPHERALS:
            cpu.mmio_map(start, length, self.read, start, self.write, start)
        self.load(image.read_bytes())
        cpu.mem_write(0x08100000, parameters.read_bytes())

    def load(self, elf):
        table, = struct.unpack_from("<I", elf, 0x1C)
        size, count = struct.unpack_from("<HH", elf, 0x2A)
        for k in range(count):
            kind, offset, _, address, length = struct.unpack_from("<5I", elf, table + k * size)
            if kind == 1 and length:
                self.cpu.mem_write(address, elf[offset : offset + length])
        self.waiting = self.cpu.hook_add(UC_HOOK_CODE, self.sleep, None, 0x08000000, 0x080FFFFF)

    def sleep(self, cpu, address, size, _):
        if size == 2 and bytes(cpu.mem_read(address, 2)) == b"\x30\xbf":
            cpu.emu_stop()

    def read(self, _, offset, size, base):
        address = base + offset
        value = self.registers[address & ~3]
        match address & ~3:
            case 0x58024400:  # RCC_CR: every oscillator and PLL is ready as soon as it is on
                value |= 0x0000C105 | 1 << 13 | (value & 0x15010000) << 1
            case 0x58024410:  # RCC_CFGR: the switch has switched
                value = value & ~0x38 | (value & 7) << 3
            case 0x58024474:  # RCC_CSR
                value |= (value & 1) << 1
            case 0x58024804 | 0x58024818:  # PWR: voltage is there
                value |= 1 << 13
            case 0x58000420:  # SYSCFG_CCCSR
                value |= 1 << 8
            case 0x40005818:  # I2C2_ISR: the sensor takes every byte
                value = 0x63
            case 0x4000A0A4:  # RXF0S
                value = len(self.arrived) | self.get << 8
            case 0x4000A0CC:  # TXBRP: what is sent is gone at once
                value = 0
            case 0x40000024:  # TIM2_CNT
                value = 80
            case 0x40000C24:  # TIM5_CNT
                value = (self.event * 500_000 + 80) & 0xFFFFFFFF
        return value >> 8 * (address & 3) & (1 << 8 * size) - 1

    def write(self, _, offset, size, value, base):
        address = base + offset
        shift, mask = 8 * (address & 3), (1 << 8 * size) - 1
        word = self.registers[address & ~3]
        self.registers[address & ~3] = word & ~(mask << shift) | value << shift
        if address == FDCAN + 0xD0:  # TXBAR
            first = MESSAGES + (self.registers[FDCAN + 0xC0] & 0xFFFC)
            for buffer in (k for k in range(32) if value >> k & 1):
                head, second, low, high = (self.registers[first + 16 * buffer + 4 * k] for k in range(4))
                data = struct.pack("<II", low, high)[: second >> 16 & 15]
                self.sent.append((head >> 18 & 0x7FF, data))
        elif address == FDCAN + 0xA8:  # RXF0A
            self.arrived.popleft()
            self.get = (self.get + 1) % 64
            self.show()
        elif address == DMA1 + 0x08:  # LIFCR
            self.registers[DMA1] &= ~value
        elif address == DMA1 + 0x10 and not value & 1:  # a stream that is switched off
            self.registers[DMA1 + 0x10] = value

    def boot(self):
        stack, reset = struct.unpack("<II", self.cpu.mem_read(0x08000000, 8))
        self.cpu.reg_write(arm.UC_ARM_REG_SP, stack)
        self.cpu.emu_start(reset, 0, count=50_000_000)
        self.cpu.hook_del(self.waiting)
        at = self.cpu.reg_read(arm.UC_ARM_REG_PC) & ~1
        assert self.cpu.mem_read(at, 2) == b"\x30\xbf", f"did not boot: stands at {at:#x}"
        assert not self.registers[0x58020418] >> 14 & 1, "halted: the red lamp is on"

    def interrupt(self, number):
        handler, = struct.unpack("<I", self.cpu.mem_read(0x08000040 + 4 * number, 4))
        self.cpu.reg_write(arm.UC_ARM_REG_LR, RETURN | 1)
        before = self.cpu.context_save()
        self.cpu.emu_start(handler, RETURN, count=LONGEST)
        assert self.cpu.reg_read(arm.UC_ARM_REG_PC) & ~1 == RETURN, f"handler {number} does not return: at {self.cpu.reg_read(arm.UC_ARM_REG_PC):#x}"
        self.cpu.context_restore(before)

    def show(self):
        """Puts the oldest frame that arrived where the core reads it."""
        if self.arrived:
            first = MESSAGES + (self.registers[FDCAN + 0xA0] & 0xFFFC) + 16 * self.get
            for k, word in enumerate(self.arrived[0]):
                self.registers[first + 4 * k] = word

    def receive(self, identifier, data):
        filters = (self.registers[MESSAGES + 4 * k] for k in range(self.registers[FDCAN + 0x84] >> 16 & 0xFF))
        if any(f >> 16 & 0x7FF <= identifier <= f & 0x7FF and f >> 27 == 1 for f in filters):
            self.arrived.append((identifier << 18, len(data) << 16, *struct.unpack("<II", data.ljust(8, b"\0"))))
            self.show()
            self.interrupt(19)

    def exposing(self):
        return self.registers[DCMI] & 1

    def read_out(self, picture):
        """The camera interface lets the picture's rows through, filled up to whole words."""
        picture = Image.open(picture)
        extent, words = self.registers[DCMI + 0x24], self.registers[DMA1 + 0x14]
        stride, rows = (extent & 0x3FFF) + 1, (extent >> 16) + 1
        assert (stride * rows, rows) == (4 * words, picture.height)
        pixels, width = picture.tobytes(), picture.width
        filled = b"".join(pixels[k * width : (k + 1) * width].ljust(stride, b"\xee") for k in range(rows))
        self.cpu.mem_write(self.registers[DMA1 + 0x1C], filled)
        self.registers[DMA1] |= 1 << 5  # LISR: transfer complete
        self.interrupt(11)
        self.interrupt(141)


def sent_by_controller(identifier):
    return identifier in (0, 0x80, 0x77F) or identifier >> 7 in (4, 6, 8, 10, 12)


def sent_by_camera(identifier):
    return identifier & 0x7F == CAMERA and identifier >> 7 in (1, 3, 5, 7, 9, 11, 14)


def main(name, run):
    run = pathlib.Path(run)
    board = Board(ROOT / "target/images/nucleo-h743" / name, run / f"{name}.params")
    board.boot()
    print(f"booted; bit timing {board.registers[FDCAN + 0x1C]:#010x}, tick every {board.registers[TIM2 + 0x2C] + 1} counts")
    own = {"controller": sent_by_controller, "camera": sent_by_camera}[name]
    log = []
    for line in (run / "bus.log").read_text().splitlines():
        time, _, frame = line.split()
        identifier, data = frame.split("#")
        log.append((float(time.strip("()")), int(identifier, 16), bytes.fromhex(data)))
    coming = collections.deque((time, identifier, data) for time, identifier, data in log if not own(identifier))
    pictures = iter(sorted((run / "frames").glob("*.png"), key=lambda picture: int(picture.stem.split("-")[1])))
    image_at = None
    while coming:
        end = board.event * HALF
        while coming and coming[0][0] <= end:
            time, identifier, data = coming.popleft()
            if image_at is not None and image_at <= time:
                board.read_out(next(pictures))
                image_at = None
            board.receive(identifier, data)
            if image_at is None and board.exposing():
                image_at = time + READ_OUT
        board.interrupt(28)
        board.event += 1
    sent, expected = collections.defaultdict(list), collections.defaultdict(list)
    for identifier, data in board.sent:
        sent[identifier].append(data)
    for _, identifier, data in log:
        if own(identifier):
            expected[identifier].append(data)
    differ = [f"{k:#05x}" for k in sent.keys() | expected.keys() if sent[k] != expected[k]]
    frames = sum(map(len, expected.values()))
    print(f"{board.event} timer events, {frames} frames recorded, {len(board.sent)} sent; differ: {', '.join(differ) or 'none'}")
    for k in differ:
        print(k, len(sent[int(k, 16)]), len(expected[int(k, 16)]), sent[int(k, 16)][:3], expected[int(k, 16)][:3])
    return bool(differ)


sys.exit(main(*sys.argv[1:]))
