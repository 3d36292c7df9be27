import math
from pathlib import Path

import numpy as np
import pytest

from gpca.errors import InputError
from gpca.io.arrays import save_arrays
from gpca.reporting.figures.cloud_views import view_from
from gpca.reporting.figures.contact_sheet import draw_contact_sheet
from gpca.reporting.figures.solid import Solid
from gpca.seeds import generator

ROOT = Path(__file__).parents[3]
FROM_ABOVE = view_from(-math.pi / 2, math.pi / 2)  # the eye looks down, x to the right, y up
COUNT = 6000


def _ball(radius, *axes, count=COUNT):
    normals = generator("test contact sheet", *axes).normal(size=(count, 3))
    normals /= np.linalg.norm(normals, axis=1, keepdims=True)
    return radius * normals, normals


def _square(z, normal, half=1.0):
    points = np.column_stack([generator("square", z).uniform(-half, half, (COUNT, 2)), np.full(COUNT, z)])
    return points, np.tile(normal, (COUNT, 1)).astype(float)


def _write_objects(path, names):
    clouds = [_ball(0.05 * (index + 1), index, count=200) for index in range(len(names))]
    save_arrays(
        path,
        {
            "names": np.array(names),
            "points_m": np.concatenate([points for points, _ in clouds]).astype(np.float32),
            "normals": np.concatenate([normals for _, normals in clouds]).astype(np.float32),
            "offsets": np.arange(len(names) + 1) * 200,
            "diameters_m": 0.1 * np.arange(1, len(names) + 1),
            "families": np.array(names),
            "folds": np.full(len(names), -1),
        },
    )
    return path


def render_cloud(*args):
    return Solid.of(*args).image


def test_the_nearer_of_two_surfaces_is_shown_and_points_behind_it_are_hidden():
    slanted = np.array([0.8, 0.0, 0.6])
    low = _square(0.0, [0.0, 0.0, 1.0])
    high = _square(0.3, slanted, half=0.5)
    both = tuple(np.concatenate(pair) for pair in zip(low, high, strict=True))
    upside_down = (both[0] * [1, 1, -1], both[1])
    alone = render_cloud(*low, FROM_ABOVE, 60)
    seen, hidden = render_cloud(*both, FROM_ABOVE, 60), render_cloud(*upside_down, FROM_ABOVE, 60)
    middle, border = np.s_[25:35, 25:35], np.s_[25:35, 6:10]
    assert abs(hidden[middle].mean() - alone[middle].mean()) < 0.1
    assert seen[middle].mean() < alone[middle].mean() - 0.15  # the slanted normals are darker
    assert abs(seen[border].mean() - alone[border].mean()) < 0.1
    ball = Solid.of(*_ball(0.03, "ball"), FROM_ABOVE, 40)
    assert ball.extent == pytest.approx([each * 0.03 / 0.9 for each in (-1, 1, -1, 1)], rel=0.02)
    seen = np.array([[0.0, 0.0, 0.03], [0.0, 0.0, 0.02], [0.0, 0.0, -0.03], [0.032, 0.032, -0.03], [1.0, 0.0, -1.0]])
    assert ball.hides(seen).tolist() == [False, True, True, False, False]


def test_ball_is_a_closed_disc_on_white_lit_from_above_left():
    image = render_cloud(*_ball(0.03, "ball"), view_from(0.3, 0.5), 80)
    assert image.shape == (80, 80, 3)
    assert image.min() >= 0
    assert image.max() == 1
    rows, columns = np.mgrid[:80, :80] - 39.5
    distance = np.hypot(rows, columns) / (0.45 * 80)
    solid = image.min(axis=2) < 1
    assert solid[distance < 0.9].all()
    assert not solid[distance > 1.15].any()
    assert image[22:30, 22:30].mean() > image[50:58, 50:58].mean() + 0.1


def test_unit_of_length_and_sign_of_normals_do_not_matter_and_flat_clouds_are_drawn():
    points, normals = _square(0.0, [0.0, 0.0, 1.0])
    image = render_cloud(points, normals, FROM_ABOVE, 40)
    np.testing.assert_allclose(render_cloud(1000 * points, normals, FROM_ABOVE, 40), image, atol=0.02)
    turned = render_cloud(points, -normals, FROM_ABOVE, 40)
    np.testing.assert_allclose(turned[12:28, 12:28], image[12:28, 12:28], atol=0.05)
    assert render_cloud(np.zeros((1, 3)), np.array([[0.0, 0.0, 1.0]]), FROM_ABOVE, 20).shape == (20, 20, 3)
    line = np.column_stack([np.linspace(0, 1, 50), np.zeros(50), np.zeros(50)])
    image = render_cloud(line, np.tile([0.0, 0.0, 1.0], (50, 1)), FROM_ABOVE, 40)
    assert image.min() < 1


def test_a_sheet_is_as_wide_as_the_text_and_the_same_bytes_each_time(tmp_path, same_bytes):
    objects = _write_objects(tmp_path / "balls.npz", ["025_mug", "a_ball"])
    image = same_bytes(lambda: draw_contact_sheet(objects, "Balls (procedural stand-in)"))
    assert abs(image.shape[1] - 7.16 * 100) <= 1
    assert (image[:, :, :3].min(axis=2) < 230).any()


@pytest.mark.parametrize("count", [1, 4, 13, 21, 66])
def test_no_caption_touches_another(tmp_path, monkeypatch, count):
    names = [f"{index:03d}_an_extra_large_thing_{'w' * (index % 9)}" for index in range(count)]
    objects = _write_objects(tmp_path / "many.npz", names)
    blank = Solid(np.ones((2, 2, 3)), (0, 1, 0, 1), np.ones((4, 4)), np.eye(3))
    monkeypatch.setattr(Solid, "of", lambda *cloud: blank)  # only the text matters here
    figure = draw_contact_sheet(objects, "Many things (procedural stand-in)")
    figure.draw_without_rendering()
    texts = [*figure.texts, *(axes.title for axes in figure.axes)]
    boxes = [part.get_window_extent() for part in (*texts, *figure.axes)]
    page = figure.bbox
    assert all(page.x0 <= box.x0 + 0.5 and box.x1 <= page.x1 + 0.5 and page.y0 <= box.y0 for box in boxes)
    assert len(boxes) == 2 * count + 1
    for index, first in enumerate(boxes):
        for second in boxes[index + 1 :]:
            width = min(first.x1, second.x1) - max(first.x0, second.x0)
            height = min(first.y1, second.y1) - max(first.y0, second.y0)
            assert width < 0.5 or height < 0.5  # tiles touch; a rounding error is no overlap


def test_broken_objects_file_is_refused(tmp_path):
    with pytest.raises(InputError, match="no such file"):
        draw_contact_sheet(tmp_path / "none.npz", "x")
    save_arrays(tmp_path / "half.npz", {"names": np.array(["a"])})
    with pytest.raises(InputError, match=r"half\.npz: array .* is missing"):
        draw_contact_sheet(tmp_path / "half.npz", "x")
