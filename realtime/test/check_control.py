"""Viewers that look, start and stop, with a WebSocket library that is not ours.

Run as: check_control.py HOW ADDRESS, where HOW is look, control, emergency, failure or socket, against the loops of
server_test.cpp. Exits 0 when all answers are as they must be.
"""
import asyncio
import struct
import sys

import websockets

from viewer import PROTOCOL, Connection

HOW, ADDRESS = sys.argv[1:]
REFUSAL = ("this program was started to be looked at alone; start it with --control to let viewers change parameters, "
           "start and stop it")


class Viewer(Connection):
    def __init__(self):
        super().__init__(ADDRESS)

    async def call(self, name, number=7, payload=b"", encoding=b"json"):
        """None, or why it is refused."""
        answer = await self.request(name, payload, number, encoding)
        if answer.get("op") == "serviceCallFailure":
            return answer["message"]
        assert answer["success"] is True and answer["service"] == self.services[name], answer
        return None

    async def goodbye(self, timing, state, end):
        """All that comes until the server closes; the last of the timing says how the program ended."""
        heard = []
        try:
            await self.until(heard.append)
        except websockets.ConnectionClosed as closed:
            assert closed.rcvd.code == 1001, closed
        told = [message for message in heard if message.get("channel") == timing]
        assert (told[-1]["state"], told[-1]["end"]) == (state, end), told[-1]
        assert all(message["end"] == "" for message in told[:-1])
        return heard

    async def set(self, who=None, **values):
        """None, or why it is refused."""
        parameters = [{"name": n.replace("__", "."), "value": v} for n, v in values.items()]
        await self.say("setParameters", id="set", parameters=parameters, **({"who": who} if who is not None else {}))
        refusal = None
        while True:
            heard = await self.until(lambda m: m.get("op") in ("status", "parameterValues"))
            if heard["op"] == "parameterValues":
                return refusal
            refusal = heard["message"]


async def look():
    async with Viewer() as viewer:
        assert viewer.info["metadata"]["read only"] == REFUSAL, viewer.info
        assert await viewer.set(gain__K=7) == REFUSAL + "; nothing was changed"
        for name in ("start", "stop", "emergency_stop"):
            assert await viewer.call(name) == REFUSAL
        await viewer.say("getParameters", parameterNames=["gain.K"], id="get")
        values = (await viewer.until(lambda m: m.get("id") == "get"))["parameters"]
        assert values == [{"name": "gain.K", "value": 3, "type": "float64"}], values
        timing = await viewer.subscribe("/live.timing")
        first = await viewer.until(lambda m: m.get("channel") == timing)
        later = await viewer.until(lambda m: m.get("channel") == timing and m["steps"] > first["steps"] + 100)
        assert later["state"] == "running" and later["period_us"] == 1000, later
        for name in ("wake_up_us", "step_us", "response_us"):
            told = later[name]
            assert abs(sum(row["count"] for row in told["rows"]) - later["steps"]) <= 1, told
            assert 0 <= told["p50"] <= told["p99"] <= told["p99_9"] <= told["p99_99"] <= told["worst"], told
        assert sum(row["count"] for row in later["deviation_of_the_period"]) >= later["steps"] - 2
        assert later["missed"] == sum(later["missed_by_cause"].values())


async def control():
    """The loop waits until it is started."""
    async with Viewer() as viewer, Viewer() as other:
        assert "read only" not in viewer.info["metadata"]
        log = await other.subscribe("/live.log")
        timing = await other.subscribe("/live.timing")
        waiting = await other.until(lambda m: m.get("channel") == timing)
        assert waiting["state"] == "waiting" and waiting["steps"] == 0, waiting
        assert waiting["step_us"]["rows"] == [] and waiting["step_us"]["worst"] == 0
        assert await viewer.set(who="page 1 of ada@desk", gain__K=4) is None, "before the start, too"
        assert await viewer.call("start", payload={"who": "page 1 of ada@desk"}) is None
        assert await viewer.call("start") == "the program does not wait to be started"
        await other.until(lambda m: m.get("channel") == timing and m["steps"] > 10 and m["state"] == "running")
        slider = "page 2\x1b[31m" + "x" * 500
        for k in range(50):  # moves for more than two seconds, and goes on after a pause of more
            assert await viewer.set(who=slider, gain__K=4.5 + k) is None
            await asyncio.sleep(0.05)
        await asyncio.sleep(2.2)
        assert await viewer.set(who=slider, gain__K=54) is None
        assert await viewer.set(k=5) is None
        assert "must be at most 50" in await viewer.set(k=51)
        assert await viewer.set(who="page 1", gain__K=60, vector__value=[7] * 8) is None
        async with Viewer() as late:
            number = await late.subscribe("/live.log")
            entries = [await late.until(lambda m: m.get("channel") == number) for _ in range(7)]
        told = [(e["name"], e["message"]) for e in entries]
        peer = entries[4]["name"]
        assert peer.startswith("127.0.0.1:"), peer
        assert told == [
            (f"page 1 of ada@desk at {peer}", "gain.K = 4, was 3"),
            (f"page 1 of ada@desk at {peer}", "start"),
            (f"page 2 [31m{'x' * 69} at {peer}", "gain.K = 53.5, was 4"),
            (f"page 2 [31m{'x' * 69} at {peer}", "gain.K = 54, was 53.5"),
            (peer, "k = 5, was 3"),
            (f"page 1 at {peer}", "gain.K = 60, was 54"),
            (f"page 1 at {peer}", "vector.value = [7 7 7 7 7 7 …], was [0 0 0 0 0 0 …]"),
        ], told
        assert [e["number"] for e in entries] == list(range(7)) and entries[0]["time"] == 0 < entries[4]["time"]
        assert entries[0]["timestamp"]["sec"] > 1.7e9 and entries[0]["level"] == 2
        assert await viewer.call("stop", payload={"who": 3}) == "the field 'who' is of the wrong type: 3"
        assert await viewer.call("dance") == "there is no service 99"
        assert await viewer.call("stop", encoding=b"cdr") == "services take JSON, and name that encoding"
        for bytes_ in (b"\x02", b"\x02" + bytes(11), b"\x01" + bytes(20)):
            await viewer.socket.send(bytes_)
            assert "takes no data" in (await viewer.until(lambda m: m.get("op") == "status"))["message"]
        await viewer.socket.send(struct.pack("<BIII", 2, 1, 9, 0xffffffff) + b"json")
        assert (await viewer.until(lambda m: m.get("callId") == 9))["op"] == "serviceCallFailure"
        assert await viewer.call("stop") is None
        heard = await other.goodbye(timing, "ended", f"the program ended in order, stopped by {peer}")
        assert [m["message"] for m in heard if m.get("channel") == log][-1] == "stop"


async def emergency():
    async with Viewer() as viewer:
        assert await viewer.call("stop") is None
        assert await viewer.call("emergency_stop", payload={"who": "page 3"}) is None
        assert await viewer.call("emergency_stop") == "the emergency stop is under way already"
        assert await viewer.call("stop") == "the program ends already"


async def failure():
    async with Viewer() as viewer:
        timing = await viewer.subscribe("/live.timing")
        assert await viewer.call("stop") is None
        await viewer.goodbye(timing, "failed", "the program failed: gain: the output is not finite")


async def socket():
    async with Viewer() as viewer:
        assert await viewer.set(gain__K=8) is None
        number = await viewer.subscribe("/live.log")
        entry = await viewer.until(lambda m: m.get("channel") == number)
        assert entry["name"].startswith("process ") and " of " in entry["name"], entry
    path, query = ADDRESS[5:].split("?")
    for wrong in ("", "/?" + query[:-1]):
        try:
            await websockets.unix_connect(path, "ws://localhost" + wrong, subprotocols=[PROTOCOL])
            raise AssertionError("a viewer without the token was let in")
        except websockets.InvalidStatus as error:
            assert error.response.status_code == 403


hows = {"look": look, "control": control, "emergency": emergency, "failure": failure, "socket": socket}
asyncio.run(asyncio.wait_for(hows[HOW](), 60))
