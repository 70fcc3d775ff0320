// The scene of a task in 3-D: bodies, joints, the target where it truly stands, hypotheses and touches. Drawn by three.js.
"use strict";

const MAX_TOUCHES = 400;

class Scene3D {
  /** Throws if the browser has no WebGL. */
  constructor(canvas) {
    this.canvas = canvas;
    this.renderer = new THREE.WebGLRenderer({ canvas, antialias: true, alpha: true, preserveDrawingBuffer: true });
    this.renderer.setPixelRatio(Math.min(2, window.devicePixelRatio || 1));
    this.renderer.shadowMap.enabled = true;
    this.renderer.shadowMap.type = THREE.PCFSoftShadowMap;
    this.renderer.autoClear = false;
    this.scene = new THREE.Scene();
    this.scene.add(new THREE.HemisphereLight(0xffffff, 0x9aa0a8, 0.78));
    this.sun = new THREE.DirectionalLight(0xfff6e8, 0.55);
    this.sun.castShadow = true;
    this.sun.shadow.mapSize.set(2048, 2048);
    this.sun.shadow.bias = -0.0004;
    this.scene.add(this.sun, this.sun.target);
    const fill = new THREE.DirectionalLight(0xdfe9ff, 0.22);
    fill.position.set(-1, -1.2, 0.8);
    this.scene.add(fill);
    this.cameras = { near: this.camera(), arm: this.camera(), above: this.camera() };
    this.controls = {};
    for (const [name, camera] of Object.entries(this.cameras)) {
      const controls = new THREE.OrbitControls(camera, canvas);
      controls.enableKeys = false;
      controls.enabled = false;
      controls.addEventListener("change", () => this.onChange && this.onChange());
      this.controls[name] = controls;
    }
    this.view = "near";
    this.world = null;
  }

  camera() {
    const camera = new THREE.PerspectiveCamera(38, 1, 0.01, 20);
    camera.up.set(0, 0, 1);
    return camera;
  }

  setView(view) {
    this.view = view;
    for (const [name, controls] of Object.entries(this.controls)) controls.enabled = name === view;
  }

  geometry(geom, meshes) {
    const s = geom.size_m;
    switch (geom.type) {
      case "box": return new THREE.BoxBufferGeometry(2 * s[0], 2 * s[1], 2 * s[2]);
      case "sphere": return new THREE.SphereBufferGeometry(s[0], 32, 20);
      case "ellipsoid": return new THREE.SphereBufferGeometry(1, 32, 20).scale(s[0], s[1], s[2]);
      case "cylinder": return new THREE.CylinderBufferGeometry(s[0], s[0], 2 * s[1], 40).rotateX(Math.PI / 2);
      case "capsule": {
        const profile = [];
        for (let i = 0; i <= 12; ++i) profile.push(new THREE.Vector2(s[0] * Math.sin((i / 24) * Math.PI), -s[1] - s[0] * Math.cos((i / 24) * Math.PI)));
        for (let i = 12; i <= 24; ++i) profile.push(new THREE.Vector2(Math.max(0, s[0] * Math.sin((i / 24) * Math.PI)), s[1] - s[0] * Math.cos((i / 24) * Math.PI)));
        return new THREE.LatheBufferGeometry(profile, 36).rotateX(Math.PI / 2);
      }
      case "mesh": {
        const mesh = meshes[geom.mesh], geometry = new THREE.BufferGeometry();
        geometry.setAttribute("position", new THREE.Float32BufferAttribute(mesh.vertices_m, 3));
        geometry.setIndex(mesh.faces);
        const flat = geometry.toNonIndexed();
        flat.computeVertexNormals();
        return flat;
      }
      default: return null;  // a plane: the floor is drawn anyhow
    }
  }

  /** Builds the bodies of a task; null: an empty stage. */
  build(description) {
    if (this.world) this.scene.remove(this.world);
    this.world = new THREE.Group();
    this.scene.add(this.world);
    this.description = description;
    this.bodies = [];
    this.joints = [];
    this.targetMaterials = [];
    this.tool = null;
    if (description) {
      description.bodies.forEach((body, i) => {
        const object = new THREE.Group();
        object.position.fromArray(body.position_m);
        object.quaternion.copy(this.quaternion(body.quaternion_wxyz));
        (i === 0 ? this.world : this.bodies[body.parent]).add(object);
        this.bodies.push(object);
        if (body.joint !== undefined) this.joints[body.joint] = { object, rest: object.quaternion.clone(), axis: new THREE.Vector3().fromArray(body.axis) };
      });
      for (const geom of description.geoms) this.addGeom(geom, description.meshes);
      this.tool = this.bodies[description.tool_body];
      this.target = this.bodies[description.target_body];
    }
    const overlay = { depthTest: false, transparent: true };
    this.path = new THREE.Line(new THREE.BufferGeometry(), new THREE.LineBasicMaterial({ color: 0x0b8792, opacity: 0.55, ...overlay }));
    this.path.frustumCulled = false;
    this.path.renderOrder = 5;
    this.touches = new THREE.InstancedMesh(new THREE.SphereBufferGeometry(0.0011, 14, 10), new THREE.MeshBasicMaterial({ color: 0xe0590f, opacity: 0.85, ...overlay }), MAX_TOUCHES);
    this.touches.frustumCulled = false;
    this.touches.renderOrder = 7;
    this.pushing = new THREE.Mesh(new THREE.SphereBufferGeometry(0.0024, 18, 12), new THREE.MeshBasicMaterial({ color: 0xff6a1f, opacity: 0.9, ...overlay }));
    this.pushing.renderOrder = 8;
    this.world.add(this.path, this.touches, this.pushing);
  }

  addGeom(geom, meshes) {
    const geometry = this.geometry(geom, meshes);
    if (!geometry) return;
    const [r, g, b, a] = geom.rgba;
    const material = new THREE.MeshStandardMaterial({ color: new THREE.Color(r, g, b), roughness: 0.62, metalness: geom.part === "robot" ? 0.12 : 0.02, flatShading: geom.type === "mesh" });
    if (a < 1) { material.transparent = true; material.opacity = a; }
    if (geom.part === "target") this.targetMaterials.push(material);
    const mesh = new THREE.Mesh(geometry, material);
    mesh.position.fromArray(geom.position_m);
    mesh.quaternion.copy(this.quaternion(geom.quaternion_wxyz));
    mesh.castShadow = true;
    mesh.receiveShadow = true;
    this.bodies[geom.body].add(mesh);
  }

  quaternion([w, x, y, z]) { return new THREE.Quaternion(x, y, z, w); }

  seeThrough(on) {
    for (const material of this.targetMaterials) { material.transparent = on; material.opacity = on ? 0.3 : 1; material.depthWrite = !on; material.needsUpdate = true; }
  }

  /** Puts the episode on the stage: target, hypotheses, path of the tool, cameras. */
  show(replay) {
    if (this.target) {
      this.target.position.fromArray(replay.truth.position);
      this.target.quaternion.copy(this.quaternion(replay.truth.quaternion));
    }
    this.showHypotheses(replay);
    const places = [];
    if (this.tool) {
      for (let i = 0; i < replay.times.length; ++i) {
        this.pose(replay.q, i * 6, i * 6, 0);
        this.world.updateMatrixWorld(true);
        places.push(new THREE.Vector3().setFromMatrixPosition(this.tool.matrixWorld));
      }
    }
    this.path.geometry = new THREE.BufferGeometry().setFromPoints(places.length ? places : [new THREE.Vector3()]);
    this.placeCameras(replay);
  }

  showHypotheses(replay) {
    if (this.cloud) this.world.remove(this.cloud);
    const [nx, ny, nz] = replay.extents, cells = nx * ny * nz, cell = this.description ? this.description.cell_m : 0.002;
    const turns = cells > 0 ? Math.max(1, Math.round(replay.hypotheses / cells)) : 1;
    const told = this.quaternion(replay.told.quaternion), centre = new THREE.Vector3().fromArray(replay.told.position);
    const positions = [], alphas = [];
    for (let h = 0; h < replay.hypotheses; ++h) {
      const c = Math.floor(h / turns);
      const place = new THREE.Vector3(Math.floor(c / (ny * nz)) - (nx - 1) / 2, (Math.floor(c / nz) % ny) - (ny - 1) / 2, (c % nz) - (nz - 1) / 2);
      place.multiplyScalar(cell).applyQuaternion(told).add(centre);
      positions.push(place.x, place.y, place.z);
      alphas.push(1);
    }
    const geometry = new THREE.BufferGeometry();
    geometry.setAttribute("position", new THREE.Float32BufferAttribute(positions, 3));
    geometry.setAttribute("alive", new THREE.Float32BufferAttribute(alphas, 1));
    this.cloud = new THREE.Points(geometry, new THREE.ShaderMaterial({
      transparent: true, depthTest: false, depthWrite: false,
      uniforms: { pixels: { value: 600 }, size: { value: 0.0005 }, crowd: { value: 1 } },
      vertexShader: "attribute float alive; varying float a; uniform float pixels; uniform float size; void main() { a = alive; vec4 p = modelViewMatrix * vec4(position, 1.0);"
        + " gl_PointSize = clamp(pixels * size * (1.0 + 1.2 * alive) * projectionMatrix[1][1] / -p.z, 1.2, 60.0); gl_Position = projectionMatrix * p; }",
      fragmentShader: "varying float a; uniform float crowd; void main() { float r = length(gl_PointCoord - 0.5) * 2.0; if (r > 1.0 || a < 0.01) discard;"
        + " vec3 gone = vec3(0.55, 0.58, 0.62); vec3 here = vec3(0.02, 0.52, 0.58); gl_FragColor = vec4(mix(gone, here, a), smoothstep(1.0, 0.75, r) * mix(0.35, crowd, a) * min(1.0, a * 3.0)); }",
    }));
    this.cloud.frustumCulled = false;
    this.cloud.renderOrder = 6;
    this.world.add(this.cloud);
  }

  placeCameras(replay) {
    const mouth = new THREE.Vector3().fromArray(replay.told.position);
    const place = (name, target, offset) => {
      this.cameras[name].position.copy(target).add(offset);
      this.controls[name].target.copy(target);
      this.cameras[name].lookAt(target);
      this.controls[name].update();
    };
    place("near", mouth.clone().add(new THREE.Vector3(0, 0, 0.022)), new THREE.Vector3(-0.13, -0.19, 0.13));
    const middle = new THREE.Vector3(mouth.x * 0.5, mouth.y * 0.5, 0.36);
    place("arm", middle, new THREE.Vector3(0.75, -1.55, 0.62));
    place("above", mouth.clone(), new THREE.Vector3(-0.002, -0.004, 0.5));
    this.sun.position.copy(mouth).add(new THREE.Vector3(-0.5, -0.7, 1.5));
    this.sun.target.position.copy(mouth);
    const box = this.sun.shadow.camera;
    box.left = box.bottom = -0.9;
    box.right = box.top = 0.9;
    box.near = 0.1;
    box.far = 4;
    box.updateProjectionMatrix();
  }

  pose(q, from, to, share) {
    this.joints.forEach((joint, i) => {
      const angle = q[from + i] + share * (q[to + i] - q[from + i]);
      joint.object.quaternion.copy(joint.rest).multiply(new THREE.Quaternion().setFromAxisAngle(joint.axis, angle));
    });
  }

  /** The state at `time`; returns the share of hypotheses that are alive. */
  moveTo(replay, time) {
    const last = replay.times.length - 1;
    let i = Math.min(last, Math.max(0, Math.floor(time / replay.period)));
    const next = Math.min(last, i + 1), span = replay.times[next] - replay.times[i];
    this.pose(replay.q, i * 6, next * 6, span > 0 ? Math.min(1, Math.max(0, (time - replay.times[i]) / span)) : 0);
    if (this.path.geometry.attributes.position) this.path.geometry.setDrawRange(Math.min(i, Math.ceil(replay.start / replay.period)), Math.max(0, i + 1 - Math.min(i, Math.ceil(replay.start / replay.period))));
    const alive = this.cloud.geometry.attributes.alive;
    const fade = replay.decisions.map((d) => (time < d.time ? 1 : Math.max(0, 1 - (time - d.time) / 0.4)));
    const walk = replay.decisions.findIndex((d) => d.attempt > 0);
    const over = walk >= 0 && time >= replay.decisions[walk].time;
    let left = 0;
    for (let h = 0; h < replay.hypotheses; ++h) {
      const by = replay.ruledOut[h];
      alive.array[h] = over ? 0 : by === 0 ? 1 : fade[by - 1];
      left += alive.array[h] >= 1 ? 1 : 0;
    }
    alive.needsUpdate = true;
    this.cloud.material.uniforms.crowd.value = left > 1500 ? 0.45 : left > 300 ? 0.62 : left > 40 ? 0.8 : 1;
    this.cloud.material.uniforms.size.value = left > 300 ? 0.0005 : left > 30 ? 0.0006 : left > 4 ? 0.0008 : 0.0011;
    this.showTouches(replay, time);
  }

  showTouches(replay, time) {
    const marks = [];
    let pushing = null;
    for (const contact of replay.contacts) {
      if (contact.time > time + 1e-9) break;
      if (time - contact.time <= 1.5 * replay.period) pushing = contact;
      const same = marks.length && Math.hypot(...contact.point.map((v, k) => v - marks[marks.length - 1][k])) < 0.0008;
      if (!same) marks.push(contact.point);
    }
    const matrix = new THREE.Matrix4();
    const shown = marks.slice(-MAX_TOUCHES);
    shown.forEach((p, k) => this.touches.setMatrixAt(k, matrix.makeTranslation(p[0], p[1], p[2])));
    this.touches.count = shown.length;
    this.touches.visible = shown.length > 0;
    this.touches.instanceMatrix.needsUpdate = true;
    this.pushing.visible = pushing !== null;
    if (pushing) {
      this.pushing.position.fromArray(pushing.point);
      this.pushing.scale.setScalar(0.7 + Math.min(1.6, pushing.force / 15));
    }
  }

  resize() {
    const width = this.canvas.clientWidth, height = this.canvas.clientHeight;
    if (!width || !height) return false;
    if (this.width !== width || this.height !== height) {
      this.width = width;
      this.height = height;
      this.renderer.setSize(width, height, false);
    }
    return true;
  }

  render() {
    if (!this.world || !this.resize()) return;
    this.renderer.setClearColor(new THREE.Color(this.background || getComputedStyle(this.canvas.parentElement).backgroundColor), 1);
    const inset = this.width > 420 && this.view !== "above" ? (this.view === "near" ? "arm" : "near") : null;
    this.renderer.setScissorTest(false);
    this.renderer.setViewport(0, 0, this.width, this.height);
    this.renderer.clear();
    this.draw(this.cameras[this.view], this.width, this.height);
    if (inset) {
      const w = Math.round(this.width * 0.27), h = Math.round(this.height * 0.36), edge = 12;
      this.renderer.setViewport(edge, edge, w, h);
      this.renderer.setScissor(edge, edge, w, h);
      this.renderer.setScissorTest(true);
      this.renderer.clear();
      this.draw(this.cameras[inset], w, h);
      this.renderer.setScissorTest(false);
    }
  }

  draw(camera, width, height) {
    camera.aspect = width / height;
    camera.updateProjectionMatrix();
    this.cloud.material.uniforms.pixels.value = height * this.renderer.getPixelRatio();
    this.renderer.render(this.scene, camera);
  }
}
