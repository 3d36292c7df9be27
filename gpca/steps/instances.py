"""Step ``instances``: BOP datasets -> ``instances/{source}.npz`` and the canonical clouds of their models."""

from __future__ import annotations

import sys
from argparse import ArgumentParser, Namespace
from pathlib import Path

from gpca.frames.initial_pose import InitialPoseSettings
from gpca.frames.meshes import datasets_of, files_behind
from gpca.frames.plausibility import points_on_model
from gpca.frames.reading import distinct_surfaces, read_instances, read_models, with_shared_models
from gpca.objects.canonical import sample_objects
from gpca.process.arguments import SURFACE_POINTS
from gpca.process.provenance import record_provenance
from gpca.settings import check_settings


def add_arguments(parser: ArgumentParser) -> None:
    """Declare files and names; ``--settings`` are parts of the config's section ``real_world``."""
    parser.add_argument("--source", required=True, help="name of the source, which seeds the draws")
    parser.add_argument("--name", help="name of the frames in the files, where it is another than --source")
    parser.add_argument("--scenes", type=Path, help="folder written by the step scenes, in place of datasets")
    parser.add_argument("--data-dir", help="folder with the datasets; what is there is not downloaded")
    parser.add_argument("--downloads", default="data/downloads", type=Path, help="where downloads are kept")
    parser.add_argument("--surface-points", type=SURFACE_POINTS, default=16384, help="points sampled on each model")
    parser.add_argument("--out", required=True, type=Path)
    parser.add_argument("--objects", required=True, type=Path, help="output file of the canonical clouds")


def run(options: Namespace) -> None:
    """Read models and frames, back-project the masks and find the initial poses."""
    check_settings(options.settings, "real_world")
    datasets = datasets_of(options.settings.get("datasets"), options.data_dir, options.downloads, options.scenes)
    inputs = files_behind(options.settings.get("datasets"), options.data_dir, options.scenes)
    initial_pose = InitialPoseSettings(**options.settings.get("initial_pose", {}))
    declared = {**options.settings, "surface_points": options.surface_points}
    with record_provenance([options.out, options.objects], inputs, declared):
        frames = {name: dataset.frames() for name, dataset in datasets.items()}
        models = with_shared_models({name: read_models(datasets[name], shown) for name, shown in frames.items()})
        objects = sample_objects(distinct_surfaces(models), options.source, options.surface_points)
        read = {name: (dataset, frames[name], models[name]) for name, dataset in datasets.items()}
        instances = read_instances(read, objects, initial_pose)
        named = options.name or options.source
        objects.save(options.objects, named)
        instances.save(options.out, named)
    for name in datasets:
        medians_m = points_on_model(instances, objects)[instances.dataset == name]
        print(
            f"{name}: {len(medians_m)} instances; median distance to the model under the true pose: "
            f"{1e3 * medians_m.mean():.2f} mm on average, {1e3 * medians_m.max():.2f} mm at most",
            file=sys.stderr,
        )
