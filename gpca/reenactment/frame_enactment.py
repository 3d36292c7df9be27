"""Re-enactments of registrations of depth frames: the frames' own counterfactuals, at hypotheses of the true pose."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace

import numpy as np

from gpca.causes.dataset import Causes
from gpca.causes.descriptors import observed_pair
from gpca.causes.frames import subjects_of
from gpca.causes.settings import CauseSettings
from gpca.errors import InputError
from gpca.frames.camera import MeshScene
from gpca.frames.instances import Instances
from gpca.frames.starts import Starts
from gpca.objects.canonical import ObjectClouds
from gpca.process.progress import progress
from gpca.reenactment.dataset import Reenactments, row_of
from gpca.reenactment.enactment import Enactment, register, start_twists
from gpca.reenactment.frame_hypotheses import find_frame_hypotheses
from gpca.reenactment.frame_view import FrameView, KnownObject
from gpca.reenactment.settings import ReenactmentSettings
from gpca.seeds import generator


def reenact_frames(
    causes: Causes,
    starts: Starts,
    instances: Instances,
    objects: ObjectClouds,
    meshes: Mapping[int, MeshScene],
    settings: ReenactmentSettings,
    truth: CauseSettings,
) -> Reenactments:
    """Return the re-enactments of every row.

    Of the instances it reads pixels, camera and what the dataset says of symmetries; of the causes, both clouds, the
    initial pose and what registrations found.

    Args:
        causes: as :func:`gpca.causes.frames.measure_frames` returns them.
        starts: of these rows, in the same order.
        meshes: as for that function.
        truth: how counterfactuals are registered, and the limits of the states.

    Raises:
        InputError: the starts are of other rows.
    """
    registrations = causes.registrations
    of_object = instances.object_index[starts.instance] if len(starts) == len(causes) else np.array([])
    if not np.array_equal(of_object, registrations.object_index):
        fault = "are of other registrations than the causes"
        raise InputError("starts of frames", fault, "regenerate both from the same config")
    known = {
        subject.index: KnownObject(subject, meshes[subject.index])
        for subject in subjects_of(instances, starts.instance, objects)
    }

    rows = []
    for row in progress(range(len(causes)), "re-enactments of frames"):
        i = int(starts.instance[row])
        pair = observed_pair(causes, row, *(registrations.axes or ()), "reenactment")
        own = known[int(instances.object_index[i])]
        view = FrameView(pair, own, instances.camera_3_3[i], instances.pixels_of(i), starts.T_camera_object_init[row])
        rows.append(row_of(reenact_frame(view, settings, truth), pair, settings, truth))
    return Reenactments.of_rows(rows, truth, registrations)


def reenact_frame(view: FrameView, settings: ReenactmentSettings, truth: CauseSettings) -> list[Enactment]:
    """Find hypotheses of the true pose in a depth frame and enact each, the most probable first.

    As in the truth of frames, a run without any correspondence stays where it started.
    """
    random = generator(*view.pair.axes, "hypotheses")
    hypotheses = find_frame_hypotheses(view, settings, random)
    xi_n_6 = start_twists(view.pair.axes, truth)
    enactments = []
    for hypothesis in hypotheses:
        candidate = view.candidate(hypothesis.T, random)
        outliers = float((hypothesis.inlier_N <= 0.5).mean())
        candidate = replace(candidate, severity=candidate.severity | {"outliers": outliers})
        errors = view.known.subject.errors
        enactments.append(register(hypothesis, candidate, errors, xi_n_6, truth, misses=True))
    return enactments
