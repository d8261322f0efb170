"""Files of poses: CSV and Parquet with wrong columns, numbers, texts and sizes."""

from __future__ import annotations

import os
import random
from pathlib import Path
from typing import Any

import pyarrow as pa
import pyarrow.parquet as pq

from tests.hostile.kinds.tables import write_bomb
from tests.hostile.running import Call
from tests.hostile.values import any_value, damaged, garbage
from tests.wrong_input import Place

QUATERNION = ("q_w", "q_x", "q_y", "q_z")
POSITION = ("t_x_mm", "t_y_mm", "t_z_mm")
MATRIX = tuple(f"r{row}{column}" for row in "123" for column in "123")


def make(rng: random.Random, place: Place) -> tuple[str, list[Call]]:
    """A file of poses, scored and told of."""
    root = place.dataset()
    what, path = rng.choice((_csv, _csv, _parquet, _parquet, _text, _file))(rng, place.folder)
    name = rng.choice(
        ("theirs", "theirs", "theirs", "best", "../x", "", "x" * 65, "a b", "ünï", "a\nb", "-x", "--help")
    )
    calls: list[Call] = [("score", root, "--poses", path, "--name", name, "-q")]
    if rng.random() < 0.3:
        calls.append(("report", root))
    return f"{what} {name[:20]!r}", calls


def _columns(rng: random.Random) -> dict[str, list[Any]]:
    """Good poses of both frames with some values replaced."""
    columns: dict[str, list[Any]] = {"frame_id": [0, 1]}
    if rng.random() < 0.5:
        columns |= {name: [float(name == "q_w")] * 2 for name in QUATERNION}
    else:
        columns |= {name: [float(name[1] == name[2])] * 2 for name in MATRIX}
    columns |= {name: [100.0, 2000.0] for name in POSITION}
    if rng.random() < 0.4:
        columns["status"] = [
            rng.choice(("ok", "OK", "failed", "", "x" * 5000, "\u202e", "<b>", "missing")) for _ in "ab"
        ]
    for _ in range(rng.choice((0, 1, 1, 2, 5))):
        name = rng.choice([*columns])
        columns[name][rng.randrange(2)] = any_value(rng)
    if rng.random() < 0.2:
        columns.pop(rng.choice([*columns]))
    if rng.random() < 0.1:
        columns[str(any_value(rng))[:2000]] = [1, 2]
    return columns


def _csv(rng: random.Random, folder: Path) -> tuple[str, Path]:
    columns = _columns(rng)
    mark = rng.choice((",", ",", ",", ";", "\t", "\0"))
    rows = [mark.join(columns), *(mark.join(str(values[i]) for values in columns.values()) for i in range(2))]
    path = folder / "poses.csv"
    path.write_bytes(
        rng.choice(("\n", "\r\n", "\r")).join(rows).encode(rng.choice(("utf-8", "utf-16")), "surrogatepass")
    )
    return "csv", path


def _parquet(rng: random.Random, folder: Path) -> tuple[str, Path]:
    path = folder / "poses.parquet"
    columns = _columns(rng)
    arrays: dict[str, Any] = {}
    for name, values in columns.items():
        kind = rng.choice(
            (None, None, None, pa.float32(), pa.string(), pa.bool_(), pa.list_(pa.int8()), pa.date32(), pa.binary())
        )
        try:
            arrays[name] = pa.array(values, kind)
        except (pa.ArrowException, OverflowError, TypeError, ValueError, UnicodeError):
            arrays[name] = pa.nulls(2)
    try:
        pq.write_table(pa.table(arrays), path)
    except (pa.ArrowException, UnicodeError, ValueError, TypeError):
        return "parquet, none", path
    if rng.random() < 0.2:
        what, data = damaged(rng, path.read_bytes())
        path.write_bytes(data)
        return f"parquet {what}", path
    if rng.random() < 0.15:
        fields = [
            pa.field("frame_id", pa.int64()),
            *(pa.field(n, pa.string()) for n in (*QUATERNION, *POSITION, "status")),
        ]
        write_bomb(path, pa.schema(fields), {}, rng.random() < 0.5)
        return "parquet bomb", path
    return "parquet", path


def _text(rng: random.Random, folder: Path) -> tuple[str, Path]:
    path = folder / "poses.csv"
    good = "frame_id,q_w,q_x,q_y,q_z,tx,ty,tz\n0,1,0,0,0,1,2,3\n"
    texts = {
        "empty": lambda: "",
        "header": lambda: good.split("\n")[0],
        "quote that never ends": lambda: good + '1,"' + "x" * 200_000,
        "one line of 100 MB": lambda: "x" * 100_000_000,
        "many columns": lambda: ",".join(f"c{i}" for i in range(200_000)) + "\n",
        "many rows": lambda: good + "1,1,0,0,0,1,2,3\n" * 2_100_000,
        "many empty lines": lambda: good + "\n" * 3_000_000,
        "columns twice": lambda: good.replace("q_x", "q_w"),
        "both forms": lambda: good.replace("tx,ty,tz", "t_x_mm,t_y_mm,t_z_mm,tx,ty,tz").replace("1,2,3", "1,2,3,1,2,3"),
        "frames twice": lambda: good + good.split("\n")[1] + "\n",
        "frame far away": lambda: good + f"{10 ** rng.choice((3, 18, 19, 30, 300))},1,0,0,0,1,2,3\n",
        "mirror": lambda: good.replace("1,0,0,0", "-1,0,0,0"),
        "text of numbers": lambda: good.replace("1,2,3", "\u0661,1_000,0x10"),
        "infinite": lambda: good.replace("1,2,3", "inf,-inf,nan"),
        "1e400": lambda: good.replace("1,2,3", "1e400,1e300,-1e300"),
        "1e60": lambda: good.replace("1,2,3", "1e60,1e150,-1e307"),
        "formula": lambda: good.replace("1,2,3", '=cmd|"/c calc"!A1,2,3'),
    }
    name = rng.choice(sorted(texts))
    path.write_text(texts[name]())
    return name, path


def _file(rng: random.Random, folder: Path) -> tuple[str, Path]:
    path = folder / rng.choice(("poses.csv", "poses.parquet", "poses.CSV", "poses.txt", "poses", ".csv"))
    way = rng.choice(("noise", "folder", "pipe", "device", "missing", "loop"))
    if way == "noise":
        path.write_bytes(garbage(rng, rng.choice((1, 100, 100_000))))
    elif way == "folder":
        path.mkdir()
    elif way == "pipe":
        os.mkfifo(path)
    elif way == "device":
        path.symlink_to(rng.choice(("/dev/zero", "/dev/random", "/dev/tty")))
    elif way == "loop":
        path.symlink_to(path)
    return f"{way} {path.suffix}", path
