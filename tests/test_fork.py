"""Child processes of every start method can plan, whatever their parent has done before."""

from __future__ import annotations

import multiprocessing
import subprocess
import sys
import threading
from pathlib import Path

import pytest

from feedplan import lazy

ROOT = Path(__file__).parent.parent

# A script as users write them: children import it again, and a pool that hangs ends with the script.
SCRIPT = """
import multiprocessing, os, sys, threading
import feedplan

def child(number):
    plan = feedplan.plan(sys.argv[1], "mill", method="jerk-limited")
    assert plan.audit().ok
    plan.account
    return plan.time, len(os.listdir("/proc/self/task")) if os.path.isdir("/proc/self/task") else 0

def plan_on(end):
    while not end.is_set():
        feedplan.plan(sys.argv[1], "mill", method="jerk-limited").account

if __name__ == "__main__":
    plan = feedplan.plan(sys.argv[1], "mill", method="jerk-limited")
    end = threading.Event()
    threads = [threading.Thread(target=plan_on, args=(end,)) for _ in range(2 if "busy" in sys.argv else 0)]
    for thread in threads:
        thread.start()
    with multiprocessing.get_context(sys.argv[2]).Pool(2) as pool:
        found = pool.map(child, range(4), chunksize=1)
    end.set()
    for thread in threads:
        thread.join()
    assert [time for time, _ in found] == [plan.time] * 4
    print(min(count for _, count in found))
"""


@pytest.mark.parametrize("busy", [False, True], ids=["idle", "busy"])
@pytest.mark.parametrize("method", multiprocessing.get_all_start_methods())
def test_children_plan_after_their_parent_has_planned(method: str, busy: bool, tmp_path: Path) -> None:
    script, program = tmp_path / "script.py", tmp_path / "program.ngc"
    script.write_text(SCRIPT, encoding="ascii")
    moves = "\n".join(f"X{i} Y{i * 7 % 5}" for i in range(60))
    program.write_text(f"G21 G90 G64 P0.05\nG1 F1000\n{moves}\nM2\n", encoding="ascii")
    command = [sys.executable, str(script), str(program), method, *(["busy"] if busy else [])]
    try:
        done = subprocess.run(
            command, cwd=ROOT, capture_output=True, text=True, timeout=120, start_new_session=True
        )
    except subprocess.TimeoutExpired:
        pytest.fail("the children hang")
    assert done.returncode == 0, done.stderr
    if sys.platform == "linux":
        # More than Python's own thread: the child has its own pool of threads.
        assert int(done.stdout) > 1


def test_what_a_plan_computes_later_imports_nothing(tmp_path: Path) -> None:
    # A process that is forked while a thread imports a module waits for ever when it imports that module.
    program = tmp_path / "program.ngc"
    program.write_text("G21 G90\nG1 X1 F1000\nX2 Y1\nM2\n", encoding="ascii")
    script = (
        "import sys, feedplan\n"
        "plan = feedplan.plan(sys.argv[1], 'mill', method='jerk-limited')\n"
        "before = set(sys.modules)\n"
        "plan.audit(), plan.account\n"
        "print(*sorted(set(sys.modules) - before))\n"
    )
    command = [sys.executable, "-c", script, str(program)]
    done = subprocess.run(command, cwd=ROOT, capture_output=True, text=True)
    assert (done.returncode, done.stdout.strip()) == (0, ""), done.stderr


def test_a_value_that_a_thread_computes_does_not_lock_another_objects() -> None:
    class Slow:
        def __init__(self, begun: threading.Event, goes_on: threading.Event) -> None:
            self.begun, self.goes_on = begun, goes_on

        @lazy.cached_property
        def value(self) -> int:
            """A value that takes long to compute."""
            self.begun.set()
            assert self.goes_on.wait(60)
            return 7

    begun, goes_on, ready = threading.Event(), threading.Event(), threading.Event()
    ready.set()
    slow, quick = Slow(begun, goes_on), Slow(threading.Event(), ready)
    thread = threading.Thread(target=lambda: slow.value)
    thread.start()
    assert begun.wait(60)
    assert quick.value == 7
    assert quick.__dict__["value"] == 7
    goes_on.set()
    thread.join()
    assert slow.value == 7
    assert Slow.value.__doc__ == "A value that takes long to compute."
