"""Draw the layers of the four packages from their real imports; refuse if an import points up or in a circle.

Usage: python tools/layers.py OUT.svg. The order of the layers is that of the import contracts in pyproject.toml.
"""

from __future__ import annotations

import argparse
import sys
import textwrap
import tomllib
from collections import defaultdict
from graphlib import CycleError, TopologicalSorter
from html import escape
from pathlib import Path

import grimp

ROOT = Path(__file__).resolve().parents[1]
Edge = tuple[str, str]  # importer, imported
Layers = dict[str, list[list[str]]]  # package -> rows of rooms, the uppermost first

WIDTH, TITLE, RIGHT, GAP = 1180, 120, 110, 14
ROOM_HEIGHT, FILE_LINE, FILE_COLUMNS, ROW_GAP, BAND_GAP = 24, 12, 46, 30, 26
COLOURS = {"pipelines": "#e8f0fe", "datasets": "#e6f4ea", "render": "#fef7e0", "eposit": "#fce8e6"}
STYLE = (
    "text{font-family:system-ui,sans-serif;fill:#202124}.room{font-size:12px;font-weight:600}.file{font-size:9px;"
    "fill:#5f6368}.title{font-size:17px;font-weight:700}.count{font-size:11px;fill:#5f6368}"
    ".arrow{fill:none;stroke:#5f6368;stroke-opacity:.55;stroke-width:1.1;marker-end:url(#head)}"
    ".thick{fill:none;stroke:#3c4043;stroke-width:2;marker-end:url(#head)}"
)


def layers_of(contracts: list[dict]) -> Layers:
    """Rows of rooms in each package, packages from the top, from import-linter's layer contracts."""
    rows = {
        contract.get("containers", [""])[0]: [[room.strip() for room in row.split("|")] for row in contract["layers"]]
        for contract in contracts
        if contract["type"] == "layers"
    }
    return {package: rows[package] for (package,) in rows[""]}


def room_of(module: str) -> str:
    """package.room of a module; a package's own file is `package`."""
    return ".".join(module.split(".")[:2])


def faults(imports: set[Edge], layers: Layers) -> list[str]:
    """A sentence for every import that points up or to the side, for a room without a layer, and for a circle."""
    packages = list(layers)
    place = {
        f"{package}.{room}": row for package in packages for row, rooms in enumerate(layers[package]) for room in rooms
    }
    found = []
    for importer, imported in sorted(imports):
        a, b = room_of(importer), room_of(imported)
        above, below = packages.index(a.split(".")[0]), packages.index(b.split(".")[0])
        if a == b or a in packages or (b in packages and above == below):
            continue  # inside a room, or a package's own file, which gathers its rooms
        unknown = [room for room in (a, b) if room not in packages and room not in place]
        if unknown:
            found.append(f"{unknown[0]} has no layer; name it in the contract in pyproject.toml")
        elif above > below or (above == below and place[a] >= place[b]):
            found.append(f"{importer} imports {imported}, which is not in a layer below")
    graph: dict[str, set[str]] = defaultdict(set)
    for importer, imported in imports:
        graph[importer].add(imported)
    try:
        TopologicalSorter(graph).prepare()
    except CycleError as error:
        found.append(f"circle: {' -> '.join(reversed(error.args[1]))}")
    return found


def needed(edges: set[Edge]) -> set[Edge]:
    """Edges that do not follow from two or more others."""
    below: dict[str, set[str]] = defaultdict(set)
    for a, b in edges:
        below[a].add(b)

    def reaches(a: str, b: str) -> bool:
        return b in below[a] or any(reaches(c, b) for c in below[a])

    return {(a, b) for a, b in edges if not any(reaches(c, b) for c in below[a] if c != b)}


class Drawing:
    """The picture: rooms are placed first, so that arrows know their ends and lie behind them."""

    def __init__(self, layers: Layers, files: dict[str, list[str]], imports: set[Edge]) -> None:
        self.layers, self.files, self.imports = layers, files, imports
        self.back: list[str] = []
        self.arrows: list[str] = []
        self.front: list[str] = []
        self.box: dict[str, tuple[float, float, float, float]] = {}  # x, y, width, height of every room
        self.bands: dict[str, tuple[float, float]] = {}  # top and bottom of every package

    def svg(self) -> str:
        """The whole picture."""
        y = 12.0
        for package, rows in self.layers.items():
            y = self._band(package, rows, y) + BAND_GAP
        self._arrows_in_packages()
        self._arrows_between_packages()
        head = '<marker id="head" viewBox="0 0 8 8" refX="7" refY="4" markerWidth="7" markerHeight="7" orient="auto">'
        head += '<path d="M0 0L8 4L0 8z" fill="#5f6368"/></marker>'
        body = "\n".join((*self.back, *self.arrows, *self.front))
        return (
            f'<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 {WIDTH} {y - BAND_GAP + 12:g}" role="img">\n'
            f"<title>Layers of the four packages, from their imports</title>\n<style>{STYLE}</style>\n"
            f"<defs>{head}</defs>\n"
            f'<rect width="100%" height="100%" fill="#fff" rx="8"/>\n{body}\n</svg>\n'
        )

    def _band(self, package: str, rows: list[list[str]], top: float) -> float:
        y = top + GAP
        for rooms in rows:
            y = self._row(package, rooms, y) + ROW_GAP
        bottom = y - ROW_GAP + GAP
        size = f'width="{WIDTH - RIGHT - 12}" height="{bottom - top:g}" rx="8"'
        self.back.append(f'<rect x="12" y="{top:g}" {size} fill="{COLOURS.get(package, "#f1f3f4")}"/>')
        self.front.append(f'<text class="title" x="26" y="{top + 30:g}">{escape(package)}</text>')
        self.bands[package] = (top, bottom)
        return bottom

    def _row(self, package: str, rooms: list[str], y: float) -> float:
        names = [f"{package}.{room}" for room in rooms]
        widths = [self._width(name) for name in names]
        free = WIDTH - TITLE - RIGHT - sum(widths)
        space = free / (len(names) + 1)
        x, bottom = TITLE + space, y
        for name, width in zip(names, widths, strict=True):
            height = ROOM_HEIGHT + FILE_LINE * len(self.files.get(name, ()))
            self.box[name] = (x, y, width, height)
            self._room(name, x, y, width, height)
            x, bottom = x + width + space, max(bottom, y + height)
        return bottom

    def _width(self, name: str) -> float:
        longest = max((len(line) * 5.0 for line in self.files.get(name, ())), default=0.0)
        return max(longest, 7.8 * len(name.split(".")[1])) + 18.0

    def _room(self, name: str, x: float, y: float, width: float, height: float) -> None:
        size = f'width="{width:.1f}" height="{height}" rx="4" fill="#fff" stroke="#80868b"'
        middle = f'x="{x + width / 2:.1f}" text-anchor="middle"'
        self.front.append(f'<rect x="{x:.1f}" y="{y:.1f}" {size}/>')
        self.front.append(f'<text class="room" y="{y + 16:.1f}" {middle}>{escape(name.split(".")[1])}</text>')
        for i, line in enumerate(self.files.get(name, ())):
            self.front.append(
                f'<text class="file" y="{y + ROOM_HEIGHT + 5 + FILE_LINE * i:.1f}" {middle}>{escape(line)}</text>'
            )

    def _arrows_in_packages(self) -> None:
        rooms = {(room_of(a), room_of(b)) for a, b in self.imports}
        inside = {
            (a, b)
            for a, b in rooms
            if a != b and a in self.box and b in self.box and a.split(".")[0] == b.split(".")[0]
        }
        for a, b in sorted(needed(inside)):
            (ax, ay, aw, ah), (bx, by, bw, _) = self.box[a], self.box[b]
            x1, y1, x2, y2 = ax + aw / 2, ay + ah, bx + bw / 2, by - 1
            half = (y1 + y2) / 2
            path = f"M{x1:.1f} {y1:.1f}C{x1:.1f} {half:.1f} {x2:.1f} {half:.1f} {x2:.1f} {y2:.1f}"
            self.arrows.append(f'<path class="arrow" d="{path}"/>')

    def _arrows_between_packages(self) -> None:
        counts: dict[Edge, int] = defaultdict(int)
        for a, b in self.imports:
            if a.split(".")[0] != b.split(".")[0]:
                counts[a.split(".")[0], b.split(".")[0]] += 1
        order = list(self.layers)
        for (a, b), count in sorted(counts.items()):
            span = order.index(b) - order.index(a)
            x, start = WIDTH - RIGHT, self.bands[a][1] - 14 * (order.index(b) - order.index(a)) - 2
            end, bulge = self.bands[b][0] + 14 * (4 - span), 26 + 26 * span
            self.arrows.append(
                f'<path class="thick" d="M{x} {start:g}C{x + bulge} {start:g} {x + bulge} {end:g} {x + 2} {end:g}"/>'
            )
            self.front.append(
                f'<text class="count" x="{x + 0.76 * bulge + 3:g}" y="{(start + end) / 2 + 4:g}">{count}</text>'
            )


def read() -> tuple[Layers, dict[str, list[str]], set[Edge]]:
    """Layers from pyproject.toml; lines with the files of every sub-package, and imports, from the source."""
    settings = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))["tool"]["importlinter"]
    graph = grimp.build_graph(*settings["root_packages"], cache_dir=None)
    imports = {(a, b) for a in graph.modules for b in graph.find_modules_directly_imported_by(a)}
    files: dict[str, list[str]] = defaultdict(list)
    for module in sorted(graph.modules):
        if module.count(".") >= 2:
            files[room_of(module)].append(module.split(".", 2)[2])
    lines = {room: textwrap.wrap(",  ".join(names), FILE_COLUMNS) for room, names in files.items()}
    return layers_of(settings["contracts"]), lines, imports


def main(out: Path) -> int:
    """Write the picture, or tell what is wrong with the imports and write none."""
    layers, files, imports = read()
    wrong = faults(imports, layers)
    for sentence in wrong:
        print(f"error: {sentence}", file=sys.stderr)
    if wrong:
        return 1
    out.parent.mkdir(parents=True, exist_ok=True)
    out.write_text(Drawing(layers, files, imports).svg(), encoding="utf-8")
    return 0


if __name__ == "__main__":
    sys.path.insert(0, str(ROOT))
    parser = argparse.ArgumentParser(description="Draw the layers as the imports are.")
    parser.add_argument("out", type=Path, help="the picture, SVG")
    sys.exit(main(parser.parse_args().out))
