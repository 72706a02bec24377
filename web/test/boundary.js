// The surface of a volume, by its definition.

/** Faces {points, cell} that one solid has, and flat cells that are none of these. */
export function boundaryOf({blocks}) {
  const nodesOfFaces = {
    10: [[0, 1, 3], [1, 2, 3], [2, 0, 3], [0, 2, 1]],
    12: [[0, 4, 7, 3], [1, 2, 6, 5], [0, 1, 5, 4], [3, 7, 6, 2], [0, 3, 2, 1], [4, 5, 6, 7]],
    13: [[0, 1, 2], [3, 5, 4], [0, 3, 4, 1], [1, 4, 5, 2], [2, 5, 3, 0]],
    14: [[0, 3, 2, 1], [0, 1, 4], [1, 2, 4], [2, 3, 4], [3, 0, 4]],
  };
  const faces = new Map(), flat = [];
  let cell = 0;
  for (const {cellType, types, offsets, connectivity} of blocks) {
    const size = nodesOfType[cellType], count = size ? connectivity.length / size : types.length;
    for (let i = 0; i < count; ++i, ++cell) {
      const type = cellType === 255 ? types[i] : cellType, first = size ? i * size : offsets[i];
      const points = [...connectivity.subarray(first, first + nodesOfType[type])];
      const keyOf = some => [...some].sort((a, b) => a - b).join(' ');
      if (!nodesOfFaces[type]) flat.push({points, cell, key: keyOf(points)});
      for (const nodes of nodesOfFaces[type] ?? []) {
        const face = nodes.map(node => points[node]), key = keyOf(face);
        if (!faces.delete(key)) faces.set(key, {points: face, cell});
      }
    }
  }
  return [...faces.values(), ...flat.filter(({key}) => !faces.has(key))];
}
export const nodesOfType = {5: 3, 9: 4, 10: 4, 12: 8, 13: 6, 14: 5};
