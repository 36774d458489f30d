"use strict";
// Picture, light, ground and camera.
View.stage = function (record, canvas, machine) {
  const renderer = new THREE.WebGLRenderer({ canvas, antialias: true, alpha: true, preserveDrawingBuffer: true });
  renderer.setPixelRatio(Math.min(window.devicePixelRatio || 1, 2));
  renderer.shadowMap.enabled = true;
  renderer.shadowMap.type = THREE.PCFShadowMap;
  const scene = new THREE.Scene(), view = record.view, size = view.size;
  const camera = new THREE.PerspectiveCamera(32, 1, 0.01 * size, 100 * size);
  const up = new THREE.Vector3(...view.up).normalize();
  camera.up.copy(up);
  scene.add(machine.root);
  scene.add(new THREE.HemisphereLight("#ffffff", "#aab2ba", 1.9));
  const sun = new THREE.DirectionalLight("#ffffff", 2.3);
  sun.castShadow = true;
  sun.shadow.mapSize.set(2048, 2048);
  sun.shadow.bias = -0.0006;
  sun.shadow.normalBias = 0.0015 * size;
  scene.add(sun, sun.target);
  const low = new THREE.Vector3(...view.low), high = new THREE.Vector3(...view.high), center = new THREE.Vector3(...view.center);
  const whole = low.clone().add(high).multiplyScalar(0.5), span = high.clone().sub(low).length();
  const follow = { body: -1, last: new THREE.Vector3() };

  // axes: forward from the eye, to the right, up
  const first = new THREE.Vector3(...view.direction).normalize();
  const level = first.clone().addScaledVector(up, -first.dot(up)).normalize();
  const ahead = ["x", "y", "z"].map((a) => new THREE.Vector3(Number(a === "x"), Number(a === "y"), Number(a === "z")))
    .reduce((best, axis) => (Math.abs(axis.dot(level)) > Math.abs(best.dot(level)) ? axis : best));
  const side = ahead.clone().multiplyScalar(Math.sign(ahead.dot(level)) || 1);
  side.addScaledVector(up, -side.dot(up)).normalize();
  const right = side.clone().cross(up);
  const directions = { iso: first, side, front: right.clone().negate(), top: up.clone().negate().addScaledVector(side, 1e-3) };

  const controls = new THREE.OrbitControls(camera, canvas);
  controls.enableDamping = true;
  controls.dampingFactor = 0.14;
  controls.zoomToCursor = true;

  const ground = record.ground ? groundPlane(record.ground, size, span) : null;
  if (ground) scene.add(ground.grid, ground.shadow);

  function box() {  // eight corners of the visible box
    const half = follow.body >= 0 ? new THREE.Vector3(...view.half).addScalar(0.06 * size) : high.clone().sub(low).multiplyScalar(0.5);
    const middle = follow.body >= 0 ? center.clone().add(moved()) : whole;
    return { middle, half };
  }
  function moved() {  // displacement of the followed body since the start
    const body = machine.bodies[follow.body];
    return body.place.clone().sub(new THREE.Vector3().fromArray(body.r, 0));
  }
  function look(name) {
    const direction = directions[name] || first, { middle, half } = box();
    const forward = direction.clone().normalize(), r = forward.clone().cross(up).normalize(), u = r.clone().cross(forward);
    const tan_y = Math.tan((camera.fov * Math.PI) / 360) * 0.9, tan_x = tan_y * camera.aspect;
    let distance = 0;
    for (const a of [-1, 1]) for (const b of [-1, 1]) for (const c of [-1, 1]) {
      const d = new THREE.Vector3(a * half.x, b * half.y, c * half.z);
      distance = Math.max(distance, -d.dot(forward) + Math.max(Math.abs(d.dot(r)) / tan_x, Math.abs(d.dot(u)) / tan_y));
    }
    controls.target.copy(middle);
    camera.position.copy(middle).addScaledVector(forward, -Math.max(distance, 0.2 * size));
    controls.update();
  }
  function followBody(number) {
    follow.body = number;
    if (number >= 0) follow.last.copy(machine.bodies[number].place);
  }
  function draw() {
    if (follow.body >= 0) {
      const place = machine.bodies[follow.body].place, step = place.clone().sub(follow.last);
      camera.position.add(step);
      controls.target.add(step);
      follow.last.copy(place);
    }
    controls.update();
    const middle = follow.body >= 0 ? center.clone().add(moved()) : whole, reach = follow.body >= 0 ? size : Math.max(span, size);
    sun.target.position.copy(middle);
    sun.position.copy(middle).addScaledVector(up, 1.6 * reach).addScaledVector(side, -0.55 * reach).addScaledVector(right, -0.5 * reach);
    const eye = sun.shadow.camera;
    Object.assign(eye, { left: -0.75 * reach, right: 0.75 * reach, top: 0.75 * reach, bottom: -0.75 * reach, near: 0.2 * reach, far: 4 * reach });
    eye.updateProjectionMatrix();
    const distance = camera.position.distanceTo(controls.target);
    camera.near = Math.max(distance / 200, 1e-4 * size);
    camera.far = distance * 4 + 30 * Math.max(size, span);
    camera.updateProjectionMatrix();
    if (ground) ground.place(middle, camera);
    renderer.render(scene, camera);
  }
  function resize() {
    const w = canvas.parentElement.clientWidth, h = canvas.parentElement.clientHeight;
    if (!w || !h) return;
    renderer.setSize(w, h, false);
    camera.aspect = w / h;
    camera.updateProjectionMatrix();
  }
  return { renderer, scene, camera, controls, look, followBody, draw, resize, ground, follow };
};

// a grid that fades with the distance, and the shadow on it
function groundPlane(given, size, span) {
  const normal = new THREE.Vector3(...given.normal).normalize(), extent = 14 * Math.max(size, span);
  const turn = new THREE.Quaternion().setFromUnitVectors(new THREE.Vector3(0, 0, 1), normal);
  const geometry = new THREE.PlaneGeometry(2 * extent, 2 * extent);
  const paint = new THREE.ShaderMaterial({
    transparent: true, depthWrite: false, side: THREE.DoubleSide,
    uniforms: { step: { value: given.step }, reach: { value: 5 * Math.max(size, 0.6 * span) }, middle: { value: new THREE.Vector2() } },
    vertexShader: `varying vec2 place; uniform vec2 middle;
      void main() { place = position.xy + middle; gl_Position = projectionMatrix * modelViewMatrix * vec4(position, 1.0); }`,
    fragmentShader: `varying vec2 place; uniform float step; uniform float reach; uniform vec2 middle;
      float lines(float width) { vec2 g = place / width; vec2 d = abs(fract(g - 0.5) - 0.5) / fwidth(g); return 1.0 - min(min(d.x, d.y), 1.0); }
      void main() {
        float fade = 1.0 - smoothstep(0.15 * reach, reach, distance(place, middle));
        float line = max(0.35 * lines(step), 0.6 * lines(5.0 * step));
        gl_FragColor = vec4(0.42, 0.47, 0.53, (0.06 + line) * fade);
      }`,
  });
  const grid = new THREE.Mesh(geometry, paint), shadow = new THREE.Mesh(geometry, new THREE.ShadowMaterial({ opacity: 0.2 }));
  shadow.receiveShadow = true;
  grid.renderOrder = -2;
  shadow.renderOrder = -1;
  const x = new THREE.Vector3(1, 0, 0).applyQuaternion(turn), y = new THREE.Vector3(0, 1, 0).applyQuaternion(turn);
  return {
    grid, shadow,
    place(middle) {
      const along = [middle.dot(x), middle.dot(y)];
      for (const object of [grid, shadow]) {
        object.quaternion.copy(turn);
        object.position.copy(normal).multiplyScalar(given.level).addScaledVector(x, along[0]).addScaledVector(y, along[1]);
      }
      paint.uniforms.middle.value.set(along[0], along[1]);
    },
  };
}
