import dataclasses

import pytest
import torch

from gpca.encoders import training
from gpca.encoders.registry import EncoderSettings
from gpca.encoders.training import load_model, train_encoder, write_weights
from gpca.errors import InputError
from gpca.pairs.perturbation import Severities
from gpca.pairs.synthesis import RegistrationSettings, make_registrations

SETTINGS = EncoderSettings(draw_points=64, draws=2, epochs=6, batch_size=12, options={"k": 8, "point_features": 16})
KEEP = training.keep


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

    def keep(checkpoint, identity, state, curve):
        epochs.append(curve[-1]["epoch"])
        KEEP(checkpoint, identity, state, curve)

    monkeypatch.setattr(training, "keep", keep)
    return epochs


def interrupted(registrations, checkpoint, after, settings=SETTINGS):
    """Leave the checkpoint of a training that was stopped after some epochs."""

    def keep(checkpoint, identity, state, curve):
        KEEP(checkpoint, identity, state, curve)
        if len(curve) == after:
            raise KeyboardInterrupt

    with pytest.MonkeyPatch.context() as monkeypatch, pytest.raises(KeyboardInterrupt):
        monkeypatch.setattr(training, "keep", keep)
        train(registrations, checkpoint, settings=settings)
    assert checkpoint.is_file()


def test_the_loss_falls_and_the_concepts_are_learned(objects):
    severe = Severities(noise=(0.06, 0.08), rotation_deg=(60, 120), translation=(0.4, 0.6), crop=(0.5, 0.7))
    easy, _ = make_registrations(objects, "tiny", 0, RegistrationSettings(48, 3, 256, severe))
    encoder, curve = train(easy)
    assert [row["epoch"] for row in curve] == [1, 2, 3, 4, 5, 6]
    assert curve[-1]["loss"] < 0.7 * curve[0]["loss"]
    assert curve[-1]["accuracy"] > 0.8
    assert not encoder.training


def test_a_seed_repeats_the_weights_and_another_does_not(registrations, unbroken):
    assert same_weights(train(registrations)[0], unbroken[0])
    assert not same_weights(train(registrations, seed=1)[0], unbroken[0])


def test_test_samples_are_not_trained_on(registrations, unbroken):
    assert same_weights(train(registrations.subset(registrations.rows("train")))[0], unbroken[0])


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


@pytest.mark.parametrize("changes", [{"fewest_points": 65}, {"fewest_points": 32, "backbone": "pointnet"}])
def test_draws_that_cannot_be_are_refused(changes):
    with pytest.raises(InputError, match="fewest_points"):
        dataclasses.replace(SETTINGS, **changes)
