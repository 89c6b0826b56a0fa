"""pyjmri, a client that Footplate shares no line with, drives a train behind the virtual JMRI and waits for its sensors.

It is made for JMRI 5.14. It reads lists over HTTP, which the virtual JMRI does not serve: those are answered here. Throttles and
sensors go through the WebSocket.

Needs FOOTPLATE, the program.
"""

import asyncio
import functools
import json
import logging
import os
import subprocess

import httpx
import pyjmri.client
from pyjmri import Client, SensorState

STATION = ["simulate", "layout", "--station", "tcp:127.0.0.1:0", "--protocol", "jmri", "--trains", "3850", "--steps", "126", "--speed", "5", "--seed", "7"]


class Complaints(logging.Handler):
    """What the client could not read."""

    def __init__(self):
        super().__init__(logging.WARNING)
        self.said = []

    def emit(self, record):
        self.said.append(record.getMessage())


def answered(sensors):
    """What JMRI's web server would list."""

    def answer(request):
        kind = request.url.path.removeprefix("/json/v5/")
        lists = {
            "version": [],
            "networkService": [{"type": "networkService", "data": {"name": "_http._tcp.local.", "jmri": "5.14.1"}}],
            "sensor": [{"type": "sensor", "data": {"name": name, "userName": None, "state": 4}} for name in sensors],
        }
        return httpx.Response(200, text=json.dumps(lists.get(kind, [])))

    return httpx.MockTransport(answer)


async def drive(port):
    names = [f"LS{number}" for number in range(1, 81)]
    pyjmri.client.HTTPClient = functools.partial(pyjmri.client.HTTPClient, transport=answered(names))
    async with Client(f"127.0.0.1:{port}") as jmri:
        # The power is pyjmri's only order over HTTP that this test would need.
        await jmri._ws.send({"type": "power", "method": "post", "data": {"state": 2}})
        layout = await jmri.discover()
        async with jmri.throttle(3850, long=True) as throttle:
            await throttle.set_function(0, True)
            await throttle.set_speed(0.6, forward=True)
            changes = [asyncio.ensure_future(sensor.wait_state(SensorState.ACTIVE, timeout=60)) for sensor in map(layout.sensors.__getitem__, names)]
            done, waiting = await asyncio.wait(changes, return_when=asyncio.FIRST_COMPLETED)
            assert all(change.result() is SensorState.ACTIVE for change in done)
            [change.cancel() for change in waiting]
            await throttle.set_speed(0.0, forward=True)
        print("pyjmri drove a train until a sensor reported it")


def main():
    complaints = Complaints()
    logging.getLogger("pyjmri").addHandler(complaints)
    station = subprocess.Popen([os.environ["FOOTPLATE"], *STATION], stdout=subprocess.PIPE, text=True)
    try:
        address = station.stdout.readline().strip()
        assert address.startswith("jmri:tcp://127.0.0.1:"), address
        asyncio.run(drive(int(address.split("?")[0].rsplit(":", 1)[1])))
        assert not complaints.said, complaints.said
    finally:
        station.terminate()
        station.wait()


if __name__ == "__main__":
    main()
