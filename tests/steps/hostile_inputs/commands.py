"""The step that reads each kind of file."""

COMMON = ["--source", "tiny"]
COMMANDS = {
    "objects.npz": ["registrations", *COMMON, "--seed", 0, "--objects", "objects.npz", "--registrations", "new.npz",
                    "--timings", "new.csv"],
    "registrations.npz": ["train", *COMMON, "--seed", 0, "--registrations", "registrations.npz", "--weights", "new.pt",
                          "--curve", "new.csv"],
    "embeddings.npz": ["reduce", *COMMON, "--reduction", "none", "--seeds", 0, "--embeddings", "embeddings.npz",
                       "--out", "new.npz"],
    "uncertainty.npz": ["attribute", *COMMON, "--explainer", "shap_removal", "--seeds", 0, "--registrations",
                        "registrations.npz", "--uncertainty", "uncertainty.npz", "--uncertainty-timings",
                        "conditions.csv", "--input-timings", "seconds.csv", "--predictions", "new.csv", "--timings",
                        "new_seconds.csv"],
}  # fmt: skip
