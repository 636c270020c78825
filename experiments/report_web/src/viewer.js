// Two rules side by side on the deformed points, coloured by error with a common scale.
import * as THREE from "three";
import { OrbitControls } from "three/examples/jsm/controls/OrbitControls.js";
import { decode, decodePositions, element, short } from "./data.js";

// Light is small: lines and shading stay visible on a white page (ColorBrewer's YlOrRd, darkened at its end).
const stops = ["#f4f1de", "#fee090", "#fdae61", "#f46d43", "#d73027", "#8c0d25", "#4a0518"].map((hex) => new THREE.Color(hex));
function colorAt(t, target) {
  const place = Math.min(Math.max(t, 0), 1) * (stops.length - 1), low = Math.min(Math.floor(place), stops.length - 2);
  return target.copy(stops[low]).lerp(stops[low + 1], place - low);
}

const mix = (a, b, t, out) => {
  for (let i = 0; i < out.length; ++i) out[i] = a[i] + (b[i] - a[i]) * t;
};

class Side {
  constructor(viewer, scene) {
    this.viewer = viewer;
    this.world = new THREE.Scene();
    const count = scene.rest.points.length / 3;
    this.positions = new Float32Array(3 * count);
    this.errors = new Float32Array(count);
    this.geometry = new THREE.BufferGeometry();
    this.geometry.setAttribute("position", new THREE.BufferAttribute(this.positions, 3));
    this.geometry.setAttribute("color", new THREE.BufferAttribute(new Float32Array(3 * count), 3));
    if (scene.faces.length) {
      this.geometry.setIndex(new THREE.BufferAttribute(scene.faces, 1));
      const options = { vertexColors: true, side: THREE.DoubleSide };
      this.material = scene.flatSpace ? new THREE.MeshBasicMaterial(options) : new THREE.MeshStandardMaterial({ ...options, roughness: 0.55, metalness: 0 });
      this.object = new THREE.Mesh(this.geometry, this.material);
    } else {
      this.material = new THREE.PointsMaterial({ vertexColors: true, size: 4, sizeAttenuation: false });
      this.object = new THREE.Points(this.geometry, this.material);
    }
    this.object.frustumCulled = false;
    // The points' own edges share their positions.
    const fineGeometry = new THREE.BufferGeometry();
    fineGeometry.setAttribute("position", this.geometry.attributes.position);
    fineGeometry.setIndex(new THREE.BufferAttribute(scene.fineEdges, 1));
    this.fine = new THREE.LineSegments(fineGeometry, new THREE.LineBasicMaterial({ color: "#1b1f24", transparent: true, opacity: 0.25 }));
    this.fine.frustumCulled = false;
    this.fine.visible = scene.flatSpace;
    this.cage = new Float32Array(scene.rest.vertices.length);
    const cageGeometry = new THREE.BufferGeometry();
    cageGeometry.setAttribute("position", new THREE.BufferAttribute(this.cage, 3));
    cageGeometry.setIndex(new THREE.BufferAttribute(scene.edges, 1));
    this.wires = new THREE.LineSegments(cageGeometry, new THREE.LineBasicMaterial({ color: "#27445c", transparent: true, opacity: 0.35 }));
    this.wires.frustumCulled = false;
    const light = new THREE.DirectionalLight("#ffffff", 2.2), fill = new THREE.DirectionalLight("#dfe8ff", 0.8);
    viewer.lights.push([light, new THREE.Vector3(0.5, 0.9, 1)], [fill, new THREE.Vector3(-1, -0.4, 0.3)]);
    this.world.add(this.object, this.fine, this.wires, new THREE.AmbientLight("#ffffff", 0.75), light, fill);
  }

  // Time 0 is rest, k the k-th stored frame, linear between.
  pose(scene, rule, time) {
    const k = Math.min(Math.floor(time), scene.frames.length - 1), t = time - k;
    const at = (frame, kind) => (frame === 0 ? scene.rest[kind] : kind === "vertices" ? scene.frames[frame - 1].vertices : rule === null ? scene.frames[frame - 1].points : scene.rules[rule].positions[frame - 1]);
    mix(at(k, "points"), at(k + 1, "points"), t, this.positions);
    mix(at(k, "vertices"), at(k + 1, "vertices"), t, this.cage);
    const error = (frame) => (frame === 0 || rule === null ? scene.zeros : scene.rules[rule].errors[frame - 1]);
    mix(error(k), error(k + 1), t, this.errors);
    this.geometry.attributes.position.needsUpdate = true;
    this.wires.geometry.attributes.position.needsUpdate = true;
    if (scene.faces.length && !scene.flatSpace) this.geometry.computeVertexNormals();
  }

  paint(greatest, logarithmic) {
    const colors = this.geometry.attributes.color.array, color = new THREE.Color();
    for (let p = 0; p < this.errors.length; ++p) {
      const relative = this.errors[p] / greatest;
      colorAt(logarithmic ? 1 + Math.log10(Math.max(relative, 1e-3)) / 3 : relative, color).toArray(colors, 3 * p);
    }
    this.geometry.attributes.color.needsUpdate = true;
  }
}

/** The edges of triangles, each once. */
function edgesOf(faces) {
  const seen = new Set(), pairs = [];
  for (let f = 0; f < faces.length; f += 3)
    for (let i = 0; i < 3; ++i) {
      const a = Math.min(faces[f + i], faces[f + ((i + 1) % 3)]), b = Math.max(faces[f + i], faces[f + ((i + 1) % 3)]);
      const key = a * 67108864 + b;
      if (!seen.has(key)) { seen.add(key); pairs.push(a, b); }
    }
  return Uint32Array.from(pairs);
}

/** Arrays of a scene as the viewer needs them; a plane's third coordinate is 0. */
function unpack(scene) {
  const points = (array) => decodePositions(array, scene.columns);
  const faces = decode(scene.faces);
  return {
    faces, edges: decode(scene.edges), fineEdges: edgesOf(faces),
    flatSpace: scene.columns < 3,
    rest: { points: decodePositions(scene.rest.points, scene.gdim), vertices: decodePositions(scene.rest.vertices, scene.gdim) },
    frames: scene.frames.map((frame) => ({ number: frame.number, vertices: points(frame.vertices), points: points(frame.truth) })),
    rules: scene.rules.map((rule) => ({ positions: rule.positions.map(points), errors: rule.errors.map(decode) })),
  };
}

export class Viewer {
  constructor(run, place) {
    this.run = run;
    this.scene = unpack(run.scene);
    this.scene.zeros = new Float32Array(this.scene.rest.points.length / 3);
    this.lights = [];
    this.time = this.scene.frames.length;
    this.#build(place);
  }

  #build(place) {
    const { run, scene } = this;
    const contest = run.rules.filter((rule) => rule.reconstructor && !rule.isBound);
    const left = run.rules.find((rule) => !rule.reconstructor) ?? run.rules[0];
    const best = contest.reduce((a, b) => (a && run.finest[a.index].error.all.rms <= run.finest[b.index].error.all.rms ? a : b), null) ?? run.rules.at(-1);
    const paper = contest.filter((rule) => rule.interpolant === "phong" && rule.reconstructor === "chandrashekar_garg");
    const right = paper.find((rule) => run.finest[rule.index].options.epsilon === 1) ?? paper[0] ?? best;
    this.chosen = [left.index, right.index];
    const options = () => [element("option", { value: "truth", textContent: "truth" }), ...run.rules.map((rule) => element("option", { value: rule.index, textContent: rule.name }))];
    const selects = this.chosen.map((rule, side) => {
      const select = element("select", { id: side ? "right" : "left" }, ...options());
      select.value = rule;
      select.onchange = () => {
        this.chosen[side] = select.value === "truth" ? null : Number(select.value);
        this.update();
      };
      return select;
    });
    const check = (label, id, value, change) => {
      const box = element("input", { type: "checkbox", id, checked: value });
      box.onchange = () => change(box.checked);
      return element("label", {}, box, label);
    };
    this.logarithmic = false;
    const first = element("div", { className: "bar" }, element("label", {}, "Left", selects[0]), element("label", {}, "Right", selects[1]));
    const scaleCanvas = element("canvas", { width: 160, height: 12 });
    this.scaleLow = element("span");
    this.scaleHigh = element("span");
    const paint = scaleCanvas.getContext("2d"), color = new THREE.Color();
    for (let x = 0; x < 160; ++x) {
      paint.fillStyle = `#${colorAt(x / 159, color).getHexString()}`;
      paint.fillRect(x, 0, 1, 12);
    }
    const second = element("div", { className: "bar" });
    if (scene.faces.length && !scene.flatSpace)
      second.append(check("flat shading", "flat", false, (on) => {
        for (const side of this.sides) { side.material.flatShading = on; side.material.needsUpdate = true; }
        this.draw();
      }));
    if (scene.faces.length)
      second.append(check("point mesh", "fine", scene.flatSpace, (on) => { for (const side of this.sides) side.fine.visible = on; this.draw(); }));
    second.append(
      check("coarse cells", "wires", true, (on) => { for (const side of this.sides) side.wires.visible = on; this.draw(); }),
      check("logarithmic scale", "logarithmic", false, (on) => { this.logarithmic = on; this.update(); }),
      element("span", { className: "scale" }, "error", this.scaleLow, scaleCanvas, this.scaleHigh),
    );
    this.canvas = element("canvas");
    this.tags = [0, 1].map((side) => element("div", { className: "tag", style: side ? "left:calc(50% + .6em)" : "left:.6em" }));
    this.frame = element("div", { className: "views" }, this.canvas, element("div", { className: "middle" }), ...this.tags);
    const slider = element("input", { type: "range", id: "frame", min: 0, max: scene.frames.length, step: 0.01, value: this.time });
    this.frameName = element("span", { style: "min-width:6.5em" });
    slider.oninput = () => { this.stop(); this.time = Number(slider.value); this.update(); };
    this.play = element("button", { textContent: "▶ play" });
    this.play.onclick = () => (this.timer ? this.stop() : this.animate(slider));
    const reset = element("button", { textContent: "reset view" });
    reset.onclick = () => { this.controls.reset(); this.draw(); };
    place.append(first, second, this.frame, element("div", { className: "bar" }, this.play, element("label", { className: "slider" }, "Frame", slider, this.frameName), reset));
    place.append(element("p", { className: "note", textContent: "Drag to turn, wheel to come closer, right button to move. The slider starts at rest." + (run.scene.note ? ` ${run.scene.note}` : "") }));
  }

  /** After the page has laid the canvas out. */
  start() {
    const { scene } = this;
    try {
      this.renderer = new THREE.WebGLRenderer({ canvas: this.canvas, antialias: true });
    } catch {
      this.frame.replaceChildren(element("p", { className: "note", style: "padding:1em", textContent: "This browser has no WebGL: the 3D view is left out." }));
      this.renderer = null;
      return;
    }
    this.renderer.setPixelRatio(Math.min(window.devicePixelRatio, 2));
    this.sides = [new Side(this, scene), new Side(this, scene)];
    const boxes = [scene.rest.points, ...scene.frames.map((frame) => frame.points)].map((list) => {
      const box = new THREE.Box3();
      for (let p = 0; p < list.length; p += 3) if (Number.isFinite(list[p])) box.expandByPoint(new THREE.Vector3(list[p], list[p + 1], list[p + 2]));
      return box;
    });
    const diagonal = (box) => box.getSize(new THREE.Vector3()).length();
    const all = boxes.reduce((a, b) => a.clone().union(b)), largest = Math.max(...boxes.map(diagonal));
    // A body that travels farther than its size is followed.
    this.centers = diagonal(all) > 1.6 * largest ? boxes.map((box) => box.getCenter(new THREE.Vector3())) : null;
    const center = this.centers ? new THREE.Vector3() : all.getCenter(new THREE.Vector3()), size = (this.centers ? largest : diagonal(all)) || 1;
    this.camera = scene.flatSpace ? new THREE.OrthographicCamera() : new THREE.PerspectiveCamera(32, 1, 0.01 * size, 20 * size);
    this.extent = size;
    const away = scene.flatSpace ? new THREE.Vector3(0, 0, 1) : new THREE.Vector3(0.75, -1, 0.5).normalize();
    if (!scene.flatSpace) this.camera.up.set(0, 0, 1);
    this.camera.position.copy(center).addScaledVector(away, 1.95 * size);
    this.controls = new OrbitControls(this.camera, this.canvas);
    this.controls.enableRotate = !scene.flatSpace;
    this.controls.target.copy(center);
    this.controls.update();
    this.controls.saveState();
    this.controls.addEventListener("change", () => this.draw());
    this.observer = new ResizeObserver(() => this.resize());
    this.observer.observe(this.frame);
    this.resize();
    this.update();
  }

  resize() {
    const width = this.frame.clientWidth, height = Math.round(Math.min(Math.max(0.46 * width, 260), 560));
    if (!width) return;
    this.renderer.setSize(width, height, false);
    this.canvas.style.height = `${height}px`;
    const aspect = width / 2 / height;
    if (this.scene.flatSpace) {
      const half = (0.37 * this.extent) / Math.min(aspect, 1);
      Object.assign(this.camera, { left: -half * aspect, right: half * aspect, top: half, bottom: -half, near: -10 * this.extent, far: 10 * this.extent });
    } else this.camera.aspect = aspect;
    this.camera.updateProjectionMatrix();
    this.draw();
  }

  /** Positions, errors, colours and words, for the time and rules chosen. */
  update() {
    if (!this.renderer) return;
    const { scene, run } = this;
    this.sides.forEach((side, i) => side.pose(scene, this.chosen[i], this.time));
    if (this.centers) {
      const k = Math.min(Math.floor(this.time), this.centers.length - 2);
      const center = this.centers[k].clone().lerp(this.centers[k + 1], this.time - k);
      for (const side of this.sides) for (const part of [side.object, side.fine, side.wires]) part.position.copy(center).negate();
    }
    // One scale for both sides and all frames: colours can be compared.
    let greatest = 0;
    for (const rule of this.chosen)
      if (rule !== null) for (const errors of scene.rules[rule].errors) for (const error of errors) if (error > greatest) greatest = error;
    greatest ||= 1;
    for (const side of this.sides) side.paint(greatest, this.logarithmic);
    this.scaleLow.textContent = this.logarithmic ? `≤ ${short(greatest / 1000)}` : "0";
    this.scaleHigh.textContent = short(greatest);
    const whole = Math.round(this.time), exact = Math.abs(this.time - whole) < 1e-9;
    this.frameName.textContent = whole === 0 && exact ? "at rest" : !exact ? "between" : scene.frames.length === 1 ? "deformed" : `${scene.frames[whole - 1].number}`;
    this.tags.forEach((tag, i) => {
      const rule = this.chosen[i], errors = this.sides[i].errors;
      let squares = 0, most = 0, count = 0;
      for (const error of errors) if (Number.isFinite(error)) { squares += error * error; most = Math.max(most, error); ++count; }
      tag.replaceChildren(element("b", { textContent: rule === null ? "truth" : run.rules[rule].name }), rule === null ? "" : `rms ${short(Math.sqrt(squares / count))}, max ${short(most)}`);
    });
    this.draw();
  }

  draw() {
    if (!this.renderer) return;
    const size = this.renderer.getSize(new THREE.Vector2());
    this.renderer.setScissorTest(true);
    this.sides.forEach((side, i) => {
      this.renderer.setViewport((i * size.x) / 2, 0, size.x / 2, size.y);
      this.renderer.setScissor((i * size.x) / 2, 0, size.x / 2, size.y);
      this.renderer.setClearColor("#fbfcfd");
      this.renderer.clear();
      this.renderer.render(side.world, this.camera);
    });
    // Lights stay with the viewer, so that the side that is seen is lit.
    for (const [light, offset] of this.lights) light.position.copy(offset).applyQuaternion(this.camera.quaternion);
  }

  animate(slider) {
    this.play.textContent = "⏸ stop";
    const speed = this.scene.frames.length > 1 ? 6 : 0.7; // frames a second
    let last = null;
    const step = (now) => {
      if (last !== null) this.time = (this.time + (speed * (now - last)) / 1000) % this.scene.frames.length;
      last = now;
      slider.value = this.time;
      this.update();
      this.timer = requestAnimationFrame(step);
    };
    this.timer = requestAnimationFrame(step);
  }

  stop() {
    cancelAnimationFrame(this.timer);
    this.timer = null;
    this.play.textContent = "▶ play";
  }

  dispose() {
    this.stop();
    this.observer?.disconnect();
    this.controls?.dispose();
    this.renderer?.dispose();
  }
}
