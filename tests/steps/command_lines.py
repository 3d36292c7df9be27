"""The words of every step, one after the other on tiny data."""

import json

FEW = {"iterations": 5, "inducing": 6, "draws": 20}  # of a classifier
ENCODER = {"draw_points": 64, "draws": 2, "epochs": 2, "batch_size": 12, "options": {"k": 8, "point_features": 16}}
POLICY = {
    "thresholds": {"uncertain": None, "queued_share": 0.1, "dominant": 0.4, "improvement": 0.1},
    "treatments": {"noise": "denoise", "pose": "reinitialize", "overlap": "new_view"},
    "loop": {"budget": 3},
}
LEARNING = {
    "held_out": ["noise", "overlap"], "initial": 6, "labels": 4, "batch": 2, "target": 0.9,
    "gpc": FEW,
    "rare": {"shares": [0.2], "labels": 2, "least": 1, "batch": 2, "gpc": FEW},
    "stream": {"arrivals": 8, "quiet": 2, "budget": 0.5, "every": 2},
}  # fmt: skip
SHIFT = {
    "samples": 6, "severities": {"noise": [0.03, 0.05], "crop": [0.6, 0.7]}, "held_out_share": 0.5, "train": 9,
    "encoder": {"epochs": 1, "draws": 1}, "neighbours": 3, "shape_points": 16,
}  # fmt: skip
CURVE = {"further": 24, "sizes": [20], "orders": 1, "classifier": FEW | {"learning_rate": 0.1}}
DESCRIBED = {"starts": 1, "restarts": 2, "icp_points": 64}
ICP = {"max_iterations": 30}
CAUSES = {  # of two symmetric objects with few points: only pose errors make them fail
    "train": 12, "test": 6, "points": [64, 128], "limits": {"nominal": 0.05, "failed": 0.06},
    "shares": {"nominal": 0.5, "borderline": 0.1, "noise": 0, "pose": 0.4, "overlap": 0}, "several": [0, 0],
    "severities": {"noise": [0.01, 0.05]}, "clean_pairs": 20, "candidates": 50,
}  # fmt: skip
REENACTED = {"reenactment": {"hypotheses": 2}, "causes": CAUSES, "icp": ICP}
CONTROLS = {"controls": ["density", "shuffled", "transfer"], "draw_points": [32, 64]}
ESTIMATES = ("reference_starts", "reference_data", "reference_all", "brossard", "cello")
COMMON = {"--source": "tiny"}
STEP_OPTIONS = {
    "objects": COMMON | {
        "--settings": {"kind": "mesh_folder", "location": "meshes", "unit": "mm"}, "--data-dir": ".",
        "--surface-points": 600, "--out": "objects.npz",
    },
    "registrations": COMMON | {
        "--settings": {"train": 18, "test": 6, "cloud_points": 128}, "--seed": 0, "--objects": "objects.npz",
        "--registrations": "registrations.npz", "--timings": "icp.csv",
    },
    "causes": COMMON | {
        "--settings": CAUSES | {"icp": ICP}, "--seed": 0, "--objects": "objects.npz",
        "--causes": "causes.npz", "--candidates": "candidates.csv", "--timings": "causes_timings.csv",
    },
    "describe": COMMON | {
        "--settings": DESCRIBED | {"icp": ICP}, "--seed": 0,
        "--causes": "causes.npz", "--causes-timings": "causes_timings.csv", "--descriptors": "descriptors.npz",
        "--timings": "descriptors.csv",
    },
    "reenact": COMMON | {
        "--settings": REENACTED, "--seed": 0, "--causes": "causes.npz", "--causes-timings": "causes_timings.csv",
        "--reenactments": "reenactments.npz", "--timings": "reenactments_seconds.csv",
    },
    "estimate": COMMON | {
        "--settings": {
            "estimator_pairs": {
                "methods": {"point_to_point": 2}, "train": 8, "train_starts": 7, "points": 64, "repeats": 20,
                "start_rotation_deg": 10.0, "start_translation": 0.05, "floor": 1e-6,
            },
            "success": {"error": 0.03},
            "estimators": {"brossard": {}, "cello": {"steps": 2}}, "causes": CAUSES, "icp": ICP,
        },
        "--seeds": 0, "--estimators": ["brossard", "cello"], "--estimates": list(ESTIMATES),
        "--objects": "objects.npz", "--causes": "causes.npz",
        "--rows": [f"{name}_said.csv" for name in ESTIMATES],
        "--timings": [f"{name}_seconds.csv" for name in ESTIMATES],
    },
    "train_on_causes": COMMON | {
        "--settings": ENCODER, "--seed": 0, "--causes": "causes.npz", "--causes-timings": "causes_timings.csv",
        "--weights": "cause_weights.pt", "--curve": "cause_curve.csv", "--embeddings": "cause_embeddings.npz",
        "--timings": "cause_embeddings.csv",
    },
    "diagnose_by_features": COMMON | {
        "--settings": {
            "by_features": {"trees_on_pair": {"trees": 5}, "trees_on_runs": {"trees": 5}},
            "descriptors": DESCRIBED,
        },
        "--seeds": 0, "--causes": "causes.npz", "--descriptors": "descriptors.npz",
        "--predictions": ["by/trees_on_pair/seed0.csv", "by/trees_on_runs/seed0.csv"],
    },
    "diagnose": COMMON | {
        "--settings": FEW, "--explainer": "gpca_pair", "--seeds": 0,
        "--remedies": DESCRIBED, "--reenactment": {"hypotheses": 2},
        "--causes": "causes.npz", "--read": "descriptors.npz", "--read-timings": "descriptors.csv",
        "--predictions": "diagnosis.csv", "--timings": "diagnosis_timings.csv",
    },
    "learning_samples": COMMON | {
        "--settings": {"learning_curve": CURVE, "causes": CAUSES, "icp": ICP}, "--seed": 0,
        "--chunk": 0, "--objects": "objects.npz", "--samples": "learning_samples.npz",
    },
    "learning_curve": COMMON | {
        "--settings": {"learning_curve": CURVE}, "--seed": 0, "--causes": "causes.npz",
        "--descriptors": "descriptors.npz", "--samples": "learning_samples.npz", "--out": "learning_curve.csv",
    },
    "register_methods": COMMON | {
        "--settings": {
            "method_pairs": {"samples": 3, "points": 64, "global_start": "fgr"},
            "methods": {"point_to_point": {}, "fgr": {}},
        },
        "--seeds": 0, "--methods": ["point_to_point", "fgr"], "--objects": "objects.npz",
        "--registrations": "registrations.npz", "--rows": ["point_trials.csv", "fgr_trials.csv"],
        "--timings": ["point_seconds.csv", "fgr_seconds.csv"],
    },
    "draw_scans": COMMON | {
        "--settings": {
            "entry": {"title": "Tiny", "kind": "virtual", "objects": 1, "views": 6}, "role": "evaluation",
            "choice": {"strata": [0.1, 1.0], "pairs": 2, "scan_points": 500},
        },
        "--seed": 0, "--out": "scans.npz",
    },
    "register_scans": COMMON | {
        "--settings": {
            "scans": {
                "voxel_m": 0.1, "points": 100, "global_start": "fgr",
                "ladder": [{"rotation_deg": 0, "translation_m": 0}, {"rotation_deg": 20, "translation_m": 0.2}],
            },
            "methods": {"point_to_point": {"correspondence_distance": 0.3}, "fgr": {"feature_radius": 0.5}},
        },
        "--seed": 0, "--methods": ["point_to_point", "fgr"], "--scans": "scans.npz",
        "--rows": ["point_scan_trials.csv", "fgr_scan_trials.csv"],
        "--timings": ["point_scan_seconds.csv", "fgr_scan_seconds.csv"],
    },
    "train": COMMON | {
        "--settings": ENCODER, "--seed": 0, "--registrations": "registrations.npz", "--weights": "weights.pt",
        "--curve": "curve.csv",
    },
    "embed": COMMON | {
        "--settings": ENCODER, "--seed": 0, "--registrations": "registrations.npz",
        "--registration-timings": "icp.csv", "--encoder": "weights.pt", "--embeddings": "embeddings.npz",
        "--timings": "dgcnn.csv",
    },
    "train_control": COMMON | {
        "--settings": {"controls": CONTROLS, "encoder": ENCODER}, "--control": "density", "--seed": 0,
        "--registrations": "registrations.npz", "--embeddings": "control.npz", "--curve": "control_curve.csv",
    },
    "controls": COMMON | {
        "--settings": {"controls": CONTROLS, "encoder": ENCODER, "uncertainty": {"starts": 13, "icp_points": 40},
                       "icp": {"max_iterations": 20},
                       "explainers": {"gpca": FEW, "residuals_logistic": {}}},
        "--seed": 0, "--registrations": "registrations.npz", "--encoder": "weights.pt",
        "--embeddings": "embeddings.npz", "--retrained": "density", "--retrained-embeddings": "control.npz",
        "--others": "other", "--other-registrations": "other.npz", "--predictions": "controls.csv",
    },
    "exchange": COMMON | {
        "--settings": {
            "exchange": {"methods": ["point_to_point", "point_to_plane"], "train": 9, "test": 3, "points": 64,
                         "estimators": ["censi", "cello"], "estimated_train": 9, "estimated_test": 3},
            "estimators": {"cello": {"steps": 2}}, "encoder": ENCODER,
            "uncertainty": {"starts": 13, "icp_points": 40},
            "explainers": {"gpca": FEW, "shap_additive": {},
                           "residuals_logistic": {}},
        },
        "--seeds": 0, "--objects": "objects.npz", "--registrations": "registrations.npz", "--encoders": "weights.pt",
        "--out": "exchange.csv",
    },
    "reduce": COMMON | {
        "--settings": {"components": 4, "epochs": 5}, "--reduction": "autoencoder", "--seeds": 0,
        "--embeddings": "embeddings.npz", "--out": "reduced.npz",
    },
    "uncertainty": COMMON | {
        "--settings": {"starts": 13, "icp_points": 40, "icp": {"max_iterations": 20}},
        "--design": "removal", "--seeds": 0, "--registrations": "registrations.npz",
        "--outcomes": "uncertainty.npz", "--tables": "uncertainty.csv", "--timings": "uncertainty_timings.csv",
    },
    "attribute": COMMON | {
        "--settings": FEW, "--explainer": "gpca", "--seeds": 0,
        "--registrations": "registrations.npz", "--embeddings": "embeddings.npz", "--input-timings": "dgcnn.csv",
        "--predictions": "predictions.csv", "--timings": "gpca.csv",
    },
    "without": COMMON | {
        "--settings": ENCODER | {"epochs": 1}, "--seed": 0, "--registrations": "registrations.npz",
        "--concepts": ["noise", "overlap"], "--out": "without.npz",
    },
    "active_learning": COMMON | {
        "--settings": LEARNING, "--seed": 0, "--registrations": "registrations.npz", "--embeddings": "embeddings.npz",
        "--embeddings-without": "without.npz", "--strategies": ["random", "bald_kmeans", "stream_bald"],
        "--out": ["random.csv", "bald_kmeans.csv", "stream_bald.csv"],
    },
    "frame_labels": COMMON | {
        "--settings": {
            "frame_labels": {"initial": 6, "share": 0.4, "labels": 2, "least": 1, "points": 64},
            "active_learning": LEARNING,
        },
        "--seed": 0, "--registrations": "registrations.npz", "--backbones": "dgcnn", "--embeddings": "embeddings.npz",
        "--strategies": ["random", "all_labels"], "--out": ["frame_random.csv", "frame_all_labels.csv"],
    },
    "kernel_grid": COMMON | {
        "--settings": {"kernels": ["rbf", "polynomial"], "iterations": [2, 4], "inducing": 6, "draws": 20},
        "--seeds": 0, "--registrations": "registrations.npz", "--embeddings": "embeddings.npz", "--out": "grid.csv",
        "--predictions": "grid_predictions.csv",
    },
    "shift": COMMON | {
        "--settings": {"shift": SHIFT, "registrations": {"cloud_points": 128}, "encoder": ENCODER}, "--seeds": 0,
        "--objects": "objects.npz", "--registrations": "registrations.npz",
        "--other-registrations": "other.npz", "--embeddings": "embeddings.npz", "--encoders": "weights.pt",
        "--out": "shifted.npz",
    },
    "learners": COMMON | {
        "--settings": {"gpca": FEW, "learner_nearest": {}}, "--seeds": 0,
        "--learners": ["gpca", "learner_nearest"], "--sets": "shifted.npz", "--out": ["learnt.csv", "nearest.csv"],
    },
    "label": {
        "registrations.npz": [], "--settings": FEW, "--initial": 6,
        "--embeddings": "embeddings.npz", "--labels": "labels.csv", "--answers": "answers.txt",
        "--predictions": "labelled.csv",
    },
    "attempt": COMMON | {
        "--settings": REENACTED | {"repair": {"samples": 4, "methods": {"fgr": {}}}}, "--seed": 0,
        "--objects": "objects.npz", "--causes": "causes.npz", "--attempts": "repairs/causes/tiny/seed0.npz",
        "--timings": "repairs.csv",
    },
    "repair_verdicts": {
        "--settings": {"tolerance": 0.03}, "--attempts": "repairs/causes/tiny/seed0.npz",
        "--verdicts": "repairs/verdicts.csv",
    },
    "model": COMMON | {
        "--settings": {"encoder": ENCODER, "gpc": FEW,
                       "registrations": {"cloud_points": 128}, "recovery": POLICY, "causes": CAUSES,
                       "reenactment": {"hypotheses": 2},
                       "model": {"classifier": FEW}},
        "--title": "Tiny", "--stand-in": [], "--seed": 0, "--registrations": "registrations.npz",
        "--encoder": "weights.pt", "--embeddings": "embeddings.npz", "--causes": "causes.npz",
        "--reenactments": "reenactments.npz", "--objects": "objects.npz", "--out": "model.pt",
    },
    "runtime": COMMON | {
        "--settings": {"runtime": {"repeats": 2}, "active_learning": LEARNING}, "--seed": 0, "--model": "model.pt",
        "--registrations": "registrations.npz", "--embeddings": "embeddings.npz", "--out": "runtime.csv",
    },
    "explain": {"meshes/brick.stl": [], "meshes/cone.ply": [], "--unit": "mm", "--model": "model.pt", "--json": []},
}  # fmt: skip


# The files of a second source that some steps read besides.
OF_ANOTHER_SOURCE = {
    "objects": {"--out": "objects_other.npz"},
    "registrations": {"--objects": "objects_other.npz", "--registrations": "other.npz", "--timings": "other_icp.csv"},
    "train": {"--registrations": "other.npz", "--weights": "other.pt", "--curve": "other_curve.csv"},
}


def arguments(step, changes=()):
    """The words of a step, with some options changed and those that are None left out."""
    words = [step]
    for name, value in (STEP_OPTIONS[step] | dict(changes)).items():
        if value is not None:
            values = value if isinstance(value, list) else [json.dumps(value) if isinstance(value, dict) else value]
            words += [name, *map(str, values)]
    return words


def every_step(left_out=()):
    """The words of every step, one after the other, but for those left out; some are run for a second source, too."""
    lines = []
    for step in STEP_OPTIONS:
        if step not in left_out:
            lines.append(arguments(step))
            if step in OF_ANOTHER_SOURCE:
                lines.append(arguments(step, {"--source": "other", **OF_ANOTHER_SOURCE[step]}))
    return lines


def settings(step, **changed):
    return {"--settings": STEP_OPTIONS[step]["--settings"] | changed}
