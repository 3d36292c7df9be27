# Every table and figure of the registry, gpca/reporting/results.yaml: a rule of its name for each.
from gpca.experiments.results import results_of

RESULTS = results_of(NAMES)


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


def reported(result, suffix):
    """Return the file as Snakemake's report shows it: by the paper's section, with title and caption."""
    return report(
        f"<results>/{result.file(suffix)}",
        caption="../report/result.rst",
        category=result.section,
        labels={"result": result.title},
    )


# Tables and figures have one each, since the path of a script is read when its job runs, after the loop.
for result in RESULTS:
    if result.kind == "tables":

        rule:
            name:
                result.name
            input:
                **below_results(result.files(NAMES)),
                code=code_files(*result.modules, "gpca.reporting.script"),
            output:
                csv=reported(result, "csv"),
                md=f"<results>/{result.file('md')}",
                tex=f"<results>/{result.file('tex')}",
            log:
                f"<logs>/tables/{result.name}.log",
            benchmark:
                f"<benchmarks>/tables/{result.name}.tsv"
            localrule: True
            conda:
                "../envs/gpca.yaml"
                    resources:
                mem_mb=2000,
                runtime=10,
            params:
                builder=result.builder,
                readers=result.readers,
                arguments=result.arguments(SHOWN),
                caption=result.caption,
            script:
                "../scripts/table.py"

    else:

        rule:
            name:
                result.name
            input:
                **below_results(result.files(NAMES)),
                code=code_files(*result.modules, "gpca.reporting.script"),
            output:
                pdf=f"<results>/{result.file('pdf')}",
                png=reported(result, "png"),
            log:
                f"<logs>/figures/{result.name}.log",
            benchmark:
                f"<benchmarks>/figures/{result.name}.tsv"
            localrule: True
            conda:
                "../envs/gpca.yaml"
                    resources:
                mem_mb=2000,
                runtime=10,
            params:
                builder=result.builder,
                readers=result.readers,
                arguments=result.arguments(SHOWN),
                caption=result.caption,
            script:
                "../scripts/figure.py"
