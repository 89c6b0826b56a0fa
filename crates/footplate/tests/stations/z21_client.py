"""z21aio, a client that Footplate shares no line with, drives a train behind the virtual Z21.

Needs FOOTPLATE, the program.
"""

import asyncio
import logging
import os
import subprocess
import time

from z21aio import DccThrottleSteps, Loco, Turnout, TurnoutPosition, Z21Station
from z21aio.messages import BROADCAST_LOCO_INFO, LAN_SET_BROADCASTFLAGS
from z21aio.packet import Packet

STATION = ["simulate", "layout", "--station", "udp:127.0.0.1:0", "--protocol", "z21", "--trains", "3850", "--steps", "126", "--seed", "7"]
# R-BUS changes: z21aio has no words for them, but hands their datasets over.
R_BUS = 0x02
R_BUS_CHANGED = 0x80


class Complaints(logging.Handler):
    """What the client could not read."""

    def __init__(self):
        super().__init__(logging.ERROR)
        self.said = []

    def emit(self, record):
        self.said.append(record.getMessage())


async def until(what, is_so, seconds=5.0):
    """Waits for something; fails with its name."""
    end = time.monotonic() + seconds
    while not is_so():
        assert time.monotonic() < end, f"not within {seconds} s: {what}"
        await asyncio.sleep(0.01)


async def drive(port):
    async with await Z21Station.connect("127.0.0.1", port) as station:
        assert await station.get_serial_number() == 101953
        assert await station.get_firmware_version() == (0x01, 0x42)
        version, kind = await station.get_version()
        assert kind == 0x12, (version, kind)

        power, states, rail_com, inputs, systems = [], [], [], [], []
        station.subscribe_track_power(power.append)
        station.subscribe_loco_state(states.append)
        station.subscribe_system_state(systems.append, freq_hz=5.0)
        station._subscribers.setdefault(R_BUS_CHANGED, []).append(lambda packet: inputs.append(packet.data))
        flags = BROADCAST_LOCO_INFO | R_BUS | 0x04
        await station.send_packet(Packet.with_header_and_data(LAN_SET_BROADCASTFLAGS, flags.to_bytes(4, "little")))
        await station.voltage_on()
        await until("power on", lambda: power and power[-1])
        await until("a system state with track voltage", lambda: systems and not systems[-1].is_track_voltage_off)

        engine = await Loco.control(station, 3850)
        engine.subscribe_railcom(rail_com.append)
        await engine.drive(50.0)
        # 50 % of 128 is the code 64: step 63, as the station says it. The train has 126 steps and a long address.
        await until("the speed", lambda: states and states[-1].speed_value == 64 and not states[-1].reverse)
        await engine.set_headlights(True)
        await engine.function_on(5)
        await engine.function_toggle(30)
        await until("functions", lambda: all(states[-1].functions[number] for number in (0, 5, 30)))
        await until("RailCom data", lambda: rail_com and rail_com[-1].loco_address == 3850 and rail_com[-1].speed > 0)
        # It runs: sensors report by themselves.
        await until("a sensor", lambda: any(any(data[1:]) for data in inputs), seconds=30.0)
        await until("the same sensor, free again", lambda: not any(inputs[-1][1:]), seconds=30.0)
        await engine.estop()
        await until("the emergency stop", lambda: states[-1].is_estop)
        await until("rest", lambda: rail_com[-1].speed == 0)

        for steps, code in ((DccThrottleSteps.STEPS_14, 7), (DccThrottleSteps.STEPS_28, 14)):
            coarse = await Loco.control(station, 3850, steps)
            await coarse.drive(50.0, reverse=True)
            await until(steps.name, lambda: states[-1].stepping == steps and states[-1].speed_value == code and states[-1].reverse)
        await coarse.stop(reverse=True)
        # A long address, of a locomotive that is not there.
        far = await Loco.control(station, 3078)
        await far.drive(10.0)
        await until("a long address", lambda: states[-1].address == 3078)

        turnouts = []
        turnout = await Turnout.control(station, 6)
        turnout.subscribe_state(turnouts.append)
        for position, queued in ((TurnoutPosition.P0, False), (TurnoutPosition.P1, False), (TurnoutPosition.P0, True)):
            await turnout.switch(position, queue_mode=queued)
            await until(position.name, lambda: turnouts and turnouts[-1].position == position)
        await station.voltage_off()
        await until("power off", lambda: not power[-1])
        print(f"z21aio drove a train over {len(states)} states, {len(inputs)} reports of sensors and {len(rail_com)} of RailCom")


def main():
    complaints = Complaints()
    logging.getLogger("z21aio").addHandler(complaints)
    station = subprocess.Popen([os.environ["FOOTPLATE"], *STATION], stdout=subprocess.PIPE, text=True)
    try:
        address = station.stdout.readline().strip()
        assert address.startswith("z21:127.0.0.1:"), address
        asyncio.run(drive(int(address.split("?")[0].rsplit(":", 1)[1])))
        assert not complaints.said, complaints.said
    finally:
        station.terminate()
        station.wait()


if __name__ == "__main__":
    main()
