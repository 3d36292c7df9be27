"""Stand-ins for the 13 usual LINEMOD objects: drawn by hand after their looks, sized by their published dimensions.

These are not the scans. Diameters and extents (mm) are those of `models_info.json` of the BOP edition of LINEMOD
(Hinterstoisser et al., ACCV 2012; Hodaň et al., ECCV 2018); axes as there, x to the front, z up. Each shape is drawn in
millimeters with its foot near z = 0, stretched to the extents and then scaled evenly to the exact diameter, which
leaves its extents within 11 % of the published ones.
"""

from __future__ import annotations

from collections.abc import Callable
from functools import partial

import numpy as np
import trimesh

from gpca.objects.shapes.solids import (
    blend,
    box,
    cylinder,
    difference,
    ellipsoid,
    extrude,
    hull,
    intersection,
    loft,
    move,
    revolve,
    scale_to,
    tube,
    union,
)

BOTH = (-1, 1)  # the two sides of what is symmetric in y


def ape() -> trimesh.Trimesh:
    """Build a sitting gorilla, hands on its knees."""
    parts = [ellipsoid((25, 29, 34), (-8, 0, 36)), ellipsoid((22, 24, 22), (4, 0, 25)), ellipsoid(18, (0, 0, 73))]
    parts += [
        ellipsoid((8, 14, 5), (13, 0, 78)),
        ellipsoid((10, 12, 9), (16, 0, 66)),
        ellipsoid((4, 6, 3), (25, 0, 70)),
    ]
    for y in BOTH:
        parts.append(tube([(-6, y * 14, 16), (18, y * 30, 22), (32, y * 22, 6)], [15, 12, 9]))
        parts.append(ellipsoid((13, 7, 6), (36, y * 21, 6)))
        parts.append(tube([(-6, y * 20, 56), (-2, y * 37, 36), (24, y * 27, 28)], [12, 10, 7]))
        parts += [ellipsoid(9, (25, y * 27, 29)), ellipsoid((4, 4, 7), (-2, y * 19, 75))]
    eyes = [ellipsoid(3, (16.5, y * 6, 73)) for y in BOTH]
    return union(blend(*parts, edge=4, rounds=5), *eyes)


def benchvise() -> trimesh.Trimesh:
    """Build a vise on a turntable: fixed jaw with anvil, sliding jaw, screw, tommy bar."""
    base = revolve(
        [(0, 0), (60, 0), (60, 10), (52, 16), (38, 22), (32, 40), (26, 50), (26, 58), (36, 62), (36, 74), (0, 74)]
    )
    lugs = [hull(cylinder(16, 10, (0, y * 48, 5)), box((40, 20, 10), (0, y * 20, 5))) for y in BOTH]
    holes = [cylinder(6, 30, (0, y * 52, 5)) for y in BOTH]
    fixed = [(-75, 72), (-75, 118), (-62, 130), (-30, 132), (-30, 176), (0, 176), (0, 72)]
    sliding = [(30, 96), (30, 176), (58, 176), (66, 148), (74, 136), (74, 90), (40, 90)]
    blocks = [move(extrude(side, 56, 2), (0, 28, 0), (90, 0, 0)) for side in (fixed, sliding)]
    jaws = [box((7, 84, 32), (x, 0, 164), 1.5) for x in (3, 27)]
    bar = [box((118, 30, 24), (20, 0, 98), 3), cylinder(11, 150, (20, 0, 120), "x")]
    screw = [cylinder(14, 30, (85, 0, 120), "x"), cylinder(11, 30, (98, 0, 120), "x")]
    handle = [cylinder(4.5, 110, (103, 0, 118)), *(ellipsoid(8, (103, 0, z)) for z in (63, 173))]
    horn = tube([(-60, 0, 110), (-88, 0, 116), (-108, 0, 122)], [15, 12, 5])
    return union(difference(union(base, *lugs), *holes), *blocks, *jaws, *bar, *screw, *handle, horn)


def camera() -> trimesh.Trimesh:
    """Build a reflex camera with its lens toward x: grip, prism, dial, shutter button, eyecup, screen."""
    body = hull(box((40, 128, 60), (0, 0, 36), 8), box((30, 104, 76), (0, 0, 40), 8))
    grip = hull(cylinder(14, 74, (14, -56, 39)), box((20, 24, 76), (-4, -58, 39), 6))
    prism = hull(box((44, 62, 10), (4, 0, 74), 4), box((30, 30, 10), (6, 0, 94), 4))
    lens = [(0, 0), (35, 0), (35, 14), (32, 16), (32, 40), (34, 42), (34, 66), (32, 68), (32, 86), (29, 88)]
    lens += [(27, 78), (24, 70)]
    glass = [(22 * np.cos(a), 66 + 8 * np.sin(a)) for a in np.linspace(0, np.pi / 2, 8)]
    barrel = move(revolve(lens + glass), (12, 0, 40), (0, 90, 0))
    details = [cylinder(10, 8, (-4, 50, 80)), cylinder(6, 7, (14, -56, 78)), box((14, 18, 4), (-6, 0, 98))]
    eyecup = difference(box((14, 34, 20), (-22, 0, 80), 4), box((10, 22, 11), (-30, 0, 80), 2))
    screen = difference(box((6, 68, 46), (-21, 6, 36), 2), box((4, 60, 38), (-25, 6, 36)))
    buttons = [cylinder(4, 6, (-20, -44, z), "x") for z in (20, 34, 62)] + [cylinder(9, 5, (-20, -44, 48), "x")]
    return union(body, grip, prism, barrel, *details, eyecup, screen, *buttons)


def can() -> trimesh.Trimesh:
    """Build a watering can, open half at the top: spout with rose toward -y, handle at the back, bow above."""
    outline = [(0, 0), (50, 0), (50, 4), (48, 6), (48, 24), (50, 26), (48, 28), (48, 84), (50, 86), (48, 88)]
    body = revolve([*outline, (48, 112), (50, 114), (50, 118), (0, 118)])
    spout = tube([(0, -40, 22), (0, -66, 62), (0, -82, 108)], [13, 10, 8])
    rose = move(revolve([(0, -8), (8, -8), (20, 18), (20, 22), (0, 26)]), (0, -84, 113), (26, 0, 0))
    back = tube([(0, 42, 98), (0, 68, 104), (0, 84, 84), (0, 76, 54), (0, 42, 34)], 6, side=(1, 0, 0), aspect=1.5)
    bow = tube(
        [(-44, 0, 100), (-46, 0, 140), (-30, 0, 178), (0, 0, 192), (30, 0, 178), (46, 0, 140), (44, 0, 100)],
        6.5,
        aspect=1.4,
    )
    solid = union(body, spout, rose, back)
    inside = intersection(
        cylinder(45, 200, (0, 0, 104)), union(cylinder(45, 102, (0, 0, 55)), box((100, 50, 200), (0, 33, 100)))
    )
    return union(difference(solid, inside), bow)


def cat() -> trimesh.Trimesh:
    """Build a kitten standing along y, tail up, head turned toward x."""
    head = [ellipsoid((26, 29, 25)), ellipsoid((11, 14, 10), (19, 0, -9)), ellipsoid((4, 5, 3), (30, 0, -4))]
    for y in BOTH:
        head.append(
            tube([(-2, y * 15, 14), (-2, y * 22, 28), (-3, y * 27, 41)], [13, 9, 2], side=(1, 0, 0), aspect=0.6)
        )
        head.append(ellipsoid((5, 6, 7), (22, y * 10, 5)))
    head = [move(part, (4, 36, 78), (0, 0, 40)) for part in head]
    body = [ellipsoid((18, 37, 19), (0, -12, 44)), ellipsoid((17, 18, 22), (1, 16, 52))]
    for x in BOTH:
        body.append(tube([(x * 10, 18, 42), (x * 13, 24, 20), (x * 14, 24, 6)], [11, 8.5, 8]))
        body.append(tube([(x * 10, -34, 42), (x * 15, -40, 22), (x * 14, -34, 6)], [14, 10, 8]))
        body += [ellipsoid((10, 13, 7), (x * 14, y, 6)) for y in (29, -29)]
    tail = tube([(0, -42, 52), (-2, -58, 66), (-2, -62, 88), (-1, -56, 104)], [8, 6.5, 6, 4])
    return blend(*head, *body, tail, edge=4.5, rounds=5)


def driller() -> trimesh.Trimesh:
    """Build a cordless driller: chuck toward x, pistol grip, trigger, battery foot."""
    motor = [
        (0, 0),
        (22, 0),
        (29, 6),
        (32, 20),
        (32, 84),
        (30, 90),
        (30, 118),
        (26, 122),
        (26, 128),
        (24, 130),
        (0, 130),
    ]
    chuck = [(0, 126), (21, 126), (22, 130), (22, 152), (20, 156), (10, 182), (7, 186), (0, 186)]
    head = move(union(revolve(motor), revolve(chuck), cylinder(3, 24, (0, 0, 194))), (-70, 0, 172), (0, 90, 0))
    ribs = [box((3, 40, 66), (x, 0, 172), 1) for x in (-52, -44, -36)]
    grip = tube([(-6, 0, 160), (-14, 0, 100), (-18, 0, 40)], [27, 21, 24], side=(1, 0, 0), aspect=1.15)
    trigger = hull(box((14, 14, 30), (22, 0, 128), 4), box((10, 14, 14), (12, 0, 110), 4))
    foot = hull(box((96, 70, 18), (-4, 0, 16), 6), box((70, 56, 36), (-10, 0, 24), 8))
    latches = [box((24, 8, 14), (-6, y * 34, 18), 3) for y in BOTH]
    return union(head, *ribs, grip, trigger, foot, *latches)


def duck() -> trimesh.Trimesh:
    """Build a rubber duck."""
    parts = [
        ellipsoid((42, 35, 27), (-2, 0, 26)),
        ellipsoid((24, 27, 22), (12, 0, 34)),
        ellipsoid((23, 22, 22), (14, 0, 63)),
    ]
    parts.append(tube([(-20, 0, 26), (-42, 0, 36), (-53, 0, 50)], [22, 13, 3], aspect=1.3))
    parts += [ellipsoid((24, 7, 13), (-12, y * 32, 32)) for y in BOTH]
    parts += [tube([(-14, y * 34, 34), (-30, y * 34, 38), (-40, y * 32, 44)], [8, 6, 2]) for y in BOTH]
    parts += [
        tube([(28, 0, 61), (42, 0, 60), (52, 0, 64)], [6, 5, 3], aspect=2.6),
        ellipsoid((14, 11, 3.5), (34, 0, 54)),
    ]
    eyes = [ellipsoid(3.5, (31, y * 10, 70)) for y in BOTH]
    floor = box((200, 200, 20), (0, 0, -6))
    return difference(union(blend(*parts, edge=4, rounds=4), *eyes), floor)


def eggbox() -> trimesh.Trimesh:
    """Build a closed box for two rows of three eggs: cups below, rim, bevelled lid with bulges above."""
    nests = [(x, y) for x in (-48, 0, 48) for y in (-25, 25)]
    cups = [move(revolve([(0, 0), (15, 0), (19, 4), (26, 36), (0, 36)]), (x, y, 0)) for x, y in nests]
    lower = [*cups, box((120, 74, 16), (0, 0, 28))]
    rim = move(extrude(_rectangle(150, 107), 5, 26), (0, 0, 35))
    lid = hull(move(extrude(_rectangle(144, 100), 4, 24), (0, 0, 38)), box((112, 68, 10), (0, 0, 63), 4))
    bulges = [ellipsoid((25, 25, 27), (x * 1.02, y * 1.02, 40)) for x, y in nests]
    top = blend(lid, *bulges, edge=6, rounds=3)
    label = box((70, 44, 2), (0, 0, 68), 0.8)
    return union(blend(*lower, edge=6, rounds=3), rim, top, label, box((16, 8, 10), (0, 54, 34), 2))


def glue() -> trimesh.Trimesh:
    """Build a flat glue bottle with sloping shoulders, a nub at the side and a stepped nozzle."""
    half = [(30, 0), (37, 4), (38, 40), (36, 66), (30, 90), (20, 118), (14, 126)]
    outline = half + [(-y, z) for y, z in reversed(half)]
    bottle = move(extrude(outline, 37, 4, 8), (-18.5, 0, 0), (90, 0, 90))
    nub = hull(*(cylinder(r, 14, (0, y, z), "x") for r, y, z in ((6, -30, 104), (5, -18, 96), (4, -18, 112))))
    nozzle = [(0, 118), (13, 118), (13, 130), (11, 132), (11, 142), (8, 145), (5.5, 166), (5.5, 172), (0, 173)]
    ribs = [cylinder(1.4, 10, (12.6 * np.cos(a), 12.6 * np.sin(a), 125)) for a in np.arange(16) * np.pi / 8]
    panel = [difference(box((3, 46, 54), (x * 18.5, 0, 40), 1), box((9, 40, 48), (x * 18.5, 0, 40))) for x in BOTH]
    return union(bottle, nub, revolve(nozzle), *ribs, *panel)


def holepuncher() -> trimesh.Trimesh:
    """Build an office hole puncher: chip tray, cheeks, two punches, broad lever with a slot."""
    tray = union(box((96, 106, 9), (0, 0, 4.5), 3), box((60, 96, 14), (-10, 0, 14), 3))
    paper_slot = box((46, 120, 3), (22, 0, 15))
    cheek = [(-40, 8), (-40, 36), (-28, 48), (-8, 44), (18, 22), (20, 8)]
    cheeks = [move(extrude(cheek, 8, 3), (0, 4 + y * 42, 0), (90, 0, 0)) for y in BOTH]
    punches = [cylinder(6, 44, (8, y * 28, 30)) for y in BOTH]
    springs = [revolve([(6, z - 1.5), (9, z - 1), (9, z + 1), (6, z + 1.5)]) for z in (26, 31, 36, 41)]
    springs = [move(spring, (8, y * 28, 0)) for spring in springs for y in BOTH]
    axle = [cylinder(4, 100, (-30, 0, 36), "y")]
    flanges = [box((84, 8, 20), (0, y * 44, -8), 3) for y in BOTH]
    lever = union(box((104, 96, 8), (10, 0, 0), 3.5), box((12, 96, 18), (58, 0, -4), 5), *flanges)
    lever = move(difference(lever, box((10, 34, 60), (28, 0, 0), 4)), (-4, 0, 62), (0, -28, 0))
    return union(difference(tray, paper_slot), *cheeks, *punches, *springs, *axle, lever)


def iron() -> trimesh.Trimesh:
    """Build a clothes iron, tip toward x: sole, water tank, looped handle, dial, spray nozzle, cord."""

    def outline(length: float, width: float, back: float, z: float) -> np.ndarray:
        turn = np.linspace(0, 2 * np.pi, 96, endpoint=False)
        point = (1 + np.cos(turn)) / 2
        y = width / 2 * np.sign(np.sin(turn)) * np.abs(np.sin(turn)) ** 0.55 * (1 - point**1.6) ** 0.75 * 1.1
        return np.stack([back + length * point, y, np.full(96, z)], axis=-1)

    sole = loft([outline(236, 118, -118, 0), outline(238, 118, -119, 6)])
    levels = [(226, 112, -116, 5), (224, 110, -116, 22), (214, 102, -114, 34), (192, 88, -111, 46), (160, 66, -106, 60)]
    tank = loft([outline(*level) for level in levels])
    loop = [(70, 0, 38), (62, 0, 76), (30, 0, 108), (-20, 0, 119), (-72, 0, 112), (-98, 0, 82), (-98, 0, 40)]
    handle = tube(loop, [19, 16, 14, 14, 14, 16, 20])
    dial = union(cylinder(22, 14, (-12, 0, 64)), box((40, 5, 10), (-12, 0, 70), 1.5))
    buttons = [ellipsoid((10, 7, 6), (48, 0, 106)), ellipsoid((9, 6, 6), (24, 0, 120))]
    nozzle = [cylinder(7, 26, (84, 0, 58), "x"), cylinder(3.5, 34, (86, 0, 58), "x")]
    cord = tube([(-90, 0, 104), (-108, 0, 118), (-124, 0, 141)], [9, 6, 4.5])
    return union(sole, tank, handle, dial, *buttons, *nozzle, cord)


def lamp() -> trimesh.Trimesh:
    """Build a desk spotlight: forked foot, leaning post, cone shade open to the front with its bulb inside."""
    fork = [box((130, 24, 12), (-30, y * 26, 6), 3) for y in BOTH]
    foot = [*fork, box((56, 76, 14), (16, 0, 7), 3)]
    post = hull(box((34, 54, 4), (14, 0, 12), 1), box((16, 34, 4), (0, 0, 106), 1))
    fin = hull(cylinder(12, 16, (0, 0, 112), "y"), box((18, 16, 10), (0, 0, 132)))
    shade = [(0, -66), (20, -66), (24, -62), (25, -20), (30, -4), (48, 36), (58, 66), (58, 74), (55, 74)]
    shade += [(45, 38), (26, 0), (0, 0)]
    bulb = [(0, -6), (11, -6), (11, 8), (13, 12)]
    bulb += [(22 * np.cos(a), 32 + 22 * np.sin(a)) for a in np.linspace(-0.9, np.pi / 2, 12)]
    slits = [move(box((8, 3, 20), (24, 0, -44)), rotation_xyz_deg=(0, 0, turn)) for turn in range(0, 360, 45)]
    rings = [revolve([(20, z), (27, z), (27, z + 4), (20, z + 4)]) for z in (-26, -16)]
    head = union(difference(revolve(shade), *slits), revolve(bulb), *rings)
    return union(*foot, post, fin, move(head, (4, 0, 152), (0, 100, 0)))


def phone() -> trimesh.Trimesh:
    """Build a cordless telephone standing in its cradle: keypad, display, earpiece slots."""
    base = hull(extrude(_rectangle(74, 147), 14, 30), box((40, 116, 18), (-16, 4, 38), 8))
    keys = [box((9, 12, 5), (24, y, z), 2) for y in (-14, 0, 14) for z in (26, 40, 54, 68)]
    body = union(box((28, 52, 158), (8, 0, 79), 10), cylinder(8, 5, (22, 0, 88), "x"), *keys)
    slots = [box((8, 18, 2.4), (22, 0, z)) for z in (139, 144, 149)]
    handset = difference(body, box((8, 36, 30), (22, 0, 116), 2), *slots)
    handset = move(handset, (-8, -40, 16), (0, -14, 0))
    dial = [cylinder(9, 20, (8, 36, 34)), *(box((8, 12, 4), (-16, y, 47), 1.5) for y in (20, 48))]
    return union(base, handset, *dial)


def _rectangle(x: float, y: float) -> list[tuple[float, float]]:
    return [(-x / 2, -y / 2), (x / 2, -y / 2), (x / 2, y / 2), (-x / 2, y / 2)]


DRAWN = {  # name: (drawing, extents mm, diameter mm)
    "ape": (ape, (75.869, 77.599, 91.769), 102.099),
    "benchvise": (benchvise, (215.670, 121.856, 219.410), 247.506),
    "camera": (camera, (136.659, 143.030, 100.497), 172.492),
    "can": (can, (100.792, 181.796, 193.734), 201.404),
    "cat": (cat, (67.011, 127.633, 117.457), 154.546),
    "driller": (driller, (229.476, 75.471, 208.002), 261.472),
    "duck": (duck, (104.429, 77.408, 85.697), 108.999),
    "eggbox": (eggbox, (150.185, 107.075, 69.241), 164.628),
    "glue": (glue, (36.721, 77.866, 172.816), 175.889),
    "holepuncher": (holepuncher, (100.888, 108.497, 90.800), 145.543),
    "iron": (iron, (258.226, 118.482, 141.132), 278.078),
    "lamp": (lamp, (203.146, 117.753, 213.116), 282.601),
    "phone": (phone, (93.918, 147.433, 184.747), 212.358),
}


def build(name: str) -> trimesh.Trimesh:
    """Return the mesh of one object in meters, with its foot at z = 0."""
    draw, extents_mm, diameter_mm = DRAWN[name]
    mesh = scale_to(draw(), np.multiply(extents_mm, 0.001), diameter_mm * 0.001)
    return move(mesh, (0, 0, -mesh.bounds[0, 2]))


OBJECTS: dict[str, Callable[[], trimesh.Trimesh]] = {name: partial(build, name) for name in DRAWN}
