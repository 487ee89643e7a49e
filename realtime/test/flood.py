"""A viewer that subscribes without end and reads nothing, until it is sent away.

Run as: flood.py PORT TOKEN. Exits 0 when the server has closed the connection.
"""
import asyncio
import itertools
import json
import sys

import websockets


async def main():
    address = f"ws://127.0.0.1:{sys.argv[1]}/?token={sys.argv[2]}"
    socket = await websockets.connect(address, subprotocols=["foxglove.websocket.v1"], max_size=None)
    socket.transport.pause_reading()
    try:
        for k in itertools.count():
            await socket.send(json.dumps({"op": "subscribe", "subscriptions": [
                {"id": 1000 * k + i, "channelId": 0} for i in range(1000)]}))
    except websockets.ConnectionClosed:
        pass


asyncio.run(asyncio.wait_for(main(), 30))
