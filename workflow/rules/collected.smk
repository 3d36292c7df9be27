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
                f"<results>/{tidy.file}",
            log:
                f"<logs>/{tidy.target}.log",
            benchmark:
                f"<benchmarks>/{tidy.target}.tsv"
            localrule: True
            conda:
                "../envs/gpca.yaml"
            params:
                **tidy.settings(config),
                collector=tidy.collector,
            script:
                "../scripts/collect.py"
