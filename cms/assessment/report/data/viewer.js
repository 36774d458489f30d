"use strict";
// Mode shapes on the surface of the body, turned by dragging: one WebGL 2 canvas, no library.
(function () {
  const holder = document.getElementById("viewer");
  if (!holder) return;
  const canvas = holder.querySelector("canvas");
  const gl = canvas.getContext("webgl2", { antialias: true, preserveDrawingBuffer: true });
  if (!gl) {
    holder.hidden = true;
    document.getElementById("no-webgl").hidden = false;
    return;
  }
  const data = JSON.parse(document.getElementById("shapes").textContent);
  const bytes = (text) => Uint8Array.from(atob(text), (c) => c.charCodeAt(0)).buffer;
  const nodes = new Float32Array(bytes(data.nodes));
  const triangles = new Uint32Array(bytes(data.triangles));
  const lines = new Uint32Array(bytes(data.lines));
  const shapes = data.shapes.map((text) => Float32Array.from(new Int16Array(bytes(text)), (v) => v / 32767));
  const colors = new Uint8Array(bytes(data.colors));

  const vertexText = `#version 300 es
    in vec3 node; in vec3 shape;
    uniform mat4 view; uniform vec3 unscale; uniform float amount; uniform float offset;
    out vec3 place; out float size;
    void main() {
      vec4 p = view * vec4(node + amount * shape, 1.0);
      place = p.xyz * unscale; size = length(shape);
      gl_Position = vec4(p.xy, p.z + offset, 1.0);
    }`;
  const fragmentText = `#version 300 es
    precision highp float;
    in vec3 place; in float size; out vec4 color;
    uniform sampler2D map; uniform vec4 plain; uniform float share;
    void main() {
      if (plain.a > 0.0) { color = vec4(plain.rgb * plain.a, plain.a); return; }
      vec3 n = normalize(cross(dFdx(place), dFdy(place)));
      if (n.z > 0.0) n = -n;
      float light = 0.58 + 0.42 * max(dot(n, normalize(vec3(-0.35, 0.55, -0.8))), 0.0) + 0.14 * max(dot(n, vec3(0.7, 0.2, -0.68)), 0.0);
      vec3 base = texture(map, vec2(clamp(size * share, 0.002, 0.998), 0.5)).rgb;
      color = vec4(base * light, 1.0);
    }`;
  function shader(kind, text) {
    const made = gl.createShader(kind);
    gl.shaderSource(made, text);
    gl.compileShader(made);
    if (!gl.getShaderParameter(made, gl.COMPILE_STATUS)) throw new Error(gl.getShaderInfoLog(made));
    return made;
  }
  const program = gl.createProgram();
  gl.attachShader(program, shader(gl.VERTEX_SHADER, vertexText));
  gl.attachShader(program, shader(gl.FRAGMENT_SHADER, fragmentText));
  gl.linkProgram(program);
  gl.useProgram(program);
  const at = (name) => gl.getUniformLocation(program, name);
  const uniforms = { view: at("view"), unscale: at("unscale"), amount: at("amount"), offset: at("offset"), plain: at("plain"), share: at("share") };

  function buffer(target, values, usage) {
    const made = gl.createBuffer();
    gl.bindBuffer(target, made);
    gl.bufferData(target, values, usage || gl.STATIC_DRAW);
    return made;
  }
  function attribute(name) {
    const where = gl.getAttribLocation(program, name);
    gl.enableVertexAttribArray(where);
    gl.vertexAttribPointer(where, 3, gl.FLOAT, false, 0, 0);
  }
  buffer(gl.ARRAY_BUFFER, nodes); attribute("node");
  const shapeBuffer = buffer(gl.ARRAY_BUFFER, shapes[0], gl.DYNAMIC_DRAW); attribute("shape");
  const triangleBuffer = buffer(gl.ELEMENT_ARRAY_BUFFER, triangles);
  const lineBuffer = buffer(gl.ELEMENT_ARRAY_BUFFER, lines);
  gl.bindTexture(gl.TEXTURE_2D, gl.createTexture());
  gl.texImage2D(gl.TEXTURE_2D, 0, gl.RGB, colors.length / 3, 1, 0, gl.RGB, gl.UNSIGNED_BYTE, colors);
  for (const [key, value] of [[gl.TEXTURE_MIN_FILTER, gl.LINEAR], [gl.TEXTURE_MAG_FILTER, gl.LINEAR], [gl.TEXTURE_WRAP_S, gl.CLAMP_TO_EDGE], [gl.TEXTURE_WRAP_T, gl.CLAMP_TO_EDGE]]) {
    gl.texParameteri(gl.TEXTURE_2D, key, value);
  }
  gl.enable(gl.DEPTH_TEST);
  gl.blendFunc(gl.ONE, gl.ONE_MINUS_SRC_ALPHA);

  // the body in a unit ball about its middle; rows of R are the axes of the screen
  const low = [0, 1, 2].map((a) => data.box[0][a]), high = [0, 1, 2].map((a) => data.box[1][a]);
  const middle = low.map((v, a) => (v + high[a]) / 2);
  const radius = Math.hypot(...high.map((v, a) => v - low[a])) / 2 || 1;
  const cross = (a, b) => [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]];
  const dot = (a, b) => a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
  const unit = (a) => { const l = Math.hypot(...a); return a.map((v) => v / l); };
  const forward = unit(data.direction), right = unit(cross(forward, data.up));
  const start = [right, cross(right, forward), forward];
  let R = start.map((row) => row.slice()), zoom = 1, mode = 0, playing = false, phase = 1;
  const amplitude = 0.12 * 2 * radius;

  function turn(axis, angle) {  // R <- rotation about an axis of the screen times R
    const c = Math.cos(angle), s = Math.sin(angle), [i, j] = axis === 0 ? [1, 2] : axis === 1 ? [2, 0] : [0, 1];
    const a = R[i].slice(), b = R[j].slice();
    R[i] = a.map((v, k) => c * v - s * b[k]);
    R[j] = a.map((v, k) => s * v + c * b[k]);
  }
  function draw() {
    const ratio = window.devicePixelRatio || 1;
    const w = Math.max(1, Math.round(canvas.clientWidth * ratio)), h = Math.max(1, Math.round(canvas.clientHeight * ratio));
    if (canvas.width !== w || canvas.height !== h) { canvas.width = w; canvas.height = h; }
    gl.viewport(0, 0, w, h);
    gl.clearColor(0, 0, 0, 0);
    gl.clear(gl.COLOR_BUFFER_BIT | gl.DEPTH_BUFFER_BIT);
    // half width and height of the turned box decide how large it can be drawn
    const half = high.map((v, a) => (v - low[a]) / 2);
    const reach = R.map((row) => row.reduce((sum, v, k) => sum + Math.abs(v) * half[k], 0) + 0.5 * amplitude);
    const fit = zoom * Math.min(w / reach[0], h / reach[1]) * 0.92;
    const scale = [fit / w, fit / h, 1 / (radius * 1.6)];
    const m = new Float32Array(16);
    for (let row = 0; row < 3; row++) {
      for (let k = 0; k < 3; k++) m[4 * k + row] = scale[row] * R[row][k];
      m[12 + row] = -scale[row] * dot(R[row], middle);
    }
    m[15] = 1;
    gl.uniformMatrix4fv(uniforms.view, false, m);
    gl.uniform3f(uniforms.unscale, ...scale.map((v) => 1 / v));
    gl.uniform1f(uniforms.share, 1);
    pass(triangleBuffer, triangles.length, gl.TRIANGLES, amplitude * phase, 0, [0, 0, 0, 0]);
    pass(lineBuffer, lines.length, gl.LINES, amplitude * phase, -0.002, triangles.length ? [0.1, 0.13, 0.17, 0.75] : [0, 0, 0, 0]);
    gl.enable(gl.BLEND);
    pass(lineBuffer, lines.length, gl.LINES, 0, 0, [0.45, 0.51, 0.57, 0.45]);
    gl.disable(gl.BLEND);
  }
  function pass(indices, count, kind, amount, offset, plain) {
    if (!count) return;
    gl.bindBuffer(gl.ELEMENT_ARRAY_BUFFER, indices);
    gl.uniform1f(uniforms.amount, amount);
    gl.uniform1f(uniforms.offset, offset);
    gl.uniform4f(uniforms.plain, ...plain);
    gl.drawElements(kind, count, gl.UNSIGNED_INT, 0);
  }
  function tick(now) {
    if (!playing) return;
    phase = Math.sin((2 * Math.PI * (now % 1600)) / 1600);
    draw();
    requestAnimationFrame(tick);
  }
  function choose(k) {
    mode = k;
    gl.bindBuffer(gl.ARRAY_BUFFER, shapeBuffer);
    gl.bufferData(gl.ARRAY_BUFFER, shapes[k], gl.DYNAMIC_DRAW);
    buttons.forEach((button, j) => button.setAttribute("aria-pressed", String(j === k)));
    if (!playing) draw();
  }
  const buttons = [...holder.querySelectorAll(".list button")];
  buttons.forEach((button, k) => button.addEventListener("click", () => choose(k)));

  let held = null;
  canvas.addEventListener("pointerdown", (e) => { held = [e.clientX, e.clientY]; canvas.setPointerCapture(e.pointerId); });
  canvas.addEventListener("pointerup", () => { held = null; });
  canvas.addEventListener("pointermove", (e) => {
    if (!held) return;
    turn(1, -(e.clientX - held[0]) * 0.008);
    turn(0, (e.clientY - held[1]) * 0.008);
    held = [e.clientX, e.clientY];
    if (!playing) draw();
  });
  canvas.addEventListener("wheel", (e) => {
    if (!e.ctrlKey && document.activeElement !== canvas) return;  // a page that scrolls must not get stuck on the picture
    e.preventDefault();
    zoom = Math.min(12, Math.max(0.3, zoom * Math.exp(-e.deltaY * 0.001)));
    if (!playing) draw();
  }, { passive: false });
  canvas.addEventListener("keydown", (e) => {
    const step = { ArrowLeft: [1, 0.1], ArrowRight: [1, -0.1], ArrowUp: [0, -0.1], ArrowDown: [0, 0.1] }[e.key];
    if (step) { turn(...step); e.preventDefault(); }
    else if (e.key === "+") zoom *= 1.15;
    else if (e.key === "-") zoom /= 1.15;
    else return;
    if (!playing) draw();
  });
  const play = holder.querySelector("[data-do=play]");
  play.addEventListener("click", () => {
    playing = !playing;
    play.setAttribute("aria-pressed", String(playing));
    play.textContent = playing ? "stop" : "move";
    if (playing) requestAnimationFrame(tick); else { phase = 1; draw(); }
  });
  holder.querySelector("[data-do=reset]").addEventListener("click", () => { R = start.map((row) => row.slice()); zoom = 1; draw(); });
  new ResizeObserver(draw).observe(canvas);
  choose(0);
  holder.dataset.ready = "drawn";
})();
