// The 3-D view: camera, light, ground grid, and drawing only when something has changed.

import {
  AmbientLight, BufferAttribute, BufferGeometry, Color, DirectionalLight, GridHelper, Group, LineBasicMaterial, LineSegments,
  OrbitControls, PerspectiveCamera, Scene, Vector3, WebGLRenderer,
} from './vendor/three.mjs';

const TURN_RAD = 0.12;
const ZOOM = 1.15;

export class View {
  constructor(canvas, cloud) {
    this.canvas = canvas;
    this.cloud = cloud;
    // Tests read the picture back after it was drawn.
    this.renderer = new WebGLRenderer({ canvas, antialias: true, preserveDrawingBuffer: navigator.webdriver });
    this.scene = new Scene();
    this.camera = new PerspectiveCamera(50, 1, 0.1, 20000);
    this.camera.up.set(0, 0, 1);
    this.camera.position.set(-60, -90, 70);
    this.controls = new OrbitControls(this.camera, canvas);
    this.controls.enableDamping = !matchMedia('(prefers-reduced-motion: reduce)').matches;
    this.controls.maxPolarAngle = Math.PI * 0.55;
    this.controls.addEventListener('change', () => this.touch());
    this.controls.addEventListener('start', () => { this.moved = true; });
    this.things = new Group();
    const sun = new DirectionalLight(0xffffff, 2);
    sun.position.set(-1, -2, 4);
    this.scene.add(cloud.object, this.things, new AmbientLight(0xffffff, 1.6), sun);
    this.mode = 'orbit';
    this.moved = false;
    this.frames = 0;
    new ResizeObserver(() => this.resize()).observe(canvas.parentElement);
    canvas.addEventListener('keydown', (event) => this.key(event));
    this.resize();
    requestAnimationFrame(() => this.frame());
  }

  /** Something is to be drawn anew. */
  touch() { this.stale = true; }

  resize() {
    const { clientWidth: width, clientHeight: height } = this.canvas.parentElement;
    if (!width || !height) return;
    const ratio = Math.min(devicePixelRatio, 2);
    this.renderer.setPixelRatio(ratio);
    this.renderer.setSize(width, height, false);
    this.cloud.material.uniforms.size.value = ratio;
    this.camera.aspect = width / height;
    this.camera.updateProjectionMatrix();
    [this.width, this.height] = [width, height];
    this.touch();
  }

  frame() {
    requestAnimationFrame(() => this.frame());
    const followed = this.mode === 'follow' ? this.followed?.() : null;
    if (followed && followed.distanceToSquared(this.controls.target) > 1e-6) {
      const step = followed.clone().sub(this.controls.target).multiplyScalar(0.2);
      this.controls.target.add(step);
      this.camera.position.add(step);
      this.touch();
    }
    this.controls.update();
    if (!this.stale) return;
    this.stale = false;
    this.beforeFrame?.(this.camera, this.width, this.height);
    this.renderer.render(this.scene, this.camera);
    this.frames += 1;
    this.afterFrame?.(this.frames);
  }

  theme(background, grid, edges) {
    this.scene.background = new Color(background);
    if (this.grid) this.scene.remove(this.grid);
    this.grid = new GridHelper(400, 40, grid, grid);
    this.grid.rotation.x = Math.PI / 2;
    this.grid.position.set(...(this.gridAt ?? [0, 0, 0]));
    this.scene.add(this.grid);
    this.edgeColour = new Color(edges);
    if (this.edges) this.edges.material.color = this.edgeColour;
    this.touch();
  }

  /** Draws the edges of a scene, six numbers each, metres. */
  setEdges(edges) {
    if (this.edges) this.scene.remove(this.edges);
    const geometry = new BufferGeometry();
    geometry.setAttribute('position', new BufferAttribute(new Float32Array(edges), 3));
    this.edges = new LineSegments(geometry, new LineBasicMaterial({ color: this.edgeColour, transparent: true, opacity: 0.7 }));
    this.scene.add(this.edges);
    this.touch();
  }

  setMode(mode) {
    const flat = mode === 'top';
    this.mode = mode;
    this.controls.enableRotate = !flat;
    this.controls.screenSpacePanning = flat;
    this.controls.mouseButtons.LEFT = flat ? 2 : 0;
    this.controls.touches.ONE = flat ? 1 : 0;
    const { target } = this.controls;
    const away = this.camera.position.distanceTo(target);
    if (flat) this.camera.position.set(target.x, target.y - 1e-3 * away, target.z + away);
    else if (this.wasFlat) this.camera.position.set(target.x - 0.45 * away, target.y - 0.62 * away, target.z + 0.64 * away);
    this.wasFlat = flat;
    this.touch();
  }

  /** Shows a box of places, as [low, high]. */
  fit([low, high]) {
    const a = new Vector3(...low);
    const b = new Vector3(...high);
    if (!(a.x <= b.x)) return;
    const { target } = this.controls;
    const from = this.camera.position.clone().sub(target).normalize();
    target.copy(a).add(b).multiplyScalar(0.5);
    const narrow = Math.min(1, this.camera.aspect);
    const away = Math.max(12, (0.62 * a.distanceTo(b)) / Math.tan((this.camera.fov * Math.PI) / 360) / narrow);
    this.camera.position.copy(target).addScaledVector(from, away);
    this.gridAt = [10 * Math.round(target.x / 10), 10 * Math.round(target.y / 10), 0];
    this.grid?.position.set(...this.gridAt);
    this.touch();
  }

  key(event) {
    const turn = { ArrowLeft: [-1, 0], ArrowRight: [1, 0], ArrowUp: [0, -1], ArrowDown: [0, 1] }[event.key];
    const { target } = this.controls;
    const offset = this.camera.position.clone().sub(target);
    if (turn && this.mode === 'top') {
      const step = new Vector3(turn[0], -turn[1], 0).multiplyScalar(0.06 * offset.length());
      target.add(step);
      this.camera.position.add(step);
    } else if (turn) {
      const level = Math.hypot(offset.x, offset.y);
      const azimuth = Math.atan2(offset.y, offset.x) + turn[0] * TURN_RAD;
      const zenith = Math.min(this.controls.maxPolarAngle, Math.max(0.05, Math.atan2(level, offset.z) + turn[1] * TURN_RAD));
      const flat = offset.length() * Math.sin(zenith);
      this.camera.position.set(
        target.x + flat * Math.cos(azimuth), target.y + flat * Math.sin(azimuth), target.z + offset.length() * Math.cos(zenith));
    } else if (event.key === '+' || event.key === '=' || event.key === '-') {
      this.camera.position.copy(target).addScaledVector(offset, event.key === '-' ? ZOOM : 1 / ZOOM);
    } else return;
    event.preventDefault();
    this.moved = true;
    this.touch();
  }
}
