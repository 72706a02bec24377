#!/usr/bin/python3
"""The goals of the surface codecs as a table: what was measured beside a bar and a stretch.

report_goals.py ROWS.jsonl [GOALS.jsonl [FILES.jsonl]]   of maille_bench, maille_bench --goals and --inversions
"""

import json
import math
import os
import re
import sys

import report

DRACO, MESHOPT = 'draco -cl 10', 'meshopt + zstd -19'
SPEED_MESHES = ('stanford_dragon_vrip', 'iso_mri_ch2bet_60', 'turbineblade', 'ogre', 'armadillo')
ROOT = os.path.join(os.path.dirname(os.path.abspath(__file__)), '..')


def cells(found):
    return [number(found.mean), number(found.median), number(found.noisy), f'{number(found.ratios[found.worst])} ({found.worst})']


def number(value):
    if math.isnan(value):
        return ''
    return f'{value:.3f}' if value < 10 else f'{value:.1f}'


class Table:
    def __init__(self):
        self.rows = []

    def add(self, text, bar, stretch, cells, value=None, least=False):
        """`value` is held against bar and stretch; least: it must be at least that."""
        reached = lambda goal: goal is not None and (value >= goal if least else value <= goal)
        state = '' if value is None or bar is None else 'stretch' if reached(stretch) else 'bar' if reached(bar) else 'MISS'
        show = lambda goal: '' if goal is None else f'{goal:g}'
        self.rows.append([text, show(bar), show(stretch), state] + (cells + [''] * 4)[:4])

    def spread(self, text, bar, stretch, found, least=False):
        if found:
            self.add(text, bar, stretch, cells(found), found.mean, least)

    def __str__(self):
        head = ['figure', 'bar', 'stretch', 'reached', 'mean', 'median', 'noisy half', 'worst']
        return report.table(head, self.rows)


class Goals:
    def __init__(self, rows):
        self.results = rows
        self.table = Table()

    def ratio(self, folder, bits, level, key='bytes', reference=DRACO, only=None, worst=max):
        return self.results.spread(folder, bits, f'maille -{level}', key, reference, worst, only)

    def speed(self, folder, bits, level, key='decode_mtps', **more):
        return self.ratio(folder, bits, level, key, worst=min, **more)

    def draco_rows(self):
        for level, bar, fast in ((1, (0.96, 0.92), (10, 14)), (3, (0.83, 0.80), (5, 7)), (5, (0.79, 0.76), (3, 4.5))):
            self.table.spread(f'tri, 14 bits, -{level}: bytes', *bar, self.ratio('tri', '14', level))
            self.table.spread(f'tri, 14 bits, -{level}: decode', *fast, self.speed('tri', '14', level), True)
        for bits, bar in (('12', (0.605, 0.58)), ('14', (0.635, 0.60))):
            found = self.ratio('tri', bits, 9)
            self.table.spread(f'tri, {bits} bits, -9: bytes', *bar, found)
            if found:
                self.table.add(f'tri, {bits} bits, -9: no mesh above', 0.87, 0.85,
                               ['', '', '', number(max(found.ratios.values()))], max(found.ratios.values()))
        self.table.spread('tri, 14 bits, -9: decode', 0.06, 0.15, self.speed('tri', '14', 9), True)
        for level, bar in ((1, (2.2, 3)), (3, (1.5, 2.2)), (5, (1.3, 2)), (9, (0.35, 0.5))):
            self.table.spread(f'tri, 14 bits, -{level}: encode', *bar, self.speed('tri', '14', level, 'encode_mtps'), True)

    def lossless_rows(self):
        for level, bar in ((5, (0.50, 0.47)), (9, (0.45, 0.43))):
            self.table.spread(f'tri, lossless, -{level}: bytes / {MESHOPT}', *bar,
                              self.ratio('tri', 'lossless', level, reference=MESHOPT))
        for key, goals in (('decode_mtps', ((2, 4, 6), (5, 2.5, 4))), ('encode_mtps', ((2, 0.9, 1.5), (5, 0.8, 1.3)))):
            for level, bar, stretch in goals:
                found = {}
                for mesh in SPEED_MESHES:
                    ours = self.results.groups.get(('tri', 'lossless'), {}).get(mesh, {}).get(f'maille -{level}', {})
                    theirs = self.results.groups.get(('tri', '14'), {}).get(mesh, {}).get(DRACO, {})
                    if ours.get(key) and theirs.get(key):
                        found[mesh] = ours[key] / theirs[key]
                if found:
                    self.table.spread(f"five meshes, lossless, -{level}: {key[:6]} / draco's at 14 bits", bar, stretch,
                                      report.Spread(found, self.results.noise('tri', '14'), min), True)

    def other_folders(self):
        for level, bar in ((3, (0.75, 0.70)), (5, (0.73, 0.68)), (9, (0.60, 0.57))):
            self.table.spread(f'poly, 14 bits, -{level}: bytes', *bar, self.ratio('poly', '14', level))
        for level, bar in ((3, (5, 7)), (5, (4, 5))):
            self.table.spread(f'poly, 14 bits, -{level}: decode', *bar, self.speed('poly', '14', level), True)
        for level, bar in ((2, (None, None)), (5, (0.88, 0.84))):
            self.table.spread(f'terrain (clean), 14 bits, -{level}: bytes', *bar,
                              self.ratio('terrain', '14', level, only=['fg_reykjavik_tile_2598528_clean']))
        self.table.spread('motorBike, 14 bits, -5: bytes', 0.73, 0.70, self.ratio('tri', '14', 5, only=['motorBike']))
        for level in (2, 5, 9):
            self.table.spread(f'textured, 14 bits, -{level}: bytes', None, None, self.ratio('textured', '14', level))

    def memory(self):
        for key, bar in (('encode_peak_per_vertex', (100, 70)), ('decode_peak_per_vertex', (70, 55))):
            for bits in ('14', 'lossless'):
                rows = self.results.groups.get(('tri', bits), {}).get('stanford_dragon_vrip', {})
                peaks = {codec: row[key] for codec, row in rows.items() if codec.startswith('maille') and row.get(key)}
                if peaks:
                    worst = max(peaks, key=peaks.get)
                    text = ', '.join(f'{codec[7:]} {peak:.0f}' for codec, peak in peaks.items())
                    self.table.add(f'dragon, {bits}: {key[:6]} peak, B a vertex', *bar, [text, '', '', number(peaks[worst])],
                                   peaks[worst])

    def extra(self, path):
        found = {}
        for line in open(path):
            row = json.loads(line)
            found.setdefault((row['goal'], row['variant'], row['level']), {})[row['mesh']] = row['value']
        one = lambda *key, worst=max: report.Spread(found[key], {}, worst) if key in found else None
        for variant in ('floats', 'decimals'):
            for level in (2, 5, 9):
                self.table.spread(f'doubles that hold {variant}, lossless, -{level}: bytes / as f32', 1.01, 1,
                                  one('doubles', variant, level))
        for level in (2, 5):
            self.table.spread(f'above 400 k cells, 14 bits, -{level}: bytes / one part', 1.005, 1, one('parts', 'bytes', level))
            for way in ('encode', 'decode'):
                self.table.spread(f'above 400 k cells, 14 bits, -{level}: {way}, two threads', 1.7, None,
                                  one('parts', f'{way}, two threads', level, worst=min), True)
        self.facets(found)
        for level in (5, 9):
            textures = found.get(('textures', 'bytes / draco', level), {})
            for mesh, value in textures.items():
                self.table.add(f"texture coordinates, {mesh}, -{level}: / Draco's", 0.95, 0.85, [number(value)], value)
        for level, bar, stretch in ((2, 1.36, 1.25), (5, 1.00, 0.95)):
            self.table.spread(f'random, dragon, 12.7 bits, -{level}: bytes a triangle', bar, stretch,
                              one('random', 'bytes a triangle', level))

    def facets(self, found):
        for level in (5, 9):
            for variant in ('computed in double', 'computed in float'):
                for mesh, value in found.get(('normals', variant, level), {}).items():
                    self.table.add(f'facet normals {variant}, {mesh}, -{level}: bits a facet', 0.3, 0.05, [number(value)], value)
            bars = {'73416': (10, 8), '99865': (18, 15), 'counter': (22, 18), 'featuretype': (12, 9)}
            for mesh, value in found.get(('normals', 'as stored', level), {}).items():
                self.table.add(f'facet normals, {mesh}, -{level}: bits a facet', *bars.get(mesh, (None, None)),
                               [number(value)], value)

    def inversions(self, path):
        rows = {}
        for line in open(path):
            row = json.loads(line)
            if row['bytes']:
                rows.setdefault((row['folder'] + '/' + row['mesh'], row['setting']), {})[row['level']] = row['bytes']
        if not rows:
            return
        growth = {}
        for where, sizes in rows.items():
            for level in sizes:
                lower = [size for other, size in sizes.items() if other < level]
                if lower and sizes[level] > 1.001 * min(lower):
                    growth[(where, level)] = sizes[level] / min(lower)
        worst = max(growth, key=growth.get) if growth else None
        text = f'{growth[worst]:.3f} ({worst[0][0]}, {worst[0][1]}, -{worst[1]})' if worst else ''
        self.table.add(f'inversions above 0.1 %, of {len(rows)} files and settings', 0, 0, [str(len(growth)), '', '', text],
                       len(growth))

    def project(self):
        lines = words = 0
        for folder, _, files in os.walk(os.path.join(ROOT, 'src')):
            if '/src/io' in folder:
                continue
            for file in files:
                if re.search(r'\.(cpp|h)$', file) and not re.search(r'_test\.|testing\.', file):
                    lines += sum(1 for _ in open(os.path.join(folder, file)))
        words = len(open(os.path.join(ROOT, 'docs/format.md')).read().split())
        self.table.add('lines of src/ without io and tests', 47000, 42000, [str(lines)], lines)
        self.table.add('words of docs/format.md', 30000, 25000, [str(words)], words)
        codings = re.findall(r'constexpr uint32_t (?!last)\w+_coding = \d', open(os.path.join(ROOT, 'src/surface/patch_streams.cpp')).read())
        self.table.add('codings of TOPO and POSI', 2, 2, [str(len(codings))], len(codings))
        size = decoder_size()
        if size:
            self.table.add('decoder of charts, wasm + js, gzip: kB', 90, 60, [f'{size:.0f}'], size)


def decoder_size():
    """kB of the decoder of charts and its JavaScript, packed, if it was built (make web)."""
    import gzip
    wasm = os.path.join(ROOT, 'web/dist/maille-charts.wasm')
    if not os.path.exists(wasm):
        return None
    scripts = [os.path.join(ROOT, 'web/src', name + '.js') for name in ('maille', 'decoder', 'session', 'pool', 'bytes', 'worker')]
    read = lambda path: open(path, 'rb').read()
    return (len(gzip.compress(read(wasm), 9)) + len(gzip.compress(b''.join(map(read, scripts)), 9))) / 1000


def main():
    paths = [path for path in sys.argv[1:] if os.path.exists(path)]
    goals = Goals(report.Results(paths[0]))
    goals.draco_rows()
    goals.lossless_rows()
    goals.other_folders()
    if len(paths) > 1:
        goals.extra(paths[1])
    if len(paths) > 2:
        goals.inversions(paths[2])
    goals.memory()
    goals.project()
    print(goals.table)


if __name__ == '__main__':
    main()
