// Where the nodes of a glTF scene put the blocks of a mesh: what its metadata says of them (src/io/gltf/gltf.h).

const IDENTITY = [1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1];

/**
 * Blocks at one place of the scene, in the order of its tree; a mesh that several nodes use is there once for each.
 * [{name, blocks, matrix}]: numbers of blocks; the matrix column after column, from the mesh to the scene. [] where the scene
 * has each block once, and not moved.
 */
export function instancesOf(metadata) {
  const values = new Map(metadata), [nodes, roots, meshes] = ['nodes', 'scene', 'meshes'].map(key => listOf(values.get(`gltf.${key}`)));
  const instances = [], visited = new Set();
  const open = [...roots].reverse().map(number => ({number, parent: IDENTITY}));
  while (open.length > 0) {
    const {number, parent} = open.pop(), node = nodes[number];
    // Each node once, whatever the file says, so cycles end.
    if (visited.has(number) || typeof node !== 'object' || node === null) continue;
    visited.add(number);
    const matrix = product(parent, matrixOf(node)), blocks = meshes[node.mesh];
    // Joints move a skinned mesh, whatever its own node says (glTF 2.0, 3.7.3.2).
    const placed = node.skin === undefined ? matrix : [...IDENTITY];
    if (Array.isArray(blocks) && blocks.length > 0) instances.push({name: String(node.name ?? ''), blocks: blocks.filter(Number.isInteger), matrix: placed});
    if (Array.isArray(node.children)) for (const child of [...node.children].reverse()) open.push({number: child, parent: matrix});
  }
  return instances;
}

function listOf(text) {
  try {
    const list = JSON.parse(text ?? '[]');
    return Array.isArray(list) ? list : [];
  } catch {
    return [];
  }
}

/** So many numbers of a member, or the others where there are none or something else. */
function numbersOf(numbers, others) {
  return Array.isArray(numbers) && numbers.length === others.length && numbers.every(Number.isFinite) ? numbers : others;
}

function matrixOf({matrix, translation, rotation, scale}) {
  if (matrix !== undefined) return numbersOf(matrix, IDENTITY);
  const [x, y, z, w] = numbersOf(rotation, [0, 0, 0, 1]), s = numbersOf(scale, [1, 1, 1]), t = numbersOf(translation, [0, 0, 0]);
  // A unit quaternion, as in glTF 2.0, 3.5.3: translation * rotation * scale.
  const columns = [[1 - 2 * (y * y + z * z), 2 * (x * y + z * w), 2 * (x * z - y * w)],
    [2 * (x * y - z * w), 1 - 2 * (x * x + z * z), 2 * (y * z + x * w)],
    [2 * (x * z + y * w), 2 * (y * z - x * w), 1 - 2 * (x * x + y * y)]];
  return [...columns.flatMap((column, k) => [...column.map(number => number * s[k]), 0]), ...t, 1];
}

function product(a, b) {
  return IDENTITY.map((_, i) => {
    const row = i % 4, column = i - row;
    return [0, 1, 2, 3].reduce((sum, k) => sum + a[4 * k + row] * b[column + k], 0);
  });
}
