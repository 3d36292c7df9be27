"""Hash of results; run in either clone as tests/test_zz_hash.py."""
import hashlib, json, os
from dataclasses import replace
import numpy as np, pytest
OUT = os.environ["H_OUT"]; ONLY = os.environ.get("H_ONLY", "")
R = {}
def put(key, *arrays):
    d = hashlib.sha256()
    for a in arrays:
        a = np.asarray(a); d.update(str(a.dtype).encode()+str(a.shape).encode())
        d.update(repr(a.tolist()).encode() if a.dtype==object else np.ascontiguousarray(a).tobytes())
    R[key] = d.hexdigest()[:16]
    with open(OUT, "w") as f: json.dump(R, f, indent=0, sort_keys=True)
def guarded(key, f):
    try: put(key, *f())
    except Exception as e: put(key, np.array(repr(e)))
only = lambda n: pytest.mark.skipif(bool(ONLY) and n not in ONLY.split(","), reason="")

@only("methods")
def test_methods(objects):
    from gpca.alignment.methods.registry import methods, make_method, installed
    from tests.alignment.methods.pairs import small_motion, perturbed
    pairs = {"small": small_motion(objects)[0], "far": replace(perturbed(objects,0,"noise")[0], target=perturbed(objects,0,"noise")[0].target+9.0)}
    for c in ("noise","pose","overlap"):
        for i in range(2): pairs[c+str(i)] = perturbed(objects, i, c, i)[0]
    pairs["bare"] = replace(pairs["noise0"], source_normals=None, target_normals=None)
    for n in installed(methods()):
        for k, p in pairs.items():
            o = make_method(n)(p); put(f"method {n} {k}", o.T_target_source, o.fitness, o.inlier_rmse, np.array(o.failure))
    for k in ("noise0","pose1"):
        for n, s in {"trimmed":{"overlap":.6},"fgr":{"tuples":50,"feature_neighbors":20},"fpfh_ransac":{"edge_similarity":.8},"teaser":{"most_matches":100,"noise":.03},
          "weight_normals":{"metric":"point_to_point","max_iterations":3},"random_sampling":{"sampled":.2},"reject_normals":{"angle_deg":20},"huber":{"scale":.02},"point_to_point":{"max_iterations":2}}.items():
            o = make_method(n, s)(pairs[k]); put(f"method {n} {k} {s}", o.T_target_source, o.fitness, o.inlier_rmse, np.array(o.failure))
    from gpca.alignment.methods.registry import method_entry
    put("titles", *[np.array(repr((n,e.title,e.is_global,e.package))) for n,e in sorted(methods().items())])

@only("estimators")
def test_estimators(objects, registrations):
    from gpca.uncertainty.estimators.registry import make_estimator, estimators
    from gpca.uncertainty.estimators.interface import Example
    from tests.uncertainty.estimators.cases import registered, plane, FAR
    rnd = np.random.default_rng(0)
    ex = [Example(rnd.normal(size=9), rnd.normal(size=(13, 6))*.1, rnd.normal(size=6)*.1, np.eye(4)) for _ in range(12)]
    q = {"monte_carlo": {"starts": 13}, "bayesian_icp": {"steps": 20, "burn_in": 5}, "stein_icp": {"steps": 5}, "cello": {"steps": 5}, "learned": {"steps": 5}}
    for m in ("point_to_point","point_to_plane","point_to_point_open3d","gicp","teaser"):
        for nm, kw in {"a":dict(noise=.01),"p":dict(shape=plane),"f":dict(T_found=FAR)}.items():
            reg = registered(method=m, describe=lambda: np.ones(9)*.3, **kw)
            for e in estimators():
                s = make_estimator(e, q.get(e), ex)(reg)
                put(f"est {e} {m} {nm}", np.zeros(1) if s.covariance_6_6 is None else s.covariance_6_6, np.array(s.failure))
    for e in ("censi","bonnabel","brossard"):
        s = make_estimator(e, {"noise": .02})(registered(method="point_to_plane" if e=="bonnabel" else "point_to_point", noise=.01)); put(f"est {e} noise", s.covariance_6_6)
    for e in ("cello","learned"):
        s = make_estimator(e, {}, ex[:3])(registered(noise=.01)); put(f"est {e} few", np.array(s.failure))
        s = make_estimator(e, {}, ex)(registered(noise=.01)); put(f"est {e} undescribed", np.array(s.failure))
    put("est titles", *[np.array(repr((n,e.title,e.models))) for n,e in sorted(estimators().items())])

@only("designs")
def test_designs(registrations, tmp_path):
    from gpca.uncertainty.designs import evaluate_design, DESIGNS, design_rows, LiveUncertainty
    from gpca.uncertainty.settings import UncertaintySettings
    from gpca.uncertainty.interventions import Knobs
    s = UncertaintySettings(starts=13, icp_points=60)
    few = registrations.subset(np.r_[0:3, 36:39])
    for d in DESIGNS:
        put(f"rows {d}", design_rows(registrations, d, 6), design_rows(registrations, d, None))
        o, a, b = evaluate_design(d, few, "tiny", 0, s)
        put(f"design {d}", o.sample, o.split, o.covariance, o.uncertainty, o.residual, o.degenerate, o.icp_calls, np.array(a.shape), np.array(b.shape))
        o.write_table(tmp_path/"t.csv", DESIGNS[d].conditions); R[f"design {d} table"] = hashlib.sha256((tmp_path/"t.csv").read_bytes()).hexdigest()[:16]
        at = o.attach_to(few, a, b).attached; put(f"design {d} attached", np.array(repr(sorted(at))))
    l = LiveUncertainty(registrations, 3, "tiny", 0, s); put("live", l(Knobs(.01,2.,.3)), l.icp_calls)

@only("exchange")
def test_exchange(registrations):
    from gpca.uncertainty.estimators.registry import make_estimator
    from gpca.uncertainty.settings import UncertaintySettings
    from gpca.uncertainty.estimators import substitute as S
    s = UncertaintySettings(starts=13, icp_points=60)
    k = S.KnobbedRegistrar(registrations, "tiny", 0, s)
    es = k.estimates(np.arange(2), {n: make_estimator(n) for n in ("censi","brossard","monte_carlo","bonnabel")})
    for n, e in es.items(): put(f"exchange {n}", e.covariance, e.failure.astype(str), e.failures(3))
    a = es["censi"].attach_to(registrations.subset(np.arange(2)), np.arange(2), 8, 1e-6).attached
    put("exchange attach", np.array(repr(sorted(a))), a["covariance"], a["uncertainty"])
    from types import SimpleNamespace
    judges = SimpleNamespace(of=lambda r, row: SimpleNamespace(symmetries=np.eye(3)[None]))
    try:
        for i, x in enumerate(k.examples(np.arange(3), judges)): put(f"exchange example {i}", x.descriptors, x.twists, x.true_twist, x.T_target_intrinsic)
    except Exception as e: put("exchange example", np.array(repr(e)))

@only("encoders")
def test_encoders(registrations, tmp_path):
    import torch
    from gpca.encoders.registry import EncoderSettings, make_encoder, parameter_count
    from gpca.encoders.training import train_encoder, embed, write_weights, load_model
    cases = {"dgcnn": {"k": 8, "point_features": 16}, "pointnet": {"width": 8}, "pointnet_tnet": {"width": 8}, "pointnet2": {"width": 8,"centroids":16}, "pointnext": {"width": 8}}
    few = registrations
    for n, o in cases.items():
        st = EncoderSettings(n, draw_points=64, draws=2, epochs=2, options=o)
        m, c = train_encoder(few, "tiny", 0, st); put(f"train {n}", *[v.numpy() for v in m.state_dict().values()], np.array(repr(list(m.state_dict()))), np.array(repr(c)))
        put(f"embed {n}", *embed(m, few, "tiny", 0, st)); put(f"count {n}", parameter_count(m))
        write_weights(tmp_path/"w.pt", m, ("tiny",0)); R[f"file {n}"] = hashlib.sha256((tmp_path/"w.pt").read_bytes()).hexdigest()[:16]
        load_model(tmp_path/"w.pt", st, axes=("tiny",0))
    torch.manual_seed(1); e = make_encoder("pointnet2", {"width": 8, "centroids": 16, "as_published": True}).eval()
    put("pointnet2 published", e(torch.from_numpy(registrations.cloud(0)[None,:64].astype(np.float32))).detach().numpy())
    for nm, kw in {"any": dict(fewest_points=40), "two": dict(head="two_layer", validation_share=.25, patience=2, epochs=4)}.items():
        st = EncoderSettings("dgcnn", **{**dict(draw_points=64, draws=2, epochs=2, options=cases["dgcnn"]), **kw})
        cp = tmp_path/f"cp{nm}.pt"
        m, c = train_encoder(few, "tiny", 0, st, cp); put(f"train dgcnn {nm}", *[v.numpy() for v in m.state_dict().values()], np.array(repr(c))); R[f"cp {nm}"] = hashlib.sha256(cp.read_bytes()).hexdigest()[:16]
        put(f"embed dgcnn {nm}", *embed(m, few, "tiny", 0, st))
        m.train(); g = torch.from_numpy(registrations.cloud(0)[None,:64].astype(np.float32)).requires_grad_(); m.eval(); m(g).sum().backward(); put(f"slope {nm}", g.grad.numpy())
    from gpca.encoders.reduction import reduce
    h = np.random.default_rng(0).normal(size=(30, 20)).astype(np.float32)
    for n, s in {"none":{}, "pca":{"components":4}, "autoencoder":{"components":4,"epochs":3}, "umap":{"components":3,"neighbours":5}}.items():
        put(f"reduce {n}", reduce(n, h[:20], h[20:], s, "tiny", 0))

FASTG = {"learning_rate": 0.1, "iterations": 20, "inducing": 8, "draws": 50}
@only("concepts")
def test_concepts(registrations):
    from gpca.explainers.registry import explainers, explainer_entry
    from gpca.uncertainty.designs import evaluate_design
    from gpca.uncertainty.settings import UncertaintySettings
    s = UncertaintySettings(starts=13, icp_points=40)
    rnd = np.random.default_rng(0); lab = {c:i for i,c in enumerate(("noise","pose","overlap"))}
    emb = rnd.normal(size=(len(registrations), 8)); emb[np.arange(len(emb)), [lab[c] for c in registrations.concept]] += 2.5
    reg = replace(registrations, attached={"embedding": emb, "head_logits": emb[:, :3]})
    K = {"additive":11,"latin":25,"saltelli":41,"oracle":8,"removal":8}
    outcome = {}
    for d,k in K.items():
        n=len(reg); A=rnd.normal(size=(n,k,6,6))*.05
        outcome[d]=dict(covariance=A@A.transpose(0,1,3,2), uncertainty=rnd.random((n,k)), residual=rnd.normal(size=(n,k)), degenerate=np.zeros((n,k)), icp_calls=np.full((n,k),13), seconds=np.ones((n,k)), icp_seconds=np.ones((n,k))*.5)
    quick = {"gpca":FASTG,"gpca_paper":FASTG,"gpca_matern":{**FASTG},"gpca_gpytorch":FASTG,"analytical_gpc":{**FASTG,"shape_points":32},"analytical_gpc_no_counts":{**FASTG,"shape_points":32},"gpca_pair":{**FASTG,"points":64},"gpca_pair_clouds":{**FASTG,"points":64},
      "gpca_pair_dgcnn":{**FASTG,"points":32,"draw_points":16,"epochs":1},"gpca_pair_dgcnn_clouds":{**FASTG,"points":32,"draw_points":16,"epochs":1},"pair_forest":{"trees":10,"points":64},"density":{"points":64},
      "learner_ensemble":{"members":2,"steps":20},"learner_dropout":{"steps":20},"learner_laplace_head":{"steps":20,"hidden":16},"learner_dirichlet_gp":{"iterations":5},"residuals_forest":{"trees":10},
      "sa_local_removal_residual":{"worth":"residual"},"shap_removal_residual":{"worth":"residual"},"rule":{"turned_deg":8.0,"complete":.9}}
    for n, e in explainers().items():
        r = reg
        if e.design: r = replace(reg, attached={**reg.attached, **outcome[e.design]})
        x = e.make("tiny", 0, **quick.get(n, {}))
        x.fit(r.subset(r.rows("train"))); test = r.subset(r.rows("test")); a = x.explain(test if e.oracle else test.without_labels())
        put(f"concept {n}", a.scores_N_C, a.abstained_N, a.icp_calls_N, *( [a.icp_seconds_N] ), *[v for v in (a.variances_N_C, a.bald_N) if v is not None], np.array(repr((a.concepts, e.title, e.sees, e.reads, e.oracle, e.observed_only))))
        if hasattr(x, "rules"): put(f"rules {n}", np.array(repr(x.rules())))

from tests.baselines.test_causes import seen, FAST, COMMITTEES
@only("causes")
def test_causes(seen):
    from gpca.explainers.registry import explainers, CAUSES
    for n, e in explainers(CAUSES).items():
        x = e.make("four", 100, **FAST.get(n, {})); x.fit(seen); a = x.explain(seen.without_labels())
        put(f"cause {n}", a.scores_N_C, a.abstained_N, a.icp_calls_N, np.array(repr((a.concepts, e.title, e.sees, e.reads, e.oracle, e.observed_only))))
