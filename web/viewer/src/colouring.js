// Colours: of the mesh's own, of one field with a colour map, of levels or charts.

import * as THREE from 'three';

import {isOfCells, tupleOfTriangle} from '../../src/three.js';
import {edgesOf} from './cut_faces.js';
import {mirrorNormals} from './light.js';
import {count, number} from './text.js';

/** Colour maps, as their colours at equal steps, dark to light or cold to hot. */
export const maps = {
  viridis: ['440154', '46327e', '365c8d', '277f8e', '1fa187', '4ac16d', 'a0da39', 'fde725'],
  magma: ['000004', '221150', '5f187f', '982d80', 'd3436e', 'f8765c', 'febb81', 'fcfdbf'],
  'cool to warm': ['3b4cc0', '6788ee', '9abbff', 'c9d7f0', 'edd1c2', 'f7a889', 'e26952', 'b40426'],
  turbo: ['30123b', '4662d7', '36aaf9', '1ae4b6', '72fe5e', 'c7ef34', 'faba39', 'f66b19', 'ca2a04', '7a0403'],
  grey: ['101010', 'f4f4f4'],
};
/** For levels, charts and labels: told apart by eyes of all kinds. */
const distinct = ['4e79a7', 'f28e2b', '59a14f', 'e15759', '76b7b2', 'edc948', 'b07aa1', 'ff9da7', '9c755f', 'bab0ac', '86bcb6', 'd37295'];

export class Colouring {
  constructor() {
    this.mode = 'plain';
    this.map = 'viridis';
    this.uniforms = {colourMap: {value: null}, valueRange: {value: new THREE.Vector2(0, 1)}, labelled: {value: 0}};
    this.plain = material({color: 0xcdc8bf});
    this.own = material({vertexColors: true});
    // The colours of the legend: no lamp and no film changes them.
    this.ofField = material({color: 0xffffff, toneMapped: false});
    this.ofField.onBeforeCompile = shader => {
      mirrorNormals(shader);
      colourByScalar(shader, this.uniforms);
      shader.fragmentShader = shader.fragmentShader.replace('#include <opaque_fragment>', `
        outgoingLight = diffuseColor.rgb * mix(0.35, 1.0, smoothstep(0.0, 0.45, dot(normal, towardsEye)));
        #include <opaque_fragment>`);
    };
    // Cuts are flat: lamps would only change their colours.
    this.cut = new THREE.MeshBasicMaterial({color: 0xb4a58c, side: THREE.DoubleSide, toneMapped: false});
    this.cutOfField = new THREE.MeshBasicMaterial({side: THREE.DoubleSide, toneMapped: false});
    this.cutOfField.onBeforeCompile = shader => colourByScalar(shader, this.uniforms);
    this.edges = new THREE.LineBasicMaterial({color: 0x000000, transparent: true, opacity: 0.45, toneMapped: false});
    this.distinct = distinct.map(colour => material({color: new THREE.Color(`#${colour}`)}));
    this.all = [this.plain, this.own, this.ofField, ...this.distinct];
    this.setMap(this.map);
  }
  /** Materials of the file, by name: see materials.js. */
  offerMaterials(materials) {
    for (const {map} of this.materials?.values() ?? []) map?.dispose();
    this.materials = materials;
    for (const each of materials?.values() ?? []) {
      if (!each.userData.isOfScene) each.onBeforeCompile = mirrorNormals;
      each.wireframe = this.plain.wireframe;
      setFlat(each, this.plain.flatShading);
    }
  }
  get #every() {
    return [...this.all, ...this.materials?.values() ?? []];
  }

  setMap(name) {
    this.map = name;
    this.#useMap();
  }
  #useMap() {
    this.uniforms.colourMap.value?.dispose();
    this.uniforms.colourMap.value = this.labels ? textureOf(distinct, true) : textureOf(maps[this.map]);
    this.uniforms.labelled.value = this.labels ? distinct.length : 0;
  }
  /** Names of what the field counts; null: it measures. */
  get labels() {
    const {field} = this;
    return field?.role === 'label' && field.components === 1 ? field.labels ?? [] : null;
  }
  setWireframe(on) {
    for (const each of this.#every) each.wireframe = on;
    this.showsEdges = on;
    for (const mesh of this.model?.meshes ?? []) this.#showEdges(mesh);
  }
  setFlat(on) {
    for (const each of this.#every) setFlat(each, on);
  }

  /** @param {string} mode 'plain', 'own', 'materials', 'level', 'chart', or the key of a field; with its component, -1: magnitude */
  set(model, mode, component = -1) {
    Object.assign(this, {model, mode, component, field: model.fields.get(mode) ?? null});
    this.#useMap();
    this.range = [Infinity, -Infinity];
    this.#widen((this.field && model.rangeOf?.(this.field, component)) ?? this.range);
    for (const mesh of model.meshes) this.apply(mesh);
    model.weigh?.();
  }

  /** Colours one mesh; returns whether the range of values grew. */
  apply(mesh) {
    const {chart: {level, group, chart}, isCut, scalarsOf} = mesh.userData;
    const perCell = this.field?.domain === 'cell';
    if (!scalarsOf) showPerCell(mesh, perCell);
    if (isCut) this.#showEdges(mesh);
    if (this.field) {
      mesh.material = isCut ? this.cutOfField : this.ofField;
      return this.#setScalars(mesh);
    }
    if (isCut) {
      mesh.material = this.cut;
      return false;
    }
    if (this.mode === 'materials') {
      mesh.material = mesh.userData.own ?? this.#materialsOf(mesh.geometry);
      return false;
    }
    if (this.mode === 'level') mesh.material = this.distinct[level % this.distinct.length];
    else if (this.mode === 'chart') mesh.material = this.distinct[(group * 7 + chart) % this.distinct.length];
    else mesh.material = this.mode === 'own' && mesh.geometry.hasAttribute('color') ? this.own : this.plain;
    return false;
  }

  /** One for each group of triangles, by the names of their labels. */
  #materialsOf({userData: {materials}, groups}) {
    const known = name => this.materials.get(name) ?? this.plain;
    return groups.length > 0 && materials ? materials.map(known) : known('');
  }

  /** Instead of the triangles of a cut, which are nobody's, the sides of its polygons. */
  #showEdges(mesh) {
    if (!mesh.userData.isCut || (mesh.children.length > 0) === Boolean(this.showsEdges)) return;
    if (this.showsEdges) return mesh.add(new THREE.LineSegments(edgesOf(mesh.geometry.userData.drawn), this.edges));
    for (const edges of [...mesh.children]) {
      edges.geometry.dispose();
      edges.removeFromParent();
    }
  }

  #setScalars(mesh) {
    const {geometry} = mesh, {arrays, cells} = geometry.userData;
    const given = mesh.userData.scalarsOf && {values: mesh.userData.scalarsOf(this.field, this.component), components: 1, domain: 'point'};
    const array = given ?? arrays.find(a => a.name === this.field.name && isOfCells(a) === (this.field.domain === 'cell'));
    const vertices = geometry.getAttribute('position').count;
    if (!geometry.hasAttribute('scalar')) geometry.setAttribute('scalar', new THREE.BufferAttribute(new Float32Array(vertices), 1));
    const attribute = geometry.getAttribute('scalar'), scalars = attribute.array.fill(NaN);
    const range = [Infinity, -Infinity];
    for (let i = 0; array && i < vertices; ++i) {
      const value = scalarOf(array, isOfCells(array) ? tupleOfTriangle(array, cells, Math.floor(i / 3)) : i, this.component);
      scalars[i] = value;
      if (value < range[0] && value > -Infinity) range[0] = value;
      if (value > range[1] && value < Infinity) range[1] = value;
    }
    attribute.needsUpdate = true;
    return this.#widen(range);
  }
  #widen([low, high]) {
    const grown = low < this.range[0] || high > this.range[1];
    this.range = [Math.min(this.range[0], low), Math.max(this.range[1], high)];
    if (this.range[0] <= this.range[1]) this.uniforms.valueRange.value.set(...this.range);
    return grown;
  }
}

function scalarOf({values, components}, index, component) {
  if (components === 1) return Number(values[index]);
  if (component >= 0) return Number(values[index * components + component]);
  let sum = 0;
  for (let c = 0; c < components; ++c) sum += Number(values[index * components + c]) ** 2;
  return Math.sqrt(sum);
}

/** Some materials of scenes are flat whatever is chosen: for meshes without normals. */
function setFlat(material, on) {
  material.flatShading = on || Boolean(material.userData.flat);
  material.needsUpdate = true;
}

function material(options) {
  const made = new THREE.MeshStandardMaterial({roughness: 0.62, metalness: 0, side: THREE.DoubleSide, ...options});
  made.onBeforeCompile = mirrorNormals;
  return made;
}

/** Values that are no numbers are drawn grey. */
function colourByScalar(shader, uniforms) {
  Object.assign(shader.uniforms, uniforms);
  shader.vertexShader = shader.vertexShader
    .replace('#include <common>', '#include <common>\nattribute float scalar;\nvarying float vScalar;')
    .replace('#include <begin_vertex>', '#include <begin_vertex>\nvScalar = scalar;');
  shader.fragmentShader = shader.fragmentShader
    .replace('#include <common>', '#include <common>\nuniform sampler2D colourMap;\nuniform vec2 valueRange;\nuniform float labelled;\nvarying float vScalar;')
    .replace('#include <color_fragment>', `#include <color_fragment>
      float place = labelled > 0.0 ? (mod(floor(vScalar + 0.5), labelled) + 0.5) / labelled
        : (vScalar - valueRange.x) / max(valueRange.y - valueRange.x, 1e-30);
      diffuseColor.rgb = isnan(vScalar) ? vec3(0.25) : texture2D(colourMap, vec2(clamp(place, 0.0, 1.0), 0.5)).rgb;`);
}

/** @param {boolean} apart without colours between them */
function textureOf(colours, apart = false) {
  const size = apart ? colours.length : 256, bytes = new Uint8Array(4 * size), all = colours.map(c => [0, 2, 4].map(i => parseInt(c.slice(i, i + 2), 16)));
  for (let i = 0; i < size; ++i) {
    const at = i / (size - 1) * (all.length - 1), k = Math.min(all.length - 2, Math.floor(at));
    for (let c = 0; c < 3; ++c) bytes[4 * i + c] = all[k][c] + (at - k) * (all[k + 1][c] - all[k][c]);
    bytes[4 * i + 3] = 255;
  }
  const texture = new THREE.DataTexture(bytes, size, 1);
  Object.assign(texture, {colorSpace: THREE.SRGBColorSpace, magFilter: apart ? THREE.NearestFilter : THREE.LinearFilter, minFilter: apart ? THREE.NearestFilter : THREE.LinearFilter, needsUpdate: true});
  return texture;
}

/** A value of a cell needs corners of its own. */
function showPerCell(mesh, perCell) {
  const {whole} = mesh.geometry.userData;
  if (perCell === Boolean(whole)) return;
  mesh.geometry.dispose();  // of the GPU
  if (!perCell) {
    mesh.geometry = whole;
    return;
  }
  const own = mesh.geometry.toNonIndexed();
  own.boundingSphere = mesh.geometry.boundingSphere;
  own.userData = {...mesh.geometry.userData, whole: mesh.geometry};
  mesh.geometry = own;
}

/** At most so many names: a legend is no list of parts. */
const MOST_LABELS = 16;
function legendOfLabels({name}, labels, [low, high]) {
  if (!(low <= high)) return null;
  const values = Array.from({length: Math.min(MOST_LABELS, high - low + 1)}, (_, i) => low + i);
  const entries = values.map(value => ({colour: distinct[value % distinct.length], text: labels[value] || `${value}`, detail: ''}));
  if (high - low >= MOST_LABELS) entries.push({colour: '00000000', text: `and ${count(high - low + 1 - MOST_LABELS)} more`, detail: ''});
  return {title: name, entries};
}

/** What the legend says: {title, colours, ticks} or {title, entries: [{colour, text, detail}]}, or null. */
export function legendOf(colouring, model) {
  const {mode, field, component, range} = colouring;
  if (colouring.labels) return legendOfLabels(field, colouring.labels, range);
  if (field) {
    if (!(range[0] <= range[1])) return null;
    const part = field.components === 1 ? '' : component < 0 ? ' (magnitude)' : ` [${component}]`;
    const whole = field.type[0] !== 'f' && (field.components === 1 || component >= 0), parts = whole ? Math.min(4, range[1] - range[0]) : 4;
    const ticks = Array.from({length: parts + 1}, (_, i) => range[1] - (parts > 0 ? i / parts : 0) * (range[1] - range[0]))
      .map(value => number(whole ? Math.round(value) : value));
    return {title: field.name + part, about: field.domain === 'cell' ? 'of cells' : 'of points', colours: maps[colouring.map], ticks};
  }
  if (mode !== 'level' || !model.refines) return null;
  const shown = new Map();
  for (const mesh of model.shown) {
    const {level} = mesh.userData.chart;
    shown.set(level, (shown.get(level) ?? 0) + mesh.userData.triangles);
  }
  const entries = model.file.levels.map((_, level) => ({
    colour: distinct[level % distinct.length], text: level === 0 ? 'the original' : `level ${level}`, here: shown.has(level),
    detail: `${count(shown.get(level) ?? 0)} △`,
  }));
  return {title: 'Level of detail', entries: entries.filter(entry => entry.here)};
}
