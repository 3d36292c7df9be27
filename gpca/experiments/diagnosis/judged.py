from gpca.causes.judged import (  # noqa: F401
    CEILING,
    Judged,
    SampleTruth,
    ceiling_of,
    joined,
    judged_by,
    judged_of,
    read_judged,
)
from gpca.evaluation.measures import POOLED  # noqa: F401
