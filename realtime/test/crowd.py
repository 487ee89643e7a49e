"""Ten viewers of all signals: two read, four are stopped, four are killed.

Run as: crowd.py PORT TOKEN SECONDS.
"""
import asyncio
import json
import os
import signal
import sys
import time

import websockets

PORT, TOKEN, SECONDS = sys.argv[1], sys.argv[2], float(sys.argv[3])


async def view():
    address = f"ws://127.0.0.1:{PORT}/?token={TOKEN}"
    async with websockets.connect(address, subprotocols=["foxglove.websocket.v1"]) as socket:
        await socket.recv()
        channels = json.loads(await socket.recv())["channels"]
        await socket.send(json.dumps({"op": "subscribe", "subscriptions": [
            {"id": c["id"], "channelId": c["id"]} for c in channels]}))
        while True:
            await socket.recv()


viewers = []
for _ in range(10):
    viewers.append(os.fork())
    if viewers[-1] == 0:
        try:
            asyncio.run(view())
        finally:
            os._exit(0)
time.sleep(SECONDS / 2)
for viewer in viewers[:4]:
    os.kill(viewer, signal.SIGSTOP)
time.sleep(SECONDS / 4)
for viewer in viewers[4:8]:
    os.kill(viewer, signal.SIGKILL)
time.sleep(SECONDS / 4)
for viewer in viewers:
    os.kill(viewer, signal.SIGKILL)
    os.waitpid(viewer, 0)
