"use strict";
// Charts as SVG: lines, bars and matrices over linear or logarithmic axes, one panel below the other.
// Point at a line to read it, drag across to zoom, double-click to see all, click a name to hide its line.
(function () {
  const { charts: all, arrays } = JSON.parse(document.getElementById("charts").textContent);
  const numbers = arrays.map((text) => Array.from(new Float32Array(Uint8Array.from(atob(text), (c) => c.charCodeAt(0)).buffer)));
  for (const { items } of Object.values(all)) {
    for (const line of items.filter((item) => item.kind === "line")) {
      for (const name of ["x", "y", "other_x"]) if (line[name] !== null) line[name] = numbers[line[name]];
    }
  }
  const SVG = "http://www.w3.org/2000/svg";
  const DASHES = { solid: "", dash: "7 4", dot: "2 3", dashdot: "7 3 2 3", longdash: "11 4", longdashdot: "11 4 2 4" };
  const MARKS = {
    circle: "M-4 0a4 4 0 1 0 8 0a4 4 0 1 0-8 0z", square: "M-3.6-3.6h7.2v7.2h-7.2z", diamond: "M0-5L5 0L0 5L-5 0z",
    "triangle-up": "M0-4.6L4.6 3.6H-4.6z", "triangle-down": "M0 4.6L4.6-3.6H-4.6z", cross: "M-4.5 0H4.5M0-4.5V4.5",
    x: "M-3.6-3.6L3.6 3.6M-3.6 3.6L3.6-3.6",
    star: "M0-5.4L1.3-1.8L5.1-1.7L2.1.7L3.2 4.4L0 2.2L-3.2 4.4L-2.1.7L-5.1-1.7L-1.3-1.8z",
  };
  const INK = "#1b1f24";
  const tone = (color) => (color === INK ? "var(--ink)" : color);
  const finite = (v) => v !== null && Number.isFinite(v);
  const short = (v) => (v === 0 ? "0" : Math.abs(v) >= 1e5 || Math.abs(v) < 1e-3 ? power(v) : String(Number(v.toPrecision(4))));
  const UP = { "-": "⁻", 0: "⁰", 1: "¹", 2: "²", 3: "³", 4: "⁴", 5: "⁵", 6: "⁶", 7: "⁷", 8: "⁸", 9: "⁹" };
  function power(v) {
    const [digits, exponent] = v.toExponential(3).split("e");
    const up = [...String(Number(exponent))].map((c) => UP[c]).join(""), first = Number(digits);
    return first === 1 ? `10${up}` : `${first}·10${up}`;
  }
  function put(parent, name, attributes, words) {
    const made = document.createElementNS(SVG, name);
    for (const [key, value] of Object.entries(attributes)) made.setAttribute(key, value);
    if (words !== undefined) made.textContent = words;
    parent.appendChild(made);
    return made;
  }
  function scale(range, isLog, from, to) {
    const [low, high] = isLog ? range.map(Math.log10) : range;
    const at = (v) => from + (to - from) * ((isLog ? Math.log10(v) : v) - low) / (high - low);
    const back = (p) => { const u = low + (high - low) * (p - from) / (to - from); return isLog ? 10 ** u : u; };
    return { at, back, range, isLog };
  }
  function extent(values, isLog) {
    let low = Infinity, high = -Infinity;
    for (const v of values) if (finite(v) && (!isLog || v > 0)) { low = Math.min(low, v); high = Math.max(high, v); }
    if (low > high) return isLog ? [0.1, 1] : [0, 1];
    if (isLog) return low === high ? [low / 3, high * 3] : [low * (low / high) ** 0.03, high * (high / low) ** 0.03];
    const room = (high - low || Math.abs(high) || 1) * 0.05;
    return [low - room, high + room];
  }
  function ticks({ range: [low, high], isLog }, room) {
    const most = Math.max(2, Math.floor(room));
    if (isLog && high / low > 9) {
      const first = Math.ceil(Math.log10(low) - 1e-9), last = Math.floor(Math.log10(high) + 1e-9);
      const step = Math.max(1, Math.ceil((last - first + 1) / most)), found = [];
      const between = step === 1 && last - first + 1 <= most / 3 ? [1, 2, 5] : [1];
      for (let e = first - 1; e <= last; e += step) {
        for (const m of between) if (m * 10 ** e >= low * 0.999 && m * 10 ** e <= high * 1.001) found.push(m * 10 ** e);
      }
      if (found.length > 1) return found;
    }
    const rough = (high - low) / most, base = 10 ** Math.floor(Math.log10(rough));
    const step = base * [1, 2, 5, 10].find((m) => m * base >= rough * 0.999), found = [];
    for (let k = Math.ceil(low / step - 1e-9); k * step <= high + 1e-9 * step; k++) found.push(Number((k * step).toPrecision(12)));
    return found;
  }

  class Drawing {
    constructor(box, chart) {
      Object.assign(this, { box, chart, zoom: null, hidden: new Set(), isOther: false, paper: 0 });
      this.lines = chart.items.filter((item) => item.kind === "line");
      box.drawing = this;
      this.keys = box.appendChild(document.createElement("div"));
      this.keys.className = "keys";
      this.svg = put(box, "svg", { class: "drawing" });
      this.tip = box.appendChild(document.createElement("div"));
      this.tip.className = "tip";
      this.tip.hidden = true;
      this.legend();
      this.draw();
      this.pointer();
    }
    across(line) { return this.isOther && line.other_x ? line.other_x : line.x; }
    legend() {
      const named = this.chart.items.filter((item) => item.name);
      if (this.chart.has_legend && named.length) {
        const seen = new Set();
        for (const item of named) {
          if (seen.has(item.name)) continue;
          seen.add(item.name);
          const key = this.keys.appendChild(document.createElement("button"));
          const sign = put(key, "svg", { width: 30, height: 12, "aria-hidden": "true" });
          if (item.kind === "bars") put(sign, "rect", { x: 9, y: 1, width: 12, height: 10, fill: tone(item.color) });
          else put(sign, "path", { d: "M1 6H29", stroke: tone(item.color), "stroke-width": Math.min(item.width, 3), "stroke-opacity": item.opacity, "stroke-dasharray": DASHES[item.dash] });
          key.appendChild(document.createTextNode(item.name));
          key.setAttribute("aria-pressed", "true");
          key.addEventListener("click", () => {
            if (this.hidden.has(item.name)) this.hidden.delete(item.name); else this.hidden.add(item.name);
            key.setAttribute("aria-pressed", String(!this.hidden.has(item.name)));
            this.draw();
          });
        }
      }
      const save = this.keys.appendChild(document.createElement("button"));
      save.className = "save";
      save.title = "save this chart as SVG";
      save.textContent = "SVG";
      save.addEventListener("click", () => this.save());
    }
    save() {
      const copy = this.svg.cloneNode(true), style = getComputedStyle(document.documentElement);
      const words = new XMLSerializer().serializeToString(copy).replace(/var\((--\w+)\)/g, (_, name) => style.getPropertyValue(name).trim());
      const link = document.createElement("a");
      link.href = URL.createObjectURL(new Blob([words], { type: "image/svg+xml" }));
      link.download = `${this.box.id}.svg`;
      link.click();
      URL.revokeObjectURL(link.href);
    }
    shown() { return this.chart.items.filter((item) => !this.hidden.has(item.name)); }
    draw() {
      const { chart, svg } = this, width = this.paper || Math.max(160, this.box.clientWidth), n = chart.panels.length;
      const height = Math.max(120, chart.height - this.keys.offsetHeight);
      svg.replaceChildren();
      for (const [key, value] of Object.entries({ width, height, viewBox: `0 0 ${width} ${height}`, "font-family": "var(--sans)", "font-size": 11.5 })) svg.setAttribute(key, value);
      const items = this.shown(), lines = items.filter((item) => item.kind === "line");
      const matrix = items.find((item) => item.kind === "matrix"), bars = items.filter((item) => item.kind === "bars");
      this.panels = chart.panels.map((axis, k) => {
        const gap = n > 1 ? 9 : 0, each = (height - 56 + gap) / n, top = 8 + k * each, bottom = top + each - gap;
        const own = lines.filter((line) => line.panel === k && !line.is_hill);
        const limits = chart.limits.filter((limit) => limit.panel === k);
        let range = axis.range;
        if (matrix) range = [0.5, matrix.values.length + 0.5];
        else if (bars.length) range = range || [0, Math.max(...bars.flatMap((bar) => bar.values.filter(finite))) * 1.05 || 1];
        else if (!range) {
          const seen = this.zoom ? own.map((line) => line.y.filter((_, i) => { const x = this.across(line)[i]; return x >= this.zoom[0] && x <= this.zoom[1]; })) : own.map((line) => line.y);
          range = extent([...seen.flat(), ...limits.flatMap((limit) => limit.low === null ? [limit.value] : [limit.low, limit.value])], axis.is_log);
        }
        return { axis, own, limits, top, bottom, y: matrix ? scale(range, false, top, bottom) : scale(range, axis.is_log, bottom, top) };
      });
      const labels = this.panels.map((panel) => matrix ? ticks(panel.y, (panel.bottom - panel.top) / 22).filter((v) => Number.isInteger(v) && v > 0) : ticks(panel.y, (panel.bottom - panel.top) / (n > 1 ? 26 : 38)));
      const widest = Math.max(...labels.flat().map((v) => short(v).length), 1);
      let left = Math.min(100, 26 + 6.6 * widest), right = width - 12;
      let xRange = this.zoom || chart.x.range;
      if (matrix) {
        xRange = [0.5, matrix.values[0].length + 0.5];
        const side = Math.min((right - left) / matrix.values[0].length, (height - 64) / matrix.values.length);
        const wide = side * matrix.values[0].length, middle = (left + right) / 2;
        left = Math.max(left, middle - wide / 2); right = left + wide;
        const panel = this.panels[0];
        panel.bottom = panel.top + side * matrix.values.length;
        panel.y = scale([0.5, matrix.values.length + 0.5], false, panel.top, panel.bottom);
      } else if (bars.length) xRange = [-0.5, chart.names.length - 0.5];
      else if (!xRange && chart.other_label && !chart.x.is_log) xRange = extent([0, ...lines.flatMap((line) => this.across(line))], false);
      else if (!xRange) xRange = chart.x.is_log ? extent(lines.flatMap((line) => this.across(line)), true) : plainRange(lines.flatMap((line) => this.across(line)));
      this.x = scale(xRange, chart.x.is_log && !matrix && !bars.length, left, right);
      this.left = left; this.right = right;
      const foot = this.panels[n - 1].bottom;
      const xTicks = bars.length ? chart.names.map((_, k) => k) : matrix ? ticks(this.x, (right - left) / 24).filter((v) => Number.isInteger(v) && v > 0) : ticks(this.x, (right - left) / 70);
      const clip = `clip-${this.box.id}`;
      this.panels.forEach((panel, k) => {
        put(put(put(svg, "defs", {}), "clipPath", { id: `${clip}-${k}` }), "rect", { x: left, y: panel.top - 1, width: Math.max(0, right - left), height: Math.max(0, panel.bottom - panel.top + 2) });
        if (!matrix) {
          for (const v of labels[k]) put(svg, "path", { d: `M${left} ${panel.y.at(v)}H${right}`, stroke: "var(--grid)" });
          if (!bars.length) for (const v of xTicks) put(svg, "path", { d: `M${this.x.at(v)} ${panel.top}V${panel.bottom}`, stroke: "var(--grid)" });
        }
        const words = panel.y.isLog && labels[k].some((v) => short(v).includes("10")) && labels[k].some((v) => v < 1e-3) ? power : short;
        for (const v of labels[k]) put(svg, "text", { x: left - 6, y: panel.y.at(v) + 4, "text-anchor": "end", fill: "var(--text)" }, words(v));
        put(svg, "path", { d: `M${left} ${panel.top}V${panel.bottom}H${right}`, stroke: "var(--axis)", fill: "none" });
        const title = put(svg, "text", { "text-anchor": "middle", fill: "var(--text)", transform: `translate(${Math.max(11, left - 14 - 6.6 * widest)} ${(panel.top + panel.bottom) / 2}) rotate(-90)`, "font-size": n > 1 ? 10 : 12 });
        panel.axis.label.split("\n").forEach((words, j, parts) => put(title, "tspan", { x: 0, dy: j ? 11 : -11 * (parts.length - 1) / 2 }, words));
        const inside = put(svg, "g", { "clip-path": `url(#${clip}-${k})` });
        for (const limit of panel.limits) {
          if (limit.low !== null) put(inside, "rect", { x: left, width: right - left, y: panel.y.at(limit.value), height: Math.max(0, panel.y.at(limit.low) - panel.y.at(limit.value)), fill: "var(--axis)", "fill-opacity": 0.2 });
          else put(inside, "path", { d: `M${left} ${panel.y.at(limit.value)}H${right}`, stroke: "var(--soft)", "stroke-width": 1.5, "stroke-dasharray": DASHES.dash });
        }
        for (const line of lines) if (line.panel === k) this.line(inside, line, panel);
        for (const limit of panel.limits) if (limit.label) put(svg, "text", { x: right - 3, y: panel.y.at(limit.value) - 4, "text-anchor": "end", fill: "var(--soft)", "font-size": 11, stroke: "var(--card)", "stroke-width": 3, "paint-order": "stroke" }, limit.label);
      });
      if (matrix) this.matrix(matrix);
      bars.forEach((bar, k) => bar.values.forEach((value, j) => {
        if (!finite(value)) return;
        const wide = 0.8 / bars.length, y = this.panels[0].y;
        const made = put(svg, "rect", { x: this.x.at(j - 0.4 + wide * k), width: Math.max(1, this.x.at(wide) - this.x.at(0) - 1), y: y.at(value), height: Math.max(0, foot - y.at(value)), fill: tone(bar.color) });
        put(made, "title", {}, `${bar.name}\n${chart.names[j]}: ${short(value)}`);
      }));
      for (const v of xTicks) {
        const words = bars.length ? chart.names[v] : short(v);
        put(svg, "text", { x: Math.min(this.x.at(v), width - 3.4 * words.length), y: foot + 16, "text-anchor": "middle", fill: "var(--text)" }, words);
      }
      put(svg, "text", { x: (left + right) / 2, y: foot + 36, "text-anchor": "middle", fill: "var(--text)", "font-size": 12 }, this.isOther && chart.other_label ? chart.other_label : chart.x.label);
      this.dot = put(svg, "circle", { r: 4.5, fill: "none", stroke: "var(--ink)", "stroke-width": 1.5, visibility: "hidden" });
      this.frame = put(svg, "rect", { y: this.panels[0].top, height: foot - this.panels[0].top, fill: "var(--accent)", "fill-opacity": 0.12, visibility: "hidden" });
    }
    line(parent, line, panel) {
      const x = this.across(line), points = [];
      const top = line.is_hill ? Math.max(...line.y.filter(finite), 0) || 1 : 0;
      const height = (v) => line.is_hill ? panel.bottom - (panel.bottom - panel.top) * v / top / 4 : panel.y.at(v);
      let path = "", isDown = false;
      line.y.forEach((v, i) => {
        const isKnown = finite(v) && finite(x[i]) && (line.is_hill || !panel.y.isLog || v > 0) && (!this.x.isLog || x[i] > 0);
        if (!isKnown) { isDown = false; return; }
        const px = this.x.at(x[i]), py = height(v);
        path += isDown ? (line.is_step ? `H${px.toFixed(1)}V${py.toFixed(1)}` : `L${px.toFixed(1)} ${py.toFixed(1)}`) : `M${px.toFixed(1)} ${py.toFixed(1)}`;
        isDown = true;
        points.push([px, py, i]);
      });
      line.points = points;
      if (line.is_hill && points.length) put(parent, "path", { d: `${path}L${points[points.length - 1][0]} ${panel.bottom}L${points[0][0]} ${panel.bottom}z`, fill: "var(--axis)", "fill-opacity": 0.22 });
      put(parent, "path", { d: path, fill: "none", stroke: tone(line.color), "stroke-width": line.width, "stroke-opacity": line.opacity, "stroke-dasharray": DASHES[line.dash], "stroke-linejoin": "round" });
      if (!line.symbol && points.length === 1) put(parent, "circle", { cx: points[0][0], cy: points[0][1], r: 3.5, fill: tone(line.color) });
      if (line.symbol) {
        const isOpen = line.symbol === "x" || line.symbol === "cross";
        for (const [px, py] of points) put(parent, "path", { d: MARKS[line.symbol], transform: `translate(${px.toFixed(1)} ${py.toFixed(1)})`, fill: tone(line.color), stroke: tone(line.color), "stroke-width": isOpen ? 2.4 : 0.8 });
      }
    }
    matrix(matrix) {
      const y = this.panels[0].y, side = this.x.at(1) - this.x.at(0);
      matrix.values.forEach((row, i) => row.forEach((value, j) => {
        const cell = put(this.svg, "rect", { x: this.x.at(j + 1) - side / 2 + 0.5, y: y.at(i + 1) - side / 2 + 0.5, width: Math.max(0.5, side - 1), height: Math.max(0.5, side - 1), fill: shade(value) });
        put(cell, "title", {}, `${matrix.row} ${i + 1}${matrix.notes[i] ? ` (${matrix.notes[i]})` : ""}\n${matrix.column} ${j + 1}\n${finite(value) ? value : "none"}`);
      }));
    }
    nearest(px, py) {
      let best = null, least = 900;
      const panel = this.panels.findIndex((each) => py >= each.top - 6 && py <= each.bottom + 6);
      for (const line of this.lines) {
        if (line.panel !== panel || this.hidden.has(line.name) || line.is_hill) continue;
        for (const [x, y, i] of line.points || []) {
          const away = (x - px) ** 2 + (y - py) ** 2;
          if (away < least && x >= this.left - 1 && x <= this.right + 1) { least = away; best = { line, x, y, i }; }
        }
      }
      return best;
    }
    pointer() {
      const place = (e) => { const box = this.svg.getBoundingClientRect(); return [e.clientX - box.left, e.clientY - box.top]; };
      const clear = () => { this.tip.hidden = true; this.dot.setAttribute("visibility", "hidden"); };
      let from = null;
      this.svg.addEventListener("pointermove", (e) => {
        const [px, py] = place(e);
        if (from !== null) {
          this.frame.setAttribute("visibility", "visible");
          this.frame.setAttribute("x", Math.min(from, px));
          this.frame.setAttribute("width", Math.abs(px - from));
          return;
        }
        const found = this.nearest(px, py);
        if (!found) return clear();
        const { line, x, y, i } = found;
        this.tip.textContent = [line.name, line.notes[i] || `${short(this.across(line)[i])}: ${short(line.y[i])}`].filter(Boolean).join("\n");
        this.tip.hidden = false;
        this.tip.style.left = `${Math.min(x + 10, this.box.clientWidth - this.tip.offsetWidth - 4)}px`;
        this.tip.style.top = `${this.svg.offsetTop + Math.max(0, y - this.tip.offsetHeight - 8)}px`;
        for (const [key, value] of Object.entries({ cx: x, cy: y, visibility: "visible" })) this.dot.setAttribute(key, value);
      });
      this.svg.addEventListener("pointerleave", () => { clear(); });
      if (!this.lines.length) return;
      this.svg.addEventListener("pointerdown", (e) => { if (e.button === 0 && e.pointerType !== "touch") { from = place(e)[0]; clear(); this.svg.setPointerCapture(e.pointerId); e.preventDefault(); } });
      this.svg.addEventListener("pointerup", (e) => {
        if (from === null) return;
        const ends = [from, place(e)[0]].map((p) => this.x.back(Math.min(this.right, Math.max(this.left, p)))).sort((a, b) => a - b);
        const isZoom = Math.abs(place(e)[0] - from) > 6;
        from = null;
        if (isZoom) { this.zoom = ends; this.draw(); } else this.frame.setAttribute("visibility", "hidden");
      });
      this.svg.addEventListener("dblclick", () => { this.zoom = null; this.draw(); });
    }
  }
  function plainRange(values) {
    let low = Infinity, high = -Infinity;
    for (const v of values) if (finite(v)) { low = Math.min(low, v); high = Math.max(high, v); }
    if (low > high) return [0, 1];
    return low === high ? [low - 1, high + 1] : [low, high];
  }
  function shade(value) {
    if (!finite(value)) return "var(--line)";
    const stops = [[247, 250, 252], [110, 163, 207], [8, 48, 107]], v = Math.min(1, Math.max(0, value)) * 2;
    const k = Math.min(1, Math.floor(v)), t = v - k;
    return `rgb(${stops[k].map((c, j) => Math.round(c + t * (stops[k + 1][j] - c))).join(",")})`;
  }

  const drawings = [];
  for (const box of document.querySelectorAll(".chart")) if (all[box.id]) drawings.push(new Drawing(box, all[box.id]));
  let width = window.innerWidth;
  window.addEventListener("resize", () => {
    if (window.innerWidth === width) return;
    width = window.innerWidth;
    for (const each of drawings) each.draw();
  });
  // paper is narrower than the screen: 184 mm, gaps as in page.css
  window.addEventListener("beforeprint", () => {
    for (const each of drawings) {
      each.paper = each.box.closest(".grid.three") ? 218 : each.box.closest(".grid") ? 332 : 695;
      each.draw();
    }
  });
  window.addEventListener("afterprint", () => { for (const each of drawings) { each.paper = 0; each.draw(); } });
  for (const button of document.querySelectorAll(".switch button")) {
    button.addEventListener("click", () => {
      for (const other of button.parentElement.children) other.setAttribute("aria-pressed", String(other === button));
      for (const each of drawings) if (each.chart.other_label) { each.isOther = button.dataset.column === "1"; each.zoom = null; each.draw(); }
    });
  }
})();
