// A server on 127.0.0.1 with ranges, for one file: so many bits a second over all connections, and a delay before each answer.
import {createServer} from 'node:http';

/** @param size more than the bytes: the file goes on with zeros. */
export async function serve(bytes, {bitsPerSecond = Infinity, delay = 0, size = bytes.length, ranges = true} = {}) {
  let free = 0;  // when the line is free again, ms
  const line = async count => {
    const now = performance.now();
    free = Math.max(free, now) + count * 8000 / bitsPerSecond;
    if (free > now) await new Promise(resolve => setTimeout(resolve, free - now));
  };
  const part = (from, to) => {
    const out = new Uint8Array(to - from);
    if (from < bytes.length) out.set(bytes.subarray(from, Math.min(to, bytes.length)));
    return out;
  };
  const server = createServer(async (request, response) => {
    const match = ranges && /^bytes=(\d+)-(\d+)$/.exec(request.headers.range ?? '');
    const first = match ? Number(match[1]) : 0, end = match ? Math.min(Number(match[2]) + 1, size) : size;
    if (delay > 0) await new Promise(resolve => setTimeout(resolve, delay));
    response.writeHead(match ? 206 : 200, {
      'Content-Length': end - first, ETag: '"one"', ...(match ? {'Content-Range': `bytes ${first}-${end - 1}/${size}`} : {}),
    });
    for (let at = first; at < end && !response.destroyed; at += 4096) {
      const piece = part(at, Math.min(end, at + 4096));
      await line(piece.length);
      response.write(piece);
    }
    response.end();
  });
  await new Promise(resolve => server.listen(0, '127.0.0.1', resolve));
  return {url: `http://127.0.0.1:${server.address().port}/file.maille`, close: () => { server.closeAllConnections(); server.close(); }};
}
