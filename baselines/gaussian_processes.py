"""GP-CA on the embedding of the aligned source, by other code and for other labels."""

from gpca.classifier.settings import GPCArguments
from gpca.explainers.gpca import GPCA
from gpca.explainers.interface import ExplainerEntry, for_causes


class GpytorchGPCA(GPCA):
    """GP-CA in gpytorch's own classes, a check: it agrees with ``gpca_paper`` within rounding."""

    def __init__(self, source: str, seed: int, **settings: GPCArguments) -> None:
        from gpca.classifier.gpytorch_classes import GpytorchGPC
        from gpca.classifier.settings import GPCSettings

        self._gpc = GpytorchGPC(self.labels, GPCSettings(**settings), source, seed)


EXPLAINERS = {
    "gpca_gpytorch": ExplainerEntry("GP-CA (gpytorch's classes)", GpytorchGPCA, ("source",), reads="embeddings")
}
CAUSE_EXPLAINERS = {"gpca": ExplainerEntry("GP-CA (aligned source)", for_causes(GPCA), ("source",), reads="embeddings")}
