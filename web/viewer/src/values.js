// Which triangle was hit, and what the arrays have there.

import * as THREE from 'three';

import {isOfCells, tupleOfTriangle} from '../../src/three.js';

/** What a ray meets first of meshes of toGeometry(): {position, distance, face, number, corners, values, ...}. */
export function pickDrawn(raycaster, meshes) {
  const [hit] = raycaster.intersectObjects(meshes, false);
  if (!hit) return null;
  const {object, faceIndex: triangle, face: {a, b, c}} = hit, drawn = drawnOf(object);
  // Where they are seen: scenes have meshes that are turned, scaled, bent.
  const corners = [a, b, c].map(vertex => object.localToWorld(object.getVertexPosition(vertex, new THREE.Vector3())).toArray());
  const barycentric = THREE.Triangle.getBarycoord(hit.point, ...corners.map(c => new THREE.Vector3(...c)), new THREE.Vector3());
  const face = drawn.cells[triangle], weights = barycentric?.toArray() ?? [1, 0, 0];
  return {position: hit.point.toArray(), distance: hit.distance, face, number: face, corners, triangle, weights, drawn, values: valuesAt(drawn, triangle, weights)};
}
/** Where values of cells are shown each triangle has corners of its own; then the geometry before is in userData. */
function drawnOf({geometry}) {
  const whole = geometry.userData.whole ?? geometry, {cells, arrays} = whole.userData;
  return {cells, arrays, triangles: whole.index.array};
}

/** The triangle of a face that has the corners that were hit. */
export function triangleOf({cells, triangles, points}, {face, corners}) {
  const wanted = [...corners].sort().join();
  for (let t = 0; t < cells.length; ++t) {
    if (cells[t] === face && [0, 1, 2].map(k => points[triangles[3 * t + k]]).sort().join() === wanted) return t;
  }
  return null;
}
export function weightsOf({triangles, points}, t, {corners, weights}) {
  return [0, 1, 2].map(k => weights[corners.indexOf(points[triangles[3 * t + k]])] ?? 0);
}
export function cornersOf({positions, triangles}, t, origin) {
  return [0, 1, 2].map(k => [0, 1, 2].map(c => positions[3 * triangles[3 * t + k] + c] + origin[c]));
}

/** Arrays at a place of a triangle: those of cells as they are, others weighted, labels of the nearest corner. */
export function valuesAt({arrays, triangles, cells}, t, weights) {
  return arrays.map(array => {
    const {name, domain, role, type, components, values} = array;
    const at = index => Array.from({length: components}, (_, c) => values[index * components + c]);
    if (isOfCells(array)) return {name, domain, value: at(tupleOfTriangle(array, cells, t))};
    const vertices = [0, 1, 2].map(k => triangles[3 * t + k]);
    if (role === 'label' || /64$/.test(type) && type[0] !== 'f')
      return {name, domain, value: at(vertices[weights.indexOf(Math.max(...weights))])};
    const corners = vertices.map(at);
    return {name, domain, value: corners[0].map((_, c) => corners.reduce((sum, v, k) => sum + weights[k] * v[c], 0))};
  });
}
