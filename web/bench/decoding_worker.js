// Decodes again and again what it was given, in a worker of a page: browser.js measures it.
import {Decoder, DecoderFile} from '../src/decoder.js';
import {ready} from '../src/maille.js';
import {decodeDraco} from './draco.js';

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
  // With the decoder that comes with three.js.
  async draco({address, library}) {
    const script = await (await fetch(`${library}draco_wasm_wrapper.js`)).text(), data = new Int8Array((await bytesOf(address)).buffer);
    const wasmBinary = (await bytesOf(`${library}draco_decoder.wasm`)).buffer;
    const create = new Function(`${script}; return DracoDecoderModule;`)();
    const draco = await new Promise(resolve => create({wasmBinary, onModuleLoaded: resolve}));
    return () => decodeDraco(draco, data);
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
