# Every table and figure of the registry, gpca/reporting/results.yaml: a rule of its name for each.
from gpca.reporting.registry import results_of

RESULTS = results_of(NAMES)
SCRIPTS = {"tables": "../scripts/table.py", "figures": "../scripts/figure.py"}
# The file of each kind that Snakemake's report shows, and those beside it.
REPORTED = {"tables": "csv", "figures": "png"}
BESIDE = {"tables": ("md", "tex"), "figures": ("pdf",)}


def below_results(files):
    """Return the files of each input below the folder of the run."""
    return {
        name: (
            f"<results>/{paths}"
            if isinstance(paths, str)
            else [f"<results>/{path}" for path in paths]
        )
        for name, paths in files.items()
    }


def outputs(result):
    """Return the files of a result; the report has one of them, by the paper's section, with title and caption."""
    suffix = REPORTED[result.kind]
    shown = report(
        f"<results>/{result.file(suffix)}",
        caption="../report/result.rst",
        category=result.section,
        labels={"result": result.title},
    )
    beside = {name: f"<results>/{result.file(name)}" for name in BESIDE[result.kind]}
    return {suffix: shown, **beside}


for result in RESULTS:

    rule:
        name:
            result.name
        input:
            **below_results(result.files(NAMES)),
            code=code_files(*result.modules, "gpca.reporting.script"),
        output:
            **outputs(result),
        log:
            f"<logs>/{result.kind}/{result.name}.log",
        benchmark:
            f"<benchmarks>/{result.kind}/{result.name}.tsv"
        localrule: True
        conda:
            "../envs/gpca.yaml"
        threads: 1
        resources:
            mem_mb=2000,
            runtime=10,
        params:
            builder=result.builder,
            readers=result.readers,
            arguments=result.arguments(SHOWN),
            caption=result.caption,
        script:
            SCRIPTS[result.kind]
