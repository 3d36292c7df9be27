"""Settings of causes and of descriptors (docs/causes.md); lengths are in diameters, or the usual size of a scan."""

from __future__ import annotations

from dataclasses import asdict, dataclass, field, fields
from typing import Annotated, Literal

import numpy as np

from gpca.causes.truth import SUBSETS
from gpca.errors import InputError
from gpca.pairs.perturbation import CONCEPTS, HalfTurn, Hidden, Severities, Shift
from gpca.settings import Bounds, Count, OpenShare, Positive, PositiveShare, Share, read_settings, require_ascending
from gpca.uncertainty.settings import FEWEST_STARTS, UncertaintySettings, start_deviation

GROUPS = ("distances", "planes", "motion", "starts", "remedied", "entropy")
QUANTILES = 13  # of each distance
MOTION = (
    *("rotation", "translation", "displacement", "fitness", "inlier_rmse"),
    *("spread_rotation", "spread_translation", "log_determinant"),
)
REMEDIED = (
    *(f"error_{subset}" for subset in range(len(SUBSETS))),
    *(f"phi_{concept}" for concept in CONCEPTS),
    *(f"{what}_{subset}" for what in ("moved", "cost", "fitness") for subset in range(len(SUBSETS))),
    *("outliers", "smoothed"),
)
DENSITIES = list(range(3 * QUANTILES, 3 * QUANTILES + 6))  # of the planes: spacings, extents, numbers of points
DescribedPoints = Annotated[int, Bounds(minimum=16, maximum=65536)]  # of each cloud
CloudPoints = Annotated[int, Bounds(minimum=64, maximum=65536)]
Calls = Annotated[int, Bounds(minimum=1, maximum=1000)]
Angle = Annotated[float, Bounds(exclusiveMinimum=0, maximum=180)]  # degrees
FEWEST_POINTS = 16  # that a crop leaves of a cloud, at least; as few as Monte-Carlo ICP takes anywhere
Moved = Literal["model", "observed"]  # the cloud that ICP moves onto the other
MODEL: Moved = "model"
OBSERVED: Moved = "observed"
NOT_OF_CAUSES = ("icp", "icp_points")  # which sections of the config lack: registrations has them
OBJECTS, SCANS = "objects", "scans"  # where an explainer of scans has learned


@dataclass(frozen=True)
class FrameCauseSettings:
    """Which starts of instances are measured, and with how many points."""

    seeds: Count = 1  # the first of the run's, each with other points, starts around these and explainers
    starts: Count | None = None  # drawn of each kind, at most; None for all
    # Of the ladder of errors that the true pose is given: turns in degrees, and shifts.
    rungs: tuple[tuple[HalfTurn, Shift], ...] = ((5.0, 0.03), (15.0, 0.08), (30.0, 0.15), (60.0, 0.3))
    points: CloudPoints = 512  # of what was measured, at most, and of the model
    methods: tuple[str, ...] = ("point_to_plane", "gicp")  # whose failures from the same starts are counted too


@dataclass(frozen=True)
class CauseSeverities(Severities):
    """Ranges (low, high) of the severities, wider than those of one perturbation at a time."""

    noise: tuple[Share, Share] = (0.01, 0.08)
    rotation_deg: tuple[HalfTurn, HalfTurn] = (10.0, 90.0)
    translation: tuple[Shift, Shift] = (0.02, 0.40)
    crop: tuple[Hidden, Hidden] = (0.20, 0.75)
    outliers: tuple[Share, Share] = (0.0, 0.05)  # of the points, that noise throws anywhere in the object's cube


@dataclass(frozen=True)
class Small:
    """Largest severities where a cause is not applied: they are drawn from 0 on, and nothing is an outlier."""

    noise: Share = 0.003
    rotation_deg: HalfTurn = 5.0
    translation: Shift = 0.03
    crop: Hidden = 0.05

    def ranges(self) -> CauseSeverities:
        """Return the ranges that they are drawn from."""
        return CauseSeverities(**{name: (0.0, most) for name, most in asdict(self).items()}, outliers=(0.0, 0.0))


@dataclass(frozen=True)
class Form:
    """How the truth is generated, beside the severities; explainers learn the first of each (docs/appendix.md)."""

    occlusion: Literal["half_space", "patches", "visibility"] = "half_space"
    noise: Literal["white", "warped", "quantized"] = "white"
    outliers: Literal["anywhere", "clustered"] = "anywhere"
    scale: Share = 0.0  # of the model's size, by which it is too large or too small
    lacking: Hidden = 0.0  # share of its surface that the model lacks beyond a plane, whatever the causes
    clutter: Hidden = 0.0  # share of the observed points that lie on a table


@dataclass(frozen=True)
class Limits:
    """The limits that tell the states apart, of errors relative to the diameter."""

    nominal: Positive = 0.02  # mean error below which nothing is wrong
    failed: Positive = 0.03  # mean error above which a registration has failed: the config's success.error
    cause: Positive = 0.01  # part of the error above which a concept is one of the causes
    margin: Share = 0.0  # by which the part of a failure's dominant cause exceeds the next one, at least
    clean: OpenShare = 0.95  # of the clean pairs whose uncertainty is no larger than a nominal registration's may be

    def __post_init__(self) -> None:
        if self.nominal > self.failed:
            fault = f"nominal {self.nominal} exceeds failed {self.failed}"
            raise InputError("causes limits", fault, "raise failed or lower nominal")


@dataclass(frozen=True)
class Shares:
    """Of the samples of a split, by their state and, of the failed, by their dominant cause."""

    nominal: Share = 0.3
    borderline: Share = 0.16
    noise: Share = 0.18
    pose: Share = 0.18
    overlap: Share = 0.18
    geometry: Share = 0.0  # of those whose clean pair is off already; where it is 0 these are refused

    def __post_init__(self) -> None:
        if abs((total := sum(asdict(self).values())) - 1) > 1e-6:
            raise InputError("causes shares", f"add up to {total:.4g}", "make them add up to 1")


@dataclass(frozen=True)
class CauseSettings(UncertaintySettings):
    """How many samples are drawn and how."""

    starts: Annotated[int, Bounds(minimum=FEWEST_STARTS)] = FEWEST_STARTS
    floor: Annotated[float, Bounds(exclusiveMinimum=0, maximum=1)] = 1e-4
    train: Annotated[int, Bounds(minimum=12)] = 600
    test: Annotated[int, Bounds(minimum=6)] = 300
    test_objects: OpenShare = 0.3  # that only test samples show, at least one
    points: tuple[CloudPoints, CloudPoints] = (128, 1024)  # of the model, and of what is left of the observed cloud
    present: PositiveShare = 0.5  # probability of each cause
    matched: bool = False  # candidates whose trivial numbers give their dominant cause away are refused as often
    partial: Share = 0.0  # of those without overlap, have a model that lacks surface
    lacking: tuple[Hidden, Hidden] = (0.10, 0.50)  # share beyond a plane that it lacks; half lack what one side hides
    form: Form = field(default_factory=Form)
    moved: Moved = MODEL  # onto the other cloud: the model lacks partners where surface is missing, the observed none
    severities: CauseSeverities = field(default_factory=CauseSeverities)
    small: Small = field(default_factory=Small)  # what there is of a cause that is not applied
    limits: Limits = field(default_factory=Limits)
    shares: Shares = field(default_factory=Shares)
    several: tuple[Share, Share] = (0.3, 0.7)  # have several causes, of the failed of each dominant cause
    clean_pairs: Annotated[int, Bounds(minimum=20)] = 200  # on which the limit of the uncertainty is measured
    candidates: Calls = 20  # drawn for each sample that is wanted, at most

    def __post_init__(self) -> None:
        require_ascending("causes ", self, "points", "several", "lacking")

    def runs(self) -> UncertaintySettings:
        """Return the part that says how ICP runs from other starts."""
        return UncertaintySettings(**{part.name: getattr(self, part.name) for part in fields(UncertaintySettings)})

    @classmethod
    def from_dict(cls, settings: dict, icp: dict | None = None) -> CauseSettings:
        """Build from the config's sections ``causes`` and ``registrations.icp``."""
        return read_settings(cls, settings | {"icp": icp or {}})


@dataclass(frozen=True)
class DescriptorSettings:
    """The registrations that a description runs again with remedies."""

    starts: Calls = 3  # near the initial pose, and as many again farther off where the remedy is a restart
    start_rotation_deg: Angle = 10.0  # root mean square angle
    start_translation: Positive = 0.05  # and length of the offsets near by
    restarts: Calls = 8  # starts farther off, with these offsets
    restart_rotation_deg: Angle = 50.0
    restart_translation: Positive = 0.25
    icp_points: DescribedPoints = 512  # of each cloud in these runs, at most

    @property
    def quick_remedy_calls(self) -> int:
        """The runs of ICP without a restart: with or without denoising, and with the clouds' roles either way."""
        return 4 * self.starts

    @property
    def remedy_calls(self) -> int:
        """All runs of ICP with remedies: with a restart each combination of the others has more starts."""
        return self.quick_remedy_calls + 4 * self.restarts

    def twists(self, near_k_6: np.ndarray, far_k_6: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Return the twists of the starts near by and farther off, of standard normal numbers."""
        return (
            near_k_6 * start_deviation(self.start_rotation_deg, self.start_translation),
            far_k_6 * start_deviation(self.restart_rotation_deg, self.restart_translation),
        )


@dataclass(frozen=True)
class ScanICP:
    """How ICP runs on scans."""

    correspondence_distance: Annotated[float, Bounds(exclusiveMinimum=0, maximum=10)] = 0.10
    max_iterations: Count = 50


@dataclass(frozen=True)
class ScanSamples:
    """Which registrations of scans are measured."""

    points: CloudPoints = 512  # of each scan, at most
    pairs: Count = 8  # of each scene and stratum of overlap, at most
    most_pairs: Count = 100  # of a data set
    ladder_starts: Count = 2  # rungs of scans.ladder drawn for each pair; none that starts at the truth
    global_start: bool = True  # whether the pose that scans.global_start finds is a start as well
    # Multiples of the sensor's noise, of which each pair in turn has one added to one registration.
    times: tuple[Positive, ...] = (1.0, 2.0, 3.0)
    icp: ScanICP = field(default_factory=ScanICP)
    folds: Annotated[int, Bounds(minimum=2)] = 10  # into which scenes are divided at most; each is left out once
