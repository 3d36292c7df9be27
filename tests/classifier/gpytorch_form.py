"""The classifier's model and objective as gpytorch's tutorials write them: what ours is compared with."""

import gpytorch
import torch


class Softmax(gpytorch.likelihoods.SoftmaxLikelihood):
    """Takes logits (…, N, C); gpytorch's own takes N = C points for an old, transposed layout."""

    def forward(self, logits_N_C, *_args, **_kwargs):
        return torch.distributions.Categorical(logits=logits_N_C)


class LatentGPs(gpytorch.models.ApproximateGP):
    def __init__(self, kernel, inducing_M_d):
        batch = kernel.batch_shape
        distribution = gpytorch.variational.CholeskyVariationalDistribution(len(inducing_M_d), batch_shape=batch)
        strategy = gpytorch.variational.VariationalStrategy(
            self, inducing_M_d, distribution, learn_inducing_locations=True
        )
        super().__init__(gpytorch.variational.IndependentMultitaskVariationalStrategy(strategy, num_tasks=batch[0]))
        self.mean_module = gpytorch.means.ZeroMean(batch_shape=batch)
        self.covar_module = kernel

    def forward(self, inputs):
        return gpytorch.distributions.MultivariateNormal(self.mean_module(inputs), self.covar_module(inputs))

    @property
    def strategy(self):
        return self.variational_strategy.base_variational_strategy


def fit(kernel, inducing_M_d, inputs_N_d, targets_N, iterations, learning_rate):
    """Maximize the ELBO with Adam from torch's global generator; return the model and the losses."""
    model = LatentGPs(kernel, inducing_M_d)
    likelihood = Softmax(num_classes=model.covar_module.batch_shape[0], mixing_weights=False)
    elbo = gpytorch.mlls.VariationalELBO(likelihood, model, num_data=len(targets_N))
    optimizer = torch.optim.Adam(model.parameters(), lr=learning_rate)
    model.train()
    losses = []
    for _ in range(iterations):
        optimizer.zero_grad()
        loss = -elbo(model(inputs_N_d), targets_N)
        loss.backward()
        optimizer.step()
        losses.append(loss.item())
    return model.eval(), losses
