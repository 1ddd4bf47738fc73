#!/usr/bin/env python3
"""Makes the golden frames from PROTOCOL.md alone, sharing nothing with the Rust code.

    python3 encode.py           writes the *.hex files beside it
    python3 encode.py --check   says whether they are what it would write; exit code 1 if not
"""

import pathlib
import sys


def varint(value):
    out = bytearray()
    while value > 0x7F:
        out.append(value & 0x7F | 0x80)
        value >>= 7
    return bytes(out) + bytes([value])


def signed(value):
    return varint(value << 1 if value >= 0 else (-value << 1) - 1)


def crc16(data):
    crc = 0xFFFF
    for byte in data:
        crc ^= byte << 8
        for _ in range(8):
            crc = (crc << 1 ^ 0x1021 if crc & 0x8000 else crc << 1) & 0xFFFF
    return crc


def cobs(data):
    out = bytearray()
    for block in data.split(b"\0"):
        assert len(block) < 254
        out += bytes([len(block) + 1]) + block
    return bytes(out)


def frame(header, message):
    body = bytes([header]) + message
    return b"\0" + cobs(body + crc16(body).to_bytes(2, "little")) + b"\0"


def request(sequence, kind, *fields):
    return frame(sequence, varint(kind) + b"".join(fields))


def reply(sequence, kind, *fields):
    return frame(0x80 | sequence, varint(kind) + b"".join(fields))


def settings(velocity, acceleration, seek, touch, pull_off, watchdog):
    return b"".join(map(varint, (velocity, acceleration, seek, touch, pull_off, watchdog)))


def status(boot, position, moving, homed, limits, fault, operation, outcome, shift):
    return b"".join(
        (varint(boot), signed(position), bytes([moving, homed, limits]), varint(fault), varint(operation), varint(outcome), signed(shift))
    )


# name: (what it says, frame). The Rust tests know the same names.
VECTORS = {
    "request-hello": ("Hello of version 1, sequence 0", request(0, 0, varint(1))),
    "request-status": ("Status, sequence 1", request(1, 1)),
    "request-home": ("Home, id 1, sequence 2", request(2, 2, varint(1))),
    "request-move": ("Move id 2 to 1500000 nm, sequence 3", request(3, 3, varint(2), signed(1_500_000))),
    "request-move-far": (
        "Move id 4294967295 to -9223372036854775808 nm, sequence 127: the longest of its kind",
        request(127, 3, varint(0xFFFFFFFF), signed(-(1 << 63))),
    ),
    "request-stop": ("Stop, sequence 4", request(4, 4)),
    "request-heartbeat": ("Heartbeat, sequence 5", request(5, 5)),
    "request-read-settings": ("ReadSettings, sequence 6", request(6, 6)),
    "request-write-settings": (
        "WriteSettings 5 mm/s, 20 mm/s2, seek 5 mm/s, touch 0.5 mm/s, pull off 1 mm, watchdog 500 ms, sequence 7",
        request(7, 7, settings(5_000_000, 20_000_000, 5_000_000, 500_000, 1_000_000, 500)),
    ),
    "request-write-settings-largest": (
        "WriteSettings with every field at its largest, sequence 127: the longest request",
        request(127, 7, settings(*[0xFFFFFFFF] * 5, 0xFFFF)),
    ),
    "reply-hello": (
        "Hello: version 1, build 1, 250 steps/mm, travel 200 mm, boot 7, last operation 0, sequence 0",
        reply(0, 0, varint(1), varint(1), varint(250), signed(200_000_000), varint(7), varint(0)),
    ),
    "reply-status-rest": (
        "Status: boot 7, at 1500000 nm, at rest, homed, limits open, no fault, operation 2 done, home not shifted, sequence 1",
        reply(1, 1, status(7, 1_500_000, 0, 1, 0, 0, 2, 2, 0)),
    ),
    "reply-status-fault": (
        "Status: boot 7, at -4000 nm, at rest, not homed, both limits closed, hard limit, operation 300 failed, home shifted by 12000 nm, sequence 9",
        reply(9, 1, status(7, -4_000, 0, 0, 3, 2, 300, 4, 12_000)),
    ),
    "reply-accepted": ("Accepted: id 2 leads to 1500000 nm, sequence 3", reply(3, 2, varint(2), signed(1_500_000))),
    "reply-finished": (
        "Finished: id 2 done at 1500000 nm, sequence 3",
        reply(3, 3, varint(2), varint(2), signed(1_500_000)),
    ),
    "reply-refused": ("Refused: not homed, sequence 3", reply(3, 4, varint(1))),
    "reply-alive": ("Alive: boot 7, moving, sequence 5", reply(5, 5, varint(7), bytes([1]))),
    "reply-settings": (
        "Settings as in request-write-settings, sequence 7",
        reply(7, 6, settings(5_000_000, 20_000_000, 5_000_000, 500_000, 1_000_000, 500)),
    ),
}


def text(name):
    meaning, data = VECTORS[name]
    return f"# {meaning}\n{data.hex(' ')}\n"


def main():
    folder = pathlib.Path(__file__).parent
    if sys.argv[1:] == ["--check"]:
        found = {path.stem: path.read_text() for path in folder.glob("*.hex")}
        wrong = sorted(name for name in VECTORS.keys() | found.keys() if name not in VECTORS or text(name) != found.get(name))
        sys.exit(f"not what PROTOCOL.md says: {', '.join(wrong)}" if wrong else 0)
    for name in VECTORS:
        (folder / f"{name}.hex").write_text(text(name))


if __name__ == "__main__":
    assert crc16(b"123456789") == 0x29B1  # the catalogue's check value of CRC-16/IBM-3740
    main()
