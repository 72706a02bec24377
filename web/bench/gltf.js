// Geometry of GLBs on one thread, in CPU time: the .maille files in them, by effort, beside the same primitives by draco3d
// (npm) at its default level, with the same bits for each kind of attribute; both as typed arrays of all accessors.
//   node bench/gltf.js [FILE.glb ...]    those of build/data without arguments
import {createRequire} from 'node:module';
import path from 'node:path';

import {compressedAccessors, createSyncDecoder, EXTENSION} from '../src/gltf.js';
import {best, compressedAs, read, table} from './support.js';

const peers = createRequire(process.env.MAILLE_PEERS ? path.join(process.env.MAILLE_PEERS, 'x.js') : import.meta.url);
const given = process.argv.slice(2).map(file => path.resolve(file));
const glbs = given.length ? given : ['SheenCloth', 'scallop', 'usd-shaderball-ball'].map(name => `textured/${name}.glb`);
const bits = {POSITION: 14, NORMAL: 10, TEXCOORD: 12, TANGENT: 10, COLOR: 8};
const options = ['--for', 'web'];

function open(file) {
  const bytes = read(file), size = bytes.readUInt32LE(12), json = JSON.parse(bytes.subarray(20, 20 + size));
  return {json, view(number) {
    const {byteOffset = 0, byteLength} = json.bufferViews[number], begin = 28 + size + byteOffset;
    return bytes.subarray(begin, begin + byteLength);
  }};
}

/** All accessors that a file's .maille files hold, by number. */
function decodeAll({json, view}, decoder) {
  const meshes = new Map(), arrays = new Map();
  for (const [number, accessor] of compressedAccessors(json)) {
    if (!meshes.has(accessor.view)) meshes.set(accessor.view, decoder.decode(view(accessor.view)));
    arrays.set(number, accessor.values(meshes.get(accessor.view)));
  }
  return arrays;
}
const bytesOf = ({json, view}) =>
  [...new Set([...compressedAccessors(json).values()].map(one => one.view))].reduce((sum, number) => sum + view(number).length, 0);
const primitivesOf = json => json.meshes.flatMap(mesh => mesh.primitives).filter(one => one.extensions?.[EXTENSION]);

function encodeDraco(draco, {attributes, indices}, arrays) {
  const encoder = new draco.Encoder(), builder = new draco.MeshBuilder(), mesh = new draco.Mesh(), coded = new draco.DracoInt8Array();
  const corners = Uint32Array.from(arrays.get(indices)), points = arrays.get(attributes.POSITION).length / 3;
  builder.AddFacesToMesh(mesh, corners.length / 3, corners);
  const sizes = [];
  for (const [semantic, number] of Object.entries(attributes)) {
    const values = arrays.get(number), kind = semantic.replace(/_.*/, '');
    const type = {POSITION: draco.POSITION, NORMAL: draco.NORMAL, TEXCOORD: draco.TEX_COORD, COLOR: draco.COLOR}[kind] ?? draco.GENERIC;
    encoder.SetAttributeQuantization(type, bits[kind] ?? 12);
    builder.AddFloatAttributeToMesh(mesh, type, points, values.length / points, Float32Array.from(values));
    sizes.push(values.length / points);
  }
  const size = encoder.EncodeMeshToDracoBuffer(mesh, coded), data = new Int8Array(size);
  for (let i = 0; i < size; ++i) data[i] = coded.GetValue(i);
  for (const one of [encoder, builder, mesh, coded]) draco.destroy(one);
  return {data, sizes};
}

/** As DRACOLoader of three.js does it. */
function decodeDraco(draco, {data, sizes}) {
  const decoder = new draco.Decoder(), mesh = new draco.Mesh();
  decoder.DecodeArrayToMesh(data, data.length, mesh);
  const copied = (bytes, get) => {
    const at = draco._malloc(bytes);
    get(at);
    const copy = draco.HEAPU8.slice(at, at + bytes);
    draco._free(at);
    return copy;
  };
  const faces = mesh.num_faces(), points = mesh.num_points();
  copied(12 * faces, at => decoder.GetTrianglesUInt32Array(mesh, 12 * faces, at));
  sizes.forEach((size, i) => copied(4 * size * points, at =>
    decoder.GetAttributeDataArrayForAllPoints(mesh, decoder.GetAttribute(mesh, i), draco.DT_FLOAT32, 4 * size * points, at)));
  draco.destroy(mesh);
  draco.destroy(decoder);
}

const decoder = await createSyncDecoder(), coder = await peers('draco3d').createEncoderModule({});
const draco = await peers('draco3d').createDecoderModule({}), rows = [];
for (const glb of glbs) {
  const exact = open(compressedAs('maille.glb', glb)), arrays = decodeAll(exact, decoder), primitives = primitivesOf(exact.json);
  const triangles = primitives.reduce((sum, one) => sum + arrays.get(one.indices).length / 3, 0);
  const coded = primitives.map(one => encodeDraco(coder, one, arrays));
  const time = best(() => coded.forEach(one => decodeDraco(draco, one)));
  rows.push([path.basename(glb, '.glb'), 'draco3d', coded.reduce((sum, one) => sum + one.data.length, 0), time.toFixed(1), triangles / time / 1000]);
  for (const effort of ['-1', '-2', '-5']) {
    const file = open(compressedAs('maille.glb', glb, effort, ...options)), ms = best(() => decodeAll(file, decoder));
    rows.push(['', `maille ${effort}`, bytesOf(file), ms.toFixed(1), triangles / ms / 1000, time / ms]);
  }
}
table('Geometry of GLBs, one thread', ['', '', 'bytes', 'ms', 'M triangles/s', 'over draco3d'],
      rows.map(row => row.map((x, i) => i > 3 ? x.toFixed(2) : x)));
