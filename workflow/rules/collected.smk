# Files of all sources, methods and seeds -> the tidy files of the experiments, as these say: a rule for each.
for experiment in experiments():
    for tidy in experiment.tidy:
        if not tidy.collector:
            continue

        rule:
            name:
                tidy.target
            input:
                **below_results(tidy.inputs(NAMES)),
                code=collector_code(tidy.collector),
            output:
                [f"<results>/{file}" for file in tidy.all_files],
            log:
                f"<logs>/{tidy.target}.log",
            benchmark:
                f"<benchmarks>/{tidy.target}.tsv"
            localrule: True
            conda:
                "../envs/gpca.yaml"
            params:
                collector=tidy.collector,
                config=token_of(tidy.file) if tidy.takes_run else "",
            script:
                "../scripts/collect.py"

        for file in tidy.others:

            rule:
                name:
                    file.removesuffix(".csv")
                input:
                    f"<results>/{file}",
