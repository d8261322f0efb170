"""The picture of the layers: it shows every room, and refuses imports that point up or in a circle."""

from xml.etree import ElementTree

import pytest

from tools import layers

HOUSE = {"top": [["a"], ["b", "c"]], "low": [["d"]]}


@pytest.mark.parametrize(
    ("edge", "part"),
    [
        (("top.b", "top.a"), "top.b imports top.a, which is not in a layer below"),
        (("top.b.x", "top.c"), "top.b.x imports top.c, which is not in a layer below"),
        (("low.d", "top.b"), "low.d imports top.b, which is not in a layer below"),
        (("top.e", "low.d"), "top.e has no layer"),
        (("top.b.y", "top.b.x"), "circle: "),
    ],
)
def test_a_wrong_import_is_told(edge, part):
    sound = {("top.a", "top.b"), ("top.b.x", "top.b.y"), ("top.c", "low.d"), ("top.a", "low")}
    assert layers.faults(sound, HOUSE) == []
    found = layers.faults(sound | {edge}, HOUSE)
    assert any(text.startswith(part) for text in found), found


def test_arrows_that_follow_from_others_are_left_out():
    assert layers.needed({("a", "b"), ("b", "c"), ("a", "c"), ("a", "d")}) == {("a", "b"), ("b", "c"), ("a", "d")}


def test_the_picture_shows_every_room(tmp_path):
    assert layers.main(tmp_path / "layers.svg") == 0
    picture = ElementTree.parse(tmp_path / "layers.svg").getroot()
    texts = [text.text for text in picture.iter("{http://www.w3.org/2000/svg}text")]
    rooms, _, _ = layers.read()
    assert {room for rows in rooms.values() for row in rows for room in row} <= set(texts)
    assert set(rooms) <= set(texts)


def test_a_wrong_import_leaves_no_picture(tmp_path, monkeypatch, capsys):
    rooms, files, imports = layers.read()
    monkeypatch.setattr(layers, "read", lambda: (rooms, files, imports | {("eposit.lens", "eposit.solver")}))
    assert layers.main(tmp_path / "layers.svg") == 1
    assert "error: eposit.lens imports eposit.solver" in capsys.readouterr().err
    assert not (tmp_path / "layers.svg").exists()
