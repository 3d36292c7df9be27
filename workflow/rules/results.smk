# Every table and figure that an experiment declares: a rule of its name for each.
from gpca.declarations.registry import results_of
from gpca.reporting.registry import SUFFIXES

RESULTS = results_of(NAMES)


def outputs(result):
    """Return the files of a result by suffix; Snakemake's report shows one of them, by the paper's section."""
    paths = {
        suffix: f"<results>/{result.file(suffix)}" for suffix in SUFFIXES[result.kind]
    }
    shown = {"tables": "csv", "figures": "png"}[result.kind]
    return paths | {
        shown: report(
            paths[shown],
            caption="../report/result.rst",
            category=result.section,
            labels={"result": result.title},
        )
    }


for result in RESULTS:

    rule:
        name:
            result.name
        input:
            **below_results(result.files(NAMES)),
            code=code_stamp(*result.modules, "gpca.jobs.job"),
        output:
            **outputs(result),
        log:
            f"<logs>/{result.kind}/{result.name}.log",
        benchmark:
            f"<benchmarks>/{result.kind}/{result.name}.tsv"
        localrule: True
        conda:
            "../envs/gpca.yaml"
        params:
            kind=result.kind,
            builder=result.builder,
            readers=result.readers,
            arguments=result.arguments,
            only=result.only,
            config=token_of(result.all_files[0]),
            caption=result.caption,
        script:
            "../scripts/result.py"
