"""A viewer of a program that runs, with a WebSocket library that is not ours, for the checks of the server."""
import asyncio
import json
import struct

import websockets

PROTOCOL = "foxglove.websocket.v1"


class Connection:
    """To ws://... or unix:PATH?..."""

    def __init__(self, address):
        self.address = address

    async def __aenter__(self):
        if self.address.startswith("unix:"):
            path, query = self.address[5:].split("?")
            self.socket = await websockets.unix_connect(path, f"ws://localhost/?{query}", subprotocols=[PROTOCOL])
        else:
            self.socket = await websockets.connect(self.address, subprotocols=[PROTOCOL], max_size=None, close_timeout=1)
        self.channels = {}  # that are there, by topic
        self.info = await self.until(lambda m: m.get("op") == "serverInfo")
        await self.until(lambda m: m.get("op") == "advertise")
        services = (await self.until(lambda m: m.get("op") == "advertiseServices"))["services"]
        self.services = {s["name"]: s["id"] for s in services}
        return self

    async def __aexit__(self, *_):
        await self.socket.close()

    async def say(self, op, **fields):
        await self.socket.send(json.dumps({"op": op, **fields}))

    async def until(self, is_it):
        """The next message that is so.

        Data is {"channel": number, **JSON}, or "bytes" in place of JSON; a service's answer {"call": ..., **JSON}.
        """
        while True:
            message = await asyncio.wait_for(self.socket.recv(), 30)
            if isinstance(message, str):
                heard = json.loads(message)
                self.channels |= {c["topic"]: c for c in heard.get("channels", [])}
                gone = heard.get("channelIds", [])
                self.channels = {t: c for t, c in self.channels.items() if c["id"] not in gone}
            elif message[0] == 3:
                service, call, length = struct.unpack_from("<III", message, 1)
                assert message[13:13 + length] == b"json"
                heard = {"call": call, "service": service, **json.loads(message[13 + length:])}
            else:
                number, = struct.unpack_from("<I", message, 1)
                encoding = next((c["encoding"] for c in self.channels.values() if c["id"] == number), "")
                heard = {"channel": number, **(json.loads(message[13:]) if encoding == "json" else {"bytes": message[13:]})}
            if is_it(heard):
                return heard

    async def subscribe(self, topic):
        number = self.channels[topic]["id"]
        await self.say("subscribe", subscriptions=[{"id": number, "channelId": number}])
        return number

    async def call_service(self, service, payload=b"", number=7, encoding=b"json"):
        """Asks with JSON or bytes; 99 is a service that is not there."""
        text = payload if isinstance(payload, bytes) else json.dumps(payload).encode()
        head = struct.pack("<BIII", 2, self.services.get(service, 99), number, len(encoding))
        await self.socket.send(head + encoding + text)

    async def request(self, service, payload=b"", number=7, encoding=b"json"):
        """What a service answers."""
        await self.call_service(service, payload, number, encoding)
        return await self.until(lambda m: m.get("callId", m.get("call")) == number)
