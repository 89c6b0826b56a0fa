"""A station that reads with z21aio's codec, which Footplate shares no line with and which refuses wrong XOR bytes, is opened and driven
by the program, and left in order.

Needs FOOTPLATE, the program.
"""

import json
import os
import socket
import struct
import subprocess
import tempfile
import threading

from z21aio.messages import XBusMessage
from z21aio.packet import Packet

LAN_X = 0x40
# What each other header is answered with.
ANSWERS = {
    0x10: struct.pack("<I", 4711),
    0x18: bytes([0]),
    0x1A: struct.pack("<IBBBB", 0x201, 0x43, 0x01, 0, 0),
}


class Station(threading.Thread):
    """Answers as a Z21 with ten feedback modules, none of whose inputs is occupied, and notes what it was commanded."""

    def __init__(self):
        super().__init__(daemon=True)
        self.socket = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
        self.socket.bind(("127.0.0.1", 0))
        self.port = self.socket.getsockname()[1]
        self.flags, self.power, self.has_logged_off = 0, False, False
        self.drives = []
        self.locomotives = {}

    def run(self):
        while True:
            datagram, client = self.socket.recvfrom(1472)
            while datagram:
                packet = Packet.from_bytes(datagram)
                length = struct.unpack("<H", datagram[:2])[0]
                assert length == packet.data_len, datagram.hex(" ")
                datagram = datagram[length:]
                for answer in self.answers(packet):
                    self.socket.sendto(answer.to_bytes(), client)

    def answers(self, packet):
        x_bus = lambda header, *data: Packet.with_header_and_data(LAN_X, XBusMessage(header, bytes(data)).to_bytes())
        header, data = packet.header, packet.data
        if header in ANSWERS:
            yield Packet.with_header_and_data(header, ANSWERS[header])
        elif header == 0x50:
            (self.flags,) = struct.unpack("<I", data)
        elif header == 0x51:
            yield Packet.with_header_and_data(header, struct.pack("<I", self.flags))
        elif header == 0x81:
            yield Packet.with_header_and_data(0x80, data + bytes(10))
        elif header == 0x30:
            self.has_logged_off = True
        elif header == LAN_X:
            message = XBusMessage.from_bytes(data)
            match message.x_header, *message.dbs:
                case 0x21, 0x24:
                    yield x_bus(0x62, 0x22, 0 if self.power else 2)
                case 0x21, (0x80 | 0x81) as power:
                    self.power = power == 0x81
                    yield x_bus(0x61, int(self.power))
                case 0xE4, 0x13, high, low, speed:
                    self.drives.append(((high & 0x3F) << 8 | low, speed))
                    self.locomotives[high, low] = speed
                case 0xE3, 0xF0, high, low:
                    yield x_bus(0xEF, high, low, 4, self.locomotives.get((high, low), 0x80), 0, 0, 0, 0)
                case 0x43, high, low:
                    yield x_bus(0x43, high, low, 2)


def main():
    station = Station()
    station.start()
    run = lambda *words: subprocess.run([os.environ["FOOTPLATE"], *words, "--link", f"z21:127.0.0.1:{station.port}"], capture_output=True, text=True)

    doctor = run("doctor", "--seconds", "3", "--json")
    assert doctor.returncode == 0, doctor.stderr
    figures = json.loads(doctor.stdout)
    expected = {"serial_number": 4711, "firmware": "1.43", "lost_answers": 0, "sensors": 80, "unread_bytes": 0, "wrong_xor": 0}
    assert expected.items() <= figures.items(), figures
    assert station.flags & 0x03 == 0x03 and not station.power and station.has_logged_off, vars(station)

    with tempfile.NamedTemporaryFile("w", suffix=".txt") as script:
        script.write("speed 24 8\nstop 24\n")
        script.flush()
        driven = run("drive", "--layout", "track-a", "--train", "24", "--script", script.name)
    assert driven.returncode == 0, driven.stdout + driven.stderr
    # Step 8 of 14 is step 72 of 126, forward, and the speed byte counts from 2.
    assert (24, 0x80 | 73) in station.drives and station.drives[-1] == (24, 0x80), station.drives
    assert not station.power
    print(f"z21aio's codec read the program: {figures['requests']} requests, {len(station.drives)} commands to a train")


if __name__ == "__main__":
    main()
