"""bf edit attaches to whatever is served: programs of bf run and generated ones, at ports and Unix sockets, and through
tunnels, as ssh -L makes them, and by ssh itself where its server is installed.

Run as: places.py BF GENERATED, a generated program of the model served.yaml with the live server.
"""
import contextlib
import functools
import json
import os
import pathlib
import re
import shutil
import socket
import stat
import struct
import subprocess
import sys
import tempfile
import threading
import time

from program import MODEL, Page, attached, served, timing

BF, GENERATED = sys.argv[1:]


@contextlib.contextmanager
def ssh_server(folder):
    """One of this user, at a port of loopback, with keys of its own. Gives the command of ssh that reaches it."""
    for key in ("host", "own"):
        subprocess.run(["ssh-keygen", "-q", "-t", "ed25519", "-N", "", "-f", folder / key], check=True)
    if os.geteuid() == 0:
        os.makedirs("/run/sshd", exist_ok=True)  # sshd of root does not start without
    port = free_port()
    (folder / "sshd").write_text(f"""Port {port}
ListenAddress 127.0.0.1
HostKey {folder}/host
AuthorizedKeysFile {folder}/own.pub
StrictModes no
PidFile none
""")
    server = subprocess.Popen([shutil.which("sshd", path="/usr/sbin:/sbin"), "-D", "-e", "-f", folder / "sshd"],
                              stderr=subprocess.DEVNULL)
    wait_for(lambda: end(port, True).close())
    try:
        yield ["ssh", "-F", "none", "-i", folder / "own", "-p", str(port), "-o", "StrictHostKeyChecking=no",
               "-o", f"UserKnownHostsFile={folder}/known", "-o", "LogLevel=ERROR", "127.0.0.1"]
    finally:
        server.kill()
        server.wait()


@contextlib.contextmanager
def ssh_tunnel(ssh, near, far):
    """ssh -L near:far, once it can be reached."""
    client = subprocess.Popen([*ssh, "-N", "-o", "ExitOnForwardFailure=yes", "-L", f"{near}:{far}"])
    wait_for(lambda: end(near, True).close())
    try:
        yield
    finally:
        client.kill()
        client.wait()
        if isinstance(near, str):
            pathlib.Path(near).unlink(missing_ok=True)


@contextlib.contextmanager
def imitated_tunnel(near, far):
    """The same without ssh: leads each connection to one of its own."""

    def carry(source, target):
        with contextlib.suppress(OSError):
            while part := source.recv(1 << 16):
                target.sendall(part)
        for one in (source, target):
            with contextlib.suppress(OSError):
                one.shutdown(socket.SHUT_RDWR)

    def accept():
        with contextlib.suppress(OSError):
            while True:
                here = listener.accept()[0]
                try:
                    there = end(far, True)
                except OSError:  # nobody is there any more
                    here.close()
                    continue
                for pair in ((here, there), (there, here)):
                    threading.Thread(target=carry, args=pair, daemon=True).start()

    with end(near, False) as listener:
        threading.Thread(target=accept, daemon=True).start()
        yield
    if isinstance(near, str):
        os.remove(near)


def end(place, connects):
    """A port of loopback, "127.0.0.1:PORT" or the path of a Unix socket, connected or listening."""
    port = place if isinstance(place, int) else place.removeprefix("127.0.0.1:")
    kind, address = (socket.AF_UNIX, port) if "/" in str(port) else (socket.AF_INET, ("127.0.0.1", int(port)))
    made = socket.socket(kind)
    try:
        made.connect(address) if connects else (made.bind(address), made.listen())
    except OSError:
        made.close()
        raise
    return made


def wait_for(action):
    for _ in range(200):
        with contextlib.suppress(OSError):
            return action()
        time.sleep(0.05)
    return action()


def free_port():
    with socket.create_server(("127.0.0.1", 0)) as listener:
        return listener.getsockname()[1]


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

    with contextlib.ExitStack() as stack:
        tunnels = [imitated_tunnel]
        if shutil.which("sshd", path="/usr/sbin:/sbin"):
            tunnels.append(functools.partial(ssh_tunnel, stack.enter_context(ssh_server(folder))))
        for tunnel in tunnels:
            with served([*interpreted, "--serve", "0"]) as (program, address):
                port, far = free_port(), re.search(r"127.0.0.1:(\d+)", address)
                with tunnel(port, far[0]):
                    expect_cockpit(model, address.replace(far[1], str(port)), " at 127.0.0.1:")
                    end_of(program, 0)
            with served([*interpreted, "--serve", "unix:" + path]) as (program, address):
                port, token = free_port(), address.split("?")[1]
                with tunnel(port, path):
                    through = f"ws://127.0.0.1:{port}/?{token}"
                    expect_cockpit(model, through, " at process ")
                    end_of(program, 0)
                    with attached(BF, model, through) as (_, page):  # the tunnel goes on listening
                        expect_end(Page(page), "failed", "nothing answers behind 127")
            with served([*interpreted, "--serve", "unix:" + path]) as (program, address), tunnel(near, path):
                expect_cockpit(model, f"unix:{near}?{address.split('?')[1]}", " at process ")
                end_of(program, 0)

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
