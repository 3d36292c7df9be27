"""Stand-ins for the 21 objects of YCB-Video, built from solids with the size of the real ones.

Shapes are drawn in millimeters, z up, each lying or standing as in the YCB scans, and then stretched to the sizes of
the published google_16k scans (tightest upright box; handles along x). The caliper table of Calli et al. (IEEE RAM,
September 2015) is some millimeters smaller, since real cardboard bulges. No label, no fine relief; the
pitcher stands without the lid that its scan wears.
"""

from __future__ import annotations

from collections.abc import Callable
from functools import partial

import numpy as np
import trimesh
from scipy.interpolate import PchipInterpolator

from gpca.objects.shapes.solids import (
    box,
    cylinder,
    difference,
    ellipsoid,
    extrude,
    hull,
    loft,
    move,
    revolve,
    scale_to,
    tube,
    union,
)


def _can(radius: float, height: float, ribs: int = 0) -> trimesh.Trimesh:
    """Build a tin can: a seam around both ends, lids sunk below it, ribs around the body."""
    body, lid = radius - 1.6, 4.0
    side = []
    for z in np.linspace(0, height, ribs + 2)[1:-1]:
        side += [(body, z - 3), (body - 0.6, z - 1.5), (body - 0.6, z + 1.5), (body, z + 3)]
    seam = [(radius - 3.5, 0), (radius - 0.8, 0), (radius, 0.8), (radius, 3), (body, 4.5)]
    upper = [(r, height - z) for r, z in reversed(seam)]
    return revolve([(0, 2), (radius - 4, 2), *seam, *side, *upper, (radius - 4, height - lid), (0, height - lid)])


def _pull_tab(at: tuple[float, float, float], turn_deg: float = 0) -> trimesh.Trimesh:
    ring = revolve([(7, 0), (10.5, 0), (10.5, 2.2), (7, 2.2)])
    tab = union(ring, box((12, 8, 2.2), (12, 0, 1.1)))
    return move(tab, at, (0, 0, turn_deg))


def _rectangle(x: float, y: float) -> list[tuple[float, float]]:
    return [(-x / 2, -y / 2), (x / 2, -y / 2), (x / 2, y / 2), (-x / 2, y / 2)]


def _ellipse(x: float, y: float, at: tuple[float, float] = (0, 0), turn_deg: float = 0) -> np.ndarray:
    angle, turn = np.linspace(0, 2 * np.pi, 64, endpoint=False), np.radians(turn_deg)
    rotation = np.array([[np.cos(turn), -np.sin(turn)], [np.sin(turn), np.cos(turn)]])
    return np.stack([x * np.cos(angle), y * np.sin(angle)], axis=1) @ rotation.T + at


def _bottle(stations: list[tuple[float, float, float, float, float]]) -> trimesh.Trimesh:
    """Build a skin over superellipses, smooth in z: rows of (z, left, right, half depth, exponent; 2: ellipse)."""
    table = np.array(stations)
    heights = np.unique(np.concatenate([table[:, 0], np.linspace(table[0, 0], table[-1, 0], 60)]))
    angle = np.linspace(0, 2 * np.pi, 72, endpoint=False)
    rings = []
    outlines = PchipInterpolator(table[:, 0], table[:, 1:])(heights)
    for z, (left, right, depth, power) in zip(heights, outlines, strict=True):
        x, y = (np.sign(wave) * np.abs(wave) ** (2 / power) for wave in (np.cos(angle), np.sin(angle)))
        rings.append(np.stack([(left + right) / 2 + (right - left) / 2 * x, depth * y, np.full_like(x, z)], axis=1))
    return loft(rings)


def _potted_meat_can() -> trimesh.Trimesh:
    body = extrude(_rectangle(96, 51.5), 80, rounding=19)
    seams = [move(extrude(_rectangle(101.5, 57.4), 4, rounding=21), (0, 0, z)) for z in (0, 79.5)]
    lids = [move(extrude(_rectangle(94, 50), 9, rounding=18), (0, 0, z)) for z in (-7, 79.5)]
    return union(difference(union(body, *seams), *lids), _pull_tab((26, 6, 79), 200))


def _banana() -> trimesh.Trimesh:
    path_xy = [
        (63, 2), (58, 10), (48, 27), (32, 55), (21, 88), (18, 120), (23, 150), (34, 173), (48, 185), (60, 192),
        (66, 197),
    ]  # fmt: skip
    radii = [3.5, 8, 12.5, 16.5, 18, 18.3, 17.5, 14.5, 8.5, 5, 5.5]
    return tube([(x, y, 0) for x, y in path_xy], radii, side=(0, 0, 1), steps=96)


def _spout(inset: float) -> trimesh.Trimesh:
    """Build a pitcher's lip toward -x, shrunk by `inset` and then raised through the rim, for the cavity."""
    lip = cylinder(9 - inset, 4 + inset, (-74 + inset, 0, 238 + inset / 2))
    mouth = cylinder(28 - inset, 4 + inset, (-38 + inset, 0, 238 + inset / 2))
    return hull(lip, mouth, ellipsoid(3, (-58 + 2 * inset, 0, 195)))


def _pitcher() -> trimesh.Trimesh:
    outer = union(revolve([(0, 0), (51, 0), (54, 4), (65, 236), (66.5, 237), (66.5, 240), (0, 240)]), _spout(0))
    cavity = union(cylinder(51.5, 240, (0, 0, 124), top=63), _spout(2.5))
    path = [(62, 0, 218), (84, 0, 219), (97, 0, 206), (99, 0, 170), (95, 0, 125), (84, 0, 95), (56, 0, 80)]
    handle = tube(path, [9, 8, 7, 6.5, 6.5, 6.5, 7], aspect=1.7)
    return difference(union(outer, difference(handle, cavity)), cavity)


def _bleach_cleanser() -> trimesh.Trimesh:
    body = _bottle(
        [
            (0, 3, 99, 30, 3), (4, 0, 102, 33.8, 3), (18, 0, 102.4, 33.8, 3), (25, 5, 101.5, 31.5, 3),
            (75, 8, 101, 30, 3), (110, 12, 100.5, 28.5, 3), (145, 18, 99.5, 27, 3), (175, 26, 98, 25.5, 2.8),
            (192, 33, 95, 24, 2.6), (200, 31, 97, 24.5, 2.4), (210, 28, 98, 24, 2.2), (217, 30, 95, 22.5, 2.1),
            (226, 40, 82, 18, 2), (231, 46, 75, 14.5, 2),
        ]
    )  # fmt: skip
    cap = revolve([(0, 226), (12.5, 226), (12.5, 232), (15, 232), (15, 240), (13.5, 241), (13, 250.6), (0, 250.6)])
    return union(body, move(cap, (60.5, 0, 0)))


def _mustard_bottle() -> trimesh.Trimesh:
    sides = [
        (0, 44, 26), (5, 48, 29), (25, 47.5, 28), (45, 43, 26.5), (65, 40.5, 25.5), (85, 42.5, 26), (105, 47, 27.5),
        (118, 48, 28.7), (132, 46, 29), (143, 40.5, 28.5), (151, 32, 25), (157, 21, 20.5), (160, 19, 19),
    ]  # fmt: skip
    body = _bottle([(z, -half, half, depth, 2.8 - 0.8 * z / 160) for z, half, depth in sides])
    cap = [(0, 158), (20.5, 158), (20.5, 170), (18, 172), (12.5, 173), (11, 187), (10, 191.3), (0, 191.3)]
    return union(body, revolve(cap))


def _bowl() -> trimesh.Trimesh:
    outside = [
        (40, 0), (44.5, 1), (50, 5), (58.5, 15), (65, 25), (70, 35), (74, 45), (76, 51.5), (80.5, 52), (80.5, 55),
    ]  # fmt: skip
    inside = [(77, 55), (73.5, 51), (71.3, 45), (67.3, 35), (62, 25), (55.5, 15), (47, 6), (42, 3.5), (0, 3.5)]
    return revolve([(0, 1.5), (38, 1.5), *outside, *inside])


def _mug() -> trimesh.Trimesh:
    outside = [(0, 0), (35, 0), (39, 2), (40.5, 6), (40.5, 77), (43, 78.5), (46.5, 78.8), (46.5, 81.3)]
    cup = revolve([*outside, (42, 81.3), (38.4, 78), (38.4, 6), (36, 3), (0, 3)])
    path = [(39, 0, 66), (54, 0, 68.5), (65, 0, 60), (67, 0, 45), (63, 0, 29), (53, 0, 18), (39, 0, 14)]
    handle = tube(path, [5.5, 4.2, 3.8, 3.6, 3.8, 4.2, 5.5], aspect=1.7)
    return union(cup, difference(handle, cylinder(39.5, 100, (0, 0, 40))))


def _power_drill() -> trimesh.Trimesh:
    """Build a drill on its side: the chuck points to -y, the grip to +x, with the battery at its end."""
    spin = [(0, 0), (9, 0), (13, 4), (19, 24), (21, 26), (21, 46), (23, 50), (23, 64), (0, 64)]
    chuck = move(revolve(spin), (28, 0, 28.5), (-90, 0, 0))
    gearbox = tube(
        [(28, 52, 28.5), (29, 70, 28.5), (31, 100, 28.5), (31, 120, 28.5)], [23.5, 26, 26, 24], side=(1, 0, 0)
    )
    motor = hull(cylinder(25, 70, (31, 140, 28.5), axis="y"), cylinder(19, 90, (32, 140, 28.5), axis="y"))
    grip = hull(ellipsoid((22, 24, 20), (44, 138, 28.5)), ellipsoid((10, 19, 16), (100, 130, 28.5)))
    grip_end = hull(ellipsoid((10, 19, 16), (98, 130, 28.5)), ellipsoid((10, 23, 18), (152, 130, 28.5)))
    trigger = hull(box((12, 30, 17), (56, 98, 28.5), rounding=3), box((10, 10, 15), (80, 108, 28.5), rounding=3))
    battery = hull(box((30, 103, 50), (172, 107, 28.5), rounding=7), box((20, 80, 57), (170, 107, 28.5), rounding=7))
    clutch = cylinder(26.5, 14, (29, 66, 28.5), axis="y")
    switch = box((14, 22, 57), (56, 120, 28.5), rounding=3)
    return union(chuck, gearbox, clutch, motor, grip, grip_end, trigger, switch, battery)


def _scissors() -> trimesh.Trimesh:
    """Build scissors lying flat, points to +y: two thin blades crossed at the pivot, two unequal thick finger loops."""
    blades = [
        move(extrude([(24, 96), (42, 108), (38, 120), (8, 197), (4, 198), (12, 160)], 2.8), (0, 0, 7.9)),
        move(extrude([(26, 106), (44, 100), (40, 118), (15, 190), (10, 191), (16, 160)], 2.8), (0, 0, 5.2)),
    ]
    loops = [
        difference(
            extrude(_ellipse(x, y, at, turn), 15, rounding_z=3.4),
            move(extrude(_ellipse(x - 7, y - 7, at, turn), 30), (0, 0, -5)),
        )
        for x, y, at, turn in ((21.5, 29.5, (25, 30), -4), (19, 33, (66, 41), 14))
    ]
    shanks = [
        hull(ellipsoid((6, 5, 6), (28, 57, 7.5)), ellipsoid((9, 9, 5), (38, 106, 8))),
        hull(ellipsoid((6, 5, 6), (57, 71, 7.5)), ellipsoid((9, 9, 5), (31, 106, 7))),
    ]
    return union(*blades, *loops, *shanks, cylinder(5, 12, (34, 108, 7.8)))


def _marker() -> trimesh.Trimesh:
    profile = [
        (0, 0), (4, 0), (4.3, 5), (8.6, 6), (9.4, 8), (9.5, 30), (8.8, 30.5), (8.8, 33), (9.2, 34), (9.2, 119),
        (8.6, 120.8), (5, 120.8), (5, 116), (0, 116),
    ]  # fmt: skip
    return move(revolve(profile), (0, 0, 9.5), (-90, 0, 0))


def _clamp(
    jaw: float, jaw_half: float, length: float, half_spread: float, grip: float, thick: float
) -> trimesh.Trimesh:
    """Build a spring clamp lying flat, its tip at the origin, grips toward +x.

    Args:
        jaw: distance from tip to pivot.
        jaw_half: half the width of the jaws.
        length, half_spread: where the grips end.
        grip: half the width of a grip.
        thick: thickness of jaws and grips; the pivot stands out on both sides.
    """
    upper = [(0, 0.04), (0.1, 0.2), (0.32, 0.68), (0.5, 0.95), (0.65, 1.0), (0.8, 0.88), (0.95, 0.5), (1.12, 0.3)]
    outline = np.array(upper + [(x, -y) for x, y in reversed(upper)]) * (jaw, jaw_half)
    mouth_upper = [(0.2, 0.05), (0.42, 0.38), (0.58, 0.52), (0.72, 0.46), (0.84, 0.15)]
    mouth = np.array(mouth_upper + [(x, -y) for x, y in reversed(mouth_upper)]) * (jaw, jaw_half)
    jaws = difference(
        extrude(outline, thick, rounding=2, rounding_z=4),
        move(extrude(mouth, 2 * thick, rounding=2), (0, 0, -thick / 2)),
    )
    grips = [
        hull(
            ellipsoid((grip * 1.1, grip * 1.1, thick * 0.5), (jaw * 0.98, side * grip * 0.8, thick / 2)),
            ellipsoid((grip, grip, thick * 0.46), (length - grip, side * (half_spread - grip), thick / 2)),
        )
        for side in (-1, 1)
    ]
    pivot = cylinder(grip * 1.1, thick + 11, (jaw, 0, thick / 2))
    spring = tube([(jaw, 0, thick / 2 - 1), (jaw, 0, thick / 2 + 1)], grip * 1.5)
    return union(jaws, *grips, pivot, spring)


def _foam_brick() -> trimesh.Trimesh:
    holes = [cylinder(6, 80, (0, y, 0)) for y in (-20, 0, 20)]
    return difference(box((52, 77.6, 51.2), rounding=1.5), *holes)


# name: (how it is drawn, extents x, y, z in millimeters)
_DRAWINGS: dict[str, tuple[Callable[[], trimesh.Trimesh], tuple[float, float, float]]] = {
    "002_master_chef_can": (lambda: _can(51, 140, ribs=5), (102.3, 102.3, 140.2)),
    "003_cracker_box": (lambda: box((71.9, 163.7, 213.4), rounding=2), (71.9, 163.7, 213.4)),
    "004_sugar_box": (lambda: box((48, 93.2, 176), rounding=1.5), (48, 93.2, 176)),
    "005_tomato_soup_can": (lambda: union(_can(34, 102), _pull_tab((8, 0, 97.5))), (67.6, 67.6, 101.9)),
    "006_mustard_bottle": (_mustard_bottle, (95.9, 58.2, 191.3)),
    "007_tuna_fish_can": (lambda: _can(42.6, 33.5), (85.3, 85.3, 33.5)),
    "008_pudding_box": (lambda: box((112.7, 89.8, 38.9), rounding=2.5), (112.7, 89.8, 38.9)),
    "009_gelatin_box": (lambda: box((73.1, 89.1, 30.1), rounding=1.5), (73.1, 89.1, 30.1)),
    "010_potted_meat_can": (_potted_meat_can, (101.5, 57.4, 83.5)),
    "011_banana": (_banana, (69, 197.6, 36.7)),
    "019_pitcher_base": (_pitcher, (187, 133, 237)),
    "021_bleach_cleanser": (_bleach_cleanser, (102.4, 67.7, 250.6)),
    "024_bowl": (_bowl, (161, 161, 55)),
    "025_mug": (_mug, (117, 93, 81.3)),
    "035_power_drill": (_power_drill, (184.2, 187.1, 57.3)),
    "036_wood_block": (lambda: box((90, 90, 206), rounding=1), (90, 90, 206)),
    "037_scissors": (_scissors, (88.1, 197.7, 15.7)),
    "040_large_marker": (_marker, (19, 120.8, 19)),
    "051_large_clamp": (lambda: _clamp(80, 38, 166, 60.5, 10.5, 27), (165.5, 121.2, 39.2)),
    "052_extra_large_clamp": (lambda: _clamp(102, 47, 202, 82.5, 8.5, 25), (202.4, 165.2, 36.3)),
    "061_foam_brick": (_foam_brick, (52, 77.6, 51.2)),
}


def _built(name: str) -> trimesh.Trimesh:
    draw, extents_mm = _DRAWINGS[name]
    return scale_to(draw(), np.array(extents_mm) / 1000)


OBJECTS: dict[str, Callable[[], trimesh.Trimesh]] = {name: partial(_built, name) for name in _DRAWINGS}
