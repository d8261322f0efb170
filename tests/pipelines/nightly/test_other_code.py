"""The baseline's code: a frozen copy runs, and nothing else answers in its place."""

import shutil

import pytest

from datasets.store.dataset import open_dataset
from datasets.verify import verify
from pipelines.detection.prepare import compile_kernels
from pipelines.nightly.carried_kernels import place_of
from pipelines.nightly.other_code import CHOOSE_CODE, ROOT, Code, OtherCodeError, digest_of, freeze


@pytest.fixture(scope="module")
def frozen(tmp_path_factory):
    return freeze(tmp_path_factory.mktemp("code"))


@pytest.mark.full
def test_frozen_code_makes_the_same_scores(frozen, tiny, tmp_path, content):
    folder = tmp_path / "dataset"
    shutil.copytree(tiny[1], folder)
    for table in ("estimates", "scores"):
        shutil.rmtree(folder / table)
    code = Code(frozen)
    code.run("estimate", folder, "--quiet")
    code.run("score", folder, "--quiet")
    (shard, *_) = open_dataset(folder).shards("scores")
    assert (
        open_dataset(folder).read_shard(shard).equals(open_dataset(tiny[1]).read_shard(tiny[1] / "scores" / shard.name))
    )
    assert verify(open_dataset(folder))[1] == []


def test_a_change_in_the_copy_is_what_runs(frozen, tmp_path):
    """The copy answers and not the checkout, whose link in this environment puts itself first."""
    changed = tmp_path / "changed"
    shutil.copytree(frozen, changed)
    (changed / "eposit" / "__init__.py").write_text("raise SystemExit('this is the copy')")
    with pytest.raises(OtherCodeError, match="this is the copy"):
        Code(changed).run("recipes")


def test_a_folder_without_a_package_does_not_run_the_checkouts(frozen, tmp_path):
    partial = tmp_path / "partial"
    shutil.copytree(frozen, partial)
    shutil.rmtree(partial / "eposit")
    with pytest.raises(OtherCodeError, match=r"eposit is .*, not in"):
        Code(partial).run("recipes")


@pytest.mark.full
def test_the_library_alone_can_be_another(frozen, tmp_path):
    library = tmp_path / "library"
    shutil.copytree(frozen / "eposit", library / "eposit")
    Code(library, ("eposit",)).run("recipes")


def test_what_fails_is_told(frozen):
    with pytest.raises(OtherCodeError, match="nosuch"):
        Code(frozen).run("describe", "nosuch")


FAILS_WITH_MORE_AT_ITS_END = """
class Held:
    def __del__(self):
        raise OSError("closed already")
held = Held()
sys.exit("the reason")
"""


def test_the_reason_is_told_whatever_python_says_behind_it(frozen):
    with pytest.raises(OtherCodeError) as told:
        Code(frozen).run_program(CHOOSE_CODE + FAILS_WITH_MORE_AT_ITS_END, what="end")
    assert str(told.value).endswith("end: the reason")


def test_code_that_hangs_is_ended(frozen, tmp_path):
    hanging = tmp_path / "hanging"
    shutil.copytree(frozen, hanging)
    (hanging / "eposit" / "__init__.py").write_text("import time; time.sleep(600)")
    with pytest.raises(OtherCodeError, match="did not end within 1 s"):
        Code(hanging, limit_s=1.0).run("recipes")


def test_the_same_files_have_one_copy(tmp_path):
    first, second = freeze(tmp_path), freeze(tmp_path)
    assert first == second
    assert digest_of(first) == digest_of(ROOT)
    assert [path.name for path in tmp_path.iterdir()] == [first.name]


COUNT_COMPILED = """
from pipelines.detection.prepare import compile_kernels
found = []
compile_kernels(lambda: found.append(1))
print(len(found))
"""


def test_a_copy_need_not_compile_what_this_checkout_has_compiled(tmp_path):
    compile_kernels()
    code = Code(freeze(tmp_path))
    assert int(code.run_program(CHOOSE_CODE + COUNT_COMPILED, what="count").stdout) == 0


def test_machine_code_of_other_sources_is_not_carried(frozen, tmp_path):
    changed = tmp_path / "changed"
    shutil.copytree(frozen, changed, ignore=shutil.ignore_patterns("__pycache__"))
    compile_kernels()
    assert place_of(freeze(tmp_path / "same", changed)).is_dir()
    with open(changed / "pipelines" / "detection" / "levels.py", "a") as file:
        file.write("# another\n")
    assert not place_of(freeze(tmp_path / "other", changed)).exists()
