"""
A registration explained, step by step
======================================

A good registration, bad ones, and what the model cannot judge. Run it with ``python docs/tutorial.py``, or cell by cell
in an editor that knows ``# %%``. It needs no data, and the model comes with the package.
"""

# %%
# Two clouds
# ----------
# The target is the reference, a whole figure of a cat in meters; the source is what a sensor saw of it. Both are drawn
# from the same surface here, but share no point. Yours would come from files.
import numpy as np

from gpca import Explainer
from gpca.objects.canonical import canonical_cloud
from gpca.objects.procedural import surfaces

cat = next(surface for surface in surfaces("linemod") if surface.name == "cat")
points_m, _, diameter_m = canonical_cloud(cat, "linemod", 4096)
random = np.random.default_rng(0)
points_m = random.permutation(points_m.astype(float))
target, source = points_m[:2048], points_m[2048:]
print(f"{cat.name}: {len(target)} points, diameter {diameter_m:.3f} m")

# %%
# The explainer
# -------------
# It loads the model once; after that, an explanation takes some tenths of a second.
explainer = Explainer.load()
print(f"GP-CA learned from: {explainer.model.title}")

# %%
# A registration that should be fine
# ----------------------------------
# The source starts a little off. ``text`` is what the command line prints, here with ``--verbose``. A model whose GP-CA
# learned partial views warns that this source shows all sides: then the diagnosis counts, and the scores of GP-CA below
# it do not.
step = np.eye(4)
step[:3, 3] = 0.03 * diameter_m
fine = explainer.explain(source, target, step)
print(fine.text(verbose=True))

# %%
# The same object, seen badly
# ---------------------------
# Few points of a noisy sensor, a wrong initial pose, a quarter of the object alone, and that quarter from the wrong
# pose.
noisy = (source + random.normal(scale=0.08 * diameter_m, size=source.shape))[:150]
turned = np.eye(4)
turned[:3, :3] = [[-1, 0, 0], [0, 1, 0], [0, 0, -1]]  # half a turn about y: upside down
quarter = source[source[:, 0] < np.quantile(source[:, 0], 0.25)]

# %%
# Several pairs at once
# ---------------------
# ``state`` says whether the registration failed, ``causes`` why, and ``action`` what to do next. Not everything that
# looks bad fails: ICP may find the pose by a quarter of the object, and then nothing is wrong.
pairs = {
    "noise": (noisy, target, None),
    "pose": (source, target, turned),
    "overlap": (quarter, target, step),
    "both": (quarter, target, turned),
}
for name, said in zip(pairs, explainer.explain_many(pairs.values()), strict=True):
    found = said.diagnosis
    causes = ", ".join(f"{cause} {share:.2f}" for cause, share in found.causes.items())
    print(f"{name:8} {found.state:8} off by 3 % or more: {found.result:.2f}; {causes}; {said.action} ({said.reason})")

# %%
# One of them in 3-D
# ------------------
# A notebook shows an explanation as its page: drag to turn the clouds, and choose where the source stands.
# ``explanation.save_html("explained.html")`` writes the same page to a file.
explainer.explain(quarter, target, turned)

# %%
# What the model cannot judge
# ---------------------------
# A source at twice its scale. The numbers still come, but with a warning.
doubtful = explainer.explain(2 * source, target)
for line in doubtful.warnings:
    print(f"warning: {line}")

# %%
# For a program
# -------------
# Plain numbers, lists and names.
print(sorted(fine.as_dict()))
