# Objects that lie in a storage of your own, read by a storage plugin of Snakemake's. Copy this file into
# workflow/rules/sources/ and install the plugin: pip install snakemake-storage-plugin-fs. Other providers are alike:
# with snakemake-storage-plugin-s3 it is provider="s3" and storage.shared("s3://bucket/objects.npz").
SOURCES["shared"] = {"title": "Shared objects", "stand_in": False}


storage shared:
    provider="fs",


rule shared_objects:
    input:
        storage.shared(f"{config['data_dir']}/shared/objects.npz"),
    output:
        "<results>/objects/shared.npz",
    log:
        "<logs>/objects/shared.log",
    benchmark:
        "<benchmarks>/objects/shared.tsv"
    conda:
        "../../envs/gpca.yaml"
    threads: 1
    resources:
        mem_mb=1000,
        runtime=10,
    shell:
        "cp {input} {output} 2> {log}"
