// The renderer, the camera, lights, cuts; draws when something changed.

import * as THREE from 'three';

const backgrounds = {dark: [0x2a3038, 0x0e1013], light: [0xfbfcfd, 0xd5dae1]};

export class Stage extends EventTarget {
  /** Throws where there is no WebGL. */
  constructor(canvas) {
    super();
    this.canvas = canvas;
    this.renderer = new THREE.WebGLRenderer({canvas, antialias: true, powerPreference: 'high-performance'});
    this.renderer.setPixelRatio(Math.min(devicePixelRatio, 2));
    this.renderer.toneMapping = THREE.NeutralToneMapping;
    this.scene = new THREE.Scene();
    this.camera = new THREE.PerspectiveCamera(45, 1, 0.01, 100);
    this.sky = new THREE.HemisphereLight(0xf4f7ff, 0x6b6258, 0.95);
    this.scene.add(this.camera, this.sky);
    // Lights of a photographer, who walks with the camera.
    this.#light(2.2, [-0.9, 1, 0.7]);
    this.#light(0.7, [1.2, -0.1, 0.5]);
    this.clip = new THREE.Plane(new THREE.Vector3(1, 0, 0), 0);
    this.sphere = new THREE.Sphere(new THREE.Vector3(), 1);
    this.changed = true;
    this.frames = [];
    addEventListener('resize', () => this.#resize());
    this.#resize();
    this.setTheme('dark');
    this.renderer.setAnimationLoop(time => this.#frame(time));
  }

  #light(intensity, position) {
    const light = new THREE.DirectionalLight(0xffffff, intensity);
    light.position.set(...position);
    this.camera.add(light, light.target);
    light.target.position.set(0, 0, -1);
  }

  touch() {
    this.changed = true;
  }

  setTheme(theme) {
    const canvas = document.createElement('canvas');
    canvas.width = 2;
    canvas.height = 256;
    const context = canvas.getContext('2d'), gradient = context.createLinearGradient(0, 0, 0, 256);
    backgrounds[theme].forEach((colour, i) => gradient.addColorStop(i, `#${colour.toString(16).padStart(6, '0')}`));
    context.fillStyle = gradient;
    context.fillRect(0, 0, 2, 256);
    this.scene.background?.dispose?.();
    this.scene.background = new THREE.CanvasTexture(canvas);
    this.scene.background.colorSpace = THREE.SRGBColorSpace;
    this.touch();
  }

  /** What is looked at: for distances of the camera. */
  setSphere(sphere) {
    this.sphere = sphere.radius > 0 ? sphere : new THREE.Sphere(sphere.center, 1);
    this.touch();
  }

  /** @param {THREE.Plane | null} plane what lies before it is seen, and a hair behind it: what lies in it, too */
  setClip(plane) {
    if (plane) this.clip.copy(plane).constant += 1e-5 * this.sphere.radius;
    this.renderer.clippingPlanes = plane ? [this.clip] : [];
    this.touch();
  }
  get clipped() {
    return this.renderer.clippingPlanes.length > 0;
  }

  /** A ray of the world through a point of the page. */
  rayAt({clientX, clientY}) {
    const box = this.canvas.getBoundingClientRect();
    const raycaster = new THREE.Raycaster();
    raycaster.setFromCamera(new THREE.Vector2((clientX - box.left) / box.width * 2 - 1, 1 - (clientY - box.top) / box.height * 2), this.camera);
    return raycaster;
  }

  #resize() {
    const {innerWidth: width, innerHeight: height} = window;
    this.renderer.setSize(width, height, false);
    this.camera.aspect = width / height;
    this.camera.updateProjectionMatrix();
    this.touch();
  }

  #frame(time) {
    this.frames.push(time);
    while (this.frames.length > 1 && time - this.frames[0] > 1000) this.frames.shift();
    this.dispatchEvent(new CustomEvent('frame', {detail: {time}}));
    if (!this.changed) return;
    this.changed = false;
    this.#setDepth();
    this.renderer.render(this.scene, this.camera);
    this.drawn = (this.drawn ?? 0) + 1;
  }

  /** As deep as needed: buffers of depth are coarse. */
  #setDepth() {
    const distance = this.camera.position.distanceTo(this.sphere.center), {radius} = this.sphere;
    this.camera.far = distance + 1.01 * radius;
    this.camera.near = Math.max(distance - 1.01 * radius, 2e-4 * radius);
    this.camera.updateProjectionMatrix();
  }
}
