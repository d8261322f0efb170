"""Figures fit a page that allows no style but its own, in two themes, several times."""

import re
import xml.etree.ElementTree as ElementTree

import matplotlib.pyplot as plt

from pipelines.pages.svg import STYLE, svg


def _figure(values):
    with plt.rc_context(STYLE):
        figure, axis = plt.subplots()
        axis.boxplot(values)
        axis.plot([1, 2], [3, 4], ".-", label="a line")
        axis.set_title("a title", fontweight="bold")
        axis.legend(frameon=False)
        return svg(figure)


def test_nothing_in_a_figure_needs_a_style_or_fixes_a_colour_of_text():
    text = _figure([[1.0, 2.0, 9.0], [2.0, 3.0, 4.0]])
    root = ElementTree.fromstring(text.replace("<svg ", '<svg xmlns="http://www.w3.org/2000/svg" ', 1))
    assert [item for item in root.iter() if "style" in item.attrib or item.tag.endswith(("style", "metadata"))] == []
    assert "#000000" not in text
    assert 'stroke="currentColor"' in text
    told = {item.text.strip(): item.attrib for item in root.iter() if item.tag.endswith("text") and item.text}
    assert told["a title"]["font-weight"] == "700"
    assert float(told["a line"]["font-size"].removesuffix("px")) > 0.0


def test_names_in_two_figures_differ_and_all_are_used():
    one, other = _figure([[1.0, 2.0]]), _figure([[1.0, 3.0]])
    names = [set(re.findall(r' id="([^"]*)"', text)) for text in (one, other)]
    assert not names[0] & names[1]
    for text, own in zip((one, other), names, strict=True):
        assert set(re.findall(r'(?:url\(#|href="#)([^")]+)', text)) == own


def test_equal_data_give_equal_text():
    assert _figure([[1.0, 2.0]]) == _figure([[1.0, 2.0]])
