// What the decoder gives for drawing, as three.js has it.

import * as THREE from 'three';

/** What an array of a mesh is called in three.js, by its role. */
const attributeNames = {normal: 'normal', colour: 'color', texture_coordinate: 'uv', tangent: 'tangent'};
/** Of numbers that are kept for the next chart. */
const MOST_ROOM = 2 ** 18;
const normalised = new Set(['i8', 'u8', 'i16', 'u16']);

/**
 * A BufferGeometry of what decodeNode() or surface() gives. userData: origin, to be added to positions; points, by vertex; cells,
 * by triangle; arrays, as the decoder gives them: of vertices (domain 'point'), cells, or one tuple for each triangle; materials:
 * where cells have labels, their names, by the materialIndex of the groups; blockCells: of the mesh, if there are several blocks;
 * normalsComputed: the file has none.
 */
export function toGeometry({positions, triangles, cells, points, arrays, origin, blockCells}) {
  cells ??= countedTo(triangles.length / 3);
  points ??= countedTo(positions.length / 3);
  const geometry = new THREE.BufferGeometry();
  geometry.setAttribute('position', new THREE.BufferAttribute(positions, 3));
  const narrow = positions.length / 3 <= 65536 && !(triangles instanceof Uint16Array);
  geometry.setIndex(new THREE.BufferAttribute(narrow ? new Uint16Array(triangles) : triangles, 1));
  for (const array of arrays) {
    const name = attributeNames[array.role];
    if (isOfCells(array) || !name || geometry.hasAttribute(name)) continue;
    geometry.setAttribute(name, new THREE.BufferAttribute(forGpu(array.values), array.components, normalised.has(array.type)));
  }
  const given = isNormal(geometry.getAttribute('normal'));
  if (!given) geometry.setAttribute('normal', normalsOf(positions, triangles));
  geometry.userData = {origin, cells, points, arrays, blockCells, normalsComputed: !given};
  addGroups(geometry, cells, arrays);
  return geometry;
}

/**
 * What the scene of a glTF file shows: a group with a mesh for each block at each place that file.readInstances() gives. They share
 * the vertices of `geometry`, which toGeometry() made of the whole mesh. userData.block: its number.
 */
export function toInstances(geometry, instances, material) {
  const {cells, origin, blockCells = [cells.length]} = geometry.userData, group = new THREE.Group(), parts = new Map();
  const toMesh = new THREE.Matrix4().makeTranslation(...origin), ends = [];
  for (const count of blockCells) ends.push((ends.at(-1) ?? 0) + count);
  const places = instances.length > 0 ? instances : [{name: '', blocks: ends.keys(), matrix: new THREE.Matrix4().elements}];
  for (const {name, blocks, matrix} of places) {
    for (const block of blocks) {
      if (!(ends[block] > 0)) continue;  // metadata may name any number
      if (!parts.has(block)) parts.set(block, partOf(geometry, ends[block] - blockCells[block], ends[block]));
      const mesh = new THREE.Mesh(parts.get(block), material);
      Object.assign(mesh, {name, matrixAutoUpdate: false, userData: {block}});
      mesh.matrix.fromArray(matrix).multiply(toMesh);
      group.add(mesh);
    }
  }
  return group;
}

/** The triangles of these cells, which follow one another. */
function partOf(geometry, firstCell, endCell) {
  const {cells} = geometry.userData, {index, attributes} = geometry, part = new THREE.BufferGeometry();
  const first = firstFrom(cells, firstCell), end = firstFrom(cells, endCell);
  part.attributes = attributes;
  part.setIndex(new THREE.BufferAttribute(index.array.subarray(3 * first, 3 * end), 1));
  for (const {start, count, materialIndex} of geometry.groups) {
    const from = Math.max(start, 3 * first), to = Math.min(start + count, 3 * end);
    if (from < to) part.addGroup(from - 3 * first, to - from, materialIndex);
  }
  // three.js would take all vertices.
  const point = new THREE.Vector3();
  part.boundingBox = new THREE.Box3();
  for (const vertex of part.index.array) part.boundingBox.expandByPoint(point.fromBufferAttribute(attributes.position, vertex));
  part.boundingSphere = part.boundingBox.getBoundingSphere(new THREE.Sphere());
  return part;
}

/** The first triangle of this cell or a later one; the numbers of cells rise. */
function firstFrom(cells, cell) {
  let low = 0, high = cells.length;
  while (low < high) {
    const middle = (low + high) >> 1;
    if (cells[middle] < cell) low = middle + 1;
    else high = middle;
  }
  return low;
}

/** How much memory a geometry takes in the page, with what its userData has; of `whole` there, too: a geometry it stands for. */
export function geometryBytes(geometry) {
  const {whole} = geometry.userData;
  return arraysOf(geometry).reduce((sum, array) => sum + array.byteLength, whole ? geometryBytes(whole) : 0);
}

/** What a geometry has for itself. */
export function arraysOf({index, attributes, userData}) {
  const values = [index, ...Object.values(attributes)].map(attribute => attribute?.array);
  const kept = [userData.cells, userData.points, ...(userData.arrays ?? []).map(array => array.values)];
  return [...new Set([...values, ...kept].filter(array => array && !shared.has(array.buffer)))];
}

/** 0, 1, 2, ...: so are points and cells of most charts, and one array for all saves a fifth of what they take. */
let counted = new Uint32Array(0);
const shared = new WeakSet();  // its buffers, now and before
function countedTo(size) {
  if (size > counted.length) {
    counted = new Uint32Array(Math.max(4096, 2 * size)).map((_, i) => i);
    shared.add(counted.buffer);
  }
  return counted.subarray(0, size);
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
  const sums = zeros(positions.length);
  for (let i = 0; i < triangles.length; i += 3) {
    const a = 3 * triangles[i], b = 3 * triangles[i + 1], c = 3 * triangles[i + 2];
    const ux = positions[b] - positions[a], uy = positions[b + 1] - positions[a + 1], uz = positions[b + 2] - positions[a + 2];
    const vx = positions[c] - positions[a], vy = positions[c + 1] - positions[a + 1], vz = positions[c + 2] - positions[a + 2];
    const nx = uy * vz - uz * vy, ny = uz * vx - ux * vz, nz = ux * vy - uy * vx;
    add(sums, a, nx, ny, nz);
    add(sums, b, nx, ny, nz);
    add(sums, c, nx, ny, nz);
  }
  const normals = new Int16Array(positions.length);
  for (let i = 0; i < normals.length; i += 3) {
    const x = sums[i], y = sums[i + 1], z = sums[i + 2], scale = 32767 / (Math.sqrt(x * x + y * y + z * z) || 1);
    normals[i] = Math.round(x * scale);
    normals[i + 1] = Math.round(y * scale);
    normals[i + 2] = Math.round(z * scale);
  }
  return new THREE.BufferAttribute(normals, 3, true);
}

function add(sums, at, x, y, z) {
  sums[at] += x;
  sums[at + 1] += y;
  sums[at + 2] += z;
}

/** Room for sums, the same for all charts: each would leave as much behind as it has positions. */
let room = new Float32Array(0);
function zeros(size) {
  if (size > MOST_ROOM) return new Float32Array(size);
  if (size > room.length) room = new Float32Array(size);
  return room.fill(0, 0, size);
}

/**
 * Runs of triangles with one label become groups: by the array of labels on cells that is called "material", or else the first one.
 * The names of the labels are userData.materials, in the order of materialIndex.
 */
function addGroups(geometry, cells, arrays) {
  const all = arrays.filter(array => isOfCells(array) && array.role === 'label' && array.components === 1), count = cells.length;
  const labels = all.find(array => array.name === 'material') ?? all[0];
  if (!labels || count === 0) return;
  geometry.userData.materials = labels.labels ?? [];
  const label = i => labels.values[tupleOfTriangle(labels, cells, i)];
  let first = 0;
  for (let i = 1; i <= count; ++i) {
    if (i < count && label(i) === label(first)) continue;
    geometry.addGroup(3 * first, 3 * (i - first), Number(label(first)));
    first = i;
  }
}
