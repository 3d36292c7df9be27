"""Settings of the registrations of scans whose causes are measured: nothing here needs the code that measures them."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Annotated

from gpca.causes.settings import CloudPoints
from gpca.settings import Bounds, Count, Positive

OBJECTS, SCANS = LEARNED = ("objects", "scans")  # where an explainer has learned


@dataclass(frozen=True)
class ScanICP:
    """How ICP runs on scans; lengths are relative to the usual size of a scan.

    Attributes:
        correspondence_distance: largest distance of a correspondence.
        max_iterations: at most.
    """

    correspondence_distance: Annotated[float, Bounds(exclusiveMinimum=0, maximum=10)] = 0.10
    max_iterations: Count = 50


@dataclass(frozen=True)
class ScanSamples:
    """Which registrations are measured.

    Attributes:
        points: of each scan, at most.
        pairs: of each scene and stratum of overlap, at most.
        most_pairs: of a data set, at most.
        ladder_starts: rungs of ``scans.ladder`` that are drawn for each pair; none that starts at the truth.
        global_start: whether the pose that ``scans.global_start`` finds is a start as well.
        times: with so many times the sensor's noise added, one registration of each pair, in turns.
        icp: how ICP runs.
        folds: in so many parts the scenes are dealt at most, each of which is unseen once.
    """

    points: CloudPoints = 512
    pairs: Count = 8
    most_pairs: Count = 100
    ladder_starts: Count = 2
    global_start: bool = True
    times: tuple[Positive, ...] = (1.0, 2.0, 3.0)
    icp: ScanICP = field(default_factory=ScanICP)
    folds: Annotated[int, Bounds(minimum=2)] = 10
