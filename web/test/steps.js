// A file with steps of time for tests, made by the command: a cube of hexahedra with the values "p" and "q" of points and "id" of cells.
import {execFileSync} from 'node:child_process';
import {writeFileSync} from 'node:fs';
import path from 'node:path';

export const times = [0.5, 1, 2.25];

function cube(n, step) {
  const side = n + 1, range = count => Array.from({length: count}, (_, i) => i);
  const points = range(side ** 3).map(i => `${i % side} ${Math.floor(i / side) % side} ${Math.floor(i / side ** 2)}`);
  const corners = [0, 1, side + 1, side, side ** 2, side ** 2 + 1, side ** 2 + side + 1, side ** 2 + side];
  const cells = range(n ** 3).map(i => {
    const first = i % n + Math.floor(i / n) % n * side + Math.floor(i / n ** 2) * side ** 2;
    return `8 ${corners.map(corner => first + corner).join(' ')}`;
  });
  // Values that nothing tells take room in the file, so that its parts lie far from one another.
  let state = step + 1;
  const noise = () => (state = Math.imul(state, 1664525) + 1013904223 >>> 0) / 2 ** 32;
  const values = name => `SCALARS ${name} float 1\nLOOKUP_TABLE default\n${points.map((_, i) => i / points.length + step + 0.2 * noise()).join('\n')}\n`;
  return `# vtk DataFile Version 3.0\nstep\nASCII\nDATASET UNSTRUCTURED_GRID\nPOINTS ${points.length} float\n${points.join('\n')}\n`
    + `CELLS ${cells.length} ${9 * cells.length}\n${cells.join('\n')}\nCELL_TYPES ${cells.length}\n${'12\n'.repeat(cells.length)}`
    + `POINT_DATA ${points.length}\n${values('p')}${values('q')}`
    + `CELL_DATA ${cells.length}\nSCALARS id int 1\nLOOKUP_TABLE default\n${cells.map((_, i) => i + (step === 2)).join('\n')}\n`;
}

/** @param n cells along a side; @returns its path */
export function withSteps(maille, folder, n) {
  const file = path.join(folder, `steps${n}.maille`), mesh = path.join(folder, `steps${n}.vtk`);
  for (const [step, time] of [null, ...times].entries()) {
    writeFileSync(mesh, cube(n, step));
    execFileSync(maille, step === 0 ? ['compress', '-q', '-f', mesh, file] : ['append', '-q', file, mesh, '--time', String(time)]);
  }
  return file;
}
