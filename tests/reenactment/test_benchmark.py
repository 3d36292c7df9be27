import json

from benchmarks import reenactment


def test_it_ends_with_its_times_and_agrees_with_the_plain_mixture(capsys):
    reenactment.main(["--pairs", "1", "--points", "128"])
    result = json.loads(capsys.readouterr().out.splitlines()[-1])
    assert list(result) == ["search_ms", "enact_ms", "speedup", "max_abs_error"]
    assert result["max_abs_error"] < 0.05 and min(result.values()) >= 0
