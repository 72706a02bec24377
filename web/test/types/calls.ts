// Compiled only: calls as programs write them, and some that must not compile.
import {decode, ErrorCode, MailleError, MeshFile, ready, setDecoder} from 'maille';
import type {Chart, DrawnMesh, Mesh} from 'maille';

export async function calls(url: string, blob: Blob, signal: AbortSignal): Promise<void> {
  await ready({full: true});
  await setDecoder('/libs/maille.wasm');
  const file = await MeshFile.open(url, {workers: 2, cacheBytes: 1e7, signal, onBytes: fetched => fetched + 1});
  await MeshFile.open(blob);
  await MeshFile.open({size: 5e12, readAt: async (offset, size) => new Uint8Array(size + offset * 0)});
  const charts: Chart[] = await file.select({box: {low: [0, 0, 0], high: [1, 1, 1]}, maxFaces: 1e5}, {signal});
  const now = file.selectNow({view: {eye: [0, 0, 1], pixelsPerRadian: 1000}});
  const drawn: DrawnMesh = await file.decodeNode((now ?? charts)[0]);
  const positions: Float32Array = drawn.positions;
  const part: Mesh = await file.extract({sphere: {centre: [0, 0, 0], radius: 1}, clip: false});
  const hit = await file.pick([0, 0, 1], [0, 0, -1]);
  const face: number | undefined = hit?.face;
  const shown: DrawnMesh = await decode(url, {drawn: true});
  const whole: Mesh = await decode(blob);
  for (const {step, time} of await file.readSteps({signal})) console.log(time, file.info.steps?.length, await file.surface({step}));
  for await (const piece of file.pieces({step: 1, signal})) console.log(piece.types.length);
  const names: string[] | undefined = whole.arrays.find(array => array.role === 'label')?.labels, [[key, value]] = await file.readMetadata({signal});
  console.log(names, key.length, value.length);
  for (const {name, blocks: [first], matrix} of await file.readInstances()) console.log(name, whole.blocks[first], matrix[12]);
  const surface = await file.surface({onProgress: ({cells, total}) => console.log(cells, total)});
  const cut = await file.slice({normal: [0, 0, 1], offset: 0}, {arrays: ['T']});
  const hot = await file.extract({where: [{array: 'T', low: 500}], plane: {normal: [1, 0, 0], offset: 0}});
  for await (const {drawn, piece} of file.slices({normal: [0, 0, 1], offset: 0}, {signal})) console.log(drawn?.faces, piece.box?.low);
  console.log(cut.triangles, hot.cellNumbers, file.info.volume?.fields[0].low);
  console.log(positions, part, face, shown.origin, whole.blocks[0].cellType, surface.arrays, file.usage.cacheBytes);
  // @ts-expect-error: a box has two corners
  await file.select({box: {low: [0, 0, 0]}});
  // @ts-expect-error: the whole mesh has no triangles of its own
  console.log(whole.triangles);
  try {
    file.close();
  } catch (error) {
    if (error instanceof MailleError && error.code === ErrorCode.network) console.log(error.message);
  }
}
