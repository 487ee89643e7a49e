"""Viewers that edit the model of a run, with a WebSocket library that is not ours.

Run as: check_edits.py HOW ADDRESS FOLDER, against the loops of edits_test.cpp, where HOW is one of those below and FOLDER
has the model and the files of the stand-in. Exits 0 when all answers are as they must be.
"""
import asyncio
import json
import os
import struct
import sys

import websockets
from viewer import Connection

HOW, ADDRESS, FOLDER = sys.argv[1:]
with open(os.path.join(FOLDER, "model.yaml")) as file:
    ONES = file.read()
THREES = ONES.replace("value: 1}", "value: 3}").replace("  old: {block: Clock}\n", "  new: {block: Gain, K: 7}\n").replace(
    "clock: gain", "clock: [gain, new]")
FIVES = ONES.replace("value: 1}", "value: 5}").replace("old: {block: Clock}", "old: {block: Constant, value: [1, 2]}")


def edit(text, **more):
    return {"what": "an edit", "after": 0, "model": text, "files": {}, "origins": {}, "is_by_hand": False,
            "accepts_loss": False, **more}


class Viewer(Connection):
    def __init__(self):
        super().__init__(ADDRESS)

    async def ask(self, text, **more):
        """The answer to an edit."""
        return await self.request("edit", edit(text, **more))

    async def refused(self, *given, **more):
        answer = await self.ask(*given, **more)
        assert answer.get("op") == "serviceCallFailure", answer
        return answer["message"]

    async def stop(self):
        assert (await self.request("stop"))["success"]

    async def sample(self, topic):
        """The next one of a number."""
        number = self.channels[topic]["id"]
        heard = await self.until(lambda m: m.get("channel") == number)
        return struct.unpack("<d", heard["bytes"][-8:])[0]

    async def set(self, **values):
        await self.say("setParameters", id="set",
                       parameters=[{"name": n.replace("__", "."), "value": v} for n, v in values.items()])

    async def answered(self):
        """What parameters are after `set`."""
        heard = await self.until(lambda m: m.get("id") == "set")
        return {p["name"]: p["value"] for p in heard["parameters"]}

    async def get(self, *names):
        await self.say("getParameters", parameterNames=names, id="get")
        heard = await self.until(lambda m: m.get("id") == "get")
        return {p["name"]: p["value"] for p in heard["parameters"]}


async def held():
    """Waits until the stand-in holds an edit."""
    while not os.path.exists(os.path.join(FOLDER, "held")):
        await asyncio.sleep(0.001)


def go():
    open(os.path.join(FOLDER, "go"), "w").close()


async def made():
    async with Viewer() as viewer, Viewer() as other, Viewer() as idle:
        assert "not editable" not in viewer.info["metadata"], viewer.info
        kept, gone = viewer.channels["/count/y"]["id"], viewer.channels["/old/y"]["id"]
        timing = await other.subscribe("/live.timing")
        log = await other.subscribe("/live.log")
        assert (await other.until(lambda m: m.get("channel") == timing))["edits"] == 0
        await other.subscribe("/one/y")
        await other.subscribe("/old/y")
        assert await other.sample("/one/y") == 1
        await other.say("subscribeParameterUpdates", parameterNames=["one.value", "gain.K"])
        await other.get("k")  # answered in order, so the subscription is there
        await viewer.subscribe("/count/y")
        counted = [await viewer.sample("/count/y") for _ in range(20)]

        heard = []

        def note(message):
            if message.get("channel") == kept:
                counted.append(struct.unpack("<d", message["bytes"][-8:])[0])
            elif "op" in message or "call" in message:
                heard.append(message)
            return message.get("call") == 7

        await viewer.call_service("edit", edit(THREES, what="threes", who="page 1 of ada@desk"))
        answer = await viewer.until(note)
        assert {k: v for k, v in answer.items() if k not in ("service", "call")} == {
            "success": True, "is_made": True, "refusal": "", "lost": [], "begun": ["what is new"], "unclear": [],
            "edits": 1}, answer
        assert answer["service"] == viewer.services["edit"]
        assert [m["channelIds"] for m in heard if m.get("op") == "unadvertise"] == [[gone]], heard
        come, = [m["channels"] for m in heard if m.get("op") == "advertise"]
        assert [c["topic"] for c in come] == ["/new/y"], come
        counted += [await viewer.sample("/count/y") for _ in range(20)]
        steps = [b - a for a, b in zip(counted, counted[1:])]
        assert steps == sorted(steps) and set(steps) == {1, 3}, "each step once, from the state before"
        await viewer.subscribe("/new/y")
        assert await viewer.sample("/new/y") > 0

        # Others are told what changed, in this order.
        update = await other.until(lambda m: m.get("op") == "parameterValues")
        assert [(p["name"], p["value"]) for p in update["parameters"]] == [("one.value", 3)] and "id" not in update, update
        entry = await other.until(lambda m: m.get("channel") in (log, timing) and m.get("edits") != 0)
        assert entry["channel"] == log and entry["message"] == "edit: threes", entry
        told = await other.until(lambda m: m.get("channel") == timing)
        assert told["edits"] == 1 and told["state"] == "running", told
        assert "/old/y" not in other.channels and "/new/y" in other.channels
        assert await other.sample("/one/y") == 3, "constants are told anew to those who have them"
        await other.say("subscribe", subscriptions=[{"id": 900, "channelId": gone}])
        wrong = await other.until(lambda m: m.get("op") == "status")
        assert wrong["message"] == f"there is no channel {gone}", wrong
        async with Viewer() as late:
            assert "/new/y" in late.channels and "/old/y" not in late.channels

        # A signal of another size has a channel of its own; a subscription of what is gone is free.
        answer = await viewer.ask(FIVES, after=1, what="x" * 500)
        assert answer["is_made"] and answer["edits"] == 2, answer
        await other.until(lambda m: "/old/y" in other.channels)
        assert other.channels["/old/y"]["id"] not in (gone, kept) and "/new/y" not in other.channels
        await other.say("subscribe", subscriptions=[{"id": gone, "channelId": other.channels["/old/y"]["id"]}])
        heard = await other.until(lambda m: m.get("channel") == gone or m.get("op") == "status")
        assert struct.unpack("<2d", heard["bytes"][-16:]) == (1, 2), heard
        assert (await viewer.get("old.value")) == {"old.value": [1, 2]}
        assert await idle.get("one.value") == {"one.value": 5}, "who subscribed to nothing lives on"


async def told():
    async with Viewer() as viewer:
        asked = await viewer.ask("doubtful", files={"part.yaml": "a text"}, origins={"new": None, "motor": "plant"},
                                 is_by_hand=True)
        assert asked["is_made"] is False and asked["success"] is True and asked["refusal"] == "", asked
        assert (asked["lost"], asked["begun"], asked["unclear"]) == (["'a.x' is no longer there"], ["b.x"], ["is c d?"])
        assert not (await viewer.ask("doubtful", after=5, accepts_loss=True))["is_made"]
        for name, value in (("gain__K", 5), ("k", 4), ("gain__K", 6)):
            await viewer.set(**{name: value})
            await viewer.answered()
        assert (await viewer.ask(THREES))["is_made"]
        assert not (await viewer.ask("doubtful"))["is_made"]


async def meanwhile():
    async with Viewer() as viewer, Viewer() as other:
        task = asyncio.create_task(viewer.ask("# hold\n" + THREES))
        await held()
        assert await other.refused(THREES) == "another edit is under way; try again"
        await other.set(gain__K=9)
        assert await other.get("gain.K") == {"gain.K": 2}, "not before the edit"
        go()
        assert await other.answered() == {"gain.K": 9}
        answer = await task
        assert answer["is_made"], answer
        assert await other.get("one.value") == {"one.value": 3}


async def refused():
    async with Viewer() as viewer:
        for text, why in (("wrong", "it is wrong; write another one"), ("model: [", "m.yaml:1")):
            for _ in range(2):  # the second one finds no trace of the first one
                answer = await viewer.ask(text)
                assert answer["is_made"] is False and answer["edits"] == 0 and why in answer["refusal"], answer
        for name, value, why in (
                ("what", 3, "the field 'what' is of the wrong type: 3"),
                ("model", None, "the field 'model' is of the wrong type: null"),
                ("files", [1], "the field 'files' is of the wrong type: [1]"),
                ("origins", {"a": 7}, "the field 'origins' has a path or null for each path"),
                ("is_by_hand", 1, "the field 'is_by_hand' is of the wrong type: 1"),
                ("accepts_loss", "no", "the field 'accepts_loss' is of the wrong type: \"no\""),
                ("who", 3, "the field 'who' is of the wrong type: 3")):
            assert await viewer.refused(THREES, **{name: value}) == why, name
        failed = await viewer.request("edit", {"what": "no model"})
        assert failed["message"] == "the field 'model' is missing", failed


async def long():
    """A model of three million bytes is asked for, and then a parameter."""
    async with Viewer() as viewer:
        timing = await viewer.subscribe("/live.timing")
        await viewer.until(lambda m: m.get("channel") == timing)
        await viewer.ask("x" * 3_000_000)
        await viewer.say("getParameters", parameterNames=["k"], id="get")
        reports = []  # one every 50 ticks of the server; at the pace of other messages an edit of that length takes 700
        await viewer.until(lambda m: reports.append(m.get("channel") == timing) or m.get("id") == "get")
        assert sum(reports) < 8, reports


async def longest():
    """Messages of 4 MiB are taken, and no longer ones."""
    async with Viewer() as viewer:
        head = 13 + len("json")
        room = (4 << 20) - head - len(json.dumps(edit("")))
        assert not (await viewer.ask("x" * room))["is_made"]
        try:
            await viewer.ask("x" * (room + 1))
            raise AssertionError("it was taken")
        except websockets.ConnectionClosed as closed:
            assert (closed.rcvd.code, closed.rcvd.reason) == (1009, "a message has at most 4194304 bytes"), closed


async def waiting():
    async with Viewer() as viewer:
        assert await viewer.refused(THREES) == "the program waits to be started; edits go on from a run"
        await viewer.stop()
        assert await viewer.refused(THREES) == "the program ends"


async def late():
    """The loop has ended when the edit is ready."""
    async with Viewer() as viewer, Viewer() as other:
        timing = await other.subscribe("/live.timing")
        task = asyncio.create_task(viewer.ask("# hold\n" + THREES))
        await held()
        await other.stop()
        last = -1
        while (now := (await other.until(lambda m: m.get("channel") == timing))["steps"]) != last:
            last = now
        go()
        while os.path.exists(os.path.join(FOLDER, "go")):
            await asyncio.sleep(0.001)
        await other.until(lambda m: m.get("channel") == timing)
        assert not task.done(), "neither made nor refused"
        task.cancel()


async def ending():
    """The program ends while the edit is prepared."""
    async with Viewer() as viewer:
        task = asyncio.create_task(viewer.ask("# hold\n" + THREES))
        await held()
        async with Viewer() as other:
            await other.stop()
        go()
        try:
            await task
            raise AssertionError("it was answered")
        except websockets.ConnectionClosed as closed:
            assert closed.rcvd.code == 1001, closed


async def nobody():
    async with Viewer() as viewer:
        why = ("this program was started without --editable, so edits change the file alone; start it with --editable to "
               "let them act in the run")
        assert viewer.info["metadata"]["not editable"] == why, viewer.info
        assert await viewer.refused(THREES) == why


async def look():
    async with Viewer() as viewer:
        why = ("this program was started to be looked at alone; start it with --control to let viewers change parameters, "
               "start and stop it")
        assert viewer.info["metadata"]["not editable"] == why, viewer.info
        assert await viewer.refused(THREES) == why


asyncio.run(asyncio.wait_for(globals()[HOW](), 60))
