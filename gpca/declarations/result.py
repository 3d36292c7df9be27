"""Tables, figures and files of numbers as an experiment declares them: functions of a run and of some of its files.

``@table`` and ``@figure`` give a result's place on the page and the words beside it, ``@numbers`` which files
its function writes. The function gets a :class:`gpca.declarations.plan.Run` first, and then its inputs by name:

- ``intervals="causes_intervals.csv"``: a file of numbers, read by :func:`gpca.evaluation.measures.read_rows`;
- ``seconds=(read_seconds, "timings/{source}/seed{seed}.csv")``: what the function makes of these files;
- ``files="methods/{source}/{method}/seed{seed}.csv"``: the paths, if the pattern has braces or is no CSV file.

A name in braces stands for all its values (:func:`gpca.experiments.run.names_of`); a result is left out where one of
its names is empty. Functions must be importable without heavy packages.
"""

from collections.abc import Callable, Iterable, Mapping, Sequence
from inspect import cleandoc
from pathlib import Path
from typing import TYPE_CHECKING, Any, TypeVar

from gpca.declarations.experiment import Tidy
from gpca.io.frame import Frame as Frame
from gpca.io.frame import Series as Series
from gpca.reporting.registry import Input, Result

if TYPE_CHECKING:
    from matplotlib.figure import Figure as Figure
else:  # planning does not import it
    Figure = Any

READ_ROWS = "gpca.evaluation.measures:read_rows"
Given = str | tuple[Callable, str | Sequence[str]]
Paths = Iterable[str | Path]  # of files that a function reads
Function = TypeVar("Function", bound=Callable)


def table(section: str, title: str, caption: str, **options: Any) -> Callable[[Function], Function]:
    """Declare a table of the function's name: a function that returns a :class:`gpca.reporting.tables.table.Table`.

    Args:
        section, title, caption: where it stands, and the words above and below it.
        options: ``name``, if not the function's, in which ``{source}`` stands for a result of each source, passed as
            ``source``; ``needs``, names that must not be empty besides those of the inputs; ``only``, name of a list
            -> its members that are shown; ``paper``, it is one of the paper's; ``after``, the result of another
            experiment that it follows. All others are inputs.
    """
    return _declared("tables", section, title, caption, **options)


def figure(section: str, title: str, caption: str, **options: Any) -> Callable[[Function], Function]:
    """Declare a figure, a function that returns a matplotlib figure; arguments as of :func:`table`."""
    return _declared("figures", section, title, caption, **options)


def numbers(*names: str, rule: str = "", **files: str) -> Callable[[Function], Function]:
    """Declare the function that returns the frames of these CSV files, in their order, or the one frame.

    Each name is a target without its suffix, and the first one the rule's unless it has another; `files` are the
    function's arguments -> patterns of the files that it reads.
    """

    def declare(function: Function) -> Function:
        function.tidy = Tidy(  # type: ignore[attr-defined]
            names[0], f"{function.__module__}:{function.__name__}", files, rule=rule, others=names[1:], takes_run=True
        )
        return function

    return declare


def _declared(
    kind: str,
    section: str,
    title: str,
    caption: str,
    *,
    name: str = "",
    needs: tuple[str, ...] = (),
    only: Mapping[str, tuple[str, ...]] | None = None,
    paper: bool = False,
    after: str = "",
    **inputs: Given,
) -> Callable[[Function], Function]:
    given = []
    for argument, of in inputs.items():
        if isinstance(of, str):
            given.append(Input(argument, (of,), READ_ROWS if of.endswith(".csv") and "{" not in of else ""))
        else:
            read, files = of[0], (of[1],) if isinstance(of[1], str) else tuple(of[1])
            given.append(Input(argument, files, f"{read.__module__}:{read.__name__}"))

    def declare(function: Function) -> Function:
        function.result = Result(  # type: ignore[attr-defined]
            name=name or function.__name__,
            kind=kind,
            section=section,
            title=title,
            caption=cleandoc(caption),
            builder=f"{function.__module__}:{function.__name__}",
            inputs=tuple(given),
            only=only or {},
            needs=needs,
            paper=paper,
            after=after,
        )
        return function

    return declare
