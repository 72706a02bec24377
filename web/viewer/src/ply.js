// A mesh as a binary PLY file, as `maille extract` writes it.

const names = {i8: 'char', u8: 'uchar', i16: 'short', u16: 'ushort', i32: 'int', u32: 'uint', f32: 'float', f64: 'double'};
const sizes = {i8: 1, u8: 1, i16: 2, u16: 2, i32: 4, u32: 4, f32: 4, f64: 8};
const setters = {i8: 'setInt8', u8: 'setUint8', i16: 'setInt16', u16: 'setUint16', i32: 'setInt32', u32: 'setUint32', f32: 'setFloat32', f64: 'setFloat64'};
const known = {normal: ['nx', 'ny', 'nz'], colour: ['red', 'green', 'blue', 'alpha'], texture_coordinate: ['s', 't']};

/**
 * @param mesh {positions, blocks, arrays} as MeshFile.extract() gives it
 * @returns {blob, left}: the file, and names of arrays that PLY has no place for
 */
export function plyOf({positions, blocks, arrays}) {
  const left = [];
  const ofPoints = arrays.filter(array => array.domain === 'point' && isPlain(array, left)).map(column);
  const ofCells = arrays.filter(array => array.domain === 'cell' && isPlain(array, left)).map(column);
  left.push(...arrays.filter(array => array.domain === 'corner').map(array => array.name));
  const position = column({
    name: '', role: 'none', components: 3, values: positions, type: positions instanceof Float64Array ? 'f64' : 'f32',
  });
  position.properties = ['x', 'y', 'z'];
  const vertices = positions.length / 3, faces = facesOf(blocks);
  const header = ['ply', 'format binary_little_endian 1.0', `element vertex ${vertices}`, ...propertyLines([position, ...ofPoints]),
    `element face ${faces.count}`, 'property list uchar int vertex_indices', ...propertyLines(ofCells), 'end_header', ''].join('\n');
  const blob = new Blob([header, rows([position, ...ofPoints], vertices), faceRows(faces, ofCells)], {type: 'application/octet-stream'});
  return {blob, left};
}

function isPlain({name, type}, left) {
  if (type in names) return true;
  left.push(name);
  return false;
}
function column(array) {
  const {name, role, components} = array, fixed = known[role];
  const word = name.replace(/[^!-~]/g, '_') || 'array';
  const properties = fixed && components <= fixed.length ? fixed.slice(0, components)
    : components === 1 ? [word] : Array.from({length: components}, (_, c) => `${word}_${c}`);
  return {array, properties, size: components * sizes[array.type]};
}
function propertyLines(columns) {
  return columns.flatMap(({array, properties}) => properties.map(name => `property ${names[array.type]} ${name}`));
}

function put(view, at, {array}, index) {
  const {components, values, type} = array;
  for (let c = 0; c < components; ++c) view[setters[type]](at + c * sizes[type], values[index * components + c], true);
}
function rows(columns, count) {
  const size = columns.reduce((sum, c) => sum + c.size, 0), view = new DataView(new ArrayBuffer(size * count));
  let at = 0;
  for (let i = 0; i < count; ++i) {
    for (const each of columns) {
      put(view, at, each, i);
      at += each.size;
    }
  }
  return view.buffer;
}

const TRIANGLE = 5, QUAD = 9;  // of VTK
/** @returns {count, each(f)}: f(corners) of every face */
function facesOf(blocks) {
  const list = blocks.map(({cellType, types, offsets, connectivity}) => {
    const fixed = {[TRIANGLE]: 3, [QUAD]: 4}[cellType];
    const begins = offsets?.length > 0 ? offsets : null;
    const count = begins ? begins.length - 1 : fixed ? connectivity.length / fixed : 0;
    return {count, connectivity, begin: i => (begins ? begins[i] : i * fixed), types};
  });
  return {
    count: list.reduce((sum, {count}) => sum + count, 0),
    * [Symbol.iterator]() {
      for (const {count, connectivity, begin} of list) {
        for (let i = 0; i < count; ++i) yield connectivity.subarray(begin(i), begin(i + 1));
      }
    },
  };
}
function faceRows(faces, columns) {
  let size = 0;
  const own = columns.reduce((sum, c) => sum + c.size, 0);
  for (const corners of faces) size += 1 + 4 * corners.length + own;
  const view = new DataView(new ArrayBuffer(size));
  let at = 0, i = 0;
  for (const corners of faces) {
    view.setUint8(at++, corners.length);
    for (const corner of corners) {
      view.setInt32(at, corner, true);
      at += 4;
    }
    for (const each of columns) {
      put(view, at, each, i);
      at += each.size;
    }
    ++i;
  }
  return view.buffer;
}
