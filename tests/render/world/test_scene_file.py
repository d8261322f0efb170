"""Scene files of strangers: what they may name, and what they may not."""

from __future__ import annotations

import shutil
from pathlib import Path

import pytest

from render.world.files import file_digest, require_unchanged
from render.world.scene_file import SceneFileError, read_scene_file

SHAPE = '<shape type="obj"><string name="filename" value="{}"/></shape>'


@pytest.fixture
def folder(tmp_path):
    """A scene's folder with a mesh and a part, beside a secret that no scene may reach."""
    (tmp_path / "secret.obj").write_text("secret")
    inner = tmp_path / "scene"
    (inner / "meshes").mkdir(parents=True)
    (inner / "meshes" / "box.obj").write_text("v 0 0 0")
    (inner / "part.xml").write_text(f"<scene>{SHAPE.format('meshes/box.obj')}</scene>")
    (inner / "link.obj").symlink_to(tmp_path / "secret.obj")
    (inner / "link").symlink_to(tmp_path)
    (inner / "round.xml").write_text('<scene><include filename="round.xml"/></scene>')
    return inner


def scene(folder, content, root="scene"):
    path = folder / "scene.xml"
    path.write_text(f"<{root}>{content}</{root}>")
    return path


def test_files_inside_the_folder_are_named_by_absolute_paths(folder):
    text = (
        '<default name="box" value="meshes/box"/><path value="meshes"/>'
        + "".join(SHAPE.format(name) for name in ("meshes/box.obj", "box.obj", "$box.obj"))
        + '<include filename="part.xml"/><integrator type="path"/><sensor type="perspective"/>'
    )
    found = read_scene_file(scene(folder, text))
    box = str((folder / "meshes" / "box.obj").resolve())
    assert found.text.count(f'value="{box}"') == 4
    assert "include" not in found.text
    assert "<path" not in found.text
    assert "integrator" not in found.text
    assert "sensor" not in found.text
    assert [path.name for path in found.files] == ["scene.xml", "part.xml", "box.obj"]


REFUSED = {
    "upwards": (SHAPE.format("../secret.obj"), "outside its folder"),
    "upwards from within": (SHAPE.format("meshes/../../secret.obj"), "outside its folder"),
    "absolute": (SHAPE.format("/etc/hostname"), "outside its folder"),
    "symbolic link": (SHAPE.format("link.obj"), "outside its folder"),
    "linked folder": (SHAPE.format("link/secret.obj"), "outside its folder"),
    "include": ('<include filename="../secret.obj"/>', "outside its folder"),
    "search path": ('<path value=".."/>' + SHAPE.format("secret.obj"), "outside its folder"),
    "parameter": ('<default name="up" value="../"/>' + SHAPE.format("$upsecret.obj"), "outside its folder"),
    "parameter without a default": (SHAPE.format("$up/secret.obj"), "has no default"),
    "spectrum": (
        '<bsdf type="diffuse"><spectrum name="reflectance" filename="../s.spd"/></bsdf>',
        "outside its folder",
    ),
    "another name": ('<texture type="x"><string name="image" value="../secret.obj"/></texture>', "outside its folder"),
    "library": ('<shape type="../secret"/>', "names a plugin '../secret'"),
    "library by a parameter": ('<default name="up" value="../x"/><shape type="$up"/>', "names a plugin '$up'"),
    "missing mesh": (SHAPE.format("meshes/none.obj"), "which is not in its folder"),
    "no name": (SHAPE.format(""), "a file without a name"),
    "includes itself": ('<include filename="round.xml"/>', "does it include itself?"),
    "not XML": ("<shape", "is not XML"),
}


@pytest.mark.parametrize("name", REFUSED)
def test_a_scene_cannot_reach_out_of_its_folder(name, folder):
    content, words = REFUSED[name]
    with pytest.raises(SceneFileError, match=words.replace("?", r"\?").replace("$", r"\$")):
        read_scene_file(scene(folder, content))


@pytest.mark.parametrize(
    "doctype",
    ['<!DOCTYPE scene [<!ENTITY e SYSTEM "../secret.obj">]>', '<!DOCTYPE scene SYSTEM "scene.dtd">'],
)
def test_entities_are_refused(doctype, folder):
    path = folder / "scene.xml"
    path.write_text(f'{doctype}<scene><shape type="&e;"/></scene>')
    with pytest.raises(SceneFileError, match="document type"):
        read_scene_file(path)


def test_other_files_than_scenes_are_refused(folder):
    with pytest.raises(SceneFileError, match="begins with <shape>"):
        read_scene_file(scene(folder, "", root="shape"))
    with pytest.raises(SceneFileError, match="cannot be read"):
        read_scene_file(folder / "none.xml")


def test_a_hash_over_the_scene_and_its_meshes_that_moves_with_the_folder(folder):
    path = scene(folder, '<include filename="part.xml"/>')
    before = file_digest(path)
    other = folder.with_name("elsewhere")
    shutil.copytree(folder, other, symlinks=True)
    assert file_digest(other / "scene.xml") == before
    require_unchanged(path, before)
    (folder / "meshes" / "box.obj").write_text("v 1 0 0")
    assert file_digest(path) != before
    with pytest.raises(SceneFileError, match="put the old one back"):
        require_unchanged(path, before)
    assert file_digest(Path(other / "meshes" / "box.obj")) != file_digest(folder / "meshes" / "box.obj")


@pytest.mark.parametrize("name", ["map.exr", "scene.xml"])
def test_a_file_that_never_ends_is_refused(name, tmp_path):
    (tmp_path / name).symlink_to("/dev/zero")
    with pytest.raises(SceneFileError, match="it is a device or a pipe"):
        file_digest(tmp_path / name)
