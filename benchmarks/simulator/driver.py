"""The user interface of LinuxCNC in the simulator: switches the machine on, executes the runs and records the
joints.

LinuxCNC starts this file as [DISPLAY], with the Python for which LinuxCNC is installed. `runs.json` in the
same folder lists the runs (programs and streams) in order. `rows.bin` gets one number per pin of `PINS` in
each servo period of a run, `said.json` the messages of LinuxCNC.
"""

from __future__ import annotations

import json
import struct
import subprocess
import sys
import threading
import time
from pathlib import Path

import hal
import linuxcnc

FOLDER = Path(__file__).parent
# Types of the recorded pins: three joints; in motion; a stream is to be played; the stream has no row; number
# of the run, from 1.
PINS = "fffbbbs"
# The key of sampler's shared memory.
SAMPLER = 0x48534130
# A stream starts to play when HAL's memory holds this many of its rows.
READY = 8000
# Longest wait for the machine to switch on, and for a program to begin [s].
PATIENCE = 30.0


class Simulator:
    """A machine that is switched on, and the recorder of its joints."""

    def __init__(self) -> None:
        self.command, self.status = linuxcnc.command(), linuxcnc.stat()
        self.errors = linuxcnc.error_channel()
        self.pins = hal.component("driver")
        self.pins.newpin("run", hal.HAL_S32, hal.HAL_OUT)
        self.pins.newpin("play", hal.HAL_BIT, hal.HAL_OUT)
        self.pins.ready()
        for net in (
            "run driver.run => sampler.0.pin.6",
            "play driver.play => streamer.0.enable sampler.0.pin.4 mux2.0.sel mux2.1.sel mux2.2.sel",
        ):
            subprocess.run(["halcmd", "net", *net.split()], check=True)
        self.said: list[str] = []
        self.samples = hal.stream(self.pins, SAMPLER, PINS)
        self.recording = True
        self.recorder = threading.Thread(target=self.record)
        self.recorder.start()

    def record(self) -> None:
        """Writes the rows of runs to the file until `recording` is False."""
        row = struct.Struct(f"<{len(PINS)}d")
        with (FOLDER / "rows.bin").open("wb") as file:
            while self.recording or self.samples.readable:
                if not self.samples.readable:
                    time.sleep(0.02)
                    continue
                values = self.samples.read()
                if values[-1]:
                    file.write(row.pack(*values))

    def wait(self, done, seconds: float = PATIENCE) -> None:
        end = time.monotonic() + seconds
        while time.monotonic() < end:
            self.status.poll()
            while message := self.errors.poll():
                kind, text = message
                if kind in (linuxcnc.OPERATOR_ERROR, linuxcnc.NML_ERROR):
                    raise RuntimeError(f"LinuxCNC says: {text}")
                self.said.append(str(text))
            if done(self.status):
                return
            time.sleep(0.02)
        raise TimeoutError(f"LinuxCNC did not get there in {seconds:g} s")

    def switch_on(self) -> None:
        def on(status) -> bool:
            self.command.state(linuxcnc.STATE_ESTOP_RESET)
            self.command.state(linuxcnc.STATE_ON)
            return status.task_state == linuxcnc.STATE_ON

        self.wait(on)

    def at_rest(self, status) -> bool:
        return status.interp_state == linuxcnc.INTERP_IDLE and status.inpos and status.queue == 0

    def to_start(self, startup: str) -> None:
        """Moves the tool to the origin and sets the modes in which a program begins."""
        self.command.mode(linuxcnc.MODE_MDI)
        self.command.wait_complete(PATIENCE)
        for block in ("G40 G49 G80 G90 G92.1 G54", "G53 G0 X0 Y0 Z0", startup):
            self.command.mdi(block)
            self.command.wait_complete(PATIENCE)
            self.wait(self.at_rest)

    def run_program(self, file: str, seconds: float) -> None:
        self.command.mode(linuxcnc.MODE_AUTO)
        self.command.wait_complete(PATIENCE)
        self.command.program_open(file)
        self.command.auto(linuxcnc.AUTO_RUN, 0)
        self.wait(lambda status: status.interp_state != linuxcnc.INTERP_IDLE)

        def done(status) -> bool:
            if status.interp_state == linuxcnc.INTERP_PAUSED and status.inpos:
                self.command.auto(linuxcnc.AUTO_RESUME)
            return self.at_rest(status)

        self.wait(done, seconds)

    def run_stream(self, file: str, seconds: float) -> None:
        with open(file, "rb") as rows:
            ready = min(READY, sum(not row.startswith(b"#") for row in rows))
        feeder = subprocess.Popen(["halstreamer", file])

        def depth() -> int:
            return hal.get_value("streamer.0.curr-depth")

        # HAL updates the number of rows in its memory once a period, perhaps late: the end of the feeder
        # process does not mean that the memory holds its rows.
        try:
            self.wait(lambda _: depth() >= ready, seconds)
            self.pins["play"] = True
            self.wait(lambda _: feeder.poll() is not None and depth() == 0, seconds)
        finally:
            feeder.kill()
        time.sleep(0.05)
        self.pins["play"] = False


def main() -> None:
    told = json.loads((FOLDER / "runs.json").read_text())
    simulator, results, failed = Simulator(), [], None
    try:
        simulator.switch_on()
        for number, run in enumerate(told["runs"], start=1):
            simulator.said = []
            simulator.to_start(told["startup"])
            simulator.pins["run"] = number
            act = simulator.run_stream if run["stream"] else simulator.run_program
            act(run["file"], run["seconds"])
            time.sleep(0.05)
            simulator.pins["run"] = 0
            results.append(simulator.said)
    except Exception as error:  # LinuxCNC's errors have no common class
        failed = str(error) or type(error).__name__
    finally:
        simulator.recording = False
        simulator.recorder.join()
        overruns = simulator.samples.num_overruns
        (FOLDER / "said.json").write_text(json.dumps({"runs": results, "failed": failed, "lost": overruns}))


if __name__ == "__main__":
    sys.exit(main())
