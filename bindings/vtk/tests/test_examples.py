#!/usr/bin/python3
"""test_examples.py BUILD (of bindings/vtk): examples/vtk in C++, against the module as it is installed, and in Python, with the same results.

MAILLE, MAILLE_DATA, PYTHONPATH: as test_reader.py has them."""
import os
import pathlib
import subprocess
import sys
import tempfile

build = pathlib.Path(sys.argv[1]).resolve()
source = pathlib.Path(__file__).resolve().parents[3] / 'examples/vtk'


def run(*command):
    done = subprocess.run([str(word) for word in command], capture_output=True, text=True)
    if done.returncode:
        sys.exit(f'{" ".join(map(str, command))}: {done.returncode}\n{done.stdout}{done.stderr}')
    return done.stdout


with tempfile.TemporaryDirectory() as name:
    folder = pathlib.Path(name)
    run('cmake', '--install', build, '--prefix', folder / 'maille')
    run('cmake', '-G', 'Ninja', '-S', source, '-B', folder / 'build', f'-DCMAKE_PREFIX_PATH={folder / "maille"}')
    run('cmake', '--build', folder / 'build')
    mesh = pathlib.Path(os.environ['MAILLE_DATA']) / 'hex/combustor_plot3d.vtu'
    for time in (0, 1, 2):
        action = ['compress'] if time == 0 else ['append', '--time', time]
        arguments = [mesh, folder / 'run.maille'] if time == 0 else [folder / 'run.maille', mesh]
        run(os.environ['MAILLE'], *action, '-q', *arguments)
    answers = []
    for program in ([folder / 'build/contour'], [sys.executable, source / 'contour.py']):
        out = folder / f'out{len(answers)}'
        out.mkdir()
        said = run(*program, folder / 'run.maille', 'Density', '0.5', out)
        answers.append((said, [(p.name, p.read_bytes()) for p in sorted(out.iterdir())]))
    assert answers[0] == answers[1], 'the programs differ: ' + answers[0][0] + answers[1][0]
    assert answers[0][1] and 'triangles' in answers[0][0] and ' 0 triangles' not in answers[0][0], answers[0][0]
    print(answers[0][0], end='')
print('examples: all is well')
