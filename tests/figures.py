"""What tests of figures and of the page share."""

import sys

import numpy as np
import pytest

from gpca.pairs.perturbation import CONCEPTS

LIMITS = {"nominal": 0.02, "failed": 0.03}  # of the errors that states are told apart by


@pytest.fixture(scope="session")
def stage_files(registrations, tmp_path_factory):
    """Paths (registrations, embeddings, predictions, uncertainties) and limits.

    Pose of sample p has score 0.5 + p / 100, all are named right, and test sample p has an uncertainty of p / 10.
    """
    from gpca.io.arrays import save_arrays

    folder = tmp_path_factory.mktemp("stages")
    registrations.save(folder / "registrations.npz")
    random = np.random.default_rng(3)
    place_S = np.array([CONCEPTS.index(concept) for concept in registrations.concept])
    h_S_d = random.normal(size=(len(registrations), 12)) + 8 * np.eye(3, 12)[place_S]
    names = {"sample": registrations.sample, "split": registrations.split}
    save_arrays(folder / "embeddings.npz", {"h": h_S_d.astype(np.float32), **names}, registrations.axes)
    score_S = 0.5 + registrations.sample / 100
    rows = ["sample,split,object,cluster,concept_true,concept_predicted,score_noise,score_pose,score_overlap,"]
    rows[0] += "variance_noise,variance_pose,variance_overlap,bald,entropy,abstained,icp_calls"
    for i, score in enumerate(score_S):
        scores = np.where(np.arange(3) == place_S[i], score, (1 - score) / 2)
        head = f"{registrations.sample[i]},{registrations.split[i]},{registrations.object_name[i]},"
        head += f"{registrations.cluster[i]},{registrations.concept[i]},{registrations.concept[i]}"
        bald = f"{0.01 + i / 1000:.6f}"
        rows.append(",".join([head, *(f"{s:.6f}" for s in scores), "0.01,0.0144,0.0025", bald, "0.5,False,0"]))
    (folder / "predictions.csv").write_text("\n".join(rows) + "\n")
    write_uncertainties(folder / "uncertainties.csv", registrations)
    names = ("registrations.npz", "embeddings.npz", "predictions.csv", "uncertainties.csv")
    return *(folder / name for name in names), LIMITS


def write_uncertainties(path, registrations):
    """Write an uncertainty of p / 10 nats for test sample p, and of 1 nat for every clean pair."""
    samples = registrations.sample[registrations.rows("test")]
    rows = [f"{sample},test,0,1,{sample / 10}" for sample in samples]
    head = "sample,split,uncertainty_reference,uncertainty_clean,uncertainty_observed"
    path.write_text("\n".join([head, *rows]) + "\n")


@pytest.fixture
def same_bytes():
    """Check that a figure that is drawn twice looks the same, and return its pixels."""

    def pixels(draw):
        once, again = (figure.canvas for figure in (draw(), draw()))
        for canvas in (once, again):
            canvas.draw()
        assert once.tostring_argb() == again.tostring_argb()
        return np.asarray(once.buffer_rgba())[..., :3]

    return pixels


def words_of(figure):
    """Return all words of a figure, and of its panels."""
    from matplotlib.text import Text

    return [text.get_text() for text in figure.findobj(Text) if text.get_text() and text.get_visible()]


def assert_words_are_large_enough_and_inside(figure):
    from matplotlib.text import Text

    figure.draw_without_rendering()
    for text in figure.findobj(Text):
        if text.get_text() and text.get_visible():
            assert text.get_fontsize() >= 7, text.get_text()
            box, page = text.get_window_extent(), figure.bbox
            assert box.x0 >= -1 and box.x1 <= page.width + 1, text.get_text()
            assert box.y0 >= -1 and box.y1 <= page.height + 1, text.get_text()


@pytest.fixture(autouse=True)
def figures_closed():
    """Matplotlib keeps every figure that a test draws."""
    yield
    if "matplotlib.pyplot" in sys.modules:
        sys.modules["matplotlib.pyplot"].close("all")
