from dataclasses import replace

import numpy as np

from gpca.alignment.icp import ICPSettings
from gpca.objects.surface import instance_of
from gpca.pairs.perturbation import CONCEPTS
from gpca.pairs.synthesis import registered_backwards
from gpca.rigid import inverse, transform
from gpca.steps.control_samples import RELABELED, ControlSettings, left_out, of_unseen_objects, relabeled, thinned


def test_a_thinned_cloud_has_a_random_number_of_its_own_points(six):
    thin = thinned(six, (32, 64), "tiny", 100)
    sizes = np.diff(thin.offsets)
    assert sizes.min() >= 32 and sizes.max() <= 64 and len(set(sizes)) > 10
    assert abs(np.corrcoef(sizes, six.concept == "overlap")[0, 1]) < 0.4
    for row in (0, 40):
        assert set(map(tuple, thin.cloud(row))) <= set(map(tuple, six.cloud(row)))
        assert np.array_equal(thin.target(row), six.target(row))
    part = thinned(six.subset(np.array([7])), (32, 64), "tiny", 100)
    assert np.array_equal(part.cloud(0), thin.cloud(7))


def test_every_object_is_unseen_once_with_all_its_views(six):
    tested = []
    for seed in range(3):
        changed = of_unseen_objects(six, 3, "tiny", seed)
        asked = changed.split == "test"
        train, test = ({instance_of(name) for name in changed.object_name[rows]} for rows in (~asked, asked))
        assert not train & test
        assert len(set(changed.sample[asked])) == asked.sum()
        shown = {instance_of(name) for name in six.object_name}
        assert train | test == shown
        of_both = np.isin([instance_of(name) for name in six.object_name], sorted(test)).sum()
        assert asked.sum() == of_both  # of both splits
        tested += sorted(test)
    assert sorted(tested) == sorted(shown)


def test_icp_backwards_aligns_as_well_and_tells_where(six):
    rows = np.flatnonzero(six.concept == "noise")[:4]
    back = registered_backwards(six.subset(rows), ICPSettings())
    for i, row in enumerate(rows):
        observed = transform(inverse(six.T_target_source("icp", row)), six.cloud(row).astype(float))
        assert np.allclose(transform(back.T_target_source("icp", i), observed), back.cloud(i), atol=1e-4)
        assert not np.array_equal(back.cloud(i), six.cloud(row))
        assert np.abs(back.cloud(i) - six.cloud(row)).max() < 0.2  # diameters
    assert (back.fitness > 0.5).all()


def test_so_many_labels_are_wrong_and_shuffled_ones_say_nothing_of_the_concept(six):
    train = six.subset(six.rows("train"))
    changed = relabeled("label_noise_30", train, "tiny", 100)
    assert (changed.concept != train.concept).sum() == round(0.3 * len(train))
    assert set(changed.concept) == set(CONCEPTS)
    assert np.array_equal(relabeled("label_noise_30", train, "tiny", 100).concept, changed.concept)
    changed = relabeled("shuffled", train, "tiny", 100)
    counts = [[(changed.concept[train.concept == true] == label).sum() for label in CONCEPTS] for true in CONCEPTS]
    assert np.array_equal(counts, np.full((3, 3), 4))
    assert set(RELABELED) == {"label_noise_30", "shuffled"}


def test_what_a_source_does_not_admit_is_said(six, registrations):
    settings = ControlSettings(draw_points=(32, 64))
    assert left_out("unseen_objects", six, settings, "dgcnn") is None
    assert (
        left_out("unseen_objects", registrations, settings, "dgcnn") == "it needs at least 5 objects, but there are 3"
    )
    assert left_out("density", six, settings, "dgcnn") is None
    assert left_out("density", six, settings, "pointnet") == "backbone 'pointnet' accepts clouds of one size only"
    fewest = np.diff(six.offsets).min()
    words = f"its smallest draw has 200 points, but a cloud has only {fewest}"
    assert left_out("density", six, replace(settings, draw_points=(200, 512)), "dgcnn") == words
