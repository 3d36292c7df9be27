"""Training with and without held-out samples, its files, and embeddings."""

import dataclasses
from collections import OrderedDict

import numpy as np
import pytest
import torch

from gpca.encoders import training
from gpca.encoders.registry import EncoderSettings, make_encoder
from gpca.encoders.training import draw_points, embed, load_model, train_encoder, write_weights
from gpca.errors import InputError

SETTINGS = EncoderSettings(draw_points=64, draws=2, epochs=6, batch_size=12, options={"k": 8, "point_features": 16})
WRITE = training.write_tensors


def train(registrations, checkpoint=None, seed=0, settings=SETTINGS):
    return train_encoder(registrations, "tiny", seed, settings, checkpoint)


def same_weights(one, other):
    one, other = one.state_dict(), other.state_dict()
    return all(torch.equal(one[name], other[name]) for name in one)


@pytest.fixture(scope="module")
def unbroken(registrations):
    return train(registrations)


@pytest.fixture
def epochs_run(monkeypatch):
    """The epochs that end while the test runs."""
    epochs = []

    def write(path, content):
        epochs.append(content["curve"][-1]["epoch"])
        WRITE(path, content)

    monkeypatch.setattr(training, "write_tensors", write)
    return epochs


def interrupted(registrations, checkpoint, after, settings=SETTINGS):
    """Leave the checkpoint of a training that was stopped after some epochs."""

    def write(path, content):
        WRITE(path, content)
        if len(content["curve"]) == after:
            raise KeyboardInterrupt

    with pytest.MonkeyPatch.context() as monkeypatch, pytest.raises(KeyboardInterrupt):
        monkeypatch.setattr(training, "write_tensors", write)
        train(registrations, checkpoint, settings=settings)
    assert checkpoint.is_file()


def test_a_seed_repeats_the_weights_and_another_does_not_and_test_samples_are_not_trained_on(registrations, unbroken):
    assert same_weights(train(registrations.subset(registrations.rows("train")))[0], unbroken[0])
    assert not same_weights(train(registrations, seed=1)[0], unbroken[0])


@pytest.mark.parametrize("head", ["linear", "two_layer"])
def test_an_interrupted_training_ends_with_the_same_weights(tmp_path, registrations, epochs_run, head):
    settings = dataclasses.replace(SETTINGS, head=head)
    unbroken = train(registrations, settings=settings)
    checkpoint = tmp_path / "seed0.checkpoint"
    interrupted(registrations, checkpoint, after=2, settings=settings)
    epochs_run.clear()
    encoder, curve = train(registrations, checkpoint, settings=settings)
    assert epochs_run == [3, 4, 5, 6]
    assert same_weights(encoder, unbroken[0])
    assert curve == unbroken[1]


def truncate(path):
    path.write_bytes(path.read_bytes()[:-50])


@pytest.mark.parametrize(
    "damage", [truncate, lambda path: path.write_bytes(b""), lambda path: torch.save([1, 2], path)]
)
def test_a_damaged_checkpoint_is_left_aside(tmp_path, registrations, unbroken, epochs_run, damage):
    checkpoint = tmp_path / "seed0.checkpoint"
    interrupted(registrations, checkpoint, after=2)
    damage(checkpoint)
    assert same_weights(train(registrations, checkpoint)[0], unbroken[0])
    assert epochs_run == [1, 2, 3, 4, 5, 6]


def test_a_checkpoint_of_other_settings_or_data_is_left_aside(tmp_path, registrations, unbroken, epochs_run):
    checkpoint = tmp_path / "seed0.checkpoint"
    other_settings = dataclasses.replace(SETTINGS, learning_rate=1e-3)
    other_data = dataclasses.replace(registrations, points=2 * registrations.points)
    for data, settings in ((registrations, other_settings), (other_data, SETTINGS)):
        epochs_run.clear()
        interrupted(data, checkpoint, after=1, settings=settings)
        assert same_weights(train(registrations, checkpoint)[0], unbroken[0])
        assert epochs_run == [1, 2, 3, 4, 5, 6]
        checkpoint.unlink()


def test_weights_survive_the_file_and_others_are_refused(tmp_path, unbroken):
    path = tmp_path / "seed0.pt"
    with pytest.raises(InputError, match="no such weights"):
        load_model(path, SETTINGS)
    write_weights(path, unbroken[0], ("tiny", 0))
    assert same_weights(load_model(path, SETTINGS), unbroken[0])
    for damage in (truncate, lambda path: torch.save(torch.nn.Linear(3, 3).state_dict(), path)):
        damage(path)
        with pytest.raises(InputError, match="not the weights of backbone 'dgcnn'") as caught:
            load_model(path, SETTINGS)
        assert str(path) in str(caught.value)


@pytest.mark.parametrize(
    ("changed", "expected"),
    [
        ({"backbone": "dgcn"}, "backbone 'dgcn': unknown; choose one of .*dgcnn"),
        ({"options": {"neighbours": 8}}, "backbone 'dgcnn': .*neighbours"),
        ({"draw_points": 16, "options": {"k": 20}}, "20 neighbors are too many for draws of 16 points"),
    ],
)
def test_wrong_settings_are_refused(registrations, changed, expected):
    with pytest.raises(InputError, match=expected):
        train(registrations, settings=dataclasses.replace(SETTINGS, **changed))


def test_a_training_that_diverges_is_stopped(registrations):
    with pytest.raises(InputError, match="the loss is not finite in epoch 1; lower"):
        train(registrations, settings=dataclasses.replace(SETTINGS, learning_rate=1e30))


def test_every_draw_has_a_number_of_points_of_its_own(registrations):
    rows = registrations.rows("train")
    clouds = training.draw_points(registrations, rows, 64, "tiny", 0, fewest=32)
    sizes = [len(cloud) for cloud in clouds]
    assert min(sizes) >= 32 and max(sizes) <= 64 and len(set(sizes)) > 3
    again = training.draw_points(registrations, rows[:1], 64, "tiny", 0, fewest=32)
    assert torch.equal(again[0], clouds[0])


VALIDATED = EncoderSettings(
    draw_points=32, draws=1, epochs=4, batch_size=12, options={"k": 4, "point_features": 8}, validation_share=0.3
)


def with_losses(monkeypatch, losses):
    """Let validation say these losses, epoch by epoch, and return the rows that it was given."""
    given, said = [], iter(losses)

    def validate(self, rows):
        given.append(rows)
        return {"validation_loss": next(said), "validation_accuracy": 0.5}

    monkeypatch.setattr(training._Training, "validate", validate)
    return given


def test_training_ends_without_a_smaller_loss_and_keeps_the_best_epoch(registrations, monkeypatch):
    with_losses(monkeypatch, [3.0, 1.0, 2.0, 2.0])
    model, curve = train_encoder(registrations, "tiny", 0, dataclasses.replace(VALIDATED, patience=1))
    assert [record["validation_loss"] for record in curve] == [3.0, 1.0, 2.0]
    with_losses(monkeypatch, [3.0, 1.0, 0.5, 2.0])  # the schedule is the same, so the second epoch is
    longer, _ = train_encoder(registrations, "tiny", 0, VALIDATED)
    assert not same_weights(model, longer)


def test_a_broken_training_knows_its_best_epoch(registrations, tmp_path, monkeypatch):
    with_losses(monkeypatch, [1.0, 2.0, 3.0, 4.0])
    whole, _ = train_encoder(registrations, "tiny", 0, VALIDATED)
    with_losses(monkeypatch, [1.0, 2.0])
    with pytest.raises(StopIteration):
        train_encoder(registrations, "tiny", 0, VALIDATED, tmp_path / "c")
    with_losses(monkeypatch, [3.0, 4.0])
    resumed, curve = train_encoder(registrations, "tiny", 0, VALIDATED, tmp_path / "c")
    assert len(curve) == 4
    assert same_weights(whole, resumed)


def test_groups_are_held_out_whole_and_are_of_the_training(registrations, monkeypatch):
    group_S = registrations.sample // 6
    given = with_losses(monkeypatch, [1.0])
    train_encoder(registrations, "tiny", 0, dataclasses.replace(VALIDATED, epochs=1), group_S=group_S)
    held_out = given[0]
    train = registrations.rows("train")
    assert set(held_out) < set(train)
    assert not set(group_S[held_out]) & set(group_S[np.setdiff1d(train, held_out)])


def test_training_goes_on_from_given_weights(registrations):
    short = dataclasses.replace(VALIDATED, epochs=1, validation_share=0.0)
    first, _ = train_encoder(registrations, "tiny", 0, short)
    still = dataclasses.replace(short, learning_rate=1e-9)
    on, _ = train_encoder(registrations, "tiny", 1, still, start=first.state_dict())
    assert torch.allclose(on.head.weight, first.head.weight, atol=1e-5)


def test_points_are_of_the_cloud_and_named_by_sample_not_by_batch(registrations):
    together = draw_points(registrations, np.array([4, 9, 40]), 32, "tiny", 0, "epoch", 1)
    assert together.shape == (3, 32, 3)
    for drawn, row in zip(together.numpy(), (4, 9, 40), strict=True):
        cloud = {tuple(point) for point in registrations.cloud(row)}
        assert len({tuple(point) for point in drawn} & cloud) == 32
        alone = draw_points(registrations.subset(np.array([row])), np.array([0]), 32, "tiny", 0, "epoch", 1)
        assert np.array_equal(alone[0], drawn)
    other = draw_points(registrations, np.array([4, 9, 40]), 32, "tiny", 0, "epoch", 2)
    assert not torch.equal(other, together)


def test_an_embedding_is_the_mean_over_its_draws(registrations):
    torch.manual_seed(0)
    encoder = make_encoder("dgcnn", SETTINGS.options)
    head = torch.nn.Linear(encoder.embedding_size, 3)
    model = torch.nn.Sequential(OrderedDict(encoder=encoder, head=head)).eval()
    rows = np.arange(len(registrations))
    with torch.no_grad():
        draws = [model.encoder(draw_points(registrations, rows, 64, "tiny", 0, "embedding", draw)) for draw in range(2)]
    h, logits = embed(model, registrations, "tiny", 0, SETTINGS)
    assert np.abs(h - sum(draws).numpy() / 2).max() < 1e-5
    with torch.no_grad():
        of_draws = sum(model.head(draw) for draw in draws).numpy() / 2
    assert np.abs(logits - of_draws).max() < 1e-5
    assert np.ptp(logits, axis=0).min() > 1e-3
    assert (draws[0] - draws[1]).abs().max() > 1e-3
