"""bf edit attaches to whatever is served: programs of bf run and generated ones, at ports and Unix sockets, and through
a tunnel, as ssh -L makes it.

Run as: places.py BF GENERATED, a generated program of the model served.yaml with the live server.
"""
import contextlib
import json
import os
import pathlib
import re
import socket
import stat
import struct
import sys
import tempfile
import threading

from program import MODEL, Page, attached, served, timing

BF, GENERATED = sys.argv[1:]


@contextlib.contextmanager
def tunnel(listener, connect):
    """Leads each connection of a listening socket to what `connect` opens."""

    def carry(source, target):
        with contextlib.suppress(OSError):
            while part := source.recv(1 << 16):
                target.sendall(part)
        for end in (source, target):
            with contextlib.suppress(OSError):
                end.shutdown(socket.SHUT_RDWR)

    def accept():
        with contextlib.suppress(OSError):
            while True:
                near = listener.accept()[0]
                try:
                    far = connect()
                except OSError:  # nobody is there any more
                    near.close()
                    continue
                for pair in ((near, far), (far, near)):
                    threading.Thread(target=carry, args=pair, daemon=True).start()

    listener.listen()
    threading.Thread(target=accept, daemon=True).start()
    yield
    listener.close()


def unix(path, connects):
    end = socket.socket(socket.AF_UNIX)
    end.connect(path) if connects else end.bind(path)
    return end


def expect_cockpit(model, address, who):
    """Starts, tunes and stops the program that waits there."""
    with attached(BF, model, address) as (_, page):
        cockpit = Page(page)
        cockpit.until(lambda m: timing(m).get("state") == "waiting")
        assert cockpit.ask("run", action="start")["state"] == "running"
        live = cockpit.until(lambda m: timing(m).get("steps", 0) > 50)["params"]
        assert live["timing"]["period_us"] == 1000 and live["timing"]["response_us"]["rows"], live
        paths = {signal["path"]: signal["index"] for signal in cockpit.ask("signals")["signals"]}
        watched = next(path for path in ("control", "control.y") if path in paths)
        cockpit.ask("watch", paths=[watched])
        while not isinstance(frame := cockpit.read(), bytes):
            pass
        index, _, count, instant, value = struct.unpack_from("<IIIdd", frame)
        assert (index, count) == (paths[watched], 1) and instant > 0 and value != 0
        assert "must be at most 5" in cockpit.ask("tune", name="k", values=[7])
        cockpit.ask("tune", name="k", values=[0.5])
        log = cockpit.until(lambda m: m.get("method") == "live" and len(m["params"]["log"]) == 2)["params"]["log"]
        assert [entry["what"] for entry in log] == ["start", "k = 0.5, was 0.3"], log
        assert all(re.match(r"page \d+ of \S+@", entry["who"]) and who in entry["who"] for entry in log), log
        assert all(entry["page"] == 1 for entry in log), log
        cockpit.ask("run", action="stop")
        expect_end(cockpit, "ended", r"the program ended in order, stopped by page 1 of \S+@.*" + who)


def expect_end(cockpit, state, message):
    """What its page says once it is over, and goes on saying while nothing is there."""
    run = cockpit.until(lambda m: m.get("method") == "run" and m["params"]["state"] in ("ended", "failed"))["params"]
    assert run["state"] == state and re.match(message, run["live"]["message"]), run
    again = cockpit.until(lambda m: m.get("method") == "run")["params"]
    assert again["live"]["message"] == run["live"]["message"], again


def end_of(program, code):
    told = program.stdout.read()
    assert program.wait() == code, told
    return told


with tempfile.TemporaryDirectory() as folder:
    folder = pathlib.Path(folder)
    model, path, near = folder / "served.yaml", str(folder / "far.sock"), str(folder / "near.sock")
    model.write_text(MODEL)
    options = ["--realtime", "--priority", "0", "--watchdog", "20", "--stop", "Inf", "--control", "--wait"]
    summary = folder / "summary.json"
    interpreted = [BF, "run", model, "--quiet", "--summary", summary, *options]
    for command in (interpreted, [GENERATED, *options]):
        with served([*command, "--serve", "0"]) as (program, address):
            expect_cockpit(model, address, " at 127.0.0.1:")
            assert "k = 0.5, was 0.3" in end_of(program, 0), "the report tells what was done"
        if command is interpreted:
            told = json.loads(summary.read_text())
            assert told["outcome"] == "stopped" and told["stopped_by"] == told["realtime"]["log"][-1]["who"], told
            assert re.match(r"page 1 of \S+@", told["stopped_by"]) and "failure" not in told, told
        with served([*command, "--serve", "unix:" + path]) as (program, address):
            assert stat.S_IMODE(os.stat(path).st_mode) == 0o600
            expect_cockpit(model, address, " at process ")
            end_of(program, 0)
        assert not os.path.exists(path)

    # ssh -L PORT:far.sock, and ssh -L near.sock:far.sock
    with served([*interpreted, "--serve", "unix:" + path]) as (program, address):
        listener = socket.create_server(("127.0.0.1", 0))
        token = address.split("?")[1]
        with tunnel(listener, lambda: unix(path, True)):
            far = f"ws://127.0.0.1:{listener.getsockname()[1]}/?{token}"
            expect_cockpit(model, far, " at process ")
            end_of(program, 0)
            with attached(BF, model, far) as (_, page):  # the tunnel goes on listening
                expect_end(Page(page), "failed", "nothing answers behind 127")
    with served([*interpreted, "--serve", "unix:" + path]) as (program, address), \
            tunnel(unix(near, False), lambda: unix(path, True)):
        expect_cockpit(model, f"unix:{near}?{address.split('?')[1]}", " at process ")
        end_of(program, 0)
    os.remove(near)

    # An emergency stop is a failure; whoever looks alone is told why he cannot.
    for command in (interpreted, [GENERATED, *options]):
        with served([*command, "--serve", "0"]) as (program, address), attached(BF, model, address) as (_, page):
            cockpit = Page(page)
            cockpit.until(timing)
            cockpit.ask("run", action="start")
            cockpit.until(lambda m: timing(m).get("steps", 0) > 50)
            cockpit.ask("run", action="emergency_stop")
            expect_end(cockpit, "ended", r"the program was stopped by emergency stop of page 1 of ")
            assert re.search(r"emergency stop by page \d+ of ", end_of(program, 1))
        alone = [part for part in command if part not in ("--control", "--wait")]
        with served([*alone, "--serve", "0"]) as (program, address), attached(BF, model, address) as (_, page):
            cockpit = Page(page)
            cockpit.until(timing)
            for answer in (cockpit.ask("run", action="stop"), cockpit.ask("tune", name="k", values=[1])):
                assert "looked at alone; start it with --control" in answer, answer
