# Frames rendered of the datasets' own models -> registrations that encoders are pretrained on.
from gpca.frames.source import RENDERED, VIRTUAL, VIRTUAL_TESTED

SCENES = REAL_WORLD["scenes"]
TABLES = {name: (REAL_WORLD["virtual"] or SCENES)[name] for name in ("count", "views")}
OBJECTS = {VIRTUAL: (REAL_WORLD["virtual"] or {}).get("objects"), VIRTUAL_TESTED: "all"}


wildcard_constraints:
    virtual="|".join(OBJECTS),


use rule render_scenes as render_models with:
    input:
        **FRAMES_FROM,
        splits=split_file("scenes"),
        code=code_files("gpca.steps.scenes"),
    output:
        out=directory("<results>/scenes/{virtual}"),
    log:
        "<logs>/scenes/{virtual}.log",
    benchmark:
        "<benchmarks>/scenes/{virtual}.tsv"
    params:
        settings=lambda wildcards: as_json(
            {
                **SCENES,
                **TABLES,
                "datasets": REAL_WORLD["datasets"],
                "role": config["splits"]["role"],
                "rendered": OBJECTS[wildcards.virtual],
            }
        ),
        source="{virtual}",
        folders=DATA_FOLDERS,


use rule instances as virtual_instances with:
    input:
        scenes="<results>/scenes/{virtual}",
        code=code_files("gpca.steps.instances"),
    output:
        instances="<results>/instances/{virtual}.npz",
        objects="<results>/objects/{virtual}.npz",
    log:
        "<logs>/instances/{virtual}.log",
    benchmark:
        "<benchmarks>/instances/{virtual}.tsv"
    params:
        settings=as_json({"initial_pose": {"form": "true_pose"}}),
        source="{virtual}",
        name="{virtual}",
        folders={},
        surface_points=config["objects"]["surface_points"],


use rule register_frames as register_virtual_frames with:
    input:
        instances="<results>/instances/{virtual}.npz",
        objects="<results>/objects/{virtual}.npz",
        code=code_files("gpca.steps.frame_registrations"),
    output:
        registrations="<results>/registrations/{virtual}/seed{seed}.npz",
        poses="<results>/poses/{virtual}/seed{seed}.csv",
        timings="<results>/timings/{virtual}/icp/seed{{seed}}.csv",
    log:
        "<logs>/registrations/{virtual}/seed{seed}.log",
    benchmark:
        "<benchmarks>/registrations/{virtual}/seed{seed}.tsv"
    params:
        settings=as_json(
            config["registrations"]
            | {
                "train": (REAL_WORLD["virtual"] or REAL_WORLD)["train"],
                "test": 3,  # of no use: only training samples are pretrained on
                "test_share": 0.05,
                "occluders": REAL_WORLD["occluders"],
            }
        ),
        source="{virtual}",
        name="{virtual}",
