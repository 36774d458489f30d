"use strict";
// Bodies, surfaces, joints and forces: built once, then posed at a row of the motion or a phase of a mode.
View.machine = function (record, array) {
  const times = array(record.time), n = times.length, size = record.view.size;
  const root = new THREE.Group();
  const groups = { body: new THREE.Group(), scene: new THREE.Group(), joint: new THREE.Group(), force: new THREE.Group(),
                   arrows: new THREE.Group(), trails: new THREE.Group(), edges: [] };
  for (const name of ["body", "scene", "joint", "force", "arrows", "trails"]) root.add(groups[name]);
  const z = new THREE.Vector3(0, 0, 1), flip = new THREE.Quaternion(1, 0, 0, 0);
  const state = { k: 0, f: 0, magnification: record.magnification, color: record.color, range: { kind: "all", own: 0 }, mode: -1 };

  // where bodies are
  const bodies = record.bodies.map((each) => ({
    name: each.name, r: array(each.r), p: array(each.p), a: array(each.a), n_a: each.a ? each.a.shape[1] : 0,
    modes: each.modes ? { re: array(each.modes.re), im: array(each.modes.im), a_re: array(each.modes.a_re), a_im: array(each.modes.a_im) } : null,
    place: new THREE.Vector3(), turn: new THREE.Quaternion(), matrix: new THREE.Matrix4(), amplitude: new Float32Array(each.a ? each.a.shape[1] : 0),
  }));
  const one = new THREE.Vector3(1, 1, 1), q0 = new THREE.Quaternion(), q1 = new THREE.Quaternion(), v0 = new THREE.Vector3(), v1 = new THREE.Vector3();
  const quaternion = (p, k, into) => into.set(p[4 * k + 1], p[4 * k + 2], p[4 * k + 3], p[4 * k]);
  const exponential = (x, y, w, into) => {  // of a rotation vector
    const angle = Math.hypot(x, y, w), s = angle > 1e-9 ? Math.sin(angle / 2) / angle : 0.5;
    return into.set(s * x, s * y, s * w, Math.cos(angle / 2));
  };
  function poseBodies() {
    const { k, f } = state, next = Math.min(k + 1, n - 1);
    for (const body of bodies) {
      quaternion(body.p, k, body.turn);
      if (f > 0) body.turn.slerp(quaternion(body.p, next, q1), f);
      body.place.fromArray(body.r, 3 * k).lerp(v1.fromArray(body.r, 3 * next), f);
      for (let j = 0; j < body.n_a; j++) body.amplitude[j] = (1 - f) * body.a[body.n_a * k + j] + f * body.a[body.n_a * next + j];
      if (state.mode >= 0 && body.modes) {
        const m = body.modes, c = Math.cos(state.phase) * state.magnification, s = Math.sin(state.phase) * state.magnification, at = 6 * state.mode;
        const x = [0, 1, 2, 3, 4, 5].map((j) => c * m.re[at + j] - s * m.im[at + j]);
        body.place.add(v1.set(x[0], x[1], x[2]).applyQuaternion(body.turn));
        body.turn.multiply(exponential(x[3], x[4], x[5], q1));
        for (let j = 0; j < body.n_a; j++) body.amplitude[j] += c * m.a_re[body.n_a * state.mode + j] - s * m.a_im[body.n_a * state.mode + j];
      }
      body.matrix.compose(body.place, body.turn, one);
    }
  }

  // carriers of pieces
  const carriers = record.carriers.map((each) => {
    const a = each.axes, axes = new THREE.Matrix4().set(a[0], a[1], a[2], 0, a[3], a[4], a[5], 0, a[6], a[7], a[8], 0, 0, 0, 0, 1);
    const group = new THREE.Group();
    group.matrixAutoUpdate = false;
    return { body: each.body, position: new THREE.Vector3(...each.position), turn: new THREE.Quaternion().setFromRotationMatrix(axes), motion: array(each.motion),
             modes: each.modes ? { re: array(each.modes.re), im: array(each.modes.im) } : null, group, at: new THREE.Vector3() };
  });
  function poseCarriers() {
    const { k, f } = state, next = Math.min(k + 1, n - 1), m = record.kind === "modes" ? 1 : state.magnification;
    for (const carrier of carriers) {
      v0.copy(carrier.position);
      q0.copy(carrier.turn);
      if (carrier.motion || (carrier.modes && state.mode >= 0)) {
        const d = [0, 0, 0, 0, 0, 0];
        if (carrier.motion) for (let j = 0; j < 6; j++) d[j] = m * ((1 - f) * carrier.motion[6 * k + j] + f * carrier.motion[6 * next + j]);
        if (carrier.modes && state.mode >= 0) {
          const c = Math.cos(state.phase) * state.magnification, s = Math.sin(state.phase) * state.magnification, at = 6 * state.mode;
          for (let j = 0; j < 6; j++) d[j] += c * carrier.modes.re[at + j] - s * carrier.modes.im[at + j];
        }
        v0.add(v1.set(d[0], d[1], d[2]));
        q0.premultiply(exponential(d[3], d[4], d[5], q1));
      }
      carrier.group.matrix.compose(v0, q0, one);
      if (carrier.body >= 0) carrier.group.matrix.premultiply(bodies[carrier.body].matrix);
      carrier.group.matrixWorldNeedsUpdate = true;
      carrier.at.setFromMatrixPosition(carrier.group.matrix);
    }
  }

  // pieces
  const materials = new Map();
  function material(color, opacity, ground) {
    const key = `${color} ${opacity} ${ground}`;
    if (!materials.has(key)) {
      materials.set(key, new THREE.MeshStandardMaterial({
        color, roughness: ground ? 0.95 : 0.5, metalness: ground ? 0 : 0.12, side: THREE.DoubleSide,
        transparent: opacity < 1, opacity, depthWrite: opacity === 1,
      }));
    }
    return materials.get(key);
  }
  function pieceObjects(piece) {
    const found = [], nodes = array(piece.nodes), corner = array(piece.corner), triangles = array(piece.triangles), segments = array(piece.segments);
    if (triangles.length) {
      const geometry = new THREE.BufferGeometry(), points = new Float32Array(3 * corner.length);
      corner.forEach((node, c) => { for (let j = 0; j < 3; j++) points[3 * c + j] = nodes[3 * node + j]; });
      geometry.setAttribute("position", new THREE.BufferAttribute(points, 3));
      geometry.setIndex(new THREE.BufferAttribute(triangles, 1));
      geometry.computeVertexNormals();
      const mesh = new THREE.Mesh(geometry, material(piece.color, piece.opacity, piece.is_ground));
      mesh.castShadow = !piece.is_ground && piece.opacity === 1;
      mesh.receiveShadow = true;
      found.push(mesh);
    }
    if (segments.length) {
      const geometry = new THREE.BufferGeometry();
      geometry.setAttribute("position", new THREE.BufferAttribute(nodes, 3));
      geometry.setIndex(new THREE.BufferAttribute(segments, 1));
      found.push(new THREE.LineSegments(geometry, new THREE.LineBasicMaterial({ color: piece.color })));
    }
    return found;
  }
  const holders = { body: [], scene: [], joint: [], force: [] };
  for (const piece of record.pieces) {
    const key = `${piece.kind} ${piece.carrier}`;
    let holder = holders[piece.kind].find((each) => each.key === key);
    if (!holder) {
      const group = new THREE.Group();
      group.matrixAutoUpdate = false;
      groups[piece.kind].add(group);
      holder = { key, group, carrier: piece.carrier, pieces: [] };
      holders[piece.kind].push(holder);
    }
    for (const object of pieceObjects(piece)) {
      holder.group.add(object);
      holder.pieces.push({ object, piece });
    }
  }
  const placed = Object.values(holders).flat();

  // parts between two carriers
  const between = record.between.map((each) => {
    const parts = each.parts.map((part) => {
      const group = new THREE.Group();
      group.matrixAutoUpdate = false;
      pieceObjects(part).forEach((object) => group.add(object));
      groups[each.kind].add(group);
      return { group, follows: part.follows };
    });
    return { first: each.first, second: each.second, parts };
  });
  function poseBetween() {
    for (const each of between) {
      const a = carriers[each.first].at, b = carriers[each.second].at, length = v0.subVectors(b, a).length();
      q0.setFromUnitVectors(z, length > 0 ? v0.divideScalar(length) : z);
      for (const part of each.parts) {
        if (part.follows === "stretch") part.group.matrix.compose(a, q0, v1.set(1, 1, Math.max(length, 1e-9)));
        else if (part.follows === "first") part.group.matrix.compose(a, q0, one);
        else part.group.matrix.compose(b, q1.copy(q0).multiply(flip), one);
        part.group.matrixWorldNeedsUpdate = true;
      }
    }
  }

  // arrows of forces
  const greatest = Math.max(...record.forces.map((each) => each.largest), 0) || 1;
  const shaft = new THREE.CylinderGeometry(1, 1, 1, 12).translate(0, 0.5, 0).rotateX(Math.PI / 2);
  const head = new THREE.ConeGeometry(1, 1, 18).translate(0, 0.5, 0).rotateX(Math.PI / 2);
  const arrows = record.forces.map((each) => {
    const group = new THREE.Group(), paint = material(each.color, 1, false);
    const parts = [new THREE.Mesh(shaft, paint), new THREE.Mesh(head, paint)];
    parts.forEach((part) => { part.matrixAutoUpdate = false; part.castShadow = true; group.add(part); });
    groups.arrows.add(group);
    return { carrier: each.carrier, values: array(each.values), at: array(each.at), own: each.is_of_element, group, parts, name: each.name };
  });
  function poseArrows() {
    const { k, f } = state, next = Math.min(k + 1, n - 1), thick = 0.0045 * size;
    for (const each of arrows) {
      each.group.visible = each.own ? state.ownForces : state.forces;
      if (!each.group.visible) continue;
      v0.fromArray(each.values, 3 * k).lerp(v1.fromArray(each.values, 3 * next), f);
      const length = (0.32 * size * v0.length()) / greatest;
      each.group.visible = length > 1e-3 * size;
      if (!each.group.visible) continue;
      q0.setFromUnitVectors(z, v0.normalize());
      const start = each.at ? v1.fromArray(each.at, 3 * k) : v1.copy(carriers[each.carrier].at), tip = Math.min(0.05 * size, 0.6 * length);
      each.parts[0].matrix.compose(start, q0, new THREE.Vector3(thick, thick, length - tip));
      each.parts[1].matrix.compose(start.addScaledVector(v0, length - tip), q0, new THREE.Vector3(2.6 * thick, 2.6 * thick, tip));
      each.parts.forEach((part) => { part.matrixWorldNeedsUpdate = true; });
    }
  }

  // flexible surfaces
  const map = colors(record.colormap);
  const surfaces = record.surfaces.map((each) => {
    const corner = array(each.corner), nodes = array(each.nodes), triangles = array(each.triangles), edges = array(each.edges);
    const count = nodes.length / 3, geometry = new THREE.BufferGeometry(), lines = new THREE.BufferGeometry();
    const moved = new Float32Array(nodes.length), points = new Float32Array(3 * corner.length);
    geometry.setAttribute("position", new THREE.BufferAttribute(points, 3).setUsage(THREE.DynamicDrawUsage));
    geometry.setAttribute("normal", new THREE.BufferAttribute(new Float32Array(points.length), 3).setUsage(THREE.DynamicDrawUsage));
    geometry.setAttribute("color", new THREE.BufferAttribute(new Float32Array(points.length).fill(1), 3).setUsage(THREE.DynamicDrawUsage));
    geometry.setIndex(new THREE.BufferAttribute(triangles, 1));
    lines.setAttribute("position", new THREE.BufferAttribute(moved, 3).setUsage(THREE.DynamicDrawUsage));
    lines.setIndex(new THREE.BufferAttribute(edges, 1));
    const coloured = new THREE.MeshStandardMaterial({ vertexColors: true, roughness: 0.62, metalness: 0.05, side: THREE.DoubleSide });
    const plain = material("#aebac6", 1, false);
    const mesh = new THREE.Mesh(geometry, coloured), wires = new THREE.LineSegments(lines, new THREE.LineBasicMaterial({ color: "#20262d", transparent: true, opacity: 0.55 }));
    for (const object of [mesh, wires]) {
      object.matrixAutoUpdate = false;
      object.frustumCulled = false;
      groups.body.add(object);
    }
    mesh.castShadow = mesh.receiveShadow = true;
    groups.edges.push(wires);
    return { body: bodies[each.body], number: each.body, corner, nodes, triangles, count, moved, points, geometry, lines, mesh, wires, coloured, plain,
             shapes: array(each.shapes), stress: array(each.stress), n_a: each.shapes.shape[0], displacement: new Float32Array(nodes.length),
             tensor: each.stress ? new Float32Array(6 * count) : null, scalars: new Float32Array(count), still: false };
  });
  function combined(shapes, amplitude, n_a, into) {  // sum of amplitude times shape
    into.fill(0);
    const length = into.length;
    for (let k = 0; k < n_a; k++) {
      const a = amplitude[k];
      if (a === 0) continue;
      const at = k * length;
      for (let j = 0; j < length; j++) into[j] += a * shapes[at + j];
    }
  }
  function mises(tensor, into) {
    for (let j = 0; j < into.length; j++) {
      const at = 6 * j, x = tensor[at], y = tensor[at + 1], w = tensor[at + 2], yw = tensor[at + 3], xw = tensor[at + 4], xy = tensor[at + 5];
      const a = x - y, b = y - w, c = w - x;
      into[j] = Math.sqrt((a * a + b * b + c * c) / 2 + 3 * (yw * yw + xw * xw + xy * xy));
    }
  }
  function deform(surface) {
    const { nodes, moved, points, corner, displacement } = surface, m = record.kind === "modes" ? 1 : state.magnification;
    combined(surface.shapes, surface.body.amplitude, surface.n_a, displacement);
    for (let j = 0; j < nodes.length; j++) moved[j] = nodes[j] + m * displacement[j];
    for (let c = 0; c < corner.length; c++) {
      const at = 3 * corner[c];
      points[3 * c] = moved[at]; points[3 * c + 1] = moved[at + 1]; points[3 * c + 2] = moved[at + 2];
    }
    normals(points, surface.triangles, surface.geometry.attributes.normal.array);
    surface.geometry.attributes.position.needsUpdate = surface.geometry.attributes.normal.needsUpdate = true;
    surface.lines.attributes.position.needsUpdate = true;
    for (const object of [surface.mesh, surface.wires]) {
      object.matrix.copy(surface.body.matrix);
      object.matrixWorldNeedsUpdate = true;
    }
  }
  function scalars(surface) {  // for a motion: values that colour the nodes, in units of the legend
    const factor = chosenColor() ? chosenColor().factor : 1;
    if (state.color === "von-mises" && surface.stress) {
      combined(surface.stress, surface.body.amplitude, surface.n_a, surface.tensor);
      mises(surface.tensor, surface.scalars);
      for (let j = 0; j < surface.count; j++) surface.scalars[j] *= factor;
    } else if (state.color === "displacement") {
      const d = surface.displacement;
      for (let j = 0; j < surface.count; j++) {
        const x = d[3 * j], y = d[3 * j + 1], w = d[3 * j + 2];
        surface.scalars[j] = factor * Math.sqrt(x * x + y * y + w * w);  // Math.hypot takes ten times as long
      }
    }
  }
  const chosenColor = () => record.colors.find((each) => each.key === state.color);
  function isColoured(surface) {
    return state.color === "displacement" || (state.color === "von-mises" && surface.stress !== null);
  }
  function paint() {
    let largest = 0;
    for (const surface of surfaces) {
      const coloured = isColoured(surface);
      surface.mesh.material = coloured ? surface.coloured : surface.plain;
      if (!coloured || state.mode >= 0) continue;
      scalars(surface);
      for (let j = 0; j < surface.count; j++) if (surface.scalars[j] > largest) largest = surface.scalars[j];
    }
    state.now = largest;
    const all = chosenColor() ? chosenColor().largest : 1;
    state.top = state.range.kind === "now" ? largest : state.range.kind === "own" ? state.range.own : all;
    if (state.mode >= 0) return;
    for (const surface of surfaces) if (isColoured(surface)) tint(surface.geometry, surface.corner, surface.scalars, state.top || 1);
  }
  function tint(geometry, corner, values, top) {
    const out = geometry.attributes.color.array, last = map.length / 3 - 1, by = last / top;
    for (let c = 0; c < corner.length; c++) {
      const v = values[corner[c]] * by, at = 3 * (v >= last ? last : v > 0 ? (v + 0.5) | 0 : 0);
      out[3 * c] = map[at]; out[3 * c + 1] = map[at + 1]; out[3 * c + 2] = map[at + 2];
    }
    geometry.attributes.color.needsUpdate = true;
  }

  // a mode has one colour per node: its amplitude or its stress, divided by the largest
  function paintMode() {
    const all = [];
    let largest = 0;
    for (const surface of surfaces) {
      if (!isColoured(surface)) continue;
      const m = surface.body.modes, at = surface.body.n_a * state.mode, values = new Float32Array(surface.count), parts = [];
      for (const [u, a] of [[m.re, m.a_re], [m.im, m.a_im]]) {
        const amplitude = a.subarray(at, at + surface.body.n_a);
        if (state.color === "von-mises") {
          combined(surface.stress, amplitude, surface.n_a, surface.tensor);
          const part = new Float32Array(surface.count);
          mises(surface.tensor, part);
          parts.push(part);
        } else {
          const d = new Float32Array(3 * surface.count);
          combined(surface.shapes, amplitude, surface.n_a, d);
          parts.push(swing(d, surface.nodes, u.subarray(6 * state.mode, 6 * state.mode + 6)));
        }
      }
      for (let j = 0; j < surface.count; j++) largest = Math.max(largest, (values[j] = Math.hypot(parts[0][j], parts[1][j])));
      all.push([surface.geometry, surface.corner, values]);
    }
    for (const [geometry, corner, values] of all) tint(geometry, corner, values, largest || 1);
    state.top = 1;
  }
  function swing(d, nodes, u) {  // magnitude of move + turn x position + elastic displacement
    const found = new Float32Array(nodes.length / 3);
    for (let j = 0; j < found.length; j++) {
      const x = nodes[3 * j], y = nodes[3 * j + 1], w = nodes[3 * j + 2];
      found[j] = Math.hypot(u[0] + u[4] * w - u[5] * y + d[3 * j], u[1] + u[5] * x - u[3] * w + d[3 * j + 1], u[2] + u[3] * y - u[4] * x + d[3 * j + 2]);
    }
    return found;
  }

  // paths of markers
  let trails = null;
  function drawTrails() {
    groups.trails.visible = Boolean(state.trails) && record.kind === "motion";
    if (!groups.trails.visible) return;
    if (!trails) trails = makeTrails();
    for (const line of trails) line.geometry.setDrawRange(0, state.k + 1);
  }
  function makeTrails() {
    const keep = { k: state.k, f: state.f }, paths = record.trails.map(() => new Float32Array(3 * n));
    for (let k = 0; k < n; k++) {
      state.k = k; state.f = 0;
      poseBodies(); poseCarriers();
      record.trails.forEach((c, j) => carriers[c].at.toArray(paths[j], 3 * k));
    }
    Object.assign(state, keep);
    poseBodies(); poseCarriers();
    groups.trails.clear();
    return paths.filter(isLong).map((path) => {
      const geometry = new THREE.BufferGeometry();
      geometry.setAttribute("position", new THREE.BufferAttribute(path, 3));
      const line = new THREE.Line(geometry, new THREE.LineBasicMaterial({ color: "#7d5ba6", transparent: true, opacity: 0.65 }));
      line.frustumCulled = false;
      groups.trails.add(line);
      return line;
    });
  }
  function isLong(path) {
    for (let j = 0; j < 3; j++) {
      let low = Infinity, high = -Infinity;
      for (let k = j; k < path.length; k += 3) { low = Math.min(low, path[k]); high = Math.max(high, path[k]); }
      if (high - low > 2e-3 * size) return true;
    }
    return false;
  }

  function pose() {
    poseBodies();
    poseCarriers();
    for (const each of placed) {
      each.group.matrix.copy(carriers[each.carrier].group.matrix);
      each.group.matrixWorldNeedsUpdate = true;
    }
    poseBetween();
    poseArrows();
    surfaces.forEach(deform);
    if (state.mode < 0) paint();
    drawTrails();
  }
  function at(time) {  // row, and fraction of the distance to the next row
    let low = 0, high = n - 1;
    while (high - low > 1) { const middle = (low + high) >> 1; if (times[middle] <= time) low = middle; else high = middle; }
    state.k = time >= times[n - 1] ? n - 1 : low;
    state.f = state.k === n - 1 || n === 1 ? 0 : Math.min(1, Math.max(0, (time - times[low]) / (times[low + 1] - times[low])));
  }
  return {
    root, groups, bodies, carriers, surfaces, state, times, pose, chosenColor,
    at(time) { at(time); pose(); },
    phase(mode, angle) { state.mode = mode; state.phase = angle; pose(); },
    repaint() { if (state.mode >= 0) { paint(); paintMode(); } else paint(); },
    forgetTrails() { trails = null; },
  };
};

// normals of corner points: sums of those of their triangles, by area
function normals(points, triangles, into) {
  into.fill(0);
  for (let t = 0; t < triangles.length; t += 3) {
    const a = 3 * triangles[t], b = 3 * triangles[t + 1], c = 3 * triangles[t + 2];
    const ux = points[b] - points[a], uy = points[b + 1] - points[a + 1], uz = points[b + 2] - points[a + 2];
    const vx = points[c] - points[a], vy = points[c + 1] - points[a + 1], vz = points[c + 2] - points[a + 2];
    const x = uy * vz - uz * vy, y = uz * vx - ux * vz, w = ux * vy - uy * vx;
    into[a] += x; into[a + 1] += y; into[a + 2] += w;
    into[b] += x; into[b + 1] += y; into[b + 2] += w;
    into[c] += x; into[c + 1] += y; into[c + 2] += w;
  }
  for (let k = 0; k < into.length; k += 3) {
    const l = into[k] * into[k] + into[k + 1] * into[k + 1] + into[k + 2] * into[k + 2], by = l > 0 ? 1 / Math.sqrt(l) : 0;
    into[k] *= by; into[k + 1] *= by; into[k + 2] *= by;
  }
}

// 256 colours for the graphics card
function colors(stops) {
  const parts = stops.map((stop) => new THREE.Color(stop)), found = new Float32Array(3 * 256), between = new THREE.Color();
  for (let k = 0; k < 256; k++) {
    const place = (k / 255) * (parts.length - 1), low = Math.min(Math.floor(place), parts.length - 2);
    between.lerpColors(parts[low], parts[low + 1], place - low).toArray(found, 3 * k);
  }
  return found;
}
