"""What to do next, in words, for each branch of the policy."""

from gpca.recovery.policy import NOTHING, QUEUE

CHECK = "check"  # the branch of an explanation without meaning: the user checks the input
WORDS = {
    NOTHING: "none",
    "reinitialize": "reinitialize ICP with a broader search",
    "new_view": "change the viewpoint",
    "denoise": "filter and check the sensor",
    CHECK: "check what was given",
    QUEUE: "queue for labeling, so that the cause can be learned",
}
