"use strict";
// Buttons, slider, keys; the page begins here.
(async function () {
  const el = (id) => document.getElementById(id);
  const { record, array } = await View.unpack();
  const machine = View.machine(record, array), state = machine.state, times = machine.times;
  const asked = new URLSearchParams(location.hash.slice(1)), isModes = record.kind === "modes", isStill = !isModes && times.length === 1;
  let stage = null;
  try { stage = View.stage(record, el("canvas"), machine); } catch (error) { el("no-webgl").hidden = false; el("canvas").hidden = true; }

  el("title").textContent = record.title;
  el("facts").textContent = record.facts.join(" \u00b7 ");
  for (const note of record.notes) { const item = document.createElement("li"); item.textContent = note; el("notes").append(item); }
  for (const [key, words] of record.sources) {
    const name = document.createElement("dt"), value = document.createElement("dd");
    name.textContent = key; value.textContent = words;
    el("sources").append(name, value);
  }
  const first = times[0], last = times[times.length - 1], clock = { now: first, playing: false, speed: record.speed, loop: true, phase: 0, seen: null };
  const decimals = Math.min(6, Math.max(1, Math.ceil(-Math.log10((last - first || 1) / 1000))));
  const plots = View.plots(record, array, (time) => { pause(); seek(time); });

  // drawing
  let due = true;
  function request() { due = true; }
  function seek(time) { clock.now = Math.min(last, Math.max(first, time)); show(); }
  function show() {
    if (isModes) {
      machine.phase(state.mode, clock.phase);
      el("slider").value = (clock.phase / (2 * Math.PI)) % 1;
      el("clock").textContent = state.mode < 0 ? "at rest" : `${Math.round((360 * clock.phase) / (2 * Math.PI)) % 360}\u00b0`;
    } else {
      machine.at(clock.now);
      el("slider").value = last > first ? (clock.now - first) / (last - first) : 0;
      el("clock").textContent = `${clock.now.toFixed(decimals)} ${record.units.time}`;
      plots.at(clock.now, !clock.playing);
      if (state.range.kind === "now") legend();
    }
    request();
  }
  function frame(now) {
    if (clock.playing) {
      const passed = clock.seen === null ? 0 : Math.min(0.1, (now - clock.seen) / 1000);
      clock.seen = now;
      if (isModes) clock.phase = (clock.phase + 2 * Math.PI * passed * clock.speed) % (2 * Math.PI);
      else {
        clock.now += (passed * clock.speed) / record.units.seconds;
        if (clock.now >= last) { if (clock.loop) clock.now = first; else { clock.now = last; pause(); } }
      }
      show();
    }
    if (stage && (due || stage.controls.update())) { stage.draw(); due = false; View.frames += 1; }
    requestAnimationFrame(frame);
  }
  View.frames = 0;

  // play
  const triangle = '<svg viewBox="0 0 16 16"><path d="M4 2l10 6-10 6z"/></svg>', bars = '<svg viewBox="0 0 16 16"><path d="M3 2h4v12H3zm6 0h4v12H9z"/></svg>';
  function pause() { clock.playing = false; el("play").innerHTML = triangle; el("play").setAttribute("aria-label", "Play"); }
  function play() { clock.playing = true; clock.seen = null; if (!isModes && clock.now >= last) clock.now = first; el("play").innerHTML = bars; el("play").setAttribute("aria-label", "Pause"); }
  el("play").addEventListener("click", () => (clock.playing ? pause() : play()));
  el("slider").addEventListener("input", (e) => {
    pause();
    if (isModes) { clock.phase = 2 * Math.PI * Number(e.target.value); show(); } else seek(first + Number(e.target.value) * (last - first));
  });
  const words = (v) => (v >= 1 ? `${Number(v.toPrecision(3))}\u00d7` : `1/${Number((1 / v).toPrecision(3))}`);
  const speeds = isModes ? [0.25, 0.5, 1, 2] : [...new Set([1e-3, 2e-3, 5e-3, 0.01, 0.02, 0.05, 0.1, 0.2, 0.5, 1, 2, 5, 10, 100, record.speed])].sort((a, b) => a - b)
    .filter((v) => (v >= record.speed / 60 && v <= record.speed * 20) || v === 1);
  fill("speed", speeds.map((v) => [v, isModes ? `${v} Hz` : words(v)]), record.speed, (v) => { clock.speed = Number(v); });
  el("loop").addEventListener("click", () => { clock.loop = !clock.loop; el("loop").setAttribute("aria-pressed", String(clock.loop)); });
  if (isModes) el("loop").hidden = true;
  if (isStill) for (const id of ["play", "slider", "clock", "speed-label", "loop"]) el(id).hidden = true;

  function fill(id, entries, chosen, act) {
    for (const [value, label] of entries) {
      const option = document.createElement("option");
      option.value = value; option.textContent = label; option.selected = String(value) === String(chosen);
      el(id).append(option);
    }
    el(id).addEventListener("change", (e) => { act(e.target.value); show(); e.target.blur(); });
  }

  // views
  if (stage) {
    for (const button of document.querySelectorAll("[data-view]")) button.addEventListener("click", () => { stage.look(button.dataset.view); request(); });
    stage.controls.addEventListener("change", request);
    stage.controls.addEventListener("start", () => { el("hint").style.opacity = 0; });
    const moving = machine.bodies.map((body, k) => [k, body.name]);
    fill("follow", [[-1, "nothing"], ...moving], record.view.follows, (v) => { stage.followBody(Number(v)); stage.look("iso"); });
    if (isModes || isStill) el("follow-label").hidden = true;
    stage.followBody(record.view.follows);
    new ResizeObserver(() => { stage.resize(); if (!stage.settled) { stage.look(asked.get("view") || "iso"); stage.settled = true; } request(); }).observe(el("stage"));
  }
  new ResizeObserver(() => plots.resize()).observe(el("side"));

  // colours
  const ramp = `linear-gradient(90deg, ${record.colormap.join(",")})`, kinds = { all: isModes ? "of the mode" : "largest of the motion", now: "largest of this instant", own: "your own" };
  el("ramp").style.background = ramp;
  function legend() {
    const color = machine.chosenColor();
    el("legend").hidden = !color;
    if (!color) return;
    el("quantity").textContent = color.title + (isModes ? ", by the largest" : ` [${color.unit}]`);
    el("top").textContent = isModes ? "1" : Number((state.top || 0).toPrecision(3)).toString();
    el("range-kind").textContent = isModes ? "" : kinds[state.range.kind];
  }
  el("top").addEventListener("click", () => {
    if (isModes) return;
    const next = { all: "now", now: "own", own: "all" }[state.range.kind];
    if (next === "own") {
      const typed = Number(prompt(`Largest value of the colours [${machine.chosenColor().unit}]`, String(Number((state.top || 1).toPrecision(3)))));
      state.range = typed > 0 ? { kind: "own", own: typed } : { kind: "all", own: 0 };
    } else state.range = { kind: next, own: 0 };
    show(); legend();
  });
  fill("color", [...record.colors.map((each) => [each.key, each.title]), ["", "none"]], record.color, (v) => {
    state.color = v; state.range = { kind: "all", own: 0 }; machine.repaint(); legend();
  });
  if (!record.colors.length) el("color-label").hidden = true;

  // magnification of the deformation
  const sizes = [...new Set([0, 1, 2, 5, 10, 20, 50, 100, 200, 500, 1000, 2000, 5000, 10000, 100000, record.magnification])].sort((a, b) => a - b);
  fill("magnify", isModes ? [[0.25, "small"], [1, "medium"], [2, "large"], [4, "huge"]] : sizes.map((v) => [v, v === 0 ? "none" : `${v}\u00d7`]), isModes ? 1 : record.magnification, (v) => {
    state.magnification = Number(v); machine.forgetTrails();
  });
  if (isModes) state.magnification = 1;
  if (!record.surfaces.length && !isModes) el("magnify-label").hidden = true;

  // visible objects
  const g = machine.groups, has = (group) => group.children.length > 0;
  const flags = [
    ["edges", "edges", g.edges.length > 0, true, (on) => g.edges.forEach((each) => { each.visible = on; })],
    ["joints", "joints", has(g.joint), true, (on) => { g.joint.visible = on; }],
    ["springs", "springs, bushings", has(g.force), true, (on) => { g.force.visible = on; }],
    ["own", "forces of elements", record.forces.some((each) => each.is_of_element), true, (on) => { state.ownForces = on; }],
    ["forces", "forces in joints, springs", record.forces.some((each) => !each.is_of_element), false, (on) => { state.forces = on; }],
    ["trails", "paths", !isModes && !isStill && record.trails.length > 0, record.view.follows < 0, (on) => { state.trails = on; }],
    ["scene", "surroundings", has(g.scene), true, (on) => { g.scene.visible = on; }],
    ["ground", "ground", Boolean(stage && stage.ground), true, (on) => { stage.ground.grid.visible = stage.ground.shadow.visible = on; }],
  ];
  for (const [key, label, exists, begins, act] of flags) {
    if (!exists) continue;
    const box = document.createElement("input"), holder = document.createElement("label");
    box.type = "checkbox"; box.checked = asked.has(key) ? asked.get(key) !== "0" : begins;
    holder.append(box, label);
    el("show").append(holder);
    act(box.checked);
    box.addEventListener("change", () => { act(box.checked); show(); });
  }
  document.addEventListener("pointerdown", (e) => { const menu = document.querySelector(".menu"); if (!menu.contains(e.target)) menu.open = false; });

  // modes
  if (isModes) {
    const list = el("modes"), choose = (number) => {
      state.mode = number;
      [...list.children].forEach((each, k) => each.setAttribute("aria-pressed", String(k === number + 1)));
      clock.phase = 0;
      machine.phase(number, 0); machine.repaint(); legend(); show();
      if (number >= 0) play(); else pause();
    };
    const entry = (number, parts, kind) => {
      const button = document.createElement("button");
      button.className = kind;
      for (const [tag, content] of parts) { const part = document.createElement(tag); part.textContent = content; button.append(part); }
      button.addEventListener("click", () => choose(number));
      list.append(button);
    };
    entry(-1, [["span", "at rest"]], "none");
    record.modes.forEach((each, k) => entry(k, [["b", k + 1], ["span", each.title], ["span", each.damping], ["small", each.moves]], ""));
    View.choose = choose;
  }

  // keys
  document.addEventListener("keydown", (e) => {
    if (e.target.tagName === "SELECT" || e.target.type === "range" || e.ctrlKey || e.metaKey || e.altKey) return;
    const step = (last - first) / 200, act = {
      " ": () => (clock.playing ? pause() : play()), l: () => el("loop").click(), Home: () => seek(first), End: () => seek(last),
      ArrowRight: () => { pause(); seek(clock.now + step); }, ArrowLeft: () => { pause(); seek(clock.now - step); },
    }[e.key] || ["iso", "side", "front", "top"].map((name) => () => { stage.look(name); request(); })[Number(e.key) - 1];
    if (act && !(e.key === " " && e.target.tagName === "BUTTON")) { e.preventDefault(); act(); }
  });

  // initial values from the address, such as #t=0.5&view=side&color=von-mises&mode=2
  if (asked.has("color") && record.colors.some((each) => each.key === asked.get("color"))) { el("color").value = state.color = asked.get("color"); }
  pause();
  if (isModes) View.choose(Math.min(record.modes.length, Math.max(0, Number(asked.get("mode") || 1))) - 1);
  seek(asked.has("t") ? Number(asked.get("t")) : first);
  legend();
  const still = asked.has("t") || isStill || window.matchMedia("(prefers-reduced-motion: reduce)").matches;
  if (still) { pause(); if (isModes) { clock.phase = 2 * Math.PI * Number(asked.get("t") || 0); show(); } } else if (!isModes || state.mode >= 0) play();
  Object.assign(View, { record, array, state, at: machine.at, seek, show, pause, play, camera: stage && stage.camera, bodies: machine.bodies, surfaces: machine.surfaces, carriers: machine.carriers });
  requestAnimationFrame(frame);
  requestAnimationFrame(() => requestAnimationFrame(() => { document.body.dataset.ready = stage ? "drawn" : "plots"; }));
})();
