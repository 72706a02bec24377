"""Builds the wheel (PEP 517): CMake builds the library and maille._core, and the rest is Python as it stands here.

    pip wheel --no-build-isolation --no-deps --no-index -w dist bindings/python

Settings (--config-settings NAME=VALUE, or the environment): MAILLE_BUILD, a folder that CMake has built in, or may
(build/python); MAILLE_JOBS, how many compilers run at once. Nothing is fetched.
"""

import base64
import hashlib
import os
import re
import shutil
import subprocess
import sys
import sysconfig
import zipfile
from pathlib import Path

here = Path(__file__).resolve().parent
root = here.parent.parent


def setting(settings, name, default):
    return (settings or {}).get(name) or os.environ.get(name) or default


def version():
    """The project's, which stands in one place."""
    return re.search(r'project\(maille VERSION ([\d.]+)', (root / 'CMakeLists.txt').read_text()).group(1)


def tag():
    interpreter = f'cp{sys.version_info.major}{sys.version_info.minor}'
    platform = re.sub(r'[-.]', '_', sysconfig.get_platform())
    return f'{interpreter}-{interpreter}-{platform}'


def metadata():
    return ('Metadata-Version: 2.1\n'
            'Name: maille\n'
            f'Version: {version()}\n'
            'Summary: Compression of large meshes: surfaces and volumes with fields, whole, in parts, and from web servers\n'
            'License: Apache-2.0\n'
            'Requires-Python: >=3.9\n'
            'Requires-Dist: numpy\n')


def entry_points():
    """Those of pyproject.toml, which are written so that each line is one here, too."""
    lines = []
    for line in (here / 'pyproject.toml').read_text().splitlines():
        group = re.match(r'\[project\.entry-points\."(.*)"\]', line)
        entry = re.match(r'"(.*)" = "(.*:.*)"', line)
        if group:
            lines.append(f'[{group.group(1)}]')
        elif entry:
            lines.append(f'{entry.group(1)} = {entry.group(2)}')
    return '\n'.join(lines) + '\n'


def information():
    """What stands in the folder .dist-info, by name, without RECORD."""
    wheel = f'Wheel-Version: 1.0\nGenerator: maille\nRoot-Is-Purelib: false\nTag: {tag()}\n'
    return {'METADATA': metadata(), 'WHEEL': wheel, 'entry_points.txt': entry_points(),
            'LICENSE': (root / 'LICENSE').read_text()}


def compile_core(settings):
    """The path of the module, stripped."""
    build = Path(setting(settings, 'MAILLE_BUILD', root / 'build' / 'python')).resolve()
    if not (build / 'CMakeCache.txt').exists():
        generator = ['-G', 'Ninja'] if shutil.which('ninja') else []
        subprocess.run(['cmake', '-S', root, '-B', build, *generator, '-DCMAKE_BUILD_TYPE=Release',
                        '-DCMAKE_CXX_FLAGS_RELEASE=-O2 -DNDEBUG', '-DMAILLE_BUILD_TOOL=OFF', '-DMAILLE_BUILD_TESTS=OFF',
                        '-DMAILLE_UNITY=ON'], check=True)
    subprocess.run(['cmake', build, '-DMAILLE_BUILD_PYTHON=ON', f'-DPython_EXECUTABLE={sys.executable}'], check=True)
    jobs = str(setting(settings, 'MAILLE_JOBS', os.cpu_count() or 1))
    subprocess.run(['cmake', '--build', build, '--target', 'maille_python', '-j', jobs], check=True)
    module = build / 'bindings' / 'python' / ('_core' + sysconfig.get_config_var('EXT_SUFFIX'))
    stripped = module.with_suffix('.stripped')
    subprocess.run(['strip', '--strip-unneeded', '-o', stripped, module], check=True)
    return module.name, stripped


def digest(content):
    return base64.urlsafe_b64encode(hashlib.sha256(content).digest()).rstrip(b'=').decode()


def build_wheel(wheel_directory, config_settings=None, metadata_directory=None):
    name, module = compile_core(config_settings)
    folder = f'maille-{version()}.dist-info'
    contents = {f'maille/{path.name}': path.read_bytes() for path in sorted((here / 'maille').iterdir())
                if path.suffix in ('.py', '.pyi') or path.name == 'py.typed'}
    contents[f'maille/{name}'] = module.read_bytes()
    contents.update({f'{folder}/{name}': text.encode() for name, text in information().items()})
    record = ''.join(f'{name},sha256={digest(content)},{len(content)}\n' for name, content in contents.items())
    contents[f'{folder}/RECORD'] = (record + f'{folder}/RECORD,,\n').encode()
    wheel = f'maille-{version()}-{tag()}.whl'
    with zipfile.ZipFile(Path(wheel_directory) / wheel, 'w', zipfile.ZIP_DEFLATED, compresslevel=9) as archive:
        for name, content in contents.items():
            # The same wheel whenever it is built.
            entry = zipfile.ZipInfo(name, (1980, 1, 1, 0, 0, 0))
            entry.compress_type = zipfile.ZIP_DEFLATED
            entry.external_attr = (0o755 if name.endswith('.so') else 0o644) << 16
            archive.writestr(entry, content, compresslevel=9)
    return wheel


def prepare_metadata_for_build_wheel(metadata_directory, config_settings=None):
    folder = Path(metadata_directory) / f'maille-{version()}.dist-info'
    folder.mkdir()
    for name, text in information().items():
        (folder / name).write_text(text)
    return folder.name


def build_sdist(sdist_directory, config_settings=None):
    raise SystemExit('maille: the package is built within the repository, by `pip wheel bindings/python`; its sources '
                     'alone are not enough')
