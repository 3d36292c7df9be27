"""Makes tables, figures and the page from files, in one style, and computes no result.

The functions that make tables (:class:`gpca.reporting.tables.table.Table`) and figures (matplotlib's) name their
arguments alike, and do not explain these again:

    metrics, intervals, grid: What the collector of their experiment returns, or its reader.
    sources: The title of each name; for tables the ``{"title": str, "stand_in": bool}``.
    explainers, learners, strategies, estimators, methods, policies: The title of each name.
    title, encoder: What a reader calls the objects or frames, and the encoder.
    dataset: That of the objects, as the BOP benchmark calls it; their names in words follow from it.
    registrations_npz, embeddings_npz, predictions_csv: Of one source and seed.
    uncertainty_csv: The uncertainties of the design ``causal``.
    limits: Limits of the errors that separate the states, from the config.

Names stand in the order in which they are shown, and those without numbers are left out. An
:class:`gpca.errors.InputError` says that nothing is left, or that a file is unusable or of another run.
"""
