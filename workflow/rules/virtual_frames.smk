# Frames rendered of the datasets' own models -> registrations that encoders are pretrained on.
SCENES = REAL_WORLD["scenes"]
TABLES = {name: (REAL_WORLD["virtual"] or SCENES)[name] for name in ("count", "views")}


use rule render_scenes as render_models with:
    input:
        **FRAMES_FROM,
        splits=split_file("scenes"),
        code=code_stamp("gpca.steps.frames:scenes"),
    output:
        out=directory(f"<results>/scenes/{VIRTUAL}"),
    log:
        f"<logs>/scenes/{VIRTUAL}.log",
    benchmark:
        f"<benchmarks>/scenes/{VIRTUAL}.tsv"
    params:
        settings=as_json(
            {
                **SCENES,
                **TABLES,
                "datasets": REAL_WORLD["datasets"],
                "role": config["splits"]["role"],
                "rendered": (REAL_WORLD["virtual"] or {}).get("objects"),
            }
        ),
        source=VIRTUAL,
        folders=DATA_FOLDERS,


use rule instances as virtual_instances with:
    input:
        scenes=f"<results>/scenes/{VIRTUAL}",
        code=code_stamp("gpca.steps.frames:instances"),
    output:
        instances=f"<results>/instances/{VIRTUAL}.npz",
        objects=f"<results>/objects/{VIRTUAL}.npz",
    log:
        f"<logs>/instances/{VIRTUAL}.log",
    benchmark:
        f"<benchmarks>/instances/{VIRTUAL}.tsv"
    params:
        settings=as_json({"initial_pose": {"form": "true_pose"}}),
        source=VIRTUAL,
        name=VIRTUAL,
        folders={},
        surface_points=config["objects"]["surface_points"],


use rule register_frames as register_virtual_frames with:
    input:
        instances=f"<results>/instances/{VIRTUAL}.npz",
        objects=f"<results>/objects/{VIRTUAL}.npz",
        code=code_stamp("gpca.steps.frames:frame_registrations"),
    output:
        registrations=f"<results>/registrations/{VIRTUAL}/seed{{seed}}.npz",
        poses=f"<results>/poses/{VIRTUAL}/seed{{seed}}.csv",
        timings=f"<results>/timings/{VIRTUAL}/icp/seed{{{{seed}}}}.csv",
    log:
        f"<logs>/registrations/{VIRTUAL}/seed{{seed}}.log",
    benchmark:
        f"<benchmarks>/registrations/{VIRTUAL}/seed{{seed}}.tsv"
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
        source=VIRTUAL,
        name=VIRTUAL,
