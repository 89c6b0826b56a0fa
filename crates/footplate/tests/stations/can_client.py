"""python-can, which Footplate shares no line with, drives a train behind the virtual station through its slcan interface.

Needs FOOTPLATE, the program. The station is at a pseudo-terminal, where it is a track box behind a serial CAN adapter.
"""

import os
import struct
import subprocess
import time

import can

STATION = ["simulate", "layout", "--station", "pty", "--protocol", "marklin-can", "--trains", "24", "--seed", "7"]
# Commands of the bus, and the response bit.
SYSTEM, SPEED, DIRECTION, FUNCTION, ACCESSORY, MODULES, CONTACT, PING, FILE, STREAM = (
    0x00, 0x04, 0x05, 0x06, 0x0B, 0x10, 0x11, 0x18, 0x20, 0x21)
RESPONSE = 1 << 16
# The train's decoder is registered under its number; another program's hash.
TRAIN, HASH = 0x4000 + 24, 0x4711


class Peer:
    def __init__(self, path):
        self.bus = can.Bus(interface="slcan", channel=path, bitrate=250000, sleep_after_open=0.2)
        self.heard = []

    def send(self, command, data=b""):
        frame = can.Message(arbitration_id=command << 17 | HASH, data=data, is_extended_id=True)
        self.bus.send(frame)

    def wait(self, what, is_so, seconds=5.0):
        """Waits for a response of which something is so; fails with its name."""
        end = time.monotonic() + seconds
        while time.monotonic() < end:
            frame = self.bus.recv(timeout=0.1)
            if frame is None:
                continue
            assert frame.is_extended_id
            command = frame.arbitration_id >> 17 & 0xFF
            is_response = bool(frame.arbitration_id & RESPONSE)
            self.heard.append((command, is_response, bytes(frame.data)))
            if is_so(*self.heard[-1]):
                return bytes(frame.data)
        raise AssertionError(f"not within {seconds} s: {what}; heard {self.heard[-5:]}")

    def ask(self, what, command, data, answer=None, seconds=5.0):
        """Sends a request and waits until it is confirmed: the same frame with the response bit, unless told otherwise."""
        self.send(command, data)
        expected = data if answer is None else answer
        return self.wait(what, lambda of, response, said: (of, response, said) == (command, True, expected), seconds)


def drive(path):
    peer = Peer(path)
    uid = struct.pack(">I", TRAIN)
    peer.send(PING)
    box = peer.wait("who is there", lambda of, response, said: of == PING and response)
    assert box[6:] == b"\x00\x10", "a track box"
    peer.ask("power on", SYSTEM, b"\0\0\0\0\x01")
    peer.ask("a direction", DIRECTION, uid + b"\x01")
    peer.ask("the direction, asked for", DIRECTION, uid, uid + b"\x01")
    peer.ask("a speed", SPEED, uid + struct.pack(">H", 600))
    peer.ask("the speed, asked for", SPEED, uid, uid + struct.pack(">H", 600))
    peer.ask("function 3", FUNCTION, uid + b"\x03\x01")

    # It runs: contacts report by themselves, with both states and the time in the state before.
    changed = lambda old, new: lambda of, response, said: of == CONTACT and response and said[4:6] == bytes([old, new])
    occupied = peer.wait("a contact", changed(0, 1), seconds=30.0)
    began = time.monotonic()
    contact = occupied[:4]
    free = peer.wait("the same contact, free", lambda *frame: changed(1, 0)(*frame) and frame[2][:4] == contact, 30.0)
    lasted, = struct.unpack(">H", free[6:8])
    assert abs(lasted * 0.01 - (time.monotonic() - began)) < 0.2, f"{lasted} times 10 ms"
    peer.send(MODULES, b"\0\0\0\0\x05")
    modules = [peer.wait("a module", lambda of, response, said: of == MODULES and response)[4] for _ in range(5)]
    assert modules == [1, 2, 3, 4, 5], modules

    peer.ask("turned while it runs", DIRECTION, uid + b"\x02")
    peer.ask("it stands", SPEED, uid, uid + b"\0\0")
    turnout = struct.pack(">I", 0x3000 + 7 - 1)
    peer.ask("a coil, powered", ACCESSORY, turnout + b"\x00\x01")
    peer.ask("a coil, released", ACCESSORY, turnout + b"\x00\x00")
    peer.send(FILE, b"loks\0\0\0\0")
    begins = peer.wait("the list of locomotives", lambda of, response, said: of == STREAM and len(said) == 6)
    length, = struct.unpack(">I", begins[:4])
    stream = b"".join(
        peer.wait("more of it", lambda of, response, said: of == STREAM and len(said) == 8)
        for _ in range((length + 7) // 8))
    import zlib
    text = zlib.decompress(stream[4:length]).decode()
    assert len(text) == struct.unpack(">I", stream[:4])[0]
    assert f".uid={TRAIN:#x}" in text and ".adresse=0x18" in text, text
    peer.ask("power off", SYSTEM, b"\0\0\0\0\x00")
    peer.bus.shutdown()
    print(f"python-can drove a train over {len(peer.heard)} frames")


def main():
    station = subprocess.Popen([os.environ["FOOTPLATE"], *STATION], stdout=subprocess.PIPE, text=True)
    try:
        address = station.stdout.readline().strip()
        assert address.startswith("marklin-can:/dev/"), address
        drive(address.split("?")[0].removeprefix("marklin-can:"))
    finally:
        station.terminate()
        station.wait()


if __name__ == "__main__":
    main()
