"""Viewers that edit the model of a run, with a WebSocket library that is not ours.

Run as: check_edits.py ADDRESS MODEL against the loop of editing_test.cpp. Exits 0 when all answers are as they must be.
"""
import asyncio
import os
import sys

import websockets

sys.path.insert(0, os.path.join(os.path.dirname(__file__), "../../realtime/test"))
from viewer import Connection  # noqa: E402

ADDRESS, MODEL = sys.argv[1:]
TEXT = open(MODEL).read()


class Viewer(Connection):
    def __init__(self):
        super().__init__(ADDRESS)

    async def call(self, payload, service="edit"):
        return await self.request(service, payload)

    async def edit(self, text, after, **more):
        return await self.call({"who": "a test\nof ours", "what": "an edit", "after": after, "model": text, "files": {},
                                "origins": {}, "is_by_hand": False, "accepts_loss": False, **more})

    async def sample(self, topic):
        return await self.until(lambda m: m.get("channel") == self.channels[topic]["id"])


MORE = TEXT.replace("blocks:\n", "blocks:\n  first: {block: UnitDelay}\n  half: {block: Gain, K: 0.5}\n").replace(
    "{sine: gain,", "{sine: half, half: [gain, first],")


async def everything():
    async with Viewer() as viewer, Viewer() as other:
        assert "not editable" not in viewer.info["metadata"], viewer.info
        await other.subscribe("/fast/y")
        await other.sample("/fast/y")
        # Garbage.
        for payload, answer in [(b"{", "no JSON object"), (b"[1]", "no JSON object"), ({}, "'what' is missing"),
                                ({"what": 3}, "'what' is of the wrong type"), (b"\xff" * 50, "no JSON object"),
                                ({"what": "x", "model": [1] * 100000}, "'model' is of the wrong type")]:
            failed = await viewer.call(payload)
            assert failed["op"] == "serviceCallFailure" and answer in failed["message"], failed
            assert len(failed["message"]) < 1000, failed
        for field, value in [("files", 3), ("files", {"a": 1}), ("origins", [1]), ("origins", {"a": 7}), ("after", "x"),
                             ("is_by_hand", 1), ("accepts_loss", None)]:
            failed = await viewer.edit(TEXT, **{"after": 0, field: value})
            assert failed.get("op") == "serviceCallFailure" and f"'{field}'" in failed["message"], (field, failed)
        for text in ["", "\0" * 1000, "- 1\n" * 1000, TEXT.replace("Gain", "Gian"), "[" * 100000]:
            refused = await viewer.edit(text, 0)
            assert not refused.get("is_made") and refused["refusal"], refused
            assert refused["edits"] == 0, refused
        # An edit, of which both hear.
        made = await viewer.edit(MORE, 0)
        assert made["is_made"] and made["edits"] == 1 and made["begun"] == ["first.x"], made
        await other.until(lambda m: "/first/y" in other.channels)
        assert "/half/y" in viewer.channels and "/fast/y" in viewer.channels
        await other.sample("/fast/y")  # still subscribed
        await other.subscribe("/half/y")
        await other.sample("/half/y")
        # The other one does not know of it, and says so where it means to.
        late = await other.edit(TEXT, 0)
        assert not late["is_made"] and "meanwhile" in late["unclear"][0] and late["lost"], late
        lost = await other.edit(TEXT, 1)
        assert not lost["is_made"] and lost["lost"] == ["'first.x' is no longer there"], lost
        made = await other.edit(TEXT, 0, accepts_loss=True)
        assert made["is_made"] and made["edits"] == 2, made
        assert "/half/y" not in other.channels
        failed = await other.say("subscribe", subscriptions=[{"id": 900, "channelId": viewer.channels["/half/y"]["id"]}])
        await other.until(lambda m: m.get("op") == "status" and "no channel" in m["message"])
        # Two at once: one is made, and both are told.
        one, two = await asyncio.gather(viewer.edit(MORE, 2), other.edit(MORE.replace("0.5", "0.25"), 2))
        outcomes = sorted([bool(one.get("is_made")), bool(two.get("is_made"))])
        assert outcomes in ([False, True], [True, True]) and outcomes[1], (one, two)
        # Values that are set stay, also while edits come.
        await viewer.say("setParameters", id="set", parameters=[{"name": "k", "value": 5}])
        await viewer.until(lambda m: m.get("id") == "set")
        now = (one if one.get("is_made") else two)["edits"]
        made = await viewer.edit(MORE.replace("0.5", "0.75"), now)
        assert made["is_made"], made
        await viewer.say("getParameters", id="get", parameterNames=["gain.K", "half.K", "k"])
        values = (await viewer.until(lambda m: m.get("id") == "get"))["parameters"]
        assert [v["value"] for v in values] == [5, 0.75, 5], values
        # Who did what.
        await viewer.subscribe("/live.log")
        entry = await viewer.sample("/live.log")
        assert entry["message"] == "edit: an edit" and entry["name"].startswith("a test of ours at "), entry
    # A message that is too long costs its viewer the connection, and nobody else.
    async with Viewer() as viewer:
        try:
            await viewer.edit("x" * (5 << 20), 0)
            raise AssertionError("it was taken")
        except websockets.ConnectionClosed as error:
            assert error.rcvd.code == 1009, error
    # The program ends while an edit is prepared.
    async with Viewer() as viewer:
        edit = asyncio.create_task(viewer.edit(TEXT, 0, accepts_loss=True))
        async with Viewer() as other:
            stopped = await other.call({}, "stop")
            assert stopped.get("success"), stopped
            failed = await other.edit(TEXT, 0)
            assert failed["message"] in ("the program ends", "another edit is under way; try again"), failed
        edit.cancel()


asyncio.run(asyncio.wait_for(everything(), 120))
