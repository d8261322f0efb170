"""One picture of each kind side by side, with the true points, for eyes."""

from __future__ import annotations

import cv2
import numpy as np

WIDE, HIGH, COLUMNS = 400, 300, 8


def keep_tile(kind, shot, folder):
    """One kind's picture, small, in a folder."""
    folder.mkdir(parents=True, exist_ok=True)
    cv2.imwrite(str(folder / f"{kind.name}.png"), _tile(kind, shot))


def write_sheet(kinds, folder, path):
    """All tiles that are there, in one PNG."""
    tiles = [cv2.imread(str(folder / f"{kind.name}.png")) for kind in kinds if (folder / f"{kind.name}.png").is_file()]
    if not tiles:
        return
    tiles += [np.zeros_like(tiles[0])] * (-len(tiles) % COLUMNS)
    rows = [np.hstack(tiles[i : i + COLUMNS]) for i in range(0, len(tiles), COLUMNS)]
    cv2.imwrite(str(path), np.vstack(rows))


def _tile(kind, shot):
    image = shot.image if shot.image.dtype == np.uint8 else (shot.image / 257).astype(np.uint8)
    scale = min(WIDE / image.shape[1], HIGH / image.shape[0])
    small = cv2.resize(image, None, fx=scale, fy=scale, interpolation=cv2.INTER_AREA)
    small = small if small.ndim == 3 else cv2.cvtColor(small, cv2.COLOR_GRAY2BGR)
    tile = np.zeros((HIGH, WIDE, 3), np.uint8)
    tile[: small.shape[0], : small.shape[1]] = small
    for i, (at, seen, hidden) in enumerate(zip(shot.truth, shot.seen, shot.hidden, strict=True)):
        colour = (0, 200, 0) if seen else (0, 0, 255) if hidden else (0, 220, 255)
        colour = (255, 128, 0) if i == 0 else colour
        if np.all(np.isfinite(at)) and np.all(np.abs(at) < 1e4):
            centre = tuple(int(v) for v in np.rint(16 * ((at + 0.5) * scale - 0.5)))
            cv2.circle(tile, centre, 2 * 16, colour, 1, cv2.LINE_AA, 4)
    cv2.putText(tile, kind.name, (4, HIGH - 6), cv2.FONT_HERSHEY_SIMPLEX, 0.5, (0, 255, 255), 1, cv2.LINE_AA)
    return tile
