"""PNG pictures in the table of frames: what claims more than it holds, other formats, other channels."""

from __future__ import annotations

import random
import shutil
import struct
import zlib

import cv2
import numpy as np
import pyarrow as pa
import pyarrow.parquet as pq

from datasets.store.shard_file import read_rows
from tests.hostile.kinds.tables import write
from tests.hostile.running import Call
from tests.hostile.values import damaged, garbage
from tests.wrong_input import Place

SIZE = 300, 400  # of the recipe's camera
START = b"\x89PNG\r\n\x1a\n"


def make(rng: random.Random, place: Place) -> tuple[str, list[Call]]:
    """A dataset whose first picture is hostile, detected and told of."""
    root = place.dataset()
    path = min((root / "frames").iterdir())
    footer = {key.decode(): value.decode() for key, value in (pq.read_metadata(path).metadata or {}).items()}
    rows = read_rows(path).replace_schema_metadata(None)
    changed = rows.to_pylist()
    what, data = rng.choice((_chunks, _chunks, _pixels, _pixels, _formats, _bytes))(rng, changed[0]["image"]["bytes"])
    changed[0]["image"]["bytes"] = data
    write(path, pa.Table.from_pylist(changed, rows.schema), footer)
    for name in ("detections", "estimates", "scores"):
        shutil.rmtree(root / name)
    detector = rng.choice(("edge-fit", "board-fit", "opencv-subpix", "opencv-sb"))
    calls: list[Call] = [("detect", root, "-q", "--detector", detector)]
    points = ("--detector", detector) if detector != "edge-fit" else ()
    calls += [("estimate", root, "-q", *points), ("score", root, "-q"), ("report", root), ("verify", root)]
    if rng.random() < 0.2:
        calls.insert(3, ("estimate", root, "-q", "--estimator", "photometric"))
    return f"{what}; {detector}", calls


def _chunk(name: bytes, data: bytes) -> bytes:
    return struct.pack(">I", len(data)) + name + data + struct.pack(">I", zlib.crc32(name + data))


def _chunks(rng: random.Random, png: bytes) -> tuple[str, bytes]:
    """Chunks of a PNG that are wrong, with sums that are right."""
    height, width = SIZE
    pixels = zlib.compress(bytes((width + 1) * height))
    claims = ((100_000, 100_000), (2**31 - 1, 2**31 - 1), (0, 0), (2**32 - 1, 1), (10_000, 10_000), (1, 100_000_000))
    bomb = zlib.compress(bytes(50_000_000))
    header = struct.pack(">IIBBBBB", width, height, 8, 0, 0, 0, 0)
    ways = {
        "claims": (struct.pack(">II", *rng.choice(claims)) + b"\x08\0\0\0\0", [(b"IDAT", pixels)]),
        "depth": (
            struct.pack(">IIBBBBB", width, height, rng.choice((0, 1, 2, 3, 16, 255)), 0, 0, 0, 0),
            [(b"IDAT", pixels)],
        ),
        "kind": (
            struct.pack(">IIBBBBB", width, height, 8, rng.choice((1, 2, 3, 4, 5, 6, 7, 255)), 0, 0, 0),
            [(b"IDAT", pixels)],
        ),
        "interlaced": (struct.pack(">IIBBBBB", width, height, 8, 0, 0, 0, rng.choice((1, 2, 9))), [(b"IDAT", pixels)]),
        "no pixels": (header, []),
        "pixels are a bomb": (header, [(b"IDAT", bomb)]),
        "text is a bomb": (header, [(b"zTXt", b"a\0\0" + bomb), (b"IDAT", pixels)]),
        "profile is a bomb": (header, [(b"iCCP", b"a\0\0" + bomb), (b"IDAT", pixels)]),
        "many texts": (header, [(b"tEXt", b"a\0b")] * 20_000 + [(b"IDAT", pixels)]),
        "palette": (
            struct.pack(">IIBBBBB", width, height, 8, 3, 0, 0, 0),
            [(b"PLTE", b"\0" * rng.choice((0, 3, 4, 768, 900))), (b"IDAT", pixels)],
        ),
        "transparent": (header, [(b"tRNS", b"\0\0"), (b"IDAT", pixels)]),
        "critical": (header, [(b"ABCD", b"x"), (b"IDAT", pixels)]),
        "moves": (header, [(b"acTL", struct.pack(">II", 10**9, 0)), (b"IDAT", pixels)]),
        "half the pixels": (header, [(b"IDAT", pixels[: len(pixels) // 2])]),
        "wrong filter": (header, [(b"IDAT", zlib.compress(b"\xff" * ((width + 1) * height)))]),
        "gamma": (header, [(b"gAMA", struct.pack(">I", rng.choice((0, 2**32 - 1)))), (b"IDAT", pixels)]),
        "orientation": (
            header,
            [(b"eXIf", b"II*\0\x08\0\0\0\1\0\x12\1\3\0\1\0\0\0\6\0\0\0\0\0\0\0"), (b"IDAT", pixels)],
        ),
        "resolution": (header, [(b"pHYs", struct.pack(">IIB", 2**32 - 1, 0, 9)), (b"IDAT", pixels)]),
    }
    name = rng.choice(sorted(ways))
    first, others = ways[name]
    data = START + _chunk(b"IHDR", first) + b"".join(_chunk(*chunk) for chunk in others) + _chunk(b"IEND", b"")
    return name, data


def _pixels(rng: random.Random, png: bytes) -> tuple[str, bytes]:
    """Sound PNG with other pixels."""
    noise = np.random.default_rng(rng.randrange(2**32))
    height, width = SIZE
    images = {
        "white": np.full(SIZE, 255, np.uint8),
        "noise": noise.integers(0, 256, SIZE, np.uint8),
        "sixteen bits": noise.integers(0, 65536, SIZE, np.uint16),
        "colour": noise.integers(0, 256, (*SIZE, 3), np.uint8),
        "alpha": noise.integers(0, 256, (*SIZE, 4), np.uint8),
        "one pixel": np.zeros((1, 1), np.uint8),
        "one line": np.zeros((1, 4000), np.uint8),
        "15 px": np.zeros((15, 15), np.uint8),
        "16 px": noise.integers(0, 256, (16, 16), np.uint8),
        "wide": np.zeros((20, 200_000), np.uint8),
        "larger": noise.integers(0, 256, (600, 800), np.uint8),
        "stripes": np.tile(np.array([[0, 255]], np.uint8), (height, width // 2)),
        "finest board": np.kron(np.indices((height, width)).sum(0) % 2, np.ones((1, 1))).astype(np.uint8) * 255,
        "board of 2 px": (np.kron(np.indices((height // 2, width // 2)).sum(0) % 2, np.ones((2, 2))) * 255).astype(
            np.uint8
        ),
        "board of 6 px": (np.kron(np.indices((height // 6, width // 6)).sum(0) % 2, np.ones((6, 6))) * 255).astype(
            np.uint8
        ),
        "mirrored": cv2.imdecode(np.frombuffer(png, np.uint8), -1)[:, ::-1],
        "turned": cv2.imdecode(np.frombuffer(png, np.uint8), -1)[::-1, ::-1],
        "inverted": 255 - cv2.imdecode(np.frombuffer(png, np.uint8), -1),
        "transposed": cv2.imdecode(np.frombuffer(png, np.uint8), -1).T,
        "four boards": np.tile(cv2.imdecode(np.frombuffer(png, np.uint8), -1)[::2, ::2], (2, 2)),
    }
    name = rng.choice(sorted(images))
    return name, cv2.imencode(".png", np.ascontiguousarray(images[name]))[1].tobytes()


def _formats(rng: random.Random, png: bytes) -> tuple[str, bytes]:
    image = cv2.imdecode(np.frombuffer(png, np.uint8), -1)
    kinds = {kind: cv2.imencode(f".{kind}", image)[1].tobytes() for kind in ("jpg", "bmp", "tiff", "webp", "pgm")}
    kinds |= {
        "text": b"hello",
        "svg": b"<svg xmlns='http://www.w3.org/2000/svg'/>",
        "huge bmp": b"BM" + struct.pack("<IHHIIiiHHIIiiII", 54, 0, 0, 54, 40, 60_000, 60_000, 1, 8, 0, 0, 0, 0, 0, 0),
        "huge pgm": b"P5 30000 30000 255\n" + bytes(100),
        "huge pam": b"P7\nWIDTH 30000\nHEIGHT 30000\nDEPTH 1\nMAXVAL 255\nTUPLTYPE GRAYSCALE\nENDHDR\n" + bytes(100),
        "huge hdr": b"#?RADIANCE\nFORMAT=32-bit_rle_rgbe\n\n-Y 30000 +X 30000\n" + bytes(100),
        "huge sun": struct.pack(">IIIIIIII", 0x59A66A95, 30000, 30000, 8, 100, 1, 0, 0) + bytes(100),
        "huge gif": b"GIF89a"
        + struct.pack("<HH", 65535, 65535)
        + b"\0\0\0,"
        + struct.pack("<HHHHB", 0, 0, 65535, 65535, 0)
        + b"\x08\x01\0\0;",
        "huge jpg": b"\xff\xd8\xff\xc0\0\x0b\x08"
        + struct.pack(">HH", 65500, 65500)
        + b"\1\1\x11\0\xff\xda\0\x08\1\1\0\0?\0"
        + bytes(100)
        + b"\xff\xd9",
    }
    name = rng.choice(sorted(kinds))
    return name, kinds[name]


def _bytes(rng: random.Random, png: bytes) -> tuple[str, bytes]:
    if rng.random() < 0.15:
        return "noise", START + garbage(rng, 5000)
    return damaged(rng, png)
