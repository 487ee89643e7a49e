"""A viewer of a running model, by the Foxglove WebSocket protocol, with a WebSocket library that is not ours.

Run as: check_server.py PORT TOKEN, against the model in server_test.cpp. Exits 0 when all answers are as they must be.
"""
import asyncio
import contextlib
import itertools
import json
import struct
import sys

import websockets
from mcap.records import Schema
from mcap_ros2.decoder import DecoderFactory

BARE = f"ws://127.0.0.1:{sys.argv[1]}"
URL = f"{BARE}/?token={sys.argv[2]}"
PROTOCOL = "foxglove.websocket.v1"
numbers = itertools.count(1)


class Viewer:
    """One connection; keeps what arrives besides what is waited for."""

    async def __aenter__(self):
        self.socket = await websockets.connect(URL, subprotocols=[PROTOCOL], max_size=None)
        assert self.socket.subprotocol == PROTOCOL
        self.info = await self.wait("serverInfo")
        self.channels = {c["topic"]: c for c in (await self.wait("advertise"))["channels"]}
        await self.wait("advertiseServices")
        return self

    async def __aexit__(self, *_):
        await self.socket.close()

    async def say(self, op, **fields):
        await self.socket.send(json.dumps({"op": op, **fields}))

    async def wait(self, op):
        """The next message of that kind; messages of others are passed over."""
        while True:
            message = await asyncio.wait_for(self.socket.recv(), 20)
            if op is bytes and isinstance(message, bytes):
                return message
            if isinstance(message, str) and json.loads(message)["op"] == op:
                return json.loads(message)

    async def wait_any(self):
        return json.loads(await asyncio.wait_for(self.socket.recv(), 20))

    async def error(self):
        status = await self.wait("status")
        assert status["level"] == 2, status
        return status["message"]

    async def subscribe(self, topic):
        """Yields (time in ns, time in s, value) of each sample."""
        channel, number = self.channels[topic], next(numbers)
        assert channel["encoding"] == "cdr" and channel["schemaEncoding"] == "ros2msg"
        schema = Schema(id=1, name=channel["schemaName"], encoding="ros2msg", data=channel["schema"].encode())
        decode = DecoderFactory().decoder_for("cdr", schema)
        await self.say("subscribe", subscriptions=[{"id": number, "channelId": channel["id"]}])
        while True:
            data = await self.wait(bytes)
            opcode, subscription, time = struct.unpack_from("<BIQ", data)
            assert opcode == 1
            if subscription == number:
                message = decode(data[13:])
                yield time, message.time, message.value

    async def get(self, *names):
        await self.say("getParameters", parameterNames=names, id="get")
        answer = await self.wait("parameterValues")
        assert answer["id"] == "get"
        return {p["name"]: p["value"] for p in answer["parameters"]}

    async def set(self, **values):
        await self.say("setParameters", id="set",
                       parameters=[{"name": n.replace("__", "."), "value": v} for n, v in values.items()])
        return {p["name"]: p["value"] for p in (await self.wait("parameterValues"))["parameters"]}


async def signals():
    async with Viewer() as viewer:
        assert viewer.info["name"] == "served", viewer.info
        assert {"parameters", "parametersSubscribe"} <= set(viewer.info["capabilities"])
        assert viewer.channels["/vector/y"]["schemaName"] == "bf_msgs/msg/Double2"
        times = []
        async for stamp, time, value in viewer.subscribe("/clock/y"):
            assert abs(stamp - 1e9 * time) < 1 and abs(value - time) < 1e-12
            times.append(round(time / 0.001))
            if len(times) == 200:
                break
        assert times == list(range(times[0], times[0] + 200)), "no step is left out"
        async for _, _, value in viewer.subscribe("/vector/y"):
            assert list(value) == [1, 2], "a constant comes to those who ask late, too"
            break
        slow = []
        async for stamp, _, _ in viewer.subscribe("/slow/y"):
            slow.append(stamp)
            if len(slow) == 3:
                break
        assert slow[2] - slow[1] == slow[1] - slow[0] == 10_000_000, "at its own rate"


async def parameters():
    async with Viewer() as viewer, Viewer() as other:
        everything = await viewer.get()
        assert everything["gain.K"] == 3 and everything["vector.value"] == [1, 2], everything
        assert everything["flag.value"] is True
        assert await viewer.get("gain.K", "nothing") == {"gain.K": 3}
        await other.say("subscribeParameterUpdates", parameterNames=["gain.K"])
        await other.get("gain.K")  # answered in order, so the subscription is there
        assert await viewer.set(gain__K=5, vector__value=[7, 8], flag__value=False) == {
            "gain.K": 5, "vector.value": [7, 8], "flag.value": False}
        update = await other.wait("parameterValues")
        assert update["parameters"] == [{"name": "gain.K", "value": 5, "type": "float64"}] and "id" not in update
        async for _, time, value in viewer.subscribe("/gain/y"):
            assert abs(value - 5 * time) < 1e-12, (value, time)
            break
        async for _, _, value in viewer.subscribe("/vector/y"):
            assert list(value) == [7, 8], "constants follow their parameters"
            break
        assert await viewer.set(vector__value=9) == {"vector.value": [9, 9]}, "one element expands"
        assert everything["k"] == 3 and everything["twice.value"] == [6, 6], everything
        await other.say("subscribeParameterUpdates", parameterNames=["twice.value"])
        await other.get("k")
        assert await viewer.set(k=4) == {"k": 4}
        assert (await other.wait("parameterValues"))["parameters"][0]["value"] == [8, 8], "it follows"
        assert await viewer.get("gain.K") == {"gain.K": 5}, "what was given by name stays"

        async def refused(reason, **values):
            before = await viewer.get()
            await viewer.say("setParameters", id="set",
                             parameters=[{"name": n.replace("__", "."), "value": v} for n, v in values.items()])
            message = await viewer.error()
            assert reason in message and message.endswith("; nothing was changed"), message
            assert (await viewer.wait("parameterValues"))["id"] == "set"
            assert await viewer.get() == before

        await refused("no parameter 'gain.k'; did you mean 'gain.K'", gain__k=1)
        await refused("parameter 'vector.value' has 2 elements, not 3", gain__K=1, vector__value=[1, 2, 3])
        await refused("parameter 'pulse.width' must be from 0 to 100, but is 101", gain__K=1, pulse__width=101)
        await refused("parameter 'pulse.cycle' must be greater than 0, but is -1", gain__K=1, cycle=-1)
        await refused("variable 'k' must be at most 50, but is 51", gain__K=1, k=51)
        await refused("with \"Inf\" for infinity, not \"fast\"", gain__K="fast")
        await refused("takes a number or an array of numbers, with \"Inf\" for infinity, not null", gain__K=None)
        await refused("parameter 'gain.K' must be a number, but is NaN", gain__K="NaN")
        await refused("parameter 'gain.K' takes a number, not true", gain__K=True)
        await refused("parameter 'k' takes a number, not false", k=False)
        await refused("parameter 'vector.value' takes a number, not true", vector__value=[1, True])
        assert await viewer.set(vector__value=["Inf", -1]) == {"vector.value": ["Inf", -1]}
        assert await viewer.set(vector__value=["-inf", "1d3"]) == {"vector.value": ["-Inf", 1000]}
        await refused("takes a number or an array of numbers", vector__value=[1, [2]])
        await refused("has 2 elements, not 0", vector__value=[])
        await refused("variable 'T' cannot change in a run: 'slow.period' follows from it", T=0.02)
        await refused("variable 'k' has 1 elements, not 2", k=[1, 2])
        await refused("must be 0 or 1, but is 2", flag__value=2)
        await refused("must be a whole number from -128 to 127, but is 128", small__value=128)


async def nonsense():
    async with Viewer() as viewer:
        for text, answer in [
            ("{", "no JSON object"), ("[1]", "no JSON object"), ("NaN", "no JSON object"),
            ('{"op": "setParameters", "parameters": [{"name": "gain.K", "value": NaN}]}', "no JSON object"),
            ('{"op": "setParameters", "parameters": [{"name": "gain.K", "value": 1e400}]}', "write \"Inf\""),
            ("{}", "'op' is missing"), ('{"op": 3}', "'op' is of the wrong type"),
            ('{"op": "dance"}', "no operation 'dance'"), ('{"op": "subscribe"}', "'subscriptions' is missing"),
            ('{"op": "subscribe", "subscriptions": [{"id": 1, "channelId": 999}]}', "no channel 999"),
            ('{"op": "subscribe", "subscriptions": [7]}', "is missing"),
            ('{"op": "subscribe", "subscriptions": [{"id": 1, "channelId": 0}, {"id": 2, "channelId": 0}]}',
             "channel 0 is subscribed already"),
            ('{"op": "subscribe", "subscriptions": [{"id": 1, "channelId": 1e300}]}', "no whole number of 32 bits"),
            ('{"op": "subscribe", "subscriptions": [{"id": -1, "channelId": 0}]}', "no whole number of 32 bits"),
            ('{"op": "unsubscribe", "subscriptionIds": [0.5]}', "no whole number of 32 bits"),
            ('{"op": "unsubscribe", "subscriptionIds": [5]}', "no subscription 5"),
            ('{"op": "setParameters", "parameters": 3}', "'parameters' is of the wrong type"),
            ('{"op": "setParameters", "parameters": [{"value": 3}]}', "'name' is missing"),
        ]:
            await viewer.socket.send(text)
            assert answer in await viewer.error(), text
        await viewer.socket.send(b"\x01bytes")
        assert "takes no data" in await viewer.error()
        assert (await viewer.get("small.value")) == {"small.value": 1}, "the connection lives"
        await viewer.socket.send("[" * 50_000)
        assert "no JSON object" in await viewer.error()
        try:
            await viewer.socket.send("x" * (2 << 20))
            await viewer.wait("status")
            raise AssertionError("a message of 2 MB was taken")
        except websockets.ConnectionClosed as error:
            assert error.rcvd.code == 1009, error
            assert error.rcvd.reason.startswith("a message has at most "), error


async def strangers():
    async def refused(status, url=URL, **options):
        try:
            await websockets.connect(url, **options)
        except websockets.InvalidStatus as error:
            assert error.response.status_code == status, error
        else:
            raise AssertionError(f"{url} {options} was let in")

    token = sys.argv[2]
    assert len(token) == 32, "as many as nobody guesses"
    for query in ["", "/", "/?token=", f"/?token={token[:-1]}", f"/?token={token}0", f"/?token={token}{token}",
                  f"/{token}", f"/?nottoken={token}", f"/?token={token[:-1]}{'1' if token[-1] == '0' else '0'}"]:
        await refused(403, BARE + query, subprotocols=[PROTOCOL])
        await refused(403, BARE + query, subprotocols=[PROTOCOL], origin="http://localhost:8080")
    await refused(400, subprotocols=["chat"])
    await refused(400)
    for origin in ["https://app.foxglove.dev", "https://viewer.example", "null", None]:
        async with websockets.connect(f"{BARE}/view?a=b&token={token}&c", subprotocols=["foxglove.sdk.v1"],
                                      origin=origin):
            pass
    reader, writer = await asyncio.open_connection("127.0.0.1", int(sys.argv[1]))
    writer.write(b"GET / HTTP/1.1\r\nHost: localhost\r\n\r\n")
    assert b"403" in await reader.readline()

    async def answer(text):
        reader, writer = await asyncio.open_connection("127.0.0.1", int(sys.argv[1]))
        writer.write(text)
        try:
            return await reader.read()
        except ConnectionResetError:
            return b""

    assert await answer(b"\x00\xff" * 10_000) == b""
    head = b"GET / HTTP/1.1\r\nHost: localhost\r\nCookie: "
    for length, is_read in ((16_000, True), (16_500, False)):  # they are given 16 KiB, whether they are friends or not
        cookie = b"c" * (length - len(head) - 4)
        assert (b"403" in await answer(head + cookie + b"\r\n\r\n")) == is_read, length
    async with Viewer() as viewer:
        assert await viewer.get("small.value") == {"small.value": 1}, "the server lives"


async def idlers():
    """Those who connect and say nothing give way to those who come later."""
    idle = [await asyncio.open_connection("127.0.0.1", int(sys.argv[1])) for _ in range(200)]
    async with Viewer() as viewer:
        assert await viewer.get("small.value") == {"small.value": 1}
        assert await idle[0][0].read() == b"", "the first one was sent away"
    for _, writer in idle:
        writer.close()
    async with contextlib.AsyncExitStack() as stack:
        for _ in range(32):
            await stack.enter_async_context(Viewer())
        try:
            await websockets.connect(URL, subprotocols=[PROTOCOL])
            raise AssertionError("a 33rd viewer was let in")
        except websockets.InvalidStatus as error:
            assert error.response.status_code == 503


async def newest_counts():
    """Thousands of changes at once: none is refused, each is answered, and the last one holds."""
    async with Viewer() as viewer, Viewer() as other:
        count = 3000
        for k in range(count):
            await viewer.say("setParameters", id=str(k), parameters=[
                {"name": "gain.K", "value": k % 7 if k + 1 < count else 3}, {"name": "k", "value": k % 5}])
            if k == count // 2:
                await other.say("setParameters", id="other", parameters=[{"name": "small.value", "value": 5}])
        for k in range(count):
            answer = await viewer.wait_any()
            assert answer["op"] == "parameterValues" and answer["id"] == str(k), answer
        assert {p["name"]: p["value"] for p in answer["parameters"]} == {"gain.K": 3, "k": (count - 1) % 5}
        assert (await other.wait("parameterValues"))["id"] == "other"
        assert await other.get("gain.K", "small.value") == {"gain.K": 3, "small.value": 5}
        await other.set(small__value=1)


async def greedy():
    """Who asks for more than his share waits, not the others."""
    async with Viewer() as viewer, Viewer() as other:
        count = 3000
        answered = 0

        async def ask():
            for _ in range(count):
                await viewer.say("getParameters", parameterNames=[], id="all")

        async def listen():
            nonlocal answered
            while True:
                await viewer.wait("parameterValues")
                answered += 1

        tasks = [asyncio.create_task(ask()), asyncio.create_task(listen())]
        while answered < 10:
            await asyncio.sleep(0.001)
        for _ in range(20):
            assert await other.get("small.value") == {"small.value": 1}
        assert answered < count, "it was not made to wait for all of them"
        for task in tasks:
            task.cancel()
        await asyncio.gather(*tasks, return_exceptions=True)


async def main():
    await signals()
    await parameters()
    await nonsense()
    await strangers()
    await idlers()
    await newest_counts()
    await greedy()


asyncio.run(asyncio.wait_for(main(), 60))
