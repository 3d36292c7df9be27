"""Stand-ins made by the package: a few solids in millimeters, z up, stretched to the extents that data sets list."""

from collections.abc import Callable, Iterator, Sequence
from itertools import pairwise
from typing import NamedTuple

import numpy as np
from manifold3d import CrossSection, Manifold, OpType

from gpca.errors import InputError
from gpca.objects.surface import Surface

SEGMENTS, TUBE_SEGMENTS = 64, 24
AXES = {"x": (0, 90, 0), "y": (-90, 0, 0), "z": (0, 0, 0)}  # degrees of the rotation that takes z to the axis
SIDES = (-1, 1)
Point = Sequence[float] | np.ndarray


class Shape(NamedTuple):
    """A solid in millimeters, the extents that it is stretched to, and the diameter that it is then scaled to."""

    solid: Manifold
    extents_mm: Point | None = None
    diameter_mm: float | None = None


def surfaces(family: str) -> Iterator[Surface]:
    """Yield the objects of a family as closed meshes in meters, in a fixed order; InputError for an unknown family."""
    require_family(family)
    return (_surface(name, shape) for name, shape in FAMILIES[family]().items())


def require_family(family: str) -> None:
    if family not in FAMILIES:
        raise InputError(f"family '{family}'", "no such procedural family", f"choose one of {', '.join(FAMILIES)}")


def _surface(name: str, shape: Shape) -> Surface:
    from scipy.spatial import ConvexHull
    from scipy.spatial.distance import pdist

    vertices_mm, faces = mesh_of(shape.solid)
    if shape.extents_mm is not None:
        vertices_mm = vertices_mm * (np.array(shape.extents_mm) / np.ptp(vertices_mm, axis=0))
    if shape.diameter_mm is not None:
        vertices_mm = vertices_mm * (shape.diameter_mm / pdist(vertices_mm[ConvexHull(vertices_mm).vertices]).max())
    return Surface(name, (vertices_mm - (0, 0, vertices_mm[:, 2].min())) / 1000, faces)


def mesh_of(solid: Manifold) -> tuple[np.ndarray, np.ndarray]:
    """Return the vertices (V, 3) float64 and triangles (F, 3) int64 of a solid."""
    mesh = solid.to_mesh64()
    return np.array(mesh.vert_properties[:, :3], np.float64), mesh.tri_verts.astype(np.int64)


def box(extents: Point, at: Point = (0, 0, 0)) -> Manifold:
    """Return a box of full side lengths `extents` centered at `at`."""
    return Manifold.cube(np.asarray(extents, float), center=True).translate(at)


def cylinder(
    radius: float, height: float, at: Point = (0, 0, 0), axis: str = "z", top: float | None = None
) -> Manifold:
    """Return a cylinder centered at `at` along x, y or z; `top` is the upper radius of a cone frustum."""
    body = Manifold.cylinder(height, radius, radius if top is None else top, SEGMENTS, center=True)
    return body.rotate(AXES[axis]).translate(at)


def ellipsoid(radii: float | Point, at: Point = (0, 0, 0)) -> Manifold:
    """Return an ellipsoid of semi-axes `radii` (one number: a ball) centered at `at`."""
    return Manifold.sphere(1, SEGMENTS).scale(np.broadcast_to(radii, 3)).translate(at)


def slab(extents: Point, corner: float, at: Point = (0, 0, 0)) -> Manifold:
    """Return a box whose upright edges are rounded with the radius `corner`."""
    (x, y), (u, v, w) = np.asarray(extents[:2], float) / 2 - corner, at
    return hull(*(cylinder(corner, extents[2], (u + i * x, v + j * y, w)) for i in SIDES for j in SIDES))


def revolved(profile_rz: Sequence[Point]) -> Manifold:
    """Return the solid of revolution about z of a closed profile (r, z), counterclockwise."""
    return Manifold.revolve(CrossSection([np.asarray(profile_rz, float)]), SEGMENTS)


def tube(path: Sequence[Point], radii: float | Sequence[float]) -> Manifold:
    """Return a chain of capsules through the points (K, 3) of a path, of one radius or one for each point."""
    balls_at = zip(path, np.broadcast_to(radii, len(path)), strict=True)
    balls = [Manifold.sphere(radius, TUBE_SEGMENTS).translate(at) for at, radius in balls_at]
    return union(*(hull(*ends) for ends in pairwise(balls)))


def hull(*solids: Manifold) -> Manifold:
    return Manifold.batch_hull(list(solids))


def union(*solids: Manifold) -> Manifold:
    return Manifold.batch_boolean(list(solids), OpType.Add)


class Cup(NamedTuple):
    """Dimensions of a cup in millimeters."""

    profile: tuple[tuple[float, float], ...]  # (outer radius, height) from the foot (height 0) to the rim
    wall: float = 4
    floor: float = 5
    handles: int = 1
    joints: tuple[float, float] = (20, 75)  # heights of the lower and the upper joint of each handle
    reach: float = 30  # of the handle's middle line from the wall
    grip: float = 4.5  # half its thickness


CUPS = {
    "classic_mug": Cup(((41, 0), (41, 96))),
    "diner_mug": Cup(((38, 0), (39, 25), (36.5, 50), (38, 75), (41, 88)), 7, 8, 1, (22, 66), 29, 6),
    "tapered_mug": Cup(((29, 0), (36, 50), (45, 102)), 3.5, 5, 1, (28, 82), 32, 4),
    "barrel_mug": Cup(((34, 0), (43, 30), (45, 50), (43, 70), (37, 98)), 5, 6, 1, (22, 76), 32, 5.5),
    "bowl_mug": Cup(((24, 0), (42, 20), (51, 45), (54, 78)), 4, 5, 1, (26, 66), 28, 5),
    "espresso_cup": Cup(((22, 0), (28, 26), (30, 62)), 4, 5, 1, (18, 49), 18, 3.2),
    "tea_cup": Cup(((22, 0), (25, 4), (38, 28), (44, 50), (49, 72)), 2.8, 4, 1, (24, 56), 26, 3),
    "latte_mug": Cup(((30, 0), (31, 40), (35, 90), (42, 122)), 4, 8, 1, (24, 82), 32, 5),
    "camping_mug": Cup(((42, 0), (42, 80)), 1.8, 1.8, 1, (16, 66), 27, 2),
    "stacking_cup": Cup(((33, 0), (34, 27), (41, 33), (41, 75)), 3.5, 4, 1, (38, 66), 24, 4),
    "soup_mug": Cup(((40, 0), (57, 25), (61, 50), (60, 72)), 5, 6, 2, (32, 60), 24, 5),
    "beer_stein": Cup(((46, 0), (43, 12), (41, 60), (39, 120)), 6, 10, 1, (18, 104), 40, 7),
    "paper_cup": Cup(((29, 0), (44, 110)), 1.6, 4, 0),
    "tumbler": Cup(((27, 0), (33, 15), (36, 50), (37, 88)), 4, 6, 0),
}


def _cup(cup: Cup) -> Shape:
    """Build a cup with its foot at z = 0 and its first handle toward +x."""
    radii, heights = np.array(cup.profile, float).T
    top, (low, high) = heights[-1], cup.joints
    inside = [(r - cup.wall, z) for r, z in cup.profile if z > cup.floor]
    floor_radius = np.interp(cup.floor, heights, radii) - cup.wall
    cavity = revolved([(0, cup.floor), (floor_radius, cup.floor), *inside, (inside[-1][0], top + 1), (0, top + 1)])
    solid = revolved([(0, 0), *cup.profile, (0, top)])
    for number in range(cup.handles):
        ends = np.interp(cup.joints, heights, radii) - cup.wall / 2
        out = ends.mean() + cup.reach
        xs = (ends[0], 0.9 * out, out, 0.9 * out, ends[1])
        path = [(x, 0, z) for x, z in zip(xs, (low, low, (low + high) / 2, high, high), strict=True)]
        solid += tube(path, cup.grip).rotate((0, 0, 360 * number / cup.handles))
    return Shape(solid - cavity)  # last, since handles reach into the wall


def _linemod() -> dict[str, Shape]:
    ape = ellipsoid((25, 29, 36), (-8, 0, 36)) + ellipsoid(18, (0, 0, 73)) + ellipsoid((10, 12, 9), (16, 0, 66))
    for y in SIDES:
        ape += tube([(-6, 14 * y, 16), (18, 30 * y, 22), (36, 21 * y, 8)], 10)
        ape += tube([(-6, 20 * y, 56), (-2, 37 * y, 36), (25, 27 * y, 28)], 8)
    benchvise = cylinder(60, 10, (0, 0, 5)) + cylinder(40, 80, (0, 0, 40), top=26) + box((118, 30, 24), (20, 0, 98))
    benchvise += box((45, 56, 58), (-52, 0, 101)) + box((30, 56, 104), (-15, 0, 124)) + box((36, 56, 86), (48, 0, 133))
    benchvise += cylinder(13, 150, (38, 0, 120), "x") + cylinder(5, 110, (103, 0, 118))
    benchvise += tube([(-60, 0, 112), (-104, 0, 120)], (14, 6))
    camera = box((40, 128, 76), (0, 0, 38)) + hull(box((40, 56, 4), (4, 0, 74)), box((30, 30, 4), (6, 0, 97)))
    camera += cylinder(14, 74, (14, -57, 39)) + cylinder(34, 88, (56, 0, 40), "x")
    camera -= cylinder(27, 30, (100, 0, 40), "x")
    bow = [(-46, 0, 100), (-46, 0, 140), (-30, 0, 178), (0, 0, 188), (30, 0, 178), (46, 0, 140), (46, 0, 100)]
    can = cylinder(50, 118, (0, 0, 59)) + tube([(0, -40, 22), (0, -66, 62), (0, -84, 110)], (13, 10, 14))
    can += tube([(0, 48, 98), (0, 68, 104), (0, 84, 84), (0, 76, 54), (0, 48, 34)], 6) + tube(bow, 6)
    can -= cylinder(45, 102, (0, 0, 55)) + (cylinder(45, 100, (0, 0, 150)) ^ box((100, 50, 100), (0, 33, 130)))
    cat = ellipsoid((18, 40, 20), (0, -6, 46)) + ellipsoid((26, 29, 25), (4, 36, 80)) + ellipsoid(11, (24, 36, 72))
    cat += tube([(0, -42, 52), (-2, -56, 66), (-2, -60, 88), (-1, -54, 104)], (8, 6.5, 6, 4))
    for x in SIDES:
        cat += cylinder(11, 28, (17 * x, 36, 104), top=2)
        cat += tube([(8 * x, 22, 44), (13 * x, 22, 8)], (11, 8)) + tube([(8 * x, -32, 44), (13 * x, -32, 8)], (11, 8))
    driller = cylinder(32, 130, (-5, 0, 172), "x") + cylinder(23, 60, (85, 0, 172), "x", top=9)
    driller += box((46, 46, 140), (-12, 0, 90)) + box((14, 20, 34), (16, 0, 128)) + slab((100, 70, 36), 12, (-6, 0, 18))
    duck = ellipsoid((42, 35, 27), (-2, 0, 26)) + ellipsoid(22, (14, 0, 62)) + ellipsoid((16, 11, 5), (38, 0, 58))
    duck += tube([(-20, 0, 26), (-42, 0, 36), (-52, 0, 48)], (20, 12, 4))
    duck -= box((200, 200, 20), (0, 0, -6))
    eggbox = slab((132, 90, 36), 20, (0, 0, 18)) + slab((150, 107, 6), 26, (0, 0, 38)) + box((70, 44, 6), (0, 0, 64))
    eggbox += union(*(ellipsoid((25, 25, 29), (x, y, 40)) for x in (-47, 0, 47) for y in (-25, 25)))
    glue = hull(box((37, 76, 66), (0, 0, 33)), box((30, 28, 4), (0, 0, 122)))
    glue += cylinder(13, 30, (0, 0, 130)) + cylinder(9, 34, (0, 0, 156), top=5.5)
    lever = box((98, 96, 10)) + box((80, 92, 16), (0, 0, -8)) - box((10, 34, 60), (28, 0, 0))
    holepuncher = box((96, 106, 9), (0, 0, 4.5)) + box((60, 96, 14), (-10, 0, 14)) + cylinder(4, 100, (-30, 0, 36), "y")
    holepuncher += lever.rotate((0, -28, 0)).translate((-4, 0, 62))
    for y in SIDES:
        holepuncher += box((50, 8, 40), (-16, 42 * y, 24)) + cylinder(6, 44, (8, 28 * y, 30))
    loop = [(66, 0, 38), (58, 0, 76), (26, 0, 106), (-20, 0, 117), (-72, 0, 110), (-94, 0, 82), (-94, 0, 40)]
    iron = hull(cylinder(59, 8, (-59, 0, 4)), cylinder(8, 8, (110, 0, 4)), box((150, 12, 60), (-30, 0, 30)))
    iron += tube(loop, 14) + tube([(-90, 0, 104), (-108, 0, 118), (-124, 0, 138)], (9, 6, 4))
    shade = cylinder(26, 140, (0, 0, 4), top=58) - cylinder(8, 100, (0, 0, 34), top=55) + ellipsoid(18, (0, 0, -8))
    lamp = box((56, 76, 14), (16, 0, 7)) + hull(box((34, 54, 4), (14, 0, 12)), box((18, 34, 4), (0, 0, 130)))
    lamp += box((130, 24, 12), (-30, 26, 6)) + box((130, 24, 12), (-30, -26, 6))
    lamp += shade.rotate((0, 100, 0)).translate((4, 0, 152))
    handset = box((28, 52, 158), (8, 0, 79)) - box((10, 36, 30), (22, 0, 116)) + box((8, 40, 54), (24, 0, 47))
    phone = slab((74, 147, 14), 30, (0, 0, 7)) + box((40, 116, 36), (-16, 4, 29)) + cylinder(9, 20, (8, 36, 34))
    phone += handset.rotate((0, -14, 0)).translate((-8, -40, 16))
    return {
        "ape": Shape(ape, (75.869, 77.599, 91.769), 102.099),
        "benchvise": Shape(benchvise, (215.670, 121.856, 219.410), 247.506),
        "camera": Shape(camera, (136.659, 143.030, 100.497), 172.492),
        "can": Shape(can, (100.792, 181.796, 193.734), 201.404),
        "cat": Shape(cat, (67.011, 127.633, 117.457), 154.546),
        "driller": Shape(driller, (229.476, 75.471, 208.002), 261.472),
        "duck": Shape(duck, (104.429, 77.408, 85.697), 108.999),
        "eggbox": Shape(eggbox, (150.185, 107.075, 69.241), 164.628),
        "glue": Shape(glue, (36.721, 77.866, 172.816), 175.889),
        "holepuncher": Shape(holepuncher, (100.888, 108.497, 90.800), 145.543),
        "iron": Shape(iron, (258.226, 118.482, 141.132), 278.078),
        "lamp": Shape(lamp, (203.146, 117.753, 213.116), 282.601),
        "phone": Shape(phone, (93.918, 147.433, 184.747), 212.358),
    }


def _ycb() -> dict[str, Shape]:
    def can(radius: float, height: float) -> Manifold:
        rims = cylinder(radius, 3, (0, 0, 1.5)) + cylinder(radius, 3, (0, 0, height - 1.5))
        lids = cylinder(radius - 4, 4) + cylinder(radius - 4, 8, (0, 0, height))
        return cylinder(radius - 1.6, height, (0, 0, height / 2)) + rims - lids

    def clamp(jaw: float, width: float, length: float, spread: float, grip: float) -> Manifold:
        solid = cylinder(1.2 * grip, 4 * grip, (jaw, 0, 0))
        for y in SIDES:
            solid += tube([(0, 0, 0), (0.4 * jaw, y * width, 0), (0.7 * jaw, y * width, 0), (jaw, 0, 0)], grip)
            solid += tube([(jaw, 0, 0), (length, y * spread, 0)], grip)
        return solid

    def ring(x: float, y: float, at: Point) -> Manifold:
        return (cylinder(1, 15).scale((x, y, 1)) - cylinder(1, 30).scale((x - 7, y - 7, 1))).translate(at)

    mustard = [(0, 0), (44, 0), (48, 8), (43, 45), (41, 65), (47, 105), (47, 130), (32, 151), (20, 160), (20, 172)]
    mustard += [(12, 174), (10, 191), (0, 191)]
    banana = [(63, 2), (58, 10), (48, 27), (32, 55), (21, 88), (18, 120), (23, 150), (34, 173), (48, 185), (66, 197)]
    handle = [(62, 0, 218), (90, 0, 218), (98, 0, 200), (99, 0, 170), (95, 0, 125), (84, 0, 95), (56, 0, 80)]
    pitcher = cylinder(54, 240, (0, 0, 120), top=66.5) + tube(handle, 8)
    pitcher += hull(cylinder(9, 4, (-74, 0, 238)), cylinder(28, 4, (-38, 0, 238)), ellipsoid(3, (-58, 0, 195)))
    bleach = hull(slab((102, 67, 20), 30, (0, 0, 10)), slab((80, 48, 4), 22, (8, 0, 205)), cylinder(15, 4, (9, 0, 230)))
    bowl = [(0, 0), (44, 0), (58, 15), (70, 35), (80.5, 55), (77, 55), (67, 35), (55.5, 15), (42, 4), (0, 4)]
    mug = cylinder(40.5, 81.3, (0, 0, 40.65)) + cylinder(46.5, 3, (0, 0, 79.8))
    mug += tube([(39, 0, 66), (54, 0, 68), (66, 0, 58), (66, 0, 30), (53, 0, 18), (39, 0, 16)], 4.5)
    drill = cylinder(10, 64, (28, 32, 28), "y", top=21) + cylinder(26, 112, (30, 110, 28), "y")
    drill += hull(ellipsoid((22, 24, 20), (44, 138, 28)), ellipsoid((10, 19, 16), (160, 130, 28)))
    drill += box((14, 30, 18), (64, 104, 28)) + slab((30, 100, 57), 9, (172, 107, 28))
    drill += cylinder(19, 26, (32, 174, 28), "y")
    scissors = ring(21.5, 29.5, (25, 30, 7.5)) + ring(19, 33, (66, 41, 7.5))
    scissors += tube([(28, 57, 7.5), (36, 106, 8)], (6, 7)) + tube([(57, 72, 7.5), (34, 106, 8)], (6, 7))
    scissors += hull(box((18, 4, 3), (34, 104, 7.5)), box((4, 2, 3), (6, 197, 7.5)))
    scissors += hull(box((18, 4, 3), (36, 104, 5)), box((4, 2, 3), (12, 190, 5)))
    meat_can = slab((101.5, 57.4, 84), 20) - slab((94, 50, 8), 17, (0, 0, 42))
    holes = union(*(cylinder(6, 80, (0, y, 0)) for y in (-20, 0, 20)))
    return {
        "002_master_chef_can": Shape(can(51, 140), (102.3, 102.3, 140.2)),
        "003_cracker_box": Shape(box((71.9, 163.7, 213.4))),
        "004_sugar_box": Shape(box((48, 93.2, 176))),
        "005_tomato_soup_can": Shape(can(34, 102), (67.6, 67.6, 101.9)),
        "006_mustard_bottle": Shape(revolved(mustard), (95.9, 58.2, 191.3)),
        "007_tuna_fish_can": Shape(can(42.6, 33.5), (85.3, 85.3, 33.5)),
        "008_pudding_box": Shape(box((112.7, 89.8, 38.9))),
        "009_gelatin_box": Shape(box((73.1, 89.1, 30.1))),
        "010_potted_meat_can": Shape(meat_can, (101.5, 57.4, 83.5)),
        "011_banana": Shape(
            tube([(x, y, 0) for x, y in banana], (4, 8, 12.5, 16.5, 18, 18.3, 17.5, 14.5, 8.5, 5)), (69, 197.6, 36.7)
        ),
        "019_pitcher_base": Shape(pitcher, (187, 133, 237)),
        "021_bleach_cleanser": Shape(bleach + cylinder(14, 30, (9, 0, 236)), (102.4, 67.7, 250.6)),
        "024_bowl": Shape(revolved(bowl), (161, 161, 55)),
        "025_mug": Shape(mug - cylinder(38.4, 100, (0, 0, 53)), (117, 93, 81.3)),
        "035_power_drill": Shape(drill, (184.2, 187.1, 57.3)),
        "036_wood_block": Shape(box((90, 90, 206))),
        "037_scissors": Shape(scissors, (88.1, 197.7, 15.7)),
        "040_large_marker": Shape(cylinder(9.5, 88, axis="y") + cylinder(8, 120.8, (0, -2, 0), "y"), (19, 120.8, 19)),
        "051_large_clamp": Shape(clamp(80, 30, 156, 50, 10.5), (165.5, 121.2, 39.2)),
        "052_extra_large_clamp": Shape(clamp(102, 38, 194, 74, 9), (202.4, 165.2, 36.3)),
        "061_foam_brick": Shape(box((52, 77.6, 51.2)) - holes),
    }


FAMILIES: dict[str, Callable[[], dict[str, Shape]]] = {
    "coffee_cup": lambda: {name: _cup(cup) for name, cup in CUPS.items()},
    "linemod": _linemod,
    "ycb": _ycb,
}
