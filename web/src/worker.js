// A decoder in a thread of its own; pool.js is at the other end.

import {buffersOf, MailleError} from './decoder.js';
import {Session} from './session.js';

let session = null;
let waiting = null;     // whoever waits for an answer
let controller = null;  // of the task at hand
let given = [];         // bytes that came for it

function ask(question) {
  return new Promise((resolve, reject) => {
    waiting = {resolve, reject};
    postMessage(question);
  });
}

addEventListener('message', async ({data}) => {
  if (data.open) {
    const {module, kind, about} = data.open;
    session = new Session({module, kind, other: wanted => ask({other: wanted})}, about, ranges => ask({ranges}));
  }
  if ('answer' in data) {
    if (Array.isArray(data.answer)) given.push(...data.answer);
    waiting.resolve(data.answer);
  }
  if (data.failed) waiting.reject(new MailleError(data.failed.code, data.failed.message));
  if (data.abort) controller?.abort();
  if (!data.task) return;
  controller = new AbortController();
  try {
    const onProgress = data.progress ? progress => postMessage({progress}) : undefined;
    const result = await session.run(data.task, {signal: controller.signal, onProgress});
    postMessage({result, memoryBytes: session.memoryBytes}, buffersOf(result));
  } catch (error) {
    postMessage({error: {code: error.code ?? 6, message: error.message}});
  }
  // The decoder has copies. These would stay for megabytes until somebody looks for what nobody uses.
  for (const bytes of [...given.splice(0), ...(data.task.given ?? []).map(part => part.bytes)]) bytes.buffer.transfer?.(0);
});
