import math

import numpy as np
import pytest
import trimesh
from scipy.spatial import ConvexHull
from scipy.spatial.distance import pdist

from gpca.errors import InputError
from gpca.objects.procedural import FAMILIES, surfaces
from gpca.objects.shapes import cups, linemod, solids

PUBLISHED_DIAMETERS_MM = {  # models_info.json of BOP's lm
    "ape": 102.099,
    "benchvise": 247.506,
    "camera": 172.492,
    "can": 201.404,
    "cat": 154.546,
    "driller": 261.472,
    "duck": 108.999,
    "eggbox": 164.628,
    "glue": 175.889,
    "holepuncher": 145.543,
    "iron": 278.078,
    "lamp": 282.601,
    "phone": 212.358,
}


@pytest.fixture(scope="module")
def built():
    """The objects of every family."""
    return {family: list(surfaces(family)) for family in FAMILIES}


def as_mesh(surface):
    return trimesh.Trimesh(surface.vertices_m, surface.faces, process=False)


@pytest.mark.parametrize("family", FAMILIES)
def test_every_object_is_one_closed_solid_of_a_table_top_s_size(built, family):
    objects = built[family]
    assert len({surface.name for surface in objects}) == len(objects) > 0
    for surface in objects:
        mesh = as_mesh(surface)
        assert mesh.is_watertight and mesh.is_winding_consistent and mesh.volume > 0, surface.name
        assert mesh.body_count == 1, surface.name
        assert mesh.extents.min() > 0.008 and mesh.extents.max() < 0.4, (surface.name, mesh.extents)
        assert len(mesh.faces) < 25_000, surface.name
        assert surface.vertices_m.dtype == np.float64 and surface.faces.dtype == np.int64


@pytest.mark.parametrize("family", FAMILIES)
def test_building_twice_gives_identical_meshes(built, family):
    for first, second in zip(built[family], surfaces(family), strict=True):
        assert np.array_equal(first.vertices_m, second.vertices_m), first.name
        assert np.array_equal(first.faces, second.faces), first.name


def test_linemod_has_the_published_diameters_and_about_the_published_extents(built):
    objects = built["linemod"]
    assert [surface.name for surface in objects] == list(PUBLISHED_DIAMETERS_MM)
    for surface in objects:
        corners = surface.vertices_m[ConvexHull(surface.vertices_m).vertices]
        assert 1000 * pdist(corners).max() == pytest.approx(PUBLISHED_DIAMETERS_MM[surface.name], rel=0.01)
        extents_mm = 1000 * np.ptp(surface.vertices_m, axis=0)
        assert extents_mm == pytest.approx(np.array(linemod.DRAWN[surface.name][1]), rel=0.11), surface.name


def test_cups_are_hollow_and_open_at_the_top(built):
    objects = built["coffee_cup"]
    for surface in objects:
        mesh = as_mesh(surface)
        assert mesh.volume < 0.4 * mesh.convex_hull.volume, surface.name
        spec = cups.CUPS[surface.name]
        floor, top = spec.floor, spec.profile[-1][1] + 5
        probe = solids.move(solids.cylinder(10, top - floor - 0.3, (0, 0, (top + floor + 0.3) / 2)), scale=0.001)
        assert solids.difference(probe, mesh).volume == pytest.approx(probe.volume), surface.name
        disc = solids.move(solids.cylinder(10, 0.5 * floor, (0, 0, 0.65 * floor)), scale=0.001)
        assert solids.intersection(disc, mesh).volume == pytest.approx(disc.volume), surface.name


def test_handles_can_be_held(built):
    for surface in built["coffee_cup"]:
        holes = 1 - as_mesh(surface).euler_number // 2  # genus
        spec = cups.CUPS[surface.name]
        assert holes == (spec.handles if spec.handle else 0), surface.name


def test_at_least_12_distinct_cups(built):
    objects = built["coffee_cup"]
    lengths_m = np.array([[*as_mesh(each).extents, as_mesh(each).volume ** (1 / 3)] for each in objects])
    assert len(objects) >= 12
    assert pdist(lengths_m).min() > 0.003


def test_unknown_family_is_refused_at_the_call():
    with pytest.raises(InputError, match=r"'teapots'.*coffee_cup, linemod, ycb"):
        surfaces("teapots")


def test_primitives_have_the_volumes_of_the_textbook():
    assert solids.box((1, 2, 3)).volume == pytest.approx(6)
    assert solids.cylinder(1, 2, axis="x").volume == pytest.approx(2 * math.pi, rel=0.01)
    assert solids.cylinder(2, 3, top=1).volume == pytest.approx(7 * math.pi, rel=0.01)
    assert solids.ellipsoid((1, 2, 3)).volume == pytest.approx(8 * math.pi, rel=0.01)
    ring = solids.revolve([(2, 0), (3, 0), (3, 1), (2, 1)])
    assert ring.volume == pytest.approx(2 * math.pi * 2.5, rel=0.01)  # Pappus
    assert solids.tube([(0, 0, 0), (1, 2, 2)], 0.5).volume == pytest.approx(0.75 * math.pi, rel=0.01)
    strap = solids.tube([(0, 0, 0), (0, 0, 3)], 0.5, side=(0, 1, 0), aspect=2)
    assert strap.extents == pytest.approx([1, 2, 3], rel=0.01)
    square = [(0, 0), (1, 0), (1, 1), (0, 1)]
    assert solids.extrude(square[::-1], 2).volume == pytest.approx(2)  # either winding
    assert solids.loft([[(x, y, z) for x, y in square] for z in (0, 1)]).volume == pytest.approx(1)


def test_rounding_takes_the_edges_and_keeps_the_extents():
    assert solids.box((2, 3, 4), (1, 1, 1), 0.5).bounds == pytest.approx(
        np.array([[0, -0.5, -1], [2, 2.5, 3]]), abs=1e-6
    )
    corner = [(0, 0), (4, 0), (4, 1), (1, 1), (1, 4), (0, 4)]
    upright, all_round = solids.extrude(corner, 1, 0.2), solids.extrude(corner, 1, 0.2, 0.2)
    assert upright.extents == pytest.approx([4, 4, 1], rel=0.01)
    assert all_round.extents == pytest.approx([4, 4, 1], rel=0.01)
    # Five corners lose, and one inner corner gains, (1 − π/4) r² each.
    assert upright.volume == pytest.approx(7 - 4 * (1 - math.pi / 4) * 0.04, rel=0.001)
    assert all_round.volume < upright.volume


def test_booleans_and_blend():
    one, other = solids.box((1, 1, 1)), solids.box((1, 1, 1), (0.5, 0, 0))
    assert solids.union(one, other).volume == pytest.approx(1.5)
    assert solids.difference(one, other).volume == pytest.approx(0.5)
    assert solids.intersection(one, other).volume == pytest.approx(0.5)
    assert solids.hull(one, solids.move(one, (2, 0, 0))).volume == pytest.approx(3)
    balls = [solids.ellipsoid(1), solids.ellipsoid(1, (1.5, 0, 0))]
    smooth, sharp = solids.blend(*balls, edge=0.15, rounds=5), solids.union(*balls)
    assert smooth.volume == pytest.approx(sharp.volume, rel=0.02)
    assert smooth.face_adjacency_angles.max() < 0.7 * sharp.face_adjacency_angles.max()


def test_an_empty_solid_is_an_error_and_not_an_empty_mesh():
    with pytest.raises(ValueError, match="nothing is left"):
        solids.intersection(solids.box((1, 1, 1)), solids.box((1, 1, 1), (5, 0, 0)))


def test_moved_turns_about_fixed_axes_then_shifts_and_leaves_the_original():
    bar = solids.box((4, 2, 1))
    turned = solids.move(bar, (10, 0, 0), (90, 0, 90), scale=2)  # x→y, y→z (about x), then about z
    assert turned.bounds == pytest.approx(np.array([[9, -4, -2], [11, 4, 2]]))
    assert bar.extents == pytest.approx([4, 2, 1])


def test_scaled_to():
    bar = solids.box((4, 2, 1))
    assert solids.scale_to(bar, (1, 2, 3)).extents == pytest.approx([1, 2, 3])
    assert pdist(solids.scale_to(bar, diameter=0.1).vertices).max() == pytest.approx(0.1)
