from gpca.config.layers import DEFAULTS, in_order, read_file, with_defaults

from .configs import CONFIG, merged


def test_rows_that_a_config_adds_stand_where_the_defaults_have_them():
    own = read_file(CONFIG / "full.yaml")
    own["controls"]["explainers"]["my_own"] = None
    given = merged(own, *map(read_file, DEFAULTS), own)  # as Snakemake does it, with the given keys first
    lower = with_defaults()
    usual = list(lower["controls"]["explainers"])
    assert next(iter(given["controls"]["explainers"])) == "residuals_rules"
    found = in_order(given)
    assert found == given
    assert list(found) == list(lower)
    assert list(found["controls"]["explainers"]) == [*usual, "my_own"]
