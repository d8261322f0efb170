"""Archives of linear images: false sizes, places and counts, other names, compressed members, no archives."""

from __future__ import annotations

import functools
import random
import struct
import warnings
import zipfile
from pathlib import Path

from datasets.plan import frame_ids_of_shard
from datasets.recipe.model import parse_recipe
from datasets.store.dataset import open_dataset
from datasets.store.kept_masters import NOTES, Kept
from datasets.store.packing import pack_masters
from datasets.store.zip_archive import END, ENTRY, LARGE_END, LOCAL, LOCATOR
from datasets.verify import verify
from tests.hostile.kinds.linear_images import generated_from
from tests.hostile.running import Call
from tests.hostile.values import TEXTS, damaged
from tests.wrong_input import Place

NUMBERS = (0, 1, 2, 8, 30, 0xFFFE, 0xFFFF, 2**31 - 1, 2**31, 2**32 - 2, 2**32 - 1, 2**63, 2**64 - 1)
SIZES = {"H": 2, "I": 4, "Q": 8}  # bytes of a field
NAMES = ("000000.exr", "000001.exr", "../../outside/x", "/etc/passwd", "000000.exr/", "./000000.exr", "", *TEXTS[:-8])
METHODS = (zipfile.ZIP_STORED, zipfile.ZIP_DEFLATED, zipfile.ZIP_BZIP2, zipfile.ZIP_LZMA)
BOMB = 300_000_000  # bytes of one member, some hundred kB in the file
MANY = 70_000  # members, more than 16 bits count


def make(rng: random.Random, place: Place) -> tuple[str, list[Call]]:
    """A packed dataset whose first archive is hostile: verified, developed again or reused, and mended."""
    root = _packed(place)
    path = min((root / "masters").glob("*.zip"))
    what = rng.choice((_fields, _fields, _fields, _others, _others, _bytes))(rng, path)
    calls: list[Call] = [("verify", root)] if rng.random() < 0.3 else []
    calls.append(generated_from(rng, root, place, rng.choice(((), ("--pack-masters",)))))
    if rng.random() < 0.3:
        calls += [("repair", root, "-q"), functools.partial(_is_sound, root)]
    return what, calls


def _packed(place: Place) -> Path:
    root = place.dataset()
    name, text = NOTES[Kept.ARCHIVES]
    (root / name).write_text(text)
    recipe = parse_recipe((root / "recipe.toml").read_text(), "recipe")
    for number in range(len([*(root / "masters").iterdir()])):
        pack_masters(root, frame_ids_of_shard(recipe, number))
    return root


def _is_sound(root: Path) -> int:
    """Exit code of a look at a dataset that was mended: 1 if its linear images are not as they should be."""
    return int(any("masters" in problem.path.parts for problem in verify(open_dataset(root))[1]))


def _fields(rng: random.Random, path: Path) -> str:
    """Numbers in a member's header, in its entry, or at the end."""
    data = bytearray(path.read_bytes())
    told: list[str] = []
    places = {"header": (LOCAL, 0), "entry": (ENTRY, data.rfind(b"PK\1\2")), "end": (END, len(data) - END.size)}
    for _ in range(rng.choice((1, 1, 2, 4))):
        where = rng.choice(sorted(places))
        form, at = places[where]
        fields = list(form.unpack_from(data, at))
        kinds = [kind for count, kind in _kinds(form) for _ in range(count)]
        index = rng.randrange(len(fields))
        if kinds[index] == "s":
            fields[index] = rng.choice((b"PK\3\4", b"PK\1\2", b"PK\5\6", b"\0\0\0\0"))
        else:
            fields[index] = rng.choice(NUMBERS) % (1 << 8 * SIZES[kinds[index]])
        form.pack_into(data, at, *fields)
        told.append(f"{where} {index} = {fields[index]}")
    if rng.random() < 0.3:
        data[-END.size : -END.size] = _large_end(rng)
        told.append("an end of 64 bits")
    path.write_bytes(data)
    return ", ".join(told)


def _kinds(form: struct.Struct) -> list[tuple[int, str]]:
    """How many fields of each type follow one another in a structure; a text counts once."""
    found, digits = [], ""
    for letter in form.format.lstrip("<"):
        if letter.isdigit():
            digits += letter
            continue
        found.append((1 if letter == "s" else int(digits or 1), letter))
        digits = ""
    return found


def _large_end(rng: random.Random) -> bytes:
    count, size, start, place = (rng.choice(NUMBERS) for _ in range(4))
    end = LARGE_END.pack(b"PK\6\6", LARGE_END.size - 12, 45, 45, 0, 0, count, count, size, start)
    return end + LOCATOR.pack(b"PK\6\7", 0, place, 1)


def _others(rng: random.Random, path: Path) -> str:
    """Archives that another program would write."""
    content = path.read_bytes()[LOCAL.size + len("000000.exr") :]
    ways = ("names", "names", "method", "bomb", "many", "comment", "link", "empty", "twice")
    way, method = rng.choice(ways), rng.choice(METHODS)
    names = {"names": rng.choices(NAMES, k=rng.choice((1, 2, 5))), "twice": ["000000.exr"] * 2, "empty": []}
    path.unlink()
    with warnings.catch_warnings(), zipfile.ZipFile(path, "w", method) as archive:
        warnings.simplefilter("ignore")  # of names that are there twice
        for name in names.get(way, ["000000.exr"]):
            archive.writestr(name.encode("utf-8", "replace").decode(), content)
        if way == "many":
            for number in range(MANY):
                archive.writestr(f"{number:06d}.exr", b"", zipfile.ZIP_STORED)
        if way == "bomb":
            archive.writestr("000000.exr", bytes(BOMB), zipfile.ZIP_DEFLATED)
        if way == "link":
            link = zipfile.ZipInfo("000001.exr")
            link.external_attr = 0o120777 << 16
            archive.writestr(link, "/etc/passwd")
        if way == "comment":
            archive.comment = b"PK\5\6" * 16_000
    return f"another program's: {way} {method}"


def _bytes(rng: random.Random, path: Path) -> str:
    if rng.random() < 0.2:
        path.unlink()
        path.symlink_to(rng.choice(("/dev/zero", "/etc/passwd", str(path), path.parent)))
        return "a link"
    what, data = damaged(rng, path.read_bytes())
    path.write_bytes(data)
    return what
