// What the decoder gives for drawing, as three.js has it.

import * as THREE from 'three';

/** What an array of a mesh is called in three.js, by its role. */
const attributeNames = {normal: 'normal', colour: 'color', texture_coordinate: 'uv', tangent: 'tangent'};
const normalised = new Set(['i8', 'u8', 'i16', 'u16']);

/**
 * A BufferGeometry of what decodeNode() or surface() gives. userData: origin, to be added to positions; points, by vertex; cells,
 * by triangle; arrays, as the decoder gives them: of vertices (domain 'point'), cells, or one tuple for each triangle.
 */
export function toGeometry({positions, triangles, cells, points, arrays, origin}) {
  const geometry = new THREE.BufferGeometry();
  geometry.setAttribute('position', new THREE.BufferAttribute(positions, 3));
  const narrow = positions.length / 3 <= 65536 && !(triangles instanceof Uint16Array);
  geometry.setIndex(new THREE.BufferAttribute(narrow ? Uint16Array.from(triangles) : triangles, 1));
  for (const array of arrays) {
    const name = attributeNames[array.role];
    if (isOfCells(array) || !name || geometry.hasAttribute(name)) continue;
    geometry.setAttribute(name, new THREE.BufferAttribute(forGpu(array.values), array.components, normalised.has(array.type)));
  }
  if (!isNormal(geometry.getAttribute('normal'))) geometry.setAttribute('normal', normalsOf(positions, triangles));
  addGroups(geometry, cells, arrays);
  geometry.userData = {origin, cells, points, arrays};
  return geometry;
}

/** How much memory of the GPU, and of the page for values. */
export function geometryBytes(geometry) {
  const values = [geometry.index, ...Object.values(geometry.attributes)].map(attribute => attribute.array);
  const kept = [geometry.userData.cells, ...(geometry.userData.arrays ?? []).map(array => array.values)];
  return [...new Set([...values, ...kept])].reduce((sum, array) => sum + (array?.byteLength ?? 0), 0);
}

export function isOfCells({domain}) {
  return domain === 'cell' || domain === 'triangle';
}
/** The tuple of an array of cells that a triangle has. */
export function tupleOfTriangle({domain}, cells, triangle) {
  return domain === 'triangle' ? triangle : cells[triangle];
}

function forGpu(values) {
  const wide = values instanceof Float64Array || values instanceof BigInt64Array || values instanceof BigUint64Array;
  return wide ? Float32Array.from(values, Number) : values;
}
function isNormal(attribute) {
  return attribute?.itemSize === 3;
}

/** Means of the normals of the triangles around, weighted by area; a byte each is too coarse for large flat faces. */
function normalsOf(positions, triangles) {
  const sums = new Float32Array(positions.length);
  for (let i = 0; i < triangles.length; i += 3) {
    const a = 3 * triangles[i], b = 3 * triangles[i + 1], c = 3 * triangles[i + 2];
    const ux = positions[b] - positions[a], uy = positions[b + 1] - positions[a + 1], uz = positions[b + 2] - positions[a + 2];
    const vx = positions[c] - positions[a], vy = positions[c + 1] - positions[a + 1], vz = positions[c + 2] - positions[a + 2];
    const nx = uy * vz - uz * vy, ny = uz * vx - ux * vz, nz = ux * vy - uy * vx;
    for (const at of [a, b, c]) {
      sums[at] += nx;
      sums[at + 1] += ny;
      sums[at + 2] += nz;
    }
  }
  const normals = new Int16Array(sums.length);
  for (let i = 0; i < sums.length; i += 3) {
    const scale = 32767 / (Math.hypot(sums[i], sums[i + 1], sums[i + 2]) || 1);
    for (let k = 0; k < 3; ++k) normals[i + k] = Math.round(sums[i + k] * scale);
  }
  return new THREE.BufferAttribute(normals, 3, true);
}

/** Runs of triangles with one label (a material, a part) become groups, by the first array of labels on cells. */
function addGroups(geometry, cells, arrays) {
  const labels = arrays.find(array => isOfCells(array) && array.role === 'label' && array.components === 1), count = cells.length;
  if (!labels || count === 0) return;
  const label = i => labels.values[tupleOfTriangle(labels, cells, i)];
  let first = 0;
  for (let i = 1; i <= count; ++i) {
    if (i < count && label(i) === label(first)) continue;
    geometry.addGroup(3 * first, 3 * (i - first), Number(label(first)));
    first = i;
  }
}
