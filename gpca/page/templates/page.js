"use strict";

// The comparison: verdicts are switched by their buttons, the table is chosen in its list.
function filterComparison() {
  const rows = [...document.querySelectorAll("#comparison-table tbody tr")];
  const buttons = [...document.querySelectorAll("#verdict-filters button")];
  const tables = document.getElementById("table-filter");
  function show() {
    const verdicts = new Set(
      buttons.filter((button) => button.ariaPressed === "true").map((button) => button.dataset.verdict),
    );
    for (const row of rows) {
      row.hidden = !verdicts.has(row.dataset.verdict) || (tables.value !== "" && row.dataset.table !== tables.value);
    }
    const shown = rows.filter((row) => !row.hidden).length;
    document.getElementById("comparison-count").textContent = `${shown} of ${rows.length} numbers`;
  }
  for (const button of buttons) {
    button.addEventListener("click", () => {
      button.ariaPressed = String(button.ariaPressed !== "true");
      show();
    });
  }
  tables.addEventListener("change", show);
  show();
}

// The 3-D view: one sample in one of its poses, and its scores beside it.
function showRegistrations() {
  const samples = JSON.parse(document.getElementById("samples").textContent);
  const chosen = document.getElementById("sample");
  const poses = [...document.querySelectorAll("#poses button")];
  const view = document.getElementById("clouds");
  if (typeof Plotly === "undefined") {
    view.textContent = "The view needs page/plotly.min.js beside this page, which is not there.";
    return;
  }

  const groups = new Map();
  samples.forEach((sample, index) => {
    const { title, stand_in: standIn } = sample.source;
    if (!groups.has(title)) {
      const group = document.createElement("optgroup");
      group.label = standIn ? `${title} (procedural stand-in)` : title;
      groups.set(title, chosen.appendChild(group));
    }
    groups.get(title).append(new Option(`${sample.concept}: ${sample.object}, sample ${sample.sample}`, index));
  });

  // Whole thousandths of the diameter, x y z after one another, moved by a 4×4 matrix given row by row.
  function coordinates(points, matrix = [1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1]) {
    const axes = { x: [], y: [], z: [] };
    for (let i = 0; i < points.length; i += 3) {
      const [x, y, z] = [points[i] / 1000, points[i + 1] / 1000, points[i + 2] / 1000];
      ["x", "y", "z"].forEach((axis, row) => {
        const [a, b, c, shift] = matrix.slice(4 * row, 4 * row + 4);
        axes[axis].push(a * x + b * y + c * z + shift);
      });
    }
    return axes;
  }

  function cloud(name, colour, axes) {
    const marker = { size: 2, color: colour };
    return { type: "scatter3d", mode: "markers", name, marker, hoverinfo: "skip", ...axes };
  }

  // Equal steps on all axes, and the same extent in every pose, so that the eye sees what the pose changes.
  function axes(clouds) {
    const [low, high] = [Math.min, Math.max].map((end) =>
      ["x", "y", "z"].map((axis) => end(...clouds.flatMap((points) => points[axis]))),
    );
    const half = Math.max(...high.map((value, axis) => value - low[axis])) / 2;
    const scene = { aspectmode: "cube", uirevision: "kept", camera: { eye: { x: 1.1, y: 1.1, z: 0.7 } } };
    ["x", "y", "z"].forEach((axis, row) => {
      const middle = (low[row] + high[row]) / 2;
      scene[`${axis}axis`] = { visible: false, range: [middle - half, middle + half] };
    });
    return scene;
  }

  function element(tag, className, text = "") {
    const made = document.createElement(tag);
    made.className = className;
    made.textContent = text;
    return made;
  }

  function scores(sample) {
    const named = sample.predicted === "" ? "names no concept" : `names ${sample.predicted}`;
    const verdict = sample.predicted === sample.concept ? ["right", "good"] : ["wrong", "bad"];
    const said = element("p", "", `GP-CA ${named}: `);
    said.append(element("span", `verdict ${verdict[1]}`, verdict[0]));
    const rows = sample.scores.map(({ concept, mean, deviation }) => {
      const row = element("div", concept === sample.concept ? "score true" : "score");
      const bar = element("div", "bar");
      if (mean !== null) {
        bar.appendChild(document.createElement("i")).style.width = `${100 * mean}%`;
      }
      if (mean !== null && deviation !== null) {
        const [from, to] = [Math.max(0, mean - deviation), Math.min(1, mean + deviation)];
        const whisker = bar.appendChild(document.createElement("b"));
        whisker.style.left = `${100 * from}%`;
        whisker.style.width = `${100 * (to - from)}%`;
      }
      const number = mean === null ? "–" : mean.toFixed(2) + (deviation === null ? "" : ` ± ${deviation.toFixed(2)}`);
      row.append(element("span", "", concept), bar, element("span", "", number));
      return row;
    });
    document.getElementById("scores").replaceChildren(
      element("h3", "", sample.object),
      element("p", "footnote", sample.source.title + (sample.source.stand_in ? ", procedural stand-in" : "")),
      element("p", "", `True cause: ${sample.concept} (${sample.severity})`),
      said,
      ...rows,
      element("p", "footnote", `Mean of the posterior draws ± their standard deviation; the true cause is bold. `
        + `ICP ends ${sample.error_percent.toFixed(1)} % of the diameter off (ADD-S: ${sample.state}); `
        + `its fitness is ${sample.fitness}`
        + (sample.uncertainty === null ? "." : `, its uncertainty u ${sample.uncertainty.toFixed(1)} nats `
          + `(of 95 % of the clean pairs: at most ${sample.clean_uncertainty.toFixed(1)}).`)),
    );
  }

  function draw() {
    const sample = samples[chosen.value];
    const pose = poses.find((button) => button.ariaPressed === "true").dataset.pose;
    const target = coordinates(sample.target_points);
    const inPose = {
      initial: coordinates(sample.points, sample.initial),
      icp: coordinates(sample.points),
      truth: coordinates(sample.points, sample.truth),
    };
    const traces = [cloud("target", "#d55e00", target), cloud("source", "#0072b2", inPose[pose])];
    const scene = axes([target, ...Object.values(inPose)]);
    const layout = { scene, margin: { l: 0, r: 0, t: 0, b: 0 }, showlegend: false };
    const config = { displaylogo: false, responsive: true, modeBarButtons: [["toImage", "resetCameraDefault3d"]] };
    Plotly.react(view, traces, layout, config).then(() => {
      view.dataset.shown = `${chosen.value} ${pose}`;
    });
    scores(sample);
  }

  for (const button of poses) {
    button.addEventListener("click", () => {
      for (const other of poses) {
        other.ariaPressed = String(other === button);
      }
      draw();
    });
  }
  chosen.addEventListener("change", draw);
  draw();
}

document.addEventListener("DOMContentLoaded", () => {
  if (document.getElementById("comparison-table")) {
    filterComparison();
  }
  if (document.getElementById("samples")) {
    showRegistrations();
  }
});
