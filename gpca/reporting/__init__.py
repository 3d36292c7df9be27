"""Makes tables, figures and the page from files, in one style, and computes no result.

The functions that make tables (:class:`gpca.reporting.tables.table.Table`) and figures (matplotlib's) name their
arguments alike, and do not explain these again:

    metrics, intervals, grid: What the collector of their experiment returns, or its reader.
    sources: The title of each name; for tables the ``{"title": str, "stand_in": bool}``.
    explainers, learners, strategies, estimators, methods, policies: The title of each name.
    title: That of the objects or frames.

Names stand in the order in which they are shown, and those without numbers are left out. An
:class:`gpca.errors.InputError` says that nothing is left, or that a file is unusable or of another run.
"""
