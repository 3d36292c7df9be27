"use strict";

// Two clouds on a plain canvas: the target, and the source in the pose that was chosen; beside it in the repaired pose,
// or in the likeliest one where that is another.
function openView() {
  const canvas = document.getElementById("view");
  const context = canvas.getContext("2d");
  const box = document.querySelector(".view");
  const byId = (name) => document.getElementById(name);
  const SOURCE = [0, 114, 178], TARGET = [213, 94, 0], BEHIND = [179, 184, 190];
  // Viridis from where it is bright enough for white paper: near is green, far is dark; lightness falls all the way.
  const MAP = [[122, 209, 81], [68, 191, 112], [34, 168, 132], [33, 145, 140], [42, 120, 142], [53, 95, 141],
    [65, 68, 135], [72, 36, 117], [68, 1, 84]];
  const IDENTITY = [1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1];
  const INITIAL = { yaw: -0.9, pitch: 0.35, zoom: 1 };

  function unpack({ step, data }) {
    const bytes = Uint8Array.from(atob(data), (letter) => letter.charCodeAt(0));
    return Float32Array.from(new Int16Array(bytes.buffer), (steps) => steps * step);
  }

  function moved(points, T) {
    const out = new Float32Array(points.length);
    for (let i = 0; i < points.length; i += 3) {
      for (let row = 0; row < 3; row += 1) {
        out[i + row] = T[4 * row] * points[i] + T[4 * row + 1] * points[i + 1] + T[4 * row + 2] * points[i + 2]
          + T[4 * row + 3];
      }
    }
    return out;
  }

  function nearest(points, others) {
    const out = new Float32Array(points.length / 3);
    for (let i = 0; i < out.length; i += 1) {
      const [x, y, z] = [points[3 * i], points[3 * i + 1], points[3 * i + 2]];
      let least = Infinity;
      for (let j = 0; j < others.length; j += 3) {
        const dx = others[j] - x, dy = others[j + 1] - y, dz = others[j + 2] - z;
        const square = dx * dx + dy * dy + dz * dz;
        if (square < least) least = square;
      }
      out[i] = Math.sqrt(least);
    }
    return out;
  }

  function colorAt(share) {
    const place = Math.min(Math.max(share, 0), 1) * (MAP.length - 1);
    const low = Math.min(Math.floor(place), MAP.length - 2);
    return MAP[low].map((value, part) => value + (place - low) * (MAP[low + 1][part] - value));
  }

  let scene = null, target = null, source = null;
  const clouds = new Map();
  const camera = { ...INITIAL };
  let shown = "found";
  let hypothesis = 0;

  // Registrations that are the same one are kept once: the others are its place in the list.
  function whatIf(clouds, row) {
    return typeof clouds[row] === "number" ? clouds[clouds[row]] : clouds[row];
  }

  // The source as one view has it, and its distances, each computed when it is first looked at.
  function cloudOf(view) {
    if (!clouds.has(view)) {
      const [kind, k, row] = view.split(":");
      const points = kind === "what" ? unpack(whatIf(scene.poses[k].what_ifs, row))
        : moved(source, { start: IDENTITY, found: scene.found, repaired: scene.repaired }[kind] || scene.poses[k].T);
      clouds.set(view, { points, distances: nearest(points, target) });
    }
    return clouds.get(view);
  }

  function length(diameters) {
    return `${Number((diameters * scene.diameter).toPrecision(2))} ${scene.unit}`;
  }

  function title(view) {
    if (scene.titles && view in scene.titles) return scene.titles[view];
    const [kind, k] = view.split(":");
    if (kind === "what") {
      const button = document.querySelector(`.what-if[data-view="${view}"] span`);
      return `Re-enacted as if pose ${Number(k) + 1} were true, ${button.textContent.toLowerCase()}`;
    }
    return { start: "Before the registration", found: "After the registration", repaired: "Repaired" }[kind]
      || `Pose ${Number(k) + 1}`;
  }

  function said(view) {
    const { distances } = cloudOf(view);
    const sorted = [...distances].sort((a, b) => a - b);
    const within = distances.reduce((count, distance) => count + (distance <= scene.reach), 0) / distances.length;
    return `${title(view)}: the median distance to the target is `
      + `${length(sorted[sorted.length >> 1])}, and ${Math.round(100 * within)} % of the points lie within `
      + `${length(scene.reach)} of it.`;
  }

  const views = () => (scene.beside && scene.beside !== shown ? [shown, scene.beside] : [shown]);

  function draw() {
    const ratio = window.devicePixelRatio || 1;
    const [width, height] = [Math.round(canvas.clientWidth * ratio), Math.round(canvas.clientHeight * ratio)];
    if (canvas.width !== width || canvas.height !== height) [canvas.width, canvas.height] = [width, height];
    context.fillStyle = "#fff";
    context.fillRect(0, 0, width, height);
    const wide = width / views().length;
    views().forEach((view, number) => {
      context.save();
      context.translate(number * wide, 0);
      context.beginPath();
      context.rect(0, 0, wide, height);
      context.clip();
      drawView(view, wide, height, ratio);
      if (scene.beside) {
        context.fillStyle = "#1a1a1a";
        context.font = `${13 * ratio}px system-ui, sans-serif`;
        context.fillText(title(view), 10 * ratio, 20 * ratio, wide - 20 * ratio);
      }
      context.restore();
    });
    canvas.dataset.shown = shown;
  }

  function drawView(view, width, height, ratio) {
    const byDistance = byId("by-distance").checked;
    const parts = [];
    if (byId("show-target").checked) parts.push({ points: target, color: () => (byDistance ? BEHIND : TARGET) });
    if (byId("show-source").checked) {
      const { points, distances } = cloudOf(view);
      parts.push({ points, color: (i) => (byDistance ? colorAt(distances[i] / scene.reach) : SOURCE) });
    }
    const scale = (0.47 * camera.zoom * Math.min(width, height)) / scene.radius;
    const [sy, cy, sp, cp] = [Math.sin(camera.yaw), Math.cos(camera.yaw), Math.sin(camera.pitch), Math.cos(camera.pitch)];
    const dots = [];
    for (const { points, color } of parts) {
      for (let i = 0; i < points.length; i += 3) {
        const [x, y, z] = [points[i], points[i + 1], points[i + 2]];
        const right = -sy * x + cy * y, ahead = cy * x + sy * y;
        const up = cp * z - sp * ahead, near = sp * z + cp * ahead;
        dots.push([near, width / 2 + scale * right, height / 2 - scale * up, color(i / 3)]);
      }
    }
    dots.sort((a, b) => a[0] - b[0]);
    const size = ratio * Math.min(Math.max(Math.min(width, height) / ratio / 190, 2.2), 4)
      * Math.min(Math.max(Math.sqrt(camera.zoom), 0.7), 2);
    for (const [near, across, down, color] of dots) {
      const pale = 0.4 * Math.min(Math.max((scene.radius - near) / (2 * scene.radius), 0), 1);
      const [r, g, b] = color.map((value) => Math.round(value + (255 - value) * pale));
      context.fillStyle = `rgb(${r},${g},${b})`;
      context.fillRect(across - size / 2, down - size / 2, size, size);
    }
  }

  let waiting = false;
  function redraw() {
    if (waiting) return;
    waiting = true;
    requestAnimationFrame(() => { waiting = false; draw(); });
  }

  function choose(view) {
    shown = view;
    const [kind, k] = view.split(":");
    if (kind === "pose" || kind === "what") hypothesis = Number(k);
    for (const button of document.querySelectorAll("[data-view]")) {
      button.setAttribute("aria-pressed", String(button.dataset.view === shown));
    }
    for (const group of document.querySelectorAll("[data-hypothesis]")) {
      group.hidden = Number(group.dataset.hypothesis) !== hypothesis;
    }
    if (byId("hypothesis")) byId("hypothesis").textContent = String(hypothesis + 1);
    byId("said").textContent = views().map(said).join(" ");
    redraw();
  }

  function color() {
    const on = byId("by-distance").checked;
    box.classList.toggle("by-distance", on);
    byId("scale").classList.toggle("off", !on);
    redraw();
  }

  // The mouse turns, and so does a finger that moves sideways: up and down scrolls the page. Two fingers, or the wheel
  // with Ctrl, zoom.
  const fingers = new Map();
  function apart() {
    const [a, b] = [...fingers.values()];
    return Math.hypot(a.x - b.x, a.y - b.y);
  }
  canvas.addEventListener("pointerdown", (event) => {
    canvas.setPointerCapture(event.pointerId);
    fingers.set(event.pointerId, { x: event.clientX, y: event.clientY });
  });
  canvas.addEventListener("pointermove", (event) => {
    const before = fingers.get(event.pointerId);
    if (!before) return;
    const wide = fingers.size === 2 ? apart() : 0;
    const now = { x: event.clientX, y: event.clientY };
    fingers.set(event.pointerId, now);
    if (fingers.size === 1) turn(0.01 * (now.x - before.x), 0.01 * (now.y - before.y));
    else if (fingers.size === 2 && wide > 0) zoom(apart() / wide);
  });
  for (const end of ["pointerup", "pointercancel", "lostpointercapture"]) {
    canvas.addEventListener(end, (event) => fingers.delete(event.pointerId));
  }
  canvas.addEventListener("wheel", (event) => {
    if (!event.ctrlKey && !event.metaKey) return;
    event.preventDefault();
    zoom(Math.exp(-0.0015 * event.deltaY));
  }, { passive: false });
  canvas.addEventListener("keydown", (event) => {
    const turns = { ArrowLeft: [-0.1, 0], ArrowRight: [0.1, 0], ArrowUp: [0, -0.1], ArrowDown: [0, 0.1] };
    if (turns[event.key]) turn(...turns[event.key]);
    else if (event.key === "+" || event.key === "-") zoom(event.key === "+" ? 1.15 : 1 / 1.15);
    else return;
    event.preventDefault();
  });
  function turn(yaw, pitch) {
    camera.yaw -= yaw;
    camera.pitch = Math.min(Math.max(camera.pitch + pitch, -1.57), 1.57);
    redraw();
  }
  function zoom(factor) {
    camera.zoom = Math.min(Math.max(camera.zoom * factor, 0.2), 12);
    redraw();
  }

  byId("reset").addEventListener("click", () => { Object.assign(camera, INITIAL); redraw(); });
  for (const name of ["show-source", "show-target"]) byId(name).addEventListener("change", redraw);
  byId("by-distance").addEventListener("change", color);
  document.addEventListener("click", (event) => {
    const button = event.target.closest("[data-view]");
    if (button) choose(button.dataset.view);
  });
  const [, bar, most] = byId("scale").children;
  bar.style.background = `linear-gradient(to right, ${MAP.map((rgb) => `rgb(${rgb})`).join(", ")})`;
  new ResizeObserver(() => { if (scene) redraw(); }).observe(canvas);

  // Shows another pair of clouds, in the view that was chosen where it has that too.
  function load(given) {
    scene = given;
    [target, source] = [unpack(scene.target), unpack(scene.source)];
    clouds.clear();
    most.textContent = `${length(scene.reach)} or more`;
    const [kind, k] = shown.split(":");
    const pose = scene.poses[k];
    const there = kind === "what" ? pose && pose.what_ifs.length : k === undefined || pose;
    choose(there ? shown : "found");
    box.classList.toggle("two", Boolean(scene.beside));
    color();
  }

  return { load };
}
