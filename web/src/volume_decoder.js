// Calls of the decoder for files of mode stream (bindings/wasm/pieces.cpp, volume.cpp), beside those of DecoderFile: they return
// what they say, or WantsBytes or GoesOn.

import {describeArray, MailleError, NEEDS_FULL, Wanted, WantsBytes} from './decoder.js';

/** Times of the steps of a file of mode stream: [{step, time}], without step 0, which is the mesh itself. */
export function steps(file) {
  return file.outcome(file.decoder.calls.maille_steps(file.reader), () => [...file.numbers()].map((time, i) => ({step: i + 1, time})));
}
/** A file of mode stream is to be given in pieces, with the arrays of a step. */
export function beginPieces(file, step = 0) {
  return file.outcome(file.decoder.calls.maille_begin_pieces(file.reader, step), () => true);
}
/** The next of them; null: there is none. */
export function nextPiece(file) {
  return file.outcome(file.decoder.calls.maille_next_piece(file.reader), () => {
    const [there, firstCell, slotCount] = file.numbers();
    return there ? {firstCell, slotCount, ...pieceOf(file)} : null;
  });
}
/** The surface of all of them. */
export function surfaceOfPieces(file) {
  return file.outcome(file.decoder.calls.maille_surface_of_pieces(file.reader), () => file.drawn(file.buffers(Wanted.surfaceOfPieces)));
}
function pieceOf(file) {
  const piece = {arrays: []};
  for (const buffer of file.list(file.decoder.calls.maille_piece_buffers(file.reader))) {
    const {kind, values} = buffer;
    if (kind === 'exactPositions') piece.positions = values;
    else if (kind === 'array') piece.arrays.push(describeArray(buffer));
    else piece[kind] = values;
  }
  return piece;
}

/**
 * A volume of mode stream: {cells, points, keepsOrder, pieces, fields}; pieces: [{piece, firstCell, firstPoint, cells, points,
 * bytes, box, ranges}] in the order of `fields`, of the index; null where it says nothing.
 */
export function openVolume(file, request) {
  return ofVolume(file, 'maille_open_volume', request, () => {
    const n = file.numbers();
    const fields = file.list(file.decoder.calls.maille_volume_fields(file.reader)).map(({values, ...field}) => describeArray(field));
    return {cells: n[0], points: n[1], keepsOrder: n[2] !== 0, fields, pieces: piecesOf(n.subarray(4), n[3], fields)};
  });
}
/** Numbers of the pieces that may have cells of a request, see MeshFile.select(). */
export function selectPieces(file, request) {
  return ofVolume(file, 'maille_select_pieces', request, () => [...file.numbers()]);
}
/** What of the file a request reads: [{offset, size}], as much as can be told beforehand. */
export function rangesOfPieces(file, request) {
  return ofVolume(file, 'maille_ranges_of_pieces', request, () => new WantsBytes(file.numbers()).ranges);
}
/** The cells of a request, exactly. */
export function extractVolume(file, request) {
  return ofVolume(file, 'maille_extract_volume', request, () => {
    const [pieces, cellsRead] = file.numbers(), problems = file.message().split('\n').filter(Boolean);
    return {...file.exact(file.list(file.decoder.calls.maille_volume_buffers(file.reader, 0))), pieces, cellsRead, problems};
  });
}
/** A first picture of all: {positions, arrays} of vertices that stand for some thousand cells each. */
export function coarseVolume(file, request) {
  return ofVolume(file, 'maille_coarse_volume', request, () => {
    const {positions, arrays} = file.exact(file.list(file.decoder.calls.maille_volume_buffers(file.reader, 0)));
    return {positions, arrays};
  });
}
/** What request.plane cuts out of the piece request.pieces[0]. */
export function sliceOfPiece(file, request) {
  return ofVolume(file, 'maille_slice_of_piece', request, () => drawnOfPiece(file));
}
/** Its surface; borderKeys: by face, the same in another piece that has it, too, or -1. */
export function surfaceOfPiece(file, request) {
  return ofVolume(file, 'maille_surface_of_piece', request, () => drawnOfPiece(file));
}
function drawnOfPiece(file) {
  // Behind the origin there are no cells of blocks here, but the pieces that the decoder has kept.
  const {blockCells: held = [], ...drawn} = file.drawn(file.list(file.decoder.calls.maille_volume_buffers(file.reader, 1)));
  return {...drawn, held};
}
function ofVolume(file, name, request, value) {
  const {calls} = file.decoder, {numbers, text} = packed(request);
  if (!calls[name]) throw new MailleError(NEEDS_FULL, 'the small decoder reads no volumes');
  const addresses = [file.decoder.put(new Uint8Array(numbers.buffer)), file.decoder.put(text)];
  const outcome = calls[name](file.reader, addresses[0], numbers.length, addresses[1], text.length);
  addresses.forEach(address => calls.maille_release(address));
  return file.outcome(outcome, value);
}

/** As unpacked() of volume.cpp unpacks it. */
function packed({step = 0, keptBytes = 0, origin, box, sphere, plane, cells, planes = [], where = [], pieces, arrays}) {
  const none = [NaN, NaN, NaN], ofPlane = ({normal, offset}) => [...normal, offset];
  const numbers = Float64Array.from([
    step, keptBytes, ...(origin ?? none), ...(box ? [...box.low, ...box.high] : [...none, ...none]),
    ...(sphere ? [...sphere.centre, sphere.radius] : [...none, NaN]), ...(plane ? ofPlane(plane) : [...none, NaN]),
    ...(cells ?? [-1, -1]), planes.length, ...planes.flatMap(ofPlane),
    where.length, ...where.flatMap(({low = -Infinity, high = Infinity, component = -1}) => [low, high, component]),
    ...(pieces ? [pieces.length, ...pieces] : [-1]), arrays ? arrays.length : -1,
  ]);
  const names = [...where.map(({array}) => array), ...(arrays ?? [])];
  return {numbers, text: new TextEncoder().encode(names.map(name => `${name}\0`).join(''))};
}

/** What maille_open_volume() says of pieces. */
function piecesOf(n, count, fields) {
  const pieces = [];
  let at = 0, firstCell = 0, firstPoint = 0;
  const next = size => [...n.subarray(at, at += size)];
  for (let piece = 0; piece < count; ++piece) {
    const [cells, points, bytes] = next(3), low = next(3), high = next(3), ranges = at < n.length ? [] : null;
    for (const {name, domain} of ranges ? fields : []) {
      const [nans, components] = next(2), numbers = next(3 * components), each = k => numbers.filter((_, i) => i % 3 === k);
      ranges.push({name, domain, nans, low: each(0), high: each(1), mean: each(2)});
    }
    pieces.push({piece, firstCell, firstPoint, cells, points, bytes, box: Number.isNaN(low[0]) ? null : {low, high}, ranges});
    firstCell += cells;
    firstPoint += points;
  }
  return pieces;
}
