"""Ways in which archives of linear images are damaged, and the dataset that they belong to."""

from __future__ import annotations

from datasets.recipe.model import parse_recipe
from datasets.store.claim import claim
from datasets.store.dataset import open_dataset
from datasets.store.kept_masters import Kept
from datasets.store.masters import archive_names
from datasets.store.zip_archive import write_archive
from datasets.verify import verify
from datasets.verify.problems import Kind
from pipelines.stages import generate
from tests.conftest import TINY

TEXT = TINY.replace("step = 90", "step = 30").replace(
    "shard_frames = 1", "shard_frames = 2"
)  # two shards of two frames
FIRST, SECOND = "masters/000000-000001.zip", "masters/000002-000003.zip"


def masters(root):
    return {path.relative_to(root).as_posix(): path.read_bytes() for path in (root / "masters").glob("*")}


def problems_of(root):
    return [(item.path.relative_to(root).as_posix(), item.kind) for item in verify(open_dataset(root))[1]]


def exchange(root, made):
    one, other = (root / FIRST).read_bytes(), (root / SECOND).read_bytes()
    (root / FIRST).write_bytes(other)
    (root / SECOND).write_bytes(one)


def other_recipe(root, made):
    """The archive of the same frames with other samples."""
    other = root.parent / "other"
    text = TEXT.replace("samples = 4", "samples = 9")
    with claim(other, parse_recipe(text, "test"), text, kept=Kept.ARCHIVES) as dataset:
        generate.run_shard(dataset, 0)
    (root / FIRST).write_bytes((other / FIRST).read_bytes())


def with_members(*numbers, names=None):
    """The first archive written with members of these frames' images, for frames 0 and 1 or under other names."""

    def damage(root, made):
        content = [(made / "single" / "masters" / f"{number:06d}.exr").read_bytes() for number in numbers]
        write_archive(root / FIRST, names or archive_names(range(len(numbers))), content)

    return damage


def flip(part):
    """A bit flipped at a place of the first archive, in parts of its size."""

    def damage(root, made):
        data = bytearray((root / FIRST).read_bytes())
        data[int(part * (len(data) - 1))] ^= 4
        (root / FIRST).write_bytes(data)

    return damage


def cut(root, made):
    (root / FIRST).write_bytes((root / FIRST).read_bytes()[:-40])


DAMAGES = {  # how, kind of the first archive's problem, how many frames are rendered again
    "missing": (lambda root, made: (root / FIRST).unlink(), Kind.MISSING, 2),
    "cut": (cut, Kind.DAMAGED, 2),
    "foreign": (other_recipe, Kind.FOREIGN, 2),
    "flip in an image": (flip(0.25), Kind.DAMAGED, 1),
    "flip at its end": (flip(1.0), Kind.DAMAGED, 2),
    "exchanged images": (with_members(1, 0), Kind.FOREIGN, 2),
    "image of another frame": (with_members(0, 2), Kind.FOREIGN, 1),
    "too few": (with_members(0), Kind.DAMAGED, 2),
    "too many": (with_members(0, 1, 2), Kind.DAMAGED, 2),
    "other names": (with_members(0, 1, names=["../a.exr", "b.exr"]), Kind.DAMAGED, 2),
}
