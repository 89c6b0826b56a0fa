"""DCC-EX-py, a client that Footplate shares no line with, drives a train behind the virtual board.

Needs FOOTPLATE, the program. The client reads one message from each portion that arrives, so the board delivers each by itself.
"""

import os
import subprocess
import time

from dcc_ex_py.DCCEX import DCCEX
from dcc_ex_py.Helpers import ActiveState, Direction, Track, TurnoutState

STATION = ["simulate", "layout", "--station", "tcp:127.0.0.1:0", "--protocol", "dcc-ex", "--trains", "24", "--seed", "7"]


def until(what, is_so, seconds=5.0):
    """Waits for something; fails with its name."""
    end = time.monotonic() + seconds
    while not is_so():
        assert time.monotonic() < end, f"not within {seconds} s: {what}"
        time.sleep(0.01)


def drive(port):
    client = DCCEX("127.0.0.1", port)
    heard = []
    client.add_command_listener(lambda command: heard.append(command.str_command))
    said = lambda text: lambda: any(text in one for one in heard)

    client.train_engines.check_max_engines()
    until("the number of locomotives", lambda: client.train_engines.maxEngines == 50)
    client.track_power.power_select_track(ActiveState.ON, Track.MAIN)
    until("power on", said("<p1 MAIN>"))

    engine = client.train_engines.get_engine(24)
    engine.set_speed(62, Direction.FORWARD)
    # The speed byte of 62 is 63, as the firmware answers.
    until("the speed", lambda: engine.speed == 63 and engine.direction == Direction.FORWARD)
    until("<T 1 62 1>, the answer to the old form", said("<T 1 62 1>"))
    engine.set_function(3, ActiveState.ON)
    until("function 3", lambda: engine.get_function(3) == ActiveState.ON)
    # It runs: sensors report by themselves.
    until("a sensor", said("<Q "), seconds=30.0)
    until("the same sensor, free again", said("<q "), seconds=30.0)

    engine.set_speed(-1, Direction.REVERSED)
    until("the emergency stop", lambda: engine.speed == 1 and engine.direction == Direction.REVERSED)
    client.send_command("<T 7 1>")
    client.send_command("<T 7 0>")
    until("a turnout", lambda: said("<H 7 1>")() or said("<H 7 0>")())
    client.turnouts.set_turnout(9999, TurnoutState.THROWN)
    until("a turnout that there is not", said("<X>"))
    client.train_engines.forget_loco(24)
    until("the locomotive forgotten", said("<- 24>"))
    client.track_power.power_all_tracks(ActiveState.OFF)
    until("power off", said("<p0>"))
    client.quit()
    print(f"DCC-EX-py drove a train over {len(heard)} messages")


def main():
    station = subprocess.Popen([os.environ["FOOTPLATE"], *STATION], stdout=subprocess.PIPE, text=True)
    try:
        address = station.stdout.readline().strip()
        assert address.startswith("dcc-ex:tcp://127.0.0.1:"), address
        drive(int(address.split("?")[0].rsplit(":", 1)[1]))
    finally:
        station.terminate()
        station.wait()


if __name__ == "__main__":
    main()
