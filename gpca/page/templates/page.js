"use strict";

// The comparison: verdicts are switched by their buttons, the table is chosen in its list.
function filterComparison() {
  const comparison = document.getElementById("comparison-table");
  const rows = [...comparison.querySelectorAll("tbody tr:not(.group)")];
  const buttons = [...document.querySelectorAll("#verdict-filters button")];
  const tables = document.getElementById("table-filter");
  function count() {
    const [seen, all] = countRows(comparison);
    document.getElementById("comparison-count").textContent = `${seen} of ${all} numbers`;
  }
  function show() {
    const verdicts = new Set(
      buttons.filter((button) => button.ariaPressed === "true").map((button) => button.dataset.verdict),
    );
    for (const row of rows) {
      row.hidden = !verdicts.has(row.dataset.verdict) || (tables.value !== "" && row.dataset.table !== tables.value);
    }
    count();
  }
  for (const button of buttons) {
    button.addEventListener("click", () => {
      button.ariaPressed = String(button.ariaPressed !== "true");
      show();
    });
  }
  tables.addEventListener("change", show);
  comparison.addEventListener("searched", count);
  show();
}

// The 3-D view: one registration in one of its poses, and beside it what is known of it.
function showRegistrations() {
  const samples = JSON.parse(document.getElementById("samples").textContent);
  const chosen = document.getElementById("sample");
  const view = openView();

  const groups = new Map();
  samples.forEach((sample, index) => {
    const { title, stand_in: standIn } = sample.source;
    const name = `${title}${standIn ? " (procedural stand-in)" : ""}`;
    if (!groups.has(name)) {
      const group = document.createElement("optgroup");
      group.label = name;
      groups.set(name, chosen.appendChild(group));
    }
    groups.get(name).append(new Option(`${sample.concept}: ${sample.object}, sample ${sample.sample}`, index));
  });

  function element(tag, className, text = "") {
    const made = document.createElement(tag);
    made.className = className;
    made.textContent = text;
    return made;
  }

  function head(sample) {
    const { title, stand_in: standIn } = sample.source;
    return [
      element("h3", "", sample.object),
      element("p", "footnote", title + (standIn ? ", procedural stand-in" : "")),
    ];
  }

  // The measured share of each cause in a failure, and every counterfactual as a button that shows its cloud.
  function measured(sample) {
    const most = Math.max(...sample.what_ifs.map(({ percent }) => percent), 1.2 * sample.limit);
    const bar = (percent) => {
      const made = element("span", "bar");
      made.appendChild(document.createElement("i")).style.width = `${Math.max(0, 100 * percent / most)}%`;
      return made;
    };
    const shares = sample.shares.map(({ concept, percent }) => {
      const row = element("div", concept === sample.concept ? "score true" : "score");
      row.append(element("span", "", concept), bar(percent), element("span", "", `${percent.toFixed(1)} %`));
      return row;
    });
    const whatIfs = sample.what_ifs.map(({ words, percent }, place) => {
      const button = element("button", "what-if");
      button.type = "button";
      button.dataset.view = `what:0:${place}`;
      const ofRow = bar(percent);
      const limit = ofRow.appendChild(element("b", "limit"));
      limit.style.left = `${100 * sample.limit / most}%`;
      button.append(element("span", "", words), ofRow, element("span", "", `${percent.toFixed(1)} %`));
      return button;
    });
    return [
      element("h4", "", "What each cause adds to the error"),
      ...shares,
      element("h4", "", "Registered again without some causes"),
      ...whatIfs.reverse(),
      element("p", "footnote", `Mean errors over many starts, in % of the diameter; the line is the limit of a failure, `
        + `${sample.limit} %. What a cause adds is its Shapley value in these eight errors. Choose a row to see where `
        + `the cloud ends from the start itself; the registration that explainers see ends `
        + `${sample.error_percent.toFixed(1)} % off.`),
    ];
  }

  function show() {
    const sample = samples[chosen.value];
    document.getElementById("scores").replaceChildren(...head(sample), ...measured(sample));
    view.load(sample.scene);
    chosen.dataset.shown = chosen.value;
  }
  chosen.addEventListener("change", show);
  show();
}

// What a link leads to may be folded.
function unfold() {
  const target = document.getElementById(decodeURIComponent(location.hash.slice(1)));
  for (let box = target; box; box = box.parentElement) {
    if (box.tagName === "DETAILS") box.open = true;
  }
  const within = target && target.querySelector(":scope > details");
  if (within && target.tagName === "SECTION") within.open = true;
  if (target) target.scrollIntoView();
}

document.addEventListener("DOMContentLoaded", () => {
  window.addEventListener("hashchange", unfold);
  if (location.hash) unfold();
  if (document.getElementById("comparison-table")) {
    filterComparison();
  }
  if (document.getElementById("samples")) {
    showRegistrations();
  }
});
