// How the camera moves: around a point, or flying.

import * as THREE from 'three';
import {OrbitControls} from 'three/addons/controls/OrbitControls.js';

import {corners} from './cuts.js';

const FLYING = {KeyW: [0, 0, -1], KeyS: [0, 0, 1], KeyA: [-1, 0, 0], KeyD: [1, 0, 0], KeyQ: [0, -1, 0], KeyE: [0, 1, 0]};

/** What is fitted into the picture has so much room, for the shadow beside it, too. */
const MARGIN = 1.1;
/** So many vertices tell how large a mesh is seen. */
const ENOUGH = 4000;

export class Navigation {
  constructor(stage) {
    this.stage = stage;
    this.#newOrbit();
    this.flying = false;
    this.speed = 0.3;  // radii of the mesh in a second
    this.keys = new Set();
    this.pointers = new Map();
    this.flight = null;
    stage.addEventListener('frame', ({detail}) => this.#frame(detail.time));
    addEventListener('keydown', event => this.#key(event, true));
    addEventListener('keyup', event => this.#key(event, false));
    addEventListener('blur', () => this.keys.clear());
    for (const kind of ['pointerdown', 'pointermove', 'pointerup', 'pointercancel'])
      stage.canvas.addEventListener(kind, event => this.#pointer(event));
    stage.canvas.addEventListener('wheel', event => {
      if (!this.flying) return;
      this.speed = Math.min(4, Math.max(0.005, this.speed * 1.15 ** -Math.sign(event.deltaY)));
    }, {passive: true});
  }

  #newOrbit() {
    this.orbit = new OrbitControls(this.stage.camera, this.stage.canvas);
    Object.assign(this.orbit, {enableDamping: true, dampingFactor: 0.12, zoomToCursor: true});
    this.orbit.addEventListener('change', () => this.stage.touch());
  }
  /** @param {string} axis 'y' or 'z': which points up. Controls ask the camera when they are made. */
  setUp(axis) {
    const {target, enabled, enableRotate, minDistance, maxDistance} = this.orbit;
    this.orbit.dispose();
    this.stage.setUp(axis);
    this.#newOrbit();
    Object.assign(this.orbit, {enabled, enableRotate, minDistance, maxDistance});
    this.orbit.target.copy(target);
  }
  /** From where a mesh is looked at first: a little from above. */
  get firstDirection() {
    return this.stage.camera.up.z === 1 ? new THREE.Vector3(0.45, -1, 0.45) : new THREE.Vector3(0.45, 0.3, 1);
  }

  /** @param {string} tool of the page: 'orbit', 'fly', 'pick', 'box' */
  setTool(tool) {
    const {orbit, stage: {camera, sphere}} = this, flying = tool === 'fly';
    if (this.flying && !flying) {
      const ahead = camera.getWorldDirection(new THREE.Vector3());
      const distance = Math.max(0.2 * sphere.radius, sphere.center.clone().sub(camera.position).dot(ahead));
      orbit.target.copy(camera.position).addScaledVector(ahead, distance);
    }
    this.flying = flying;
    orbit.enabled = !flying;
    orbit.enableRotate = tool !== 'box';
    this.keys.clear();
  }

  /**
   * Shows all of a model, in what is free of the picture: by its vertices where they are here, else by its box or its sphere.
   */
  fit(model, direction = null) {
    const {sphere} = model;
    let box = model.box ?? (model.shown.length > 0 ? model.shownBox : null);
    const {camera, free, size} = this.stage, away = direction?.clone() ?? camera.position.clone().sub(this.orbit.target);
    if (away.lengthSq() === 0) away.set(0.5, 0.35, 1);
    away.normalize();
    const tangent = Math.tan(THREE.MathUtils.degToRad(camera.fov) / 2) / size[1], across = free.width * tangent, along = free.height * tangent;
    if (box?.isEmpty()) box = null;  // points alone
    const centre = box ? box.getCenter(new THREE.Vector3()) : sphere.center;
    const points = !box ? [] : model.volume ? corners(box) : someVertices(model.shown);
    const distance = points.length > 0 ? distanceToSee(points.map(point => point.sub(centre)), away, camera.up, across, along)
      : sphere.radius / Math.sin(Math.atan(Math.min(across, along)));
    this.place(centre.clone().addScaledVector(away, Math.max(MARGIN * distance, 1e-3 * sphere.radius)), centre);
    this.orbit.minDistance = 1e-3 * sphere.radius;
    this.orbit.maxDistance = 20 * sphere.radius;
  }

  place(position, target) {
    this.flight = null;
    this.stage.camera.position.copy(position);
    this.orbit.target.copy(target);
    this.stage.camera.lookAt(target);
    this.orbit.update();
    this.stage.touch();
  }

  /** Turns around another point from now on; the way there takes a third of a second. */
  turnAround(point) {
    const {camera} = this.stage, step = point.clone().sub(this.orbit.target);
    this.flight = {begin: performance.now(), target: this.orbit.target.clone(), position: camera.position.clone(), step};
  }

  turn(right, up) {
    const {camera} = this.stage, toY = new THREE.Quaternion().setFromUnitVectors(camera.up, new THREE.Vector3(0, 1, 0));
    const away = new THREE.Spherical().setFromVector3(camera.position.clone().sub(this.orbit.target).applyQuaternion(toY));
    away.theta -= right;
    away.phi = Math.min(Math.PI - 0.01, Math.max(0.01, away.phi - up));
    const turned = new THREE.Vector3().setFromSpherical(away).applyQuaternion(toY.invert());
    this.place(this.orbit.target.clone().add(turned), this.orbit.target.clone());
  }
  move(right, up) {
    const {camera} = this.stage, scale = camera.position.distanceTo(this.orbit.target);
    const step = new THREE.Vector3(right * scale, up * scale, 0).applyQuaternion(camera.quaternion);
    this.place(camera.position.clone().add(step), this.orbit.target.clone().add(step));
  }
  approach(factor) {
    const {camera} = this.stage, away = camera.position.clone().sub(this.orbit.target).multiplyScalar(factor);
    this.place(this.orbit.target.clone().add(away), this.orbit.target.clone());
  }

  #key(event, down) {
    if (!this.flying || !(event.code in FLYING) || isTyping(event) || event.ctrlKey || event.metaKey) return;
    if (down) this.keys.add(event.code);
    else this.keys.delete(event.code);
    this.fast = event.shiftKey;
    event.preventDefault();
  }

  #pointer(event) {
    if (!this.flying) return;
    const before = this.pointers.get(event.pointerId);
    if (event.type === 'pointerdown') {
      this.stage.canvas.setPointerCapture(event.pointerId);
    } else if (event.type !== 'pointermove') {
      this.pointers.delete(event.pointerId);
      return;
    } else if (before && this.pointers.size === 1) {
      this.#look(event.clientX - before.clientX, event.clientY - before.clientY);
    } else if (!before) {
      return;
    }
    this.pointers.set(event.pointerId, event);
  }
  #look(x, y) {
    const {camera} = this.stage, ahead = camera.getWorldDirection(new THREE.Vector3());
    const rise = Math.asin(THREE.MathUtils.clamp(ahead.dot(camera.up), -1, 1));
    const aside = new THREE.Vector3().crossVectors(ahead, camera.up).normalize();
    ahead.applyAxisAngle(aside, THREE.MathUtils.clamp(rise + y * 0.003, -1.55, 1.55) - rise).applyAxisAngle(camera.up, x * 0.003);
    camera.lookAt(camera.position.clone().add(ahead));
    this.stage.touch();
  }

  #frame(time) {
    const seconds = Math.min(0.1, (time - (this.last ?? time)) / 1000);
    this.last = time;
    if (this.flight) this.#fly();
    if (!this.flying) {
      this.orbit.update();
      return;
    }
    const step = new THREE.Vector3();
    for (const key of this.keys) step.add(new THREE.Vector3(...FLYING[key]));
    if (this.pointers.size > 1) step.z -= 1;
    if (step.lengthSq() === 0) return;
    const {camera, sphere} = this.stage;
    step.normalize().multiplyScalar(seconds * this.speed * sphere.radius * (this.fast ? 4 : 1)).applyQuaternion(camera.quaternion);
    camera.position.add(step);
    this.stage.touch();
  }
  #fly() {
    const {begin, target, position, step} = this.flight;
    const t = Math.min(1, (performance.now() - begin) / 300), eased = t * t * (3 - 2 * t);
    this.orbit.target.copy(target).addScaledVector(step, eased);
    this.stage.camera.position.copy(position).addScaledVector(step, eased);
    this.stage.touch();
    if (t === 1) this.flight = null;
  }
}

/** How far away along a direction an eye sees points around the origin, with tangents of half the angles across and along. */
function distanceToSee(points, away, up, across, along) {
  const right = new THREE.Vector3().crossVectors(up, away);
  if (right.lengthSq() < 1e-12) right.set(1, 0, 0);
  right.normalize();
  const above = new THREE.Vector3().crossVectors(away, right);
  return Math.max(...points.map(point => Math.max(Math.abs(point.dot(right)) / across, Math.abs(point.dot(above)) / along) + point.dot(away)));
}

function someVertices(meshes) {
  const found = [], all = meshes.reduce((sum, {geometry}) => sum + geometry.getAttribute('position').count, 0), step = Math.max(1, all / ENOUGH);
  for (const mesh of meshes) {
    mesh.updateWorldMatrix(true, false);
    const {count} = mesh.geometry.getAttribute('position');
    for (let i = 0; i < count; i += step) {
      const point = mesh.localToWorld(mesh.getVertexPosition(Math.floor(i), new THREE.Vector3()));
      if (Number.isFinite(point.lengthSq())) found.push(point);
    }
  }
  return found;
}

export function isTyping({target}) {
  return target instanceof HTMLInputElement && !['checkbox', 'range', 'button', 'file'].includes(target.type)
    || target instanceof HTMLSelectElement || target instanceof HTMLTextAreaElement;
}
