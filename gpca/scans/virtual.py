"""Virtual scenes: furnished rooms and compound objects, scanned by the virtual depth camera from several places."""

from collections.abc import Iterator

import numpy as np

from gpca.objects.camera import Camera, DepthNoise, MeshScene, look_at
from gpca.objects.procedural import box, cylinder, ellipsoid, mesh_of
from gpca.scans.pair import Kind
from gpca.scans.scene import Scan, ScannedScene
from gpca.seeds import generator

FIRST_OF_DEVELOPMENT = 100
ROOM_CAMERA = Camera(160, 120, 142.5)  # every fourth pixel of a Kinect
OBJECT_CAMERA = Camera(140, 140, 285.0)  # every second pixel around the object
ROOM_NOISE, OBJECT_NOISE = DepthNoise(scale=0.5), DepthNoise()
TURN_DEG = 16.0  # of the camera between two scans of a room
DISTANCE_M = 0.6  # of the camera from an object
WALL_M = 0.1

Mesh = tuple[np.ndarray, np.ndarray]


def scenes(rooms: int, objects: int, views: int, development: bool) -> Iterator[ScannedScene]:
    """Yield this many rooms, then this many objects, each with the same number of scans."""
    first = FIRST_OF_DEVELOPMENT if development else 0
    for number in range(first, first + rooms):
        yield room(f"room_{number}", views)
    for number in range(first, first + objects):
        yield compound(f"object_{number}", views)


def room(name: str, views: int) -> ScannedScene:
    random = generator("virtual scans", name)
    extent_3 = random.uniform((3.5, 3.5, 2.4), (6.0, 5.0, 3.0))
    meshes = MeshScene(_furnished(extent_3, random))
    heading_rad, places = random.uniform(0, 2 * np.pi), []
    for i in range(views):
        yaw, pitch = heading_rad + np.deg2rad(TURN_DEG) * i + random.normal(0, 0.05), random.normal(-0.2, 0.08)
        eye_m = np.array([*random.uniform(-0.35, 0.35, 2), random.uniform(1.1, 1.6)])
        ahead_3 = [np.cos(yaw) * np.cos(pitch), np.sin(yaw) * np.cos(pitch), np.sin(pitch)]
        places.append(look_at(eye_m, eye_m + ahead_3))
    return _scanned(name, "room", meshes, places, ROOM_CAMERA, ROOM_NOISE)


def compound(name: str, views: int) -> ScannedScene:
    """Return an object of this name, a few solids in one another, and its scans."""
    random, meshes = generator("virtual scans", name), []
    size_m = random.uniform(0.12, 0.22)
    for _ in range(random.integers(4, 7)):
        at_3, extent_3 = random.uniform(-0.2, 0.2, 3), random.uniform(0.2, 0.6, 3)
        match random.integers(3):
            case 0:
                solid = box(extent_3, at_3)
            case 1:
                solid = cylinder(extent_3[0] / 2, extent_3[1] + 0.2, at_3, "xyz"[random.integers(3)])
            case _:
                solid = ellipsoid(extent_3 / 2, at_3)
        vertices, faces = mesh_of(solid)
        meshes.append((vertices * size_m, faces))
    places = []
    for i in range(views):
        azimuth = 2 * np.pi * i / views + random.normal(0, 0.05)
        to_camera_3 = np.array([np.cos(azimuth), np.sin(azimuth), random.uniform(0.2, 0.7)])
        places.append(look_at(DISTANCE_M * to_camera_3 / np.linalg.norm(to_camera_3), np.zeros(3)))
    return _scanned(name, "object", MeshScene(meshes), places, OBJECT_CAMERA, OBJECT_NOISE)


def _scanned(
    name: str, kind: Kind, meshes: MeshScene, places: list[np.ndarray], camera: Camera, noise: DepthNoise
) -> ScannedScene:
    scans = {}
    for i, T_scene_camera in enumerate(places):
        depth_m = noise.measure(meshes.look(camera, T_scene_camera), generator("virtual scans", name, i))
        points_N_3 = (camera.rays() * depth_m[..., None])[depth_m > 0]
        scans[str(i)] = Scan(points_N_3, T_scene_camera, np.zeros(3))
    return ScannedScene(name, kind, scans)


def _furnished(extent_3: np.ndarray, random: np.random.Generator) -> list[Mesh]:
    """Return a room around the origin, its floor at z = 0, and furniture along its walls, none in the middle."""
    x, y, z = extent_3
    solids = [
        box((x, y, WALL_M), (0, 0, -WALL_M / 2)),
        box((x, y, WALL_M), (0, 0, z + WALL_M / 2)),
        *(box((WALL_M, y, z), (side * (x + WALL_M) / 2, 0, z / 2)) for side in (-1, 1)),
        *(box((x, WALL_M, z), (0, side * (y + WALL_M) / 2, z / 2)) for side in (-1, 1)),
    ]
    meshes = [mesh_of(solid) for solid in solids]
    for wall in range(4):
        along, across = (y, x) if wall % 2 else (x, y)
        position = -along / 2 + random.uniform(0.1, 0.4)
        while position < along / 2 - 0.5:
            width, depth = min(random.uniform(0.4, 1.2), along / 2 - position), random.uniform(0.3, 0.7)
            height = random.uniform(*((0.4, 0.9), (1.2, 2.1))[random.integers(2)])
            at_2 = np.array([position + width / 2, (across - depth) / 2])
            for solid in _furniture(at_2, np.array([width, depth, height]), random):
                vertices_m, faces = mesh_of(solid)
                meshes.append((_turned(vertices_m, wall), faces))
            position += width + random.uniform(0.1, 0.8)
    return meshes


def _furniture(at_2: np.ndarray, extent_3: np.ndarray, random: np.random.Generator) -> list:
    """Return a cupboard, a table, a bin or a chair at a place along a wall, and things that stand on it."""
    (u, v), (width, depth, height) = at_2, extent_3
    kind = random.integers(4)
    if kind == 0:
        solids = [box(extent_3, (u, v, height / 2))]
    elif kind == 1:
        height = min(height, 0.9)
        legs = [(u + a * 0.45 * width, v + b * 0.45 * depth) for a in (-1, 1) for b in (-1, 1)]
        solids = [
            box((width, depth, 0.05), (u, v, height)),
            *(box((0.06, 0.06, height), (*leg, height / 2)) for leg in legs),
        ]
    elif kind == 2:
        height = min(height, 1.4)
        solids = [cylinder(min(width, depth) / 2, height, (u, v, height / 2))]
    else:
        height = 0.45
        solids = [box((0.5, 0.5, height), (u, v, height / 2)), box((0.5, 0.1, 0.6), (u, v + 0.2, height + 0.3))]
    for _ in range(random.integers(0, 4) if height < 1.3 else 0):
        w, d, h = random.uniform(0.08, 0.3, 3)
        at = (u + random.uniform(-0.3, 0.3) * width, v + random.uniform(-0.3, 0.3) * depth, height + h / 2)
        solids.append(box((w, d, h), at) if random.integers(2) else cylinder(w / 2, h, at))
    return solids


def _turned(vertices_V_3: np.ndarray, wall: int) -> np.ndarray:
    """Return vertices after quarter turns about z, by exchanged coordinates: (x, y) becomes (-y, x)."""
    x, y, z = vertices_V_3.T
    for _ in range(wall):
        x, y = -y, x
    return np.stack([x, y, z], axis=1)
