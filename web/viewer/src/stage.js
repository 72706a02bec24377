// The renderer, the camera, what surrounds a mesh; draws when something changed, and with more care when nothing does.

import * as THREE from 'three';

import {Rest} from '../../src/rest.js';
import {Ground} from './ground.js';
import {OVERLAY} from './layers.js';
import {Light} from './light.js';
import {Occlusion} from './occlusion.js';

const backgrounds = {dark: [0x171b20, 0x3a414b], light: [0xfbfcfd, 0xd5dae1]};
/** The camera rests when it has not moved for so long, in milliseconds. */
const REST = 220;
/** A frame that takes longer is a slow one, in milliseconds; after so many of them there is no shade while the camera moves. */
const SLOW = 28, MOST_SLOW = 4;

export class Stage extends EventTarget {
  /**
   * Throws where there is no WebGL.
   * @param {HTMLCanvasElement} canvas whose size on the page is that of the picture
   */
  constructor(canvas) {
    super();
    this.canvas = canvas;
    this.renderer = new THREE.WebGLRenderer({canvas, alpha: true, antialias: true, powerPreference: 'high-performance'});
    this.renderer.setPixelRatio(Math.min(devicePixelRatio, 2));
    this.renderer.toneMapping = THREE.NeutralToneMapping;
    this.scene = new THREE.Scene();
    this.camera = new THREE.PerspectiveCamera(45, 1, 0.01, 100);
    this.camera.layers.enable(OVERLAY);
    this.scene.add(this.camera);
    this.light = new Light(this.scene, this.camera);
    this.occlusion = new Occlusion();
    this.ground = new Ground(this.scene);
    this.shades = true;       // is there shade where little light comes in?
    this.shadeStrength = 1;
    this.groundShown = false;
    this.clips = [];
    this.sphere = new THREE.Sphere(new THREE.Vector3(), 1);
    /** What covers the canvas on its sides, in pixels of the page. */
    this.insets = {left: 0, top: 0, right: 0, bottom: 0};
    /** Parts of the canvas, from left to right, or from above where it is upright: {begin(), end()} are called around the drawing of each. */
    this.panes = [{}];
    this.changed = true;
    this.slow = 0;
    this.rest = new Rest(REST);
    this.frames = [];
    this.watch = new ResizeObserver(() => this.#resize());
    this.watch.observe(canvas);
    this.#resize();
    this.setTheme('dark');
    this.renderer.setAnimationLoop(time => this.#frame(time));
  }
  dispose() {
    this.watch.disconnect();
    this.renderer.setAnimationLoop(null);
    this.renderer.dispose();
  }

  touch() {
    this.changed = true;
  }
  /** Has the camera not moved for a while? */
  get resting() {
    return this.rest.resting;
  }

  /** @param {string | null} theme 'dark' or 'light'; null: nothing behind the mesh, the page is seen */
  setTheme(theme) {
    this.scene.background?.dispose?.();
    this.scene.background = theme && gradientOf(backgrounds[theme]);
    this.touch();
  }
  /** @param {string} axis 'y' or 'z' */
  setUp(axis) {
    this.camera.up.set(0, 0, 0)[axis] = 1;
    this.light.setUp(this.camera.up);
    this.groundIsOld = true;
    this.touch();
  }

  /** @param {boolean} on the mesh has materials that shine */
  setReflecting(on) {
    if (on !== Boolean(this.light.mirror)) this.light.setReflecting(this.renderer, on);
    this.touch();
  }

  /** After the graphics card lost what it had: pictures that were drawn there are made again. */
  renew() {
    if (this.light.mirror) this.light.setReflecting(this.renderer, true);
    this.touchGround();
  }

  /** What is looked at: for distances of the camera. */
  setSphere(sphere) {
    this.sphere = sphere.radius > 0 ? sphere : new THREE.Sphere(sphere.center, 1);
    this.groundIsOld = true;
    this.touch();
  }
  /** @param {function} box gives a THREE.Box3 of what stands there; null: no ground */
  setGround(box) {
    this.boxOfGround = box;
    this.groundIsOld = true;
    this.touch();
  }
  /** What stands on the ground has changed. */
  touchGround() {
    this.groundIsOld = true;
    this.touch();
  }

  /** @param {THREE.Plane[]} planes what lies before all of them is seen, and a hair behind them: what lies in them, and no gap beside it */
  setClips(planes) {
    this.clips = planes.map(plane => new THREE.Plane(plane.normal.clone(), plane.constant + 2e-4 * this.sphere.radius));
    this.renderer.clippingPlanes = this.clips;
    this.touchGround();
  }
  /** Do the cuts leave a point? */
  isLeft(point, slack = 0) {
    return this.clips.every(plane => plane.distanceToPoint(point) >= -slack);
  }

  /** What covers the picture at its sides, in pixels: the middle of what is free is the middle of the view. */
  setInsets(insets) {
    Object.assign(this.insets, insets);
    this.#resize();
  }
  /** What is free of each pane, {x, y, width, height} in pixels, from the upper left corner. */
  rectangleOf(pane) {
    const {left, top, right, bottom} = this.insets, [width, height] = this.size, [wide, tall] = [width - left - right, height - top - bottom];
    const [columns, rows] = tall > wide ? [1, this.panes.length] : [this.panes.length, 1];
    return {x: left + (columns > 1 ? pane : 0) * wide / columns, y: top + (rows > 1 ? pane : 0) * tall / rows, width: wide / columns, height: tall / rows};
  }
  get free() {
    const {width, height} = this.rectangleOf(0);
    return {width: Math.max(80, width), height: Math.max(80, height)};
  }
  setPanes(panes) {
    this.panes = panes;
    this.#resize();
  }
  /** The pane at a place of the page; @returns its number */
  paneAt({clientX, clientY}) {
    const box = this.canvas.getBoundingClientRect(), isIn = ({right, bottom}) => clientX - box.left < right && clientY - box.top < bottom;
    const found = this.panes.findIndex((_, pane) => isIn(this.#shareOf(pane)));
    return found < 0 ? this.panes.length - 1 : found;
  }
  /** What a pane has of the canvas, covered or not. */
  #shareOf(pane) {
    const {x, y, width, height} = this.rectangleOf(pane), first = pane === 0, last = pane === this.panes.length - 1, next = this.rectangleOf(pane + 1);
    const stacked = next.y > y, [wide, tall] = this.size;
    return {
      left: first || stacked ? 0 : x, top: first || !stacked ? 0 : y,
      right: last || stacked ? wide : x + width, bottom: last || !stacked ? tall : y + height,
    };
  }
  /** Sets the camera as it looks in one of the panes. */
  lookIn(pane) {
    const rectangle = this.rectangleOf(pane), [width, height] = this.size, {view} = this.camera;
    const x = rectangle.x + (rectangle.width - width) / 2, y = rectangle.y + (rectangle.height - height) / 2;
    if (view?.enabled && view.offsetX === -x && view.offsetY === -y && view.fullWidth === width && view.fullHeight === height) return;
    this.camera.setViewOffset(width, height, -x, -y, width, height);
  }

  /** A ray of the world through a point of the page. */
  rayAt(event) {
    const box = this.canvas.getBoundingClientRect(), raycaster = new THREE.Raycaster();
    this.lookIn(this.paneAt(event));
    raycaster.setFromCamera(new THREE.Vector2((event.clientX - box.left) / box.width * 2 - 1, 1 - (event.clientY - box.top) / box.height * 2), this.camera);
    return raycaster;
  }
  /** Where a point of the world is on the canvas, {x, y} in pixels of the page; null: behind the camera. */
  placeOf(point, pane = 0) {
    this.lookIn(pane);
    const {x, y, z} = point.clone().project(this.camera), [width, height] = this.size;
    return z > 1 ? null : {x: (x + 1) / 2 * width, y: (1 - y) / 2 * height};
  }

  #resize() {
    const width = this.canvas.clientWidth || 1, height = this.canvas.clientHeight || 1;
    this.size = [width, height];
    this.renderer.setSize(width, height, false);
    this.camera.aspect = width / height;
    this.lookIn(0);
    this.camera.updateProjectionMatrix();
    this.touch();
    this.dispatchEvent(new CustomEvent('resize'));
  }

  #frame(time) {
    const since = time - (this.frames.at(-1) ?? time);
    this.frames.push(time);
    while (this.frames.length > 1 && time - this.frames[0] > 1000) this.frames.shift();
    this.dispatchEvent(new CustomEvent('frame', {detail: {time}}));
    this.camera.updateMatrixWorld();
    if (this.rest.look(this.camera.matrixWorld.elements, this.sphere.radius)) {
      if (this.shadedMoving) this.slow = since > SLOW ? this.slow + 1 : 0;
      this.touch();
    }
    const {resting} = this, careful = this.shades && (resting || this.slow < MOST_SLOW);
    if (!this.changed && !(resting && this.rough)) return;
    this.changed = false;
    this.rough = !resting;
    this.shadedMoving = careful && !resting;
    this.draw(careful);
    this.drawn = (this.drawn ?? 0) + 1;
  }

  /** @param {boolean} careful with shade */
  draw(careful = this.shades) {
    const {renderer, scene, camera, panes} = this;
    this.#setDepth();
    const above = camera.position.clone().sub(this.ground.plane.position).dot(camera.up) > 0;
    const ground = this.groundShown && Boolean(this.boxOfGround) && panes.length === 1;
    if (ground && this.groundIsOld && (this.resting || !this.groundCast)) {
      const box = this.boxOfGround();
      if (!box.isEmpty()) this.ground.cast(renderer, scene, box, camera.up);
      this.groundIsOld = box.isEmpty();
      this.groundCast = true;
    }
    this.ground.show(ground && above && this.groundCast);
    renderer.setScissorTest(panes.length > 1);
    panes.forEach((pane, i) => {
      const {left, top, right, bottom} = this.#shareOf(i);
      renderer.setScissor(left, this.size[1] - bottom, right - left, bottom - top);
      pane.begin?.();
      this.lookIn(i);
      renderer.render(scene, camera);
      if (careful) this.occlusion.draw(renderer, scene, camera, this.sphere.radius, this.shadeStrength);
      pane.end?.();
    });
    renderer.setScissorTest(false);
    this.lookIn(0);
  }

  /** As deep as needed: buffers of depth are coarse. */
  #setDepth() {
    const distance = this.camera.position.distanceTo(this.sphere.center), {radius} = this.sphere;
    this.camera.far = distance + (this.groundShown ? 3 : 1.01) * radius;
    this.camera.near = Math.max(distance - (this.groundShown ? 1.3 : 1.01) * radius, 2e-4 * radius);
    this.camera.updateProjectionMatrix();
  }
}

function gradientOf(colours) {
  const canvas = document.createElement('canvas');
  canvas.width = 2;
  canvas.height = 256;
  const context = canvas.getContext('2d'), gradient = context.createLinearGradient(0, 0, 0, 256);
  colours.forEach((colour, i) => gradient.addColorStop(i, `#${colour.toString(16).padStart(6, '0')}`));
  context.fillStyle = gradient;
  context.fillRect(0, 0, 2, 256);
  const texture = new THREE.CanvasTexture(canvas);
  texture.colorSpace = THREE.SRGBColorSpace;
  return texture;
}
