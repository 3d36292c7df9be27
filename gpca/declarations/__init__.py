"""What the file of an experiment declares: settings, steps, numbers, tables and figures."""

from gpca.declarations.experiment import EXPLAINERS, ByName, Experiment, LeftOut, Names, Tidy  # noqa: F401
from gpca.declarations.plan import Run, plain  # noqa: F401
from gpca.declarations.result import Figure, Frame, Paths, Series, figure, numbers, table  # noqa: F401
from gpca.declarations.step import Plan, Step, Wildcards  # noqa: F401
