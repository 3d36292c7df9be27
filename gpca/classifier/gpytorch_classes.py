"""The classifier in gpytorch's own classes, with the same random numbers as :mod:`gpca.classifier.gpc`."""

import math
from collections.abc import Iterable, Iterator

import gpytorch
import numpy as np
import torch
from torch import Tensor
from torch.overrides import TorchFunctionMode

from gpca.classifier.gpc import GPC
from gpca.classifier.latents import expected_log_likelihood
from gpca.classifier.prior import Covariance, Standardization
from gpca.classifier.sparse_gp import start_of
from gpca.errors import InputError
from gpca.portable import Adam, square_root
from gpca.process.progress import progress
from gpca.seeds import seed_of


class ScaledPolynomial(gpytorch.kernels.PolynomialKernel):
    """The covariance (xᵀx' / d + c)²."""

    def __init__(self, **options) -> None:
        super().__init__(power=2, **options)

    def forward(self, x1: Tensor, x2: Tensor, **options) -> Tensor:
        """Return the covariance of the inputs."""
        width = math.sqrt(x1.shape[-1])
        return super().forward(x1 / width, x2 / width, **options)


KERNELS = {
    "rbf": gpytorch.kernels.RBFKernel,
    "matern32": lambda **options: gpytorch.kernels.MaternKernel(nu=1.5, **options),
    "polynomial": ScaledPolynomial,
}


def gpytorch_kernel(covariance: Covariance) -> gpytorch.kernels.ScaleKernel:
    batch = torch.Size([len(covariance.scale_C)])
    kernel = gpytorch.kernels.ScaleKernel(KERNELS[covariance.form](batch_shape=batch), batch_shape=batch)
    kernel.outputscale = torch.from_numpy(covariance.scale_C).float()
    parameter_C = torch.from_numpy(covariance.parameter_C).float()
    if kernel.base_kernel.has_lengthscale:
        kernel.base_kernel.lengthscale = parameter_C[:, None, None]
    else:
        kernel.base_kernel.offset = parameter_C[:, None]
    return kernel


class LatentGPs(gpytorch.models.ApproximateGP):
    """C independent latent GPs, one per batch entry of the covariance, on shared, learned inducing inputs."""

    def __init__(self, covariance: gpytorch.kernels.ScaleKernel, inducing_M_d: Tensor) -> None:
        batch = covariance.batch_shape
        posterior = gpytorch.variational.CholeskyVariationalDistribution(len(inducing_M_d), batch_shape=batch)
        strategy = gpytorch.variational.VariationalStrategy(
            self, inducing_M_d, posterior, learn_inducing_locations=True
        )
        super().__init__(gpytorch.variational.IndependentMultitaskVariationalStrategy(strategy, num_tasks=batch[0]))
        self.mean_module = gpytorch.means.ZeroMean(batch_shape=batch)
        self.covar_module = covariance

    def forward(self, inputs: Tensor) -> gpytorch.distributions.MultivariateNormal:
        """Return the prior."""
        return gpytorch.distributions.MultivariateNormal(self.mean_module(inputs), self.covar_module(inputs))


def ascend(model: LatentGPs, inputs_N_d: Tensor, targets_N: Tensor, learning_rate: float) -> Iterator[float]:
    """Yield, without end, the loss before each step of Adam on the ELBO, by torch's global random numbers."""
    n_classes = model.variational_strategy.num_tasks
    if len(targets_N) == n_classes:
        fault = f"{n_classes} samples for {n_classes} classes, which gpytorch's SoftmaxLikelihood would read transposed"
        raise InputError("training samples", fault, "give more samples")
    likelihood = gpytorch.likelihoods.SoftmaxLikelihood(num_classes=n_classes, mixing_weights=False)
    elbo = gpytorch.mlls.VariationalELBO(likelihood, model, num_data=len(targets_N))
    optimizer = Adam(model.parameters(), learning_rate)
    while True:
        model.train()
        optimizer.zero_grad()
        loss = -elbo(model(inputs_N_d), targets_N)
        loss.backward()
        optimizer.step()
        model.eval()
        yield loss.item()


class GpytorchGPC(GPC):
    """:class:`gpca.classifier.gpc.GPC` by gpytorch: same seeds and results, but fitted once, on the labeled samples."""

    def fit_up_to(  # type: ignore[override]  # it starts from nothing
        self, iterations: Iterable[int], h_N_d: np.ndarray, labels_N: np.ndarray, *_start: None
    ) -> Iterator[int]:
        """Yield each number of iterations in rising order; the classifier is then as :meth:`fit` would leave it."""
        self._scaler = Standardization.of(h_N_d)
        self._inputs_N_d = torch.from_numpy(self._scaler.single(h_N_d))
        self._targets_N = self._targets(labels_N)
        start = start_of(self._inputs_N_d, len(self.classes), self.settings, self._axes)
        self._model = LatentGPs(gpytorch_kernel(start.covariance), torch.from_numpy(start.inducing_M_d))
        steps = ascend(self._model, self._inputs_N_d, torch.from_numpy(self._targets_N), self.settings.learning_rate)
        state = torch.Generator().manual_seed(seed_of(*self._axes, "gpc")).get_state()
        stops = sorted(set(iterations))
        for done in progress(range(1, stops[-1] + 1), " ".join(map(str, ("gpytorch's GPC", *self._axes)))):
            with torch.random.fork_rng(devices=[]), SameRoots():
                torch.set_rng_state(state)
                next(steps)
                state = torch.get_rng_state()
            if done in stops:
                yield done

    def posterior(  # type: ignore[override]  # it projects nothing
        self, h_N_d: np.ndarray
    ) -> tuple[np.ndarray, np.ndarray]:
        """Return mean and standard deviation (N, C) of the latent logits q(f(h))."""
        return self._marginals(torch.from_numpy(self._scaler.single(h_N_d)))

    def elbo(self) -> float:
        """Return the evidence lower bound per labeled sample in nats."""
        expected = expected_log_likelihood(*self._marginals(self._inputs_N_d), self._targets_N)
        with torch.no_grad(), SameRoots():
            divergence = float(self._model.variational_strategy.kl_divergence())
        return (expected - divergence) / len(self._targets_N)

    def _marginals(self, inputs_N_d: Tensor) -> tuple[np.ndarray, np.ndarray]:
        with torch.no_grad(), SameRoots():
            latents = self._model(inputs_N_d)
            return latents.mean.double().numpy(), np.sqrt(latents.variance.double().numpy())


class SameRoots(TorchFunctionMode):
    """Inside this context, torch's roots and distances have the same bits on processors of every vendor."""

    def __torch_function__(self, function, types, arguments=(), keywords=None):
        if function is torch.cdist:
            a_A_d, b_B_d = arguments[:2]
            squares_A_B = a_A_d.square().sum(dim=-1)[..., :, None] + b_B_d.square().sum(dim=-1)[..., None, :]
            # At least 1e-30, because the root has no derivative at 0.
            return _Root.apply((squares_A_B - 2 * a_A_d @ b_B_d.mT).clamp_min(1e-30))
        if function in (torch.sqrt, Tensor.sqrt):
            return _Root.apply(arguments[0])
        if function is Tensor.sqrt_:
            return arguments[0].copy_(_Root.apply(arguments[0]))
        return function(*arguments, **(keywords or {}))


class _Root(torch.autograd.Function):
    """The elementary root with torch's derivative, which is finite wherever the root is positive."""

    @staticmethod
    def forward(context, positive: Tensor) -> Tensor:
        root = square_root(positive)
        context.save_for_backward(root)
        return root

    @staticmethod
    def backward(context, *gradients: Tensor) -> Tensor:
        (root,) = context.saved_tensors
        return gradients[0] / (2 * root)
