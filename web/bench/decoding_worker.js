// Decodes again and again what it was given, in a worker of a page: browser.js measures it.
import {Decoder, DecoderFile} from '../src/decoder.js';
import {ready} from '../src/maille.js';

const bytesOf = async address => new Uint8Array(await (await fetch(address)).arrayBuffer());

/** Each gives a function that decodes all of it once, to typed arrays, and returns how many triangles these have. */
const makers = {
  async maille({address}) {
    const bytes = await bytesOf(address), file = new DecoderFile(await Decoder.create(await ready()), bytes.length, 'bench');
    file.give(0, bytes);
    file.open();
    const list = file.select({level: 0});
    return () => list.reduce((count, {group, chart}) => count + file.chart(group, chart, true).triangles.length / 3, 0);
  },
  // As DRACOLoader does it, with the decoder that comes with three.js.
  async draco({address, library}) {
    const script = await (await fetch(`${library}draco_wasm_wrapper.js`)).text(), data = new Int8Array((await bytesOf(address)).buffer);
    const wasmBinary = (await bytesOf(`${library}draco_decoder.wasm`)).buffer;
    const create = new Function(`${script}; return DracoDecoderModule;`)();
    const draco = await new Promise(resolve => create({wasmBinary, onModuleLoaded: resolve}));
    return () => {
      const decoder = new draco.Decoder(), mesh = new draco.Mesh();
      decoder.DecodeArrayToMesh(data, data.length, mesh);
      const faces = mesh.num_faces(), points = mesh.num_points(), indexBytes = faces * 12, index = draco._malloc(indexBytes);
      decoder.GetTrianglesUInt32Array(mesh, indexBytes, index);
      new Uint32Array(draco.HEAPF32.buffer, index, faces * 3).slice();
      draco._free(index);
      const attribute = decoder.GetAttribute(mesh, decoder.GetAttributeId(mesh, draco.POSITION));
      const positionBytes = points * 12, positions = draco._malloc(positionBytes);
      decoder.GetAttributeDataArrayForAllPoints(mesh, attribute, draco.DT_FLOAT32, positionBytes, positions);
      new Float32Array(draco.HEAPF32.buffer, positions, points * 3).slice();
      draco._free(positions);
      draco.destroy(mesh);
      draco.destroy(decoder);
      return faces;
    };
  },
};

let decode;
addEventListener('message', async ({data}) => {
  try {
    decode ??= await makers[data.what](data);
    const begin = performance.now();
    let triangles = 0;
    for (let i = 0; i < data.times; ++i) triangles += decode();
    postMessage({triangles, ms: performance.now() - begin});
  } catch (error) {
    postMessage({failed: String(error?.stack ?? error)});
  }
});
