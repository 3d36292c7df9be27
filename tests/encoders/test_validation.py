"""Training with samples held out: the best epoch, the end, and where it starts."""

from dataclasses import replace

import numpy as np
import pytest
import torch

from gpca.encoders import training
from gpca.encoders.registry import EncoderSettings
from gpca.encoders.training import train_encoder
from gpca.errors import InputError

SETTINGS = EncoderSettings(
    draw_points=32, draws=1, epochs=4, batch_size=12, options={"k": 4, "point_features": 8}, validation_share=0.3
)


def same_weights(one, other):
    one, other = one.state_dict(), other.state_dict()
    return all(torch.equal(one[name], other[name]) for name in one)


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
    model, curve = train_encoder(registrations, "tiny", 0, replace(SETTINGS, patience=1))
    assert [record["validation_loss"] for record in curve] == [3.0, 1.0, 2.0]
    with_losses(monkeypatch, [3.0, 1.0, 0.5, 2.0])  # the schedule is the same, so the second epoch is
    longer, _ = train_encoder(registrations, "tiny", 0, SETTINGS)
    assert not same_weights(model, longer)


def test_a_broken_training_knows_its_best_epoch(registrations, tmp_path, monkeypatch):
    with_losses(monkeypatch, [1.0, 2.0, 3.0, 4.0])
    whole, _ = train_encoder(registrations, "tiny", 0, SETTINGS)
    with_losses(monkeypatch, [1.0, 2.0])
    with pytest.raises(StopIteration):
        train_encoder(registrations, "tiny", 0, SETTINGS, tmp_path / "c")
    with_losses(monkeypatch, [3.0, 4.0])
    resumed, curve = train_encoder(registrations, "tiny", 0, SETTINGS, tmp_path / "c")
    assert len(curve) == 4
    assert same_weights(whole, resumed)


def test_groups_are_held_out_whole_and_are_of_the_training(registrations, monkeypatch):
    group_S = registrations.sample // 6
    given = with_losses(monkeypatch, [1.0])
    train_encoder(registrations, "tiny", 0, replace(SETTINGS, epochs=1), group_S=group_S)
    held_out = given[0]
    train = registrations.rows("train")
    assert set(held_out) < set(train)
    assert not set(group_S[held_out]) & set(group_S[np.setdiff1d(train, held_out)])


def test_training_goes_on_from_given_weights(registrations):
    short = replace(SETTINGS, epochs=1, validation_share=0.0)
    first, _ = train_encoder(registrations, "tiny", 0, short)
    still = replace(short, learning_rate=1e-9)
    on, _ = train_encoder(registrations, "tiny", 1, still, start=first.state_dict())
    assert torch.allclose(on.head.weight, first.head.weight, atol=1e-5)


def test_validation_says_the_loss_of_what_was_held_out(registrations):
    _, curve = train_encoder(registrations, "tiny", 0, replace(SETTINGS, epochs=1))
    assert 0 < curve[0]["validation_loss"] < 10
    assert 0 <= curve[0]["validation_accuracy"] <= 1


def test_patience_needs_samples_held_out():
    with pytest.raises(InputError, match="'patience': needs held-out samples; set validation_share above 0"):
        EncoderSettings(patience=2)
