"""Files of a stage -> files of the next, by the step that the rule names."""

from gpca.jobs.job import run_step

run_step(snakemake)
