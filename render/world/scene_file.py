"""A Mitsuba scene file of a stranger's, read so that it cannot reach beyond its own folder.

The XML is parsed here, not by Mitsuba. Every value that can name a file must name one inside the scene's folder, with
symbolic links followed; included files are put in the place of the `<include>`. What Mitsuba then reads is written
anew from the parsed elements with absolute paths, so that it cannot understand the file differently.
"""

from __future__ import annotations

import errno
import re
from collections.abc import Iterator
from dataclasses import dataclass, field
from pathlib import Path
from xml.etree import ElementTree
from xml.etree.ElementTree import Element
from xml.parsers import expat

MAX_BYTES = 64 << 20  # of XML, included files and all
MAX_INCLUDES = 32  # files in one another
PLUGIN = re.compile(r"[A-Za-z_][A-Za-z0-9_]*")  # a name with a path in it would load a library from there
PARAMETER = re.compile(r"\$([A-Za-z_][A-Za-z0-9_]*)")
NOT_OURS = ("integrator", "sensor", "film", "sampler")  # at the top level: the recipe has its own


class SceneFileError(ValueError):
    """A scene file that cannot be used; the message is one sentence with the remedy."""


def read_file(path: Path, most_bytes: int, what: str = "") -> bytes:
    """The first bytes of a regular file; a device or a pipe might never end. what: before its name in a message.

    Raises:
        SceneFileError: it cannot be read.
    """
    try:
        if path.exists() and not path.is_dir() and not path.is_file():
            raise OSError(errno.EINVAL, "it is a device or a pipe", str(path))
        with open(path, "rb") as file:
            return file.read(most_bytes)
    except OSError as error:
        raise SceneFileError(f"{what}{path} cannot be read ({error.strerror}); give the path of a file") from None


@dataclass(frozen=True, slots=True)
class SceneFile:
    """A scene as XML text that names files by absolute paths inside the scene's folder, and these files."""

    text: str
    files: tuple[Path, ...]  # the scene first, each once


def read_scene_file(path: Path) -> SceneFile:
    """Read and check a scene.

    Raises:
        SceneFileError: missing, not XML, not a scene, too large, with a document type, or with a path that leads out of
            the scene's folder or to nothing.
    """
    reader = _Reader(path.resolve().parent)
    root = reader.tree(path)
    if root.tag != "scene":
        raise SceneFileError(f"{path} begins with <{root.tag}>; a Mitsuba scene begins with <scene>")
    for element in [child for child in root if child.tag in NOT_OURS]:
        root.remove(element)
    reader.check(root)
    return SceneFile(ElementTree.tostring(root, encoding="unicode"), tuple(dict.fromkeys(reader.files)))


@dataclass(slots=True)
class _Reader:
    """The state of one reading: its folder, what was read, search paths and parameters of the scene."""

    folder: Path  # resolved
    files: list[Path] = field(default_factory=list)
    bytes_read: int = 0
    search: list[Path] = field(default_factory=list)
    parameters: dict[str, str] = field(default_factory=dict)

    def tree(self, path: Path, depth: int = 0) -> Element:
        """The elements of a file with those of included files in their places."""
        if depth > MAX_INCLUDES:
            raise SceneFileError(f"{path} is included through more than {MAX_INCLUDES} files; does it include itself?")
        root = self._parsed(path)
        self._collect(root)
        self._replace_includes(root, depth)
        return root

    def check(self, root: Element) -> None:
        """Check plugins' names and put absolute paths in the place of every name of a file."""
        for element in root.iter():
            kind = element.get("type")
            if kind is not None and not PLUGIN.fullmatch(self._substituted(kind)):
                raise SceneFileError(
                    f"the scene names a plugin {kind!r}; plugins are letters, digits and underscores, without a path"
                )
            for attribute in _file_attributes(element):
                element.set(attribute, str(self._inside(element.get(attribute, ""))))

    def _parsed(self, path: Path) -> Element:
        data = read_file(path, MAX_BYTES + 1, "scene file ")
        self.bytes_read += len(data)
        if self.bytes_read > MAX_BYTES:
            raise SceneFileError(
                f"{path} makes the scene larger than {MAX_BYTES >> 20} MiB of XML; keep meshes in files"
            )
        self.files.append(path.resolve())
        return _elements(data, path)

    def _collect(self, root: Element) -> None:
        """Note the parameters' defaults and the search paths of a file, and take the latter out."""
        for element in root.iter("default"):
            name, value = element.get("name"), element.get("value")
            if name and value is not None:
                self.parameters.setdefault(name, value)
        for parent, element in list(_with_parents(root)):
            if element.tag == "path":
                self.search.append(self._inside(element.get("value", "")))
                parent.remove(element)

    def _replace_includes(self, root: Element, depth: int) -> None:
        for parent, element in list(_with_parents(root)):
            if element.tag == "include":
                included = self.tree(self._inside(element.get("filename", "")), depth + 1)
                place = list(parent).index(element)
                parent.remove(element)
                for i, child in enumerate(list(included) if included.tag == "scene" else [included]):
                    parent.insert(place + i, child)

    def _substituted(self, value: str) -> str:
        """A value with the defaults of parameters in it; a parameter without one stays."""
        names = sorted(self.parameters, key=len, reverse=True)
        for name in names:
            value = value.replace(f"${name}", self.parameters[name])
        return value

    def _inside(self, value: str) -> Path:
        """The absolute path of a file or folder that the scene names."""
        name = self._substituted(value)
        if PARAMETER.search(name):
            raise SceneFileError(
                f"the scene names the file {value!r}, whose parameter has no default; write the name out"
            )
        if not name or "\0" in name:
            raise SceneFileError("the scene names a file without a name; write one")
        for folder in (self.folder, *self.search):
            found = (folder / name).resolve()
            if not found.is_relative_to(self.folder):
                raise SceneFileError(
                    f"the scene names {name!r}, which lies outside its folder {self.folder}; copy it into the folder"
                )
            if found.exists():
                self.files += [found] if found.is_file() else []
                return found
        raise SceneFileError(f"the scene names {name!r}, which is not in its folder {self.folder}; put it there")


def _file_attributes(element: Element) -> Iterator[str]:
    """The attributes of an element whose values Mitsuba may open as files."""
    if "filename" in element.attrib:
        yield "filename"
    if element.tag == "string":
        name, value = element.get("name", "").lower(), element.get("value", "")
        if "file" in name or "path" in name or "/" in value or "\\" in value or value.startswith((".", "~")):
            yield "value"


def _with_parents(root: Element) -> Iterator[tuple[Element, Element]]:
    for parent in root.iter():
        for child in parent:
            yield parent, child


def _elements(data: bytes, path: Path) -> Element:
    """The elements of an XML text without a document type, which could define entities."""
    builder = ElementTree.TreeBuilder()
    parser = expat.ParserCreate()

    def refuse(*_: object) -> None:
        raise SceneFileError(f"{path} has a document type or an entity; take <!DOCTYPE ...> out of it")

    parser.StartDoctypeDeclHandler = refuse
    parser.EntityDeclHandler = refuse
    parser.StartElementHandler = builder.start
    parser.EndElementHandler = builder.end
    try:
        parser.Parse(data, True)
    except expat.ExpatError as error:
        raise SceneFileError(f"{path} is not XML: {error}; mend it") from None
    return builder.close()
