// Real meshes for the tests, by what they are for: the shared ones, or where these are not there those of Debian's packages
// (scripts/data).
import {existsSync, readFileSync} from 'node:fs';
import path from 'node:path';
import {fileURLToPath} from 'node:url';

export const root = fileURLToPath(new URL('../..', import.meta.url));
const isThere = name => existsSync(path.join(root, 'build/data', name));
const areShared = isThere('hex/can.vtu');

/** Where a mesh is, by its name in build/data. */
export function pathOf(name) {
  if (!isThere(name)) throw new Error(`${name} is not in build/data: scripts/data fetches it`);
  return path.join(root, 'build/data', name);
}

export const bear = 'tri/bear.off', cheese = 'tri/cheese.off';
export const scan = areShared ? 'tri/armadillo.obj' : 'tri/armadillo.off', bunny = areShared ? 'tri/stanford-bunny.obj' : 'tri/bunny00.off';
export const quads = areShared ? 'poly/fertility_quad.off' : 'poly/contact_quads.off';
/** Texture coordinates of corners and colours of faces; normals and colours of points; texture coordinates of corners. */
export const painted = areShared ? 'textured/bunny10k_textured.ply' : 'textured/bear_painted.ply';
export const coloured = areShared ? 'textured/gargo.ply' : 'textured/bear_coloured.ply';
export const textured = areShared ? 'textured/spot.obj' : 'textured/bear.obj';
/** Two files of glTF; and one with pictures for colours, normals, roughness and occlusion, mostly blue. */
export const models = (areShared ? ['usd-shaderball-ball', 'scallop'] : ['2CylinderEngine', 'bear_scene']).map(name => `textured/${name}.glb`);
export const cloth = areShared ? 'textured/SheenCloth.glb' : 'textured/bear_scene.glb';

/** Hexahedra with a number of each cell and vectors of points; `pieces`: cells in each of about ten. `least`, `most`: where to cut. */
export const can = areShared ? {mesh: 'hex/can.vtu', pieces: 500, scalar: 'EQPS', least: 1, vector: 'DISPL', most: -10, reach: 8, other: 'VEL'}
  : {mesh: 'hex/fire_cells.vtk', pieces: 1000, scalar: 'heat', least: 400, vector: 'uvw', most: 0, reach: 2, other: 't'};
/** Hexahedra with a number and a vector of points, which come first of all arrays; in pieces of so many cells there are 11. */
export const flow = areShared ? {mesh: 'hex/combustor_plot3d.vtu', pieces: 4000, scalar: 'Density', vector: 'Momentum'}
  : {mesh: 'hex/fire_ug.vtu', pieces: 950, scalar: 't', vector: 'uvw'};
/** [mesh, cells in a piece]: hexahedra, tetrahedra, mixed cells, and curved ones. */
export const volumes = [[can.mesh, can.pieces], ...(areShared
  ? [['tet/raptorTetra_19409.vtu', 3000], ['mixed/AngularSector.vtk', 1500], ['mixed/notch_disp.vtu', 400]]
  : [['tet/plates3d.vtk', 3000], ['mixed/metalforming.vtk', 150], ['tet/disk_segment.vtk', 300]])];
/** Faces of other points lie at the same places. */
export const hasTwins = mesh => mesh === 'mixed/AngularSector.vtk' || mesh === 'mixed/metalforming.vtk';
export const manyMixed = areShared ? ['mixed/mesh_brick_pyra_ffd.su2', 4000] : ['mixed/metalforming.vtk', 60];
/** In twelve pieces or so, of which a plane near a side meets few. */
export const long = areShared ? ['hex/2016_fertility-hex.mesh', 1000] : ['hex/fire_ug.vtu', 800];
/** With their options: where the order of the input stands apart, pieces have another one than decode(). */
export const streams = areShared
  ? [['hex/2017_spring.mesh'], ['hex/can.vtu'], ['tet/hand.mesh', '--any-order'], ['tet/post.vtk'], ['mixed/mesh_brick_pyra_ffd.su2', '--any-order'],
    ['mixed/AngularSector.vtk']]
  : [['hex/contact.vtk'], ['hex/fire_cells.vtk'], ['tet/box_hole.mesh', '--any-order'], ['tet/plates3d.vtk'], ['mixed/metalforming.vtk', '--any-order'],
    ['mixed/metalforming.vtk']];

/** Of a file of glTF, without its nodes. */
export function trianglesOfScene(file) {
  const bytes = readFileSync(file), {meshes, accessors} = JSON.parse(bytes.subarray(20, 20 + bytes.readUInt32LE(12)));
  return meshes.flatMap(({primitives}) => primitives).reduce((sum, {indices}) => sum + accessors[indices].count / 3, 0);
}
