"""Reads a recording and its exports with foreign readers and compares them with the raw samples beside them.

Run as: check_recording.py FOLDER, which holds run.mcap, run.mat, run.csv and joint<n>.bin.
"""
import csv
import pathlib
import sys

import numpy
import scipy.io
from mcap.reader import NonSeekingReader, SeekingReader
from mcap_ros2.decoder import DecoderFactory

DTYPES = ["float64", "float32", "int8", "uint8", "int16", "uint16", "int32", "uint32", "bool"]
SHAPES = [(1,), (5,), (2, 3)]
SAMPLES = 300
# What the elements of one vector are called; others have numbers.
NAMES = {"plant.joint2": ["hip", "", "l knee", "r_knee", ""]}

folder = pathlib.Path(sys.argv[1])
expected = {}  # name -> samples x shape; files hold each sample column-major
for n in range(len(DTYPES) * len(SHAPES)):
    dtype, shape = DTYPES[n // 3], SHAPES[n % 3]
    raw = numpy.fromfile(folder / f"joint{n + 1}.bin", dtype=dtype).reshape(SAMPLES, -1)
    expected[f"plant.joint{n + 1}"] = numpy.stack([row.reshape(shape, order="F") for row in raw])


def equal(a, b):
    """Bit for bit, but for the payload of a NaN, which Python does not keep."""
    a, b = numpy.asarray(a), numpy.asarray(b)
    same = numpy.array_equal(a, b, equal_nan=a.dtype.kind == "f")
    return same and (a.dtype.kind != "f" or numpy.array_equal(numpy.signbit(a[a == a]), numpy.signbit(b[b == b])))


def check(condition, text):
    if not condition:
        sys.exit(f"{folder}: {text}")

#Every message, by the index and by scanning, with all checksums verified.
for Reader in SeekingReader, NonSeekingReader:
    found = {
name: [] for name in expected}
    with open(folder / "run.mcap", "rb") as stream:
        reader = Reader(stream, decoder_factories=[DecoderFactory()], validate_crcs=True)
        for schema, channel, message, decoded in reader.iter_decoded_messages():
            name = channel.metadata["name"]
            check(channel.topic == "/" + name.replace(".", "/"), f"topic {channel.topic} of {name}")
            check(channel.metadata["unit"] == "rad/s", f"unit of {name}")
            lines = "".join(element + "\n" for element in NAMES.get(name, []))
            check(channel.metadata["elements"] == lines, f"elements of {name}")
            check(schema.encoding == "ros2msg" and channel.message_encoding == "cdr", f"encoding of {name}")
            check(message.sequence == len(found[name]), f"sequence of {name}")
            check(decoded.time == message.log_time / 1e9, f"time of {name}")
            check(message.log_time == len(found[name]) * 1_000_000, f"log time of {name}")
            value = numpy.frombuffer(decoded.value, numpy.uint8) if isinstance(decoded.value, bytes) else decoded.value
            found[name].append(numpy.atleast_1d(numpy.asarray(value)).reshape(expected[name].shape[1:], order="F"))
    for name, samples in expected.items():
        check(len(found[name]) == SAMPLES, f"{name} has {len(found[name])} messages")
        check(equal(numpy.array(found[name], dtype=samples.dtype), samples), f"{name} differs")

with open(folder / "run.mcap", "rb") as stream:
    reader = SeekingReader(stream, validate_crcs=True)
    summary = reader.get_summary()
    check(summary.statistics.message_count == SAMPLES * len(expected), "message count")
    check(summary.statistics.chunk_count == len(summary.chunk_indexes) > 1, "chunk count")
    check(len(summary.schemas) == len(expected), "one schema per type and shape")
    texts = {schema.name: schema.data.decode() for schema in summary.schemas.values()}
    check(texts["bf_msgs/msg/Double5"] == "float64 time\nfloat64[5] value\n", f"schema texts {texts}")
    for index in summary.chunk_indexes:
        indices_start = index.chunk_start_offset + index.chunk_length
        indices_end = indices_start + index.message_index_length
        offsets = sorted(index.message_index_offsets.values())
        check(offsets[0] == indices_start, "the message indices follow their chunk")
        for offset, end in zip(offsets, offsets[1:] + [indices_end]):
            stream.seek(offset)
            header = stream.read(9)
            check(header[0] == 7, "a message index is where the chunk index says")
            check(offset + 9 + int.from_bytes(header[1:], "little") == end, "the message indices have the length given")
    attachments = list(reader.iter_attachments())
    check([(a.name, a.data) for a in attachments] == [("model.yaml", b"blocks: [gain]\n")], "attachments")
    metadata = list(reader.iter_metadata())
    check([(m.name, m.metadata) for m in metadata] == [("recording", {"model": "walking"})], "metadata")
#A seek into the middle uses chunk and message indices.
    middle = list(reader.iter_messages(topics=["/plant/joint4"], starting_at=100_000_000, ending_before=200_000_000))
    check([m.log_time for _, _, m in middle] == list(range(100_000_000, 200_000_000, 1_000_000)), "seek")

mat = scipy.io.loadmat(folder / "run.mat", squeeze_me=False)
for name, samples in expected.items():
    variable = mat[name.replace(".", "_")][0, 0]
    check(equal(variable["time"], numpy.arange(SAMPLES)[:, None] * 1_000_000 / 1e9), f"MAT time of {name}")
    signals = variable["signals"][0, 0]
    values = signals["values"]
    if samples.ndim == 3:
        values = numpy.moveaxis(values, 2, 0)
    check(equal(values, samples), f"MAT values of {name}")
    kind = "uint8" if samples.dtype == bool else samples.dtype  # scipy gives logicals as uint8
    check(values.dtype == kind, f"MAT class of {name} is {values.dtype}")
    check(signals["label"][0] == name and signals["unit"][0] == "rad/s", f"MAT label of {name}")
    elements = [str(cell[0]) if cell.size else "" for cell in signals["elements"][:, 0]] if name in NAMES else None
    check(elements == NAMES.get(name) and ("elements" in signals.dtype.names) == (name in NAMES), f"MAT elements of {name}")
    check(tuple(signals["dimensions"][0]) == samples.shape[1:], f"MAT dimensions of {name}")

with open(folder / "run.csv", newline="") as stream:
    rows = list(csv.reader(stream))
columns = dict(zip(rows[0], numpy.array(rows[1:]).T))
check(equal(columns["time (s)"].astype(float), numpy.arange(SAMPLES) * 1_000_000 / 1e9), "CSV time")
for name, samples in expected.items():
    for index in numpy.ndindex(samples.shape[1:]):
        brackets = "" if samples.shape[1:] == (1,) else "".join(f"[{i + 1}]" for i in index)
        brackets = "[" + NAMES[name][index[0]] + "]" if name in NAMES and NAMES[name][index[0]] else brackets
        column = columns[f"{name}{brackets} (rad/s)"].astype(float).astype(samples.dtype)
        check(equal(column, samples[(slice(None), *index)]), f"CSV column {name}{brackets}")
check(len(columns) == 1 + sum(samples[0].size for samples in expected.values()), "CSV column count")
