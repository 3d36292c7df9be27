"""How tests damage the tiny dataset, and how the step that reads it is called."""

import json
from pathlib import Path

from PIL import Image

SCENE = Path("tiny/test/000001")
CAMERA, TRUTH = SCENE / "scene_camera.json", SCENE / "scene_gt.json"
DEPTH, MASK = SCENE / "depth/000000.png", SCENE / "mask_visib/000000_000001.png"
FILES = ["--instances", "instances.npz", "--objects", "objects.npz", "--surface-points", "4096"]


def instances(settings=None, scenes="tiny"):
    """Return the arguments of the step ``instances`` in a folder that holds the tiny dataset."""
    given = settings or {"initial_pose": {"form": "true_pose"}}
    where = ["--scenes", scenes] if scenes else []
    return ["instances", "--source", "tiny", "--settings", json.dumps(given), *where, *FILES]


def edit(path, change):
    """Change what a JSON file holds in place."""
    content = json.loads(path.read_text(encoding="utf-8"))
    change(content)
    path.write_text(json.dumps(content), encoding="utf-8")


def save(path, pixels):
    """Write an image."""
    Image.fromarray(pixels).save(path)
