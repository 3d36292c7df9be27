"""Table-top scenes of resting objects, seen by the virtual camera and written as a BOP dataset."""

from __future__ import annotations

import json
from collections.abc import Iterable, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Annotated, Any

import numpy as np
from scipy.spatial.transform import Rotation

from gpca.errors import InputError
from gpca.io.files import whole_folder
from gpca.objects.bop import find_symmetries
from gpca.objects.camera import TABLE_M, Camera, DepthNoise, MeshScene, direction, look_at, shade, table
from gpca.objects.canonical import canonical_cloud, diameter
from gpca.objects.surface import Surface
from gpca.process.progress import progress
from gpca.rigid import inverse, rigid_motion, transform
from gpca.seeds import generator
from gpca.settings import Bounds, Count, Distinct, require_ascending

FLAT = 1e-9  # volume of the convex hull in diameters cubed; that of a sheet of paper is 1e-4


def stable_poses(surface: Surface) -> tuple[np.ndarray, np.ndarray]:
    """Return the poses (n, 4, 4) in which a solid of uniform density rests on z = 0, and their probabilities (n,)."""
    import trimesh
    from trimesh.util import diagonal_dot

    mesh = trimesh.Trimesh(surface.vertices_m, surface.faces, process=False)
    with np.errstate(invalid="ignore", divide="ignore"):  # what is flat or open may enclose no volume
        hull, center_m = mesh.convex_hull, mesh.center_mass
    if hull.volume < FLAT * diameter(surface.vertices_m, surface.name) ** 3:
        raise InputError(f"object '{surface.name}'", "is flat and cannot be stood on a table", "leave it out")
    # That of an open surface may be anywhere. By the test that trimesh repeats until it is passed, is it inside?
    if not np.all(diagonal_dot(center_m - hull.triangles_center, hull.face_normals) < 0):
        center_m = hull.center_mass
    return trimesh.poses.compute_stable_poses(mesh, center_mass=center_m, sigma=0.0, threshold=0.0)


def rest(poses_n: np.ndarray, probabilities_n: np.ndarray, random: np.random.Generator) -> np.ndarray:
    """Draw one of the stable poses and turn it about the vertical."""
    chosen = poses_n[random.choice(len(poses_n), p=probabilities_n / probabilities_n.sum())]
    return rigid_motion(Rotation.from_euler("z", random.uniform(0, 2 * np.pi)).as_matrix()) @ chosen


DEPTH_SCALE = 0.1  # millimeters per unit of the depth images
Distance = Annotated[float, Bounds(minimum=0.2, maximum=10)]  # in meters
Elevation = Annotated[float, Bounds(minimum=0, maximum=89)]  # in degrees
TABLE_COLOR = (0.72, 0.65, 0.55)


@dataclass(frozen=True)
class SceneSettings:
    """Settings of scenes: the objects on the table, and the cameras."""

    families: Distinct[str] = ("ycb",)  # of procedural objects; none for objects of another kind
    count: Annotated[int, Bounds(minimum=2)] = 12  # of scenes
    views: Count = 4  # frames of each scene
    objects: tuple[Count, Count] = (4, 8)  # range of their number in a scene
    distance_m: tuple[Distance, Distance] = (0.6, 0.9)  # from the camera to the middle of the objects
    elevation_deg: tuple[Elevation, Elevation] = (15.0, 50.0)  # above the table; the azimuth goes all around
    gap_m: Annotated[float, Bounds(minimum=0, maximum=1)] = 0.01  # least between two outlines on the table
    camera: Camera = field(default_factory=Camera)
    noise: DepthNoise = field(default_factory=DepthNoise)

    def __post_init__(self) -> None:
        require_ascending("scenes ", self, "objects", "distance_m", "elevation_deg")


@dataclass(frozen=True)
class Placed:
    """An object on the table: its number among the models, from 0, and its pose."""

    model: int
    T_world_object: np.ndarray


def write_scenes(surfaces: Iterable[Surface], source: str, settings: SceneSettings, folder: str | Path) -> None:
    """Write models/ and test/{scene}/ in the layout of BOP; random numbers are named by source, scene and view."""
    import trimesh

    folder = Path(folder)
    surfaces = [center(surface) for surface in surfaces]
    resting = [stable_poses(surface) for surface in surfaces]
    with whole_folder(folder) as partial:
        (partial / "models").mkdir()
        info = {}
        for number, surface in enumerate(surfaces, start=1):
            mesh = trimesh.Trimesh(1e3 * surface.vertices_m, surface.faces, process=False)
            mesh.export(partial / f"models/obj_{number:06d}.ply")
            cloud_m, _, diameter_m = canonical_cloud(surface, source, 4096)
            info[number] = {
                "name": surface.name,
                "diameter": 1e3 * diameter(surface.vertices_m, surface.name),
                **find_symmetries(cloud_m, diameter_m),
            }
        (partial / "models/models_info.json").write_text(json.dumps(info, indent=1) + "\n", encoding="utf-8")
        for scene in progress(range(settings.count), f"scenes of {source}"):
            standing = lay_table(surfaces, settings, source, scene, resting)
            middle_m = np.mean([object_.T_world_object[:3, 3] for object_ in standing], axis=0)
            # The cameras are on a hemisphere about the middle of the objects.
            random = generator(source, "views", scene)
            turn, views = random.uniform(0, 2 * np.pi), []
            for view in range(settings.views):
                azimuth = turn + 2 * np.pi * (view + random.uniform(-0.3, 0.3)) / settings.views
                elevation = np.deg2rad(random.uniform(*settings.elevation_deg))
                target_m = middle_m + np.append(random.uniform(-0.03, 0.03, size=2), 0.0)
                eye_m = target_m + random.uniform(*settings.distance_m) * direction(azimuth, elevation)
                views.append(look_at(eye_m, target_m))
            _write_scene(partial / f"test/{scene:06d}", surfaces, standing, views, settings, (source, scene))


def lay_table(
    surfaces: list[Surface],
    settings: SceneSettings,
    source: str,
    scene: int,
    resting: Sequence[tuple[np.ndarray, np.ndarray]],
) -> list[Placed]:
    """Stand objects on the table z = 0, each in a stable pose drawn by its probability, close but not touching."""
    from shapely import MultiPoint
    from shapely.affinity import translate

    random = generator(source, "scene", scene)
    count = min(int(random.integers(settings.objects[0], settings.objects[1] + 1)), len(surfaces))
    standing: list[Placed] = []
    outlines: list[Any] = []
    for model in random.permutation(len(surfaces))[:count]:
        poses_n, probabilities_n = resting[model]
        T_world_object = rest(poses_n, probabilities_n, random)
        flat_m = transform(T_world_object, surfaces[model].vertices_m)[:, :2]
        flat_center_m = (flat_m.min(axis=0) + flat_m.max(axis=0)) / 2
        outline = MultiPoint(flat_m - flat_center_m).convex_hull
        outward = direction(random.uniform(0, 2 * np.pi), 0.0)[:2]
        ways = (distance_m * outward for distance_m in np.arange(0, TABLE_M, 0.005))
        free = (way for way in ways if all(translate(outline, *way).distance(o) >= settings.gap_m for o in outlines))
        if (at := next(free, None)) is None:
            fault = f"there is no room for {count} objects {settings.gap_m} m apart"
            raise InputError("scenes gap_m and objects", fault, "lower objects or gap_m")
        T_world_object[:2, 3] += at - flat_center_m
        outlines.append(translate(outline, *at))
        standing.append(Placed(int(model), T_world_object))
    return standing


def center(surface: Surface) -> Surface:
    """Return the surface with its bounding box's center at the origin."""
    center_m = (surface.vertices_m.min(axis=0) + surface.vertices_m.max(axis=0)) / 2
    return Surface(surface.name, surface.vertices_m - center_m, surface.faces)


def _write_scene(folder: Path, surfaces, standing: list[Placed], views, settings: SceneSettings, axes: tuple) -> None:
    from PIL import Image

    placed = [(p.T_world_object, surfaces[p.model]) for p in standing]
    meshes = [(transform(T_world_object, surface.vertices_m), surface.triangles) for T_world_object, surface in placed]
    scene = MeshScene([*meshes, table()])
    colors_M_3 = np.array([*(model_color(p.model, len(surfaces)) for p in standing), TABLE_COLOR])
    for name in ("depth", "rgb", "mask_visib"):
        (folder / name).mkdir(parents=True)
    camera_json: dict[int, dict] = {}
    truth_json: dict[int, list[dict]] = {}
    for image, T_world_camera in enumerate(views):
        view = scene.look(settings.camera, T_world_camera)
        depth_m = settings.noise.measure(view, generator(*axes, "depth", image))
        depth_units = np.rint(1e3 * depth_m / DEPTH_SCALE).clip(0, 65535).astype(np.uint16)
        Image.fromarray(depth_units).save(folder / f"depth/{image:06d}.png")
        Image.fromarray(shade(view, colors_M_3, T_world_camera)).save(folder / f"rgb/{image:06d}.png")
        truth_json[image] = []
        for n, object_ in enumerate(standing):
            mask = np.where(view.mesh == n, 255, 0).astype(np.uint8)
            Image.fromarray(mask).save(folder / f"mask_visib/{image:06d}_{n:06d}.png")
            T_camera_object = inverse(T_world_camera) @ object_.T_world_object
            rotation, translation_mm = T_camera_object[:3, :3].ravel().tolist(), (1e3 * T_camera_object[:3, 3]).tolist()
            pose = {"cam_R_m2c": rotation, "cam_t_m2c": translation_mm}
            truth_json[image].append({"obj_id": object_.model + 1, **pose})
        camera_json[image] = {"cam_K": settings.camera.matrix_3_3.ravel().tolist(), "depth_scale": DEPTH_SCALE}
    for name, content in (("camera", camera_json), ("gt", truth_json)):
        (folder / f"scene_{name}.json").write_text(json.dumps(content, indent=1) + "\n", encoding="utf-8")


def model_color(model: int, count: int) -> tuple[float, float, float]:
    from colorsys import hsv_to_rgb

    return hsv_to_rgb(model * 0.618034 % 1, 0.55 if model % 2 else 0.75, 0.85)
