"""What stands around and before a board, in the picture's own px, with soft edges; and how light varies over it."""

from __future__ import annotations

import dataclasses

import numpy as np

from tests.stress.scenes import GREY, Cover


def stripes(period, deg=30.0):
    """A background of stripes."""
    c, s = np.cos(np.radians(deg)), np.sin(np.radians(deg))

    def behind(x, y, cell):
        return 0.1 + 0.6 * _wave((c * x + s * y) / period, cell / period)

    return behind


def checkers(period, deg=20.0):
    """A background of smaller checkers."""
    c, s = np.cos(np.radians(deg)), np.sin(np.radians(deg))

    def behind(x, y, cell):
        u, v = (_wave(q / period, cell / period) for q in (c * x + s * y, c * y - s * x))
        return 0.1 + 0.6 * (u * v + (1.0 - u) * (1.0 - v))

    return behind


def halftone(period, deg=45.0):
    """A background of a halftone screen, as print has it."""
    c, s = np.cos(np.radians(deg)), np.sin(np.radians(deg))

    def behind(x, y, cell):
        u, v = (2.0 * np.pi * q / period for q in (c * x + s * y, c * y - s * x))
        return np.clip(0.4 + 0.6 * (np.cos(u) + np.cos(v)), 0.08, 0.75)

    return behind


def clutter(rng):
    """A background of boxes of every grey: three layers, each with one box in each cell of a lattice of its own."""
    layers = [_boxes(rng, period) for period in (110.0, 60.0, 33.0)]

    def behind(x, y, cell):
        value = np.full(np.shape(x), GREY)
        for layer in layers:
            grey, inside = layer(x, y, cell)
            value += (grey - value) * inside
        return value

    return behind


def _boxes(rng, period, count=32):
    """Grey and cover of one layer; its boxes repeat after `count` cells."""
    turn = rng.uniform(0.0, np.pi)
    angles, greys = rng.uniform(0.0, np.pi, (count, count)), rng.uniform(0.02, 0.9, (count, count))
    halves = rng.uniform(0.05, 0.33, (2, count, count)) * period

    def layer(x, y, cell):
        u, v = _turned(x, y, turn)
        i, j = np.floor(u / period).astype(int), np.floor(v / period).astype(int)
        at = i % count, j % count
        p, q = _turned(u - (i + 0.5) * period, v - (j + 0.5) * period, angles[at])
        depth = np.minimum(halves[0][at] - np.abs(p), halves[1][at] - np.abs(q))
        return greys[at], np.clip(0.5 + depth / cell, 0.0, 1.0)

    return layer


def _turned(x, y, angle):
    c, s = np.cos(angle), np.sin(angle)
    return c * x + s * y, c * y - s * x


def _wave(q, width):
    """1 in even cells and 0 in odd ones."""
    depth = 0.5 - np.abs((q + 0.5) % 2.0 - 1.0)
    return np.clip(0.5 + depth / width, 0.0, 1.0)


def behind(make):
    """A kind's scene with another background."""
    return lambda scene, rng: dataclasses.replace(scene, background=make)


def cluttered(scene, rng):
    """A kind's scene before a cluttered wall, another one for each view."""
    return dataclasses.replace(scene, background=clutter(rng))


def hand(share):
    """A kind's scene with an arm that reaches in over a corner of the board, and covers about a share of its width."""

    def put(scene, rng):
        points = scene.truth()[:-1]
        middle = points.mean(axis=0)
        tip = points[rng.choice([0, scene.board.inner[0] - 1, len(points) - 1])]
        wide = share * np.ptp(points, axis=0).max()
        along = (tip - middle) / np.linalg.norm(tip - middle)

        def depth(x, y):
            dx, dy = x - tip[0], y - tip[1]
            forward, aside = dx * along[0] + dy * along[1], dy * along[0] - dx * along[1]
            return wide / 2.0 - np.hypot(np.minimum(forward + wide / 4.0, 0.0), aside)

        return dataclasses.replace(scene, covers=(Cover(depth),))

    return put


def finger(scene, rng):
    """A kind's scene with a round thing in the middle of the board."""
    points = scene.truth()[:-1]
    at = points[rng.integers(len(points))]
    radius = 0.08 * np.ptp(points, axis=0).max()
    cover = Cover(lambda x, y: radius - np.hypot(x - at[0], y - at[1]), grey=0.6)
    return dataclasses.replace(scene, covers=(cover,))


def hard_shadow(scene, rng):
    """A kind's scene of which one half is in shadow, the line across the board."""
    middle, angle = scene.truth()[:-1].mean(axis=0), rng.uniform(0.0, np.pi)
    c, s = np.cos(angle), np.sin(angle)
    cover = Cover(lambda x, y: c * (x - middle[0]) + s * (y - middle[1]), opacity=0.7)
    return dataclasses.replace(scene, covers=(cover,))


def gradient(ratio):
    """Light that falls off across the picture by a ratio."""

    def light(linear, rng):
        angle = rng.uniform(0.0, 2.0 * np.pi)
        y, x = np.indices(linear.shape) / max(linear.shape) - 0.5
        along = np.cos(angle) * x + np.sin(angle) * y
        return linear * (1.0 / ratio) ** (along + 0.5)

    return light


def vignetting(linear, rng):
    """Light that falls to a fifth in the picture's corners."""
    y, x = np.indices(linear.shape) - (np.array(linear.shape).reshape(2, 1, 1) - 1.0) / 2.0
    return linear / (1.0 + 4.0 * (x**2 + y**2) / (np.array(linear.shape) ** 2).sum() * 4.0)


def flicker(linear, rng):
    """Lamps that flicker while rows are exposed one after the other."""
    phase = rng.uniform(0.0, 2.0 * np.pi)
    return linear * (1.0 + 0.35 * np.sin(2.0 * np.pi * np.arange(len(linear)) / 90.0 + phase))[:, None]


def glare(level, share):
    """A kind's spot of reflected light somewhere on the picture's middle, soft, of a size in the picture's width."""

    def light(linear, rng):
        y, x = np.indices(linear.shape)
        height, width = linear.shape
        at = np.array([width, height]) * rng.uniform(0.35, 0.65, 2)
        return linear + level * np.exp(-0.5 * ((x - at[0]) ** 2 + (y - at[1]) ** 2) / (share * width) ** 2)

    return light


def ghost(linear, rng):
    """A weak second picture, as a window pane before the camera makes it."""
    return 0.9 * linear + 0.12 * np.roll(linear[::-1], 9, axis=1)
