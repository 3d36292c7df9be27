# The steps that experiments declare: a rule for each, of one shape, and a target for all its files.
from gpca.declarations.registry import steps
from gpca.declarations.step import all_files, rule_of

if workflow.is_main_process:
    for experiment in experiments():
        for notice in experiment.notices(config):
            print(f"gpca: {notice}", file=sys.stderr)

for step in steps():
    if step.target:

        rule:
            name:
                step.target
            input:
                [f"<results>/{file}" for file in all_files(step, PLAN)]
                if step.when(PLAN)
                else [],

    if step.when(PLAN):
        made = rule_of(step, PLAN)

        rule:
            name:
                step.name
            input:
                **below_results(made.inputs),
                **made.data,
                code=code_of(made.modules),
            output:
                **below_results(made.outputs),
            log:
                f"<logs>/{made.place}.log",
            benchmark:
                f"<benchmarks>/{made.place}.tsv"
            wildcard_constraints:
                **made.constraints,
            priority: step.priority
            conda:
                "../envs/gpca.yaml"
            threads: step.threads
            resources:
                **step.resources,
            params:
                **made.params,
                step=step.run,
                settings=made.settings,
            script:
                "../scripts/step.py"
