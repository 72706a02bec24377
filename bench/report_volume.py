"""Tables from the JSON lines of maille_bench_volume: report.py RESULTS --volume [--docs FILE]."""

import collections
import json
import math
import statistics

GENERIC = 'delta+shuffle+zstd -19'
XZ = 'xz -9'
BEST, DEFAULT = 'maille -9', 'maille -5'
ANY = ' --any-order'
HEXALAB = ('2014_', '2015_', '2016_', '2017_')  # its files carry the year of their paper


def geometric_mean(values):
    values = [v for v in values if v > 0]
    return math.exp(statistics.fmean(math.log(v) for v in values)) if values else math.nan


def table(header, rows):
    align = ['---'] + ['--:'] * (len(header) - 1)
    return '\n'.join('| ' + ' | '.join(line) + ' |' for line in [header, align] + rows) + '\n'


class Volumes:
    """Rows by precision, (folder, mesh), codec, in the order measured."""

    def __init__(self, path):
        self.meshes = {'f32': collections.OrderedDict(), 'as read': collections.OrderedDict()}
        self.codecs = []
        self.whole_coder = []
        for line in open(path):
            row = json.loads(line)
            if 'whole_coder' in row:
                self.whole_coder.append(row)
                continue
            if row['precision'] == 'f32' and row['round_trip'] != 'exact':
                continue  # listed with the round trips
            self.meshes[row['precision']].setdefault((row['folder'], row['mesh']), {})[row['codec']] = row
            if row['precision'] == 'f32' and row['codec'] not in self.codecs:
                self.codecs.append(row['codec'])

    def each(self, *folders):
        return [(key, rows) for key, rows in self.meshes['f32'].items() if not folders or key[0] in folders]


def bits(row, key):
    return 8 * row[key] / row['solids'] if row else math.nan


def generic(rows, key='bytes'):
    """The smallest that packs arrays: of the parts that make `key`."""
    found = [r for c, r in rows.items() if not c.startswith('maille') and r['whole'] and r['round_trip'] == 'exact']
    return min(found, key=lambda r: r[key], default=None)


def mesh_bytes(row):
    return row['connectivity_bytes'] + row['numbering_bytes'] + row['geometry_bytes']


def best_mesh(rows):
    found = [r for c, r in rows.items() if not c.startswith('maille') and r['whole'] and r['round_trip'] == 'exact']
    return min((mesh_bytes(r) for r in found), default=math.nan)


def whole_files(results):
    codecs = [c for c in results.codecs if any(r.get(c, {}).get('whole') for _, r in results.each())]
    lines = []
    for (folder, mesh), rows in results.each():
        first = next(iter(rows.values()))
        lines.append([f'{folder}/{mesh}', f'{first["solids"]:,}'] +
                     [f'{bits(rows[c], "bytes"):.2f}' if c in rows else '-' for c in codecs])
    return table(['file', 'cells'] + codecs, lines)


def parts(results):
    lines = []
    for (folder, mesh), rows in results.each():
        ours, any_order, peer = rows.get(BEST), rows.get(BEST + ANY), rows.get(GENERIC)
        if not (ours and any_order and peer):
            continue
        least, indices = generic(rows, 'connectivity_bytes'), rows.get('index prediction')
        lines.append([f'{folder}/{mesh}', f'{ours["solids"]:,}', f'{bits(ours, "connectivity_bytes"):.3f}',
                      f'{bits(ours, "numbering_bytes"):.3f}', f'{bits(any_order, "connectivity_bytes"):.3f}',
                      f'{bits(least, "connectivity_bytes"):.3f}',
                      f'{bits(indices, "connectivity_bytes"):.3f}', f'{bits(ours, "geometry_bytes"):.2f}',
                      f'{bits(any_order, "geometry_bytes"):.2f}', f'{bits(peer, "geometry_bytes"):.2f}'])
    return table(['file', 'cells', 'connectivity', '+ numbering', 'any order', 'best generic', 'index prediction', 'geometry', 'any order',
                  GENERIC], lines)


def fields(results):
    lines = []
    for (folder, mesh), rows in results.each():
        for name, reference in rows.get(GENERIC, {}).get('field_bytes', {}).items():
            cells = []
            for codec in (DEFAULT, BEST, BEST + ANY, 'fpzip', 'zfp reversible', 'VTKHDF shuffle+gzip'):
                size = rows.get(codec, {}).get('field_bytes', {}).get(name)
                cells.append(f'{size / reference:.2f}' if size is not None and reference else '-')
            lines.append([f'{folder}/{mesh}', name, f'{reference:,}'] + cells)
    return table(['file', 'array', f'bytes, {GENERIC}', DEFAULT, BEST, 'any order', 'fpzip', 'zfp', 'VTKHDF'], lines)


def speeds(results):
    lines = []
    for codec in results.codecs:
        rows = [r[codec] for _, r in results.each() if codec in r]
        sizes = [r[codec]['bytes'] / r[GENERIC]['bytes'] for _, r in results.each()
                 if codec in r and GENERIC in r and r[codec]['whole']]
        pipe = results.meshes['f32'].get(('generated', 'pipe 1M'), {}).get(codec)
        lines.append([codec, f'{geometric_mean(sizes):.3f}' if sizes else 'not all arrays',
                      f'{statistics.median(r["encode_mcps"] for r in rows):.2f}',
                      f'{statistics.median(r["decode_mcps"] for r in rows):.2f}',
                      f'{pipe["encode_mcps"]:.2f} / {pipe["decode_mcps"]:.2f}' if pipe else '-'])
    return table(['codec', f'whole file / {GENERIC}', 'encode M cells/s', 'decode M cells/s', 'pipe 1M'], lines)


def whole_coder(results):
    lines = [[row['whole_coder'], str(row['threads'])] + [f'{row[key]:.2f}' for key in ('encode_mcps', 'decode_mcps', 'encode_mcps_cpu', 'decode_mcps_cpu')] +
             [row['round_trip']] for row in results.whole_coder]
    return table(['pipe 1M from and to', 'threads', 'encode M cells/s', 'decode M cells/s', 'encode M cells/CPU-s', 'decode M cells/CPU-s', 'round trip'], lines)


def round_trips(results):
    lines = []
    for (folder, mesh), rows in results.meshes['as read'].items():
        first = next(iter(rows.values()))
        lines.append([f'{folder}/{mesh}', f'{first["points"]:,}', f'{first["cells"]:,}', str(len(first['field_bytes']))] +
                     [rows.get(c, {}).get('round_trip', '-') for c in (DEFAULT, DEFAULT + ANY)])
    return table(['file as read', 'points', 'cells', 'arrays', 'order kept', 'any order'], lines)


def aims(results):
    """The rows of the project's aims: text, value, bar, stretch."""
    def of(test, codec, key):
        return [bits(rows[codec], key) for (folder, mesh), rows in results.each() if test(folder, mesh) and codec in rows]
    def is_in(*folders):
        return lambda folder, mesh: folder in folders
    pipe = lambda folder, mesh: folder == 'generated'
    combustor = lambda folder, mesh: mesh.startswith('combustor')
    voxel = lambda folder, mesh: mesh.startswith('voxel')
    hexalab = lambda folder, mesh: mesh.startswith(HEXALAB)
    mean = lambda values: statistics.fmean(values) if values else math.nan
    found = []
    verdicts = [r['round_trip'] for rows in results.meshes['as read'].values() for c, r in rows.items()]
    yield 'round trips that are not exact', sum(v != 'exact' for v in verdicts), 0, 0
    for key, name, bars in (('connectivity_bytes', 'connectivity, order kept', ((pipe, 'pipe 1M', 0.03, 0.01), (combustor, 'combustor', 0.05, 0.03), (voxel, 'voxel bone', 2.4, 1.5), (hexalab, 'HexaLab-type', 7, 5))),
                            ('numbering_bytes', 'numbering', ((pipe, 'pipe 1M', 0.02, 0.01), (combustor, 'combustor', 0.02, 0.01), (hexalab, 'HexaLab-type', 7, 5))),
                            ('geometry_bytes', 'geometry f32', ((pipe, 'pipe 1M', 10, 8.5), (combustor, 'combustor', 30, 27), (hexalab, 'HexaLab-type', 48, 45), (voxel, 'voxel bone', 1.5, 0.8)))):
        for test, what, bar, stretch in bars:
            yield f'{name}: {what}, bits/cell', mean(of(test, BEST, key)), bar, stretch
    yield 'connectivity, any order: HexaLab-type, bits/cell', mean(of(hexalab, BEST + ANY, 'connectivity_bytes')), 1.5, 0.9
    ratios = [mesh_bytes(rows[BEST]) / mesh_bytes(rows[GENERIC]) for (folder, mesh), rows in results.each('hex', 'tet', 'mixed')
              if BEST in rows and GENERIC in rows and not combustor(folder, mesh) and not voxel(folder, mesh)]
    yield f'whole mesh / {GENERIC}, unstructured, order kept', geometric_mean(ratios), 0.65, 0.5
    ratios = [mesh_bytes(rows[BEST + ANY]) / mesh_bytes(rows[GENERIC]) for (folder, mesh), rows in results.each('hex', 'tet', 'mixed')
              if BEST + ANY in rows and GENERIC in rows and not combustor(folder, mesh) and not voxel(folder, mesh)]
    yield f'whole mesh / {GENERIC}, unstructured, any order', geometric_mean(ratios), 0.65, 0.5
    ratios = [mesh_bytes(rows[BEST + ANY]) / best_mesh(rows) for _, rows in results.each('tet') if BEST + ANY in rows]
    yield 'tets: whole mesh, any order / best generic', geometric_mean(ratios), 0.5, 0.4
    for precision in results.meshes:
        for codec in (DEFAULT, DEFAULT + ANY):
            ratios = [(rows[codec]['bytes'] / rows[XZ]['bytes'], mesh) for (_, mesh), rows in results.meshes[precision].items() if codec in rows and XZ in rows]
            if ratios:
                worst, mesh = max(ratios)
                yield f'{codec} / {XZ} of the raw arrays, {precision}: worst file, {mesh}', worst, 1, 0.7
            tets = [rows[codec]['bytes'] / rows[XZ]['bytes'] for (folder, _), rows in results.meshes[precision].items() if folder == 'tet' and codec in rows and XZ in rows]
            if tets and precision == 'f32':
                bar, stretch = (0.42, 0.35) if codec == DEFAULT else (0.24, 0.22)
                yield f'{codec} / {XZ} of the raw arrays, {precision}: tets', geometric_mean(tets), bar, stretch
    # Floats are what fpzip takes; in arrays of some hundred bytes headers decide.
    ratios = [rows[BEST]['field_bytes'][name] / size for _, rows in results.each() if BEST in rows and 'fpzip' in rows
              for name, size in rows[GENERIC]['field_bytes'].items()
              if size >= 1000 and name in rows['fpzip']['field_bytes']]
    yield f'fields of floats / {GENERIC}', geometric_mean(ratios), 0.85, 0.7


    for row in results.whole_coder:
        if row['threads'] == 2 and row['whole_coder'] == 'memory':
            for key, bar in (('encode', 5), ('decode', 6)):
                yield f'whole coder, structured, two threads, {key}: ns/hexahedron', 1000 / row[key + '_mcps'], 1000 / bar, 1000 / 8.3


def aims_table(results):
    lines = []
    for text, value, bar, stretch in aims(results):
        verdict = 'stretch' if value <= stretch else 'met' if value <= bar else 'missed'
        lines.append([text, f'{value:.3f}' if isinstance(value, float) else str(value), f'{bar:g}', f'{stretch:g}', verdict])
    return table(['aim', 'reached', 'bar', 'stretch', ''], lines)


def sections(results):
    yield '### Aims\n\n' + f'`{BEST}`, order kept where nothing else is said; means over files, of ratios geometric.\n\n' + aims_table(results)
    yield '### Size and speed\n\nGeometric means of sizes, medians of speeds.\n\n' + speeds(results)
    if results.whole_coder:
        yield '### Whole coder, wall time\n\nEffort 5, order kept, the best of some rounds; only of an idle machine.\n\n' + whole_coder(results)


def sections_by_file(results):
    """The long tables, for a page of their own."""
    yield '### Connectivity, numbering and geometry, bits per solid cell\n\n' + parts(results)
    yield '### Whole files, bits per solid cell\n\n' + whole_files(results)
    yield '### Arrays, bytes against ' + GENERIC + '\n\n' + fields(results)
    yield '### Round trip of the files as they are, all arrays\n\n' + round_trips(results)
