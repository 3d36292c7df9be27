import pytest
import torch

from gpca.portable import log_sum_exp, logarithm, square_root


@pytest.mark.parametrize("dtype", [torch.float32, torch.float64])
@pytest.mark.parametrize(("own", "theirs"), [(square_root, torch.sqrt), (logarithm, torch.log)])
def test_values_and_slopes_are_torchs_within_rounding(own, theirs, dtype):
    outcomes = []
    for function in (own, theirs):
        positive = torch.logspace(-15, 15, 1001, dtype=dtype, requires_grad=True)
        values = function(positive)
        [slopes] = torch.autograd.grad(values.sum(), positive)
        outcomes.append((values.detach(), slopes))
    for ours, torchs in zip(*outcomes, strict=True):
        torch.testing.assert_close(ours, torchs, rtol=4 * torch.finfo(dtype).eps, atol=0)


def test_a_sum_of_exponentials_is_torchs_within_rounding():
    values_N_C = torch.tensor([[1e3, 1e3, -1e3], [-1e3, -1e3, -1e3], [0.0, 1.0, 2.0]], dtype=torch.float64)
    torch.testing.assert_close(log_sum_exp(values_N_C), values_N_C.logsumexp(dim=1), rtol=1e-15, atol=0)
