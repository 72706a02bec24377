// A decoder in a thread of its own; pool.js is at the other end.

import {buffersOf, MailleError} from './decoder.js';
import {Session} from './session.js';

let session = null;
let arrived = null;  // whoever waits for bytes

function read(offset, size) {
  return new Promise((resolve, reject) => {
    arrived = {resolve, reject};
    postMessage({offset, size});
  });
}

addEventListener('message', async ({data}) => {
  if (data.open) session = new Session(data.open.module, data.open.about, read);
  if (data.bytes) arrived.resolve(data.bytes);
  if (data.failed) arrived.reject(new MailleError(data.failed.code, data.failed.message));
  if (!data.task) return;
  try {
    const result = await session.run(data.task);
    postMessage({result}, buffersOf(result));
  } catch (error) {
    postMessage({error: {code: error.code ?? 6, message: error.message}});
  }
});
