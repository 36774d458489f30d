"use strict";
// Curves over time beside the motion, with a line that moves with it.
View.plots = function (record, array, seek) {
  const holder = document.getElementById("plots"), palette = ["#0072B2", "#D55E00", "#009E73", "#CC79A7", "#E69F00", "#6B4E9B"];
  if (!record.panels.length) return { at() {}, resize() {} };
  const times = Array.from(array(record.panel_time));
  const sync = uPlot.sync("time");
  let told = 0, last = null;
  const drawn = [];
  drawn.push(...record.panels.map((panel) => {
    const box = document.createElement("div"), title = document.createElement("h3"), unit = document.createElement("small");
    box.className = "plot";
    title.textContent = panel.title;
    unit.textContent = (panel.unit ? `[${panel.unit}]` : "") + (panel.n_all > panel.curves.length ? `  the largest ${panel.curves.length} of ${panel.n_all}` : "");
    title.append(unit);
    box.append(title);
    holder.append(box);
    const values = panel.curves.map((curve) => Array.from(array(curve.values), (v) => (Number.isFinite(v) ? v : null)));
    const digits = (v) => (v === null || v === undefined ? "" : Math.abs(v) >= 1e5 || (Math.abs(v) < 1e-3 && v !== 0) ? v.toExponential(2) : String(Number(v.toPrecision(4))));
    const now = document.createElement("div");
    now.className = "now";
    const plot = new uPlot({
      width: width(), height: 138,
      scales: { x: { time: false } },
      cursor: { sync: { key: sync.key }, drag: { x: false, y: false }, points: { size: 5 } },
      legend: { live: true },
      axes: [
        { size: 26, font: "11px sans-serif", stroke: "#66727e", grid: { stroke: "#eef1f4" }, ticks: { stroke: "#dde2e7", size: 4 } },
        { size: 60, space: 24, font: "11px sans-serif", stroke: "#66727e", grid: { stroke: "#eef1f4" }, ticks: { stroke: "#dde2e7", size: 4 }, values: (u, splits) => splits.map(digits) },
      ],
      series: [
        { label: `t [${record.units.time}]`, value: (u, v) => digits(v) },
        ...panel.curves.map((curve, k) => ({ label: curve.name, stroke: palette[k % palette.length], width: 1.5, pxAlign: 0, points: { show: false }, value: (u, v) => digits(v) })),
      ],
      hooks: { ready: [(u) => { u.over.append(now); if (last !== null) at(last, true); }] },
    }, [times, ...values], box);
    plot.over.addEventListener("pointerdown", (e) => {
      const from = plot.over.getBoundingClientRect();
      seek(plot.posToVal(e.clientX - from.left, "x"));
    });
    return { plot, now };
  }));
  function width() { return Math.max(200, holder.clientWidth); }
  function at(time, force) {
    last = time;
    for (const { plot, now } of drawn) now.style.left = `${plot.valToPos(time, "x")}px`;
    const clock = performance.now();
    if (!force && clock - told < 120) return;
    told = clock;
    let low = 0, high = times.length - 1;
    while (high - low > 1) { const middle = (low + high) >> 1; if (times[middle] <= time) low = middle; else high = middle; }
    const nearest = times.length > 1 && times[high] - time < time - times[low] ? high : low;
    for (const { plot } of drawn) if (plot.cursor.left === undefined || plot.cursor.left < 0) plot.setLegend({ idx: nearest }, false);
  }
  return { at, drawn, resize() { drawn.forEach(({ plot }) => plot.setSize({ width: width(), height: 138 })); } };
};
