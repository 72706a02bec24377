#!/usr/bin/python3
"""Tables and the plot from the JSON lines of maille_bench.

report.py RESULTS.jsonl               prints the summary and the bars of the project
report.py RESULTS.jsonl --docs FILE   also writes the tables into FILE between its markers, those of single meshes into
                                      the page beside it whose name ends in -by-mesh
report.py RESULTS.jsonl --plot FILE   also draws size against decode speed (PNG)
report.py RESULTS.jsonl --volume      the same for the results of maille_bench_volume, between its own markers
"""

import argparse
import collections
import json
import math
import re
import statistics

import report_volume

YARDSTICK = {'lossless': 'meshopt + zstd -19'}  # every other precision: Draco's best
DRACO = 'draco -cl 10'
PLOT_BITS = '14'
BESIDE_BITS = ('12',)  # says what 14 bits say: its summary is on the page of single meshes


def yardstick(bits):
    return YARDSTICK.get(bits, DRACO)


def geometric_mean(values):
    return math.exp(statistics.fmean(math.log(v) for v in values)) if values else math.nan


class Results:
    """Rows by (folder, bits), then mesh, then codec, in the order measured."""

    def __init__(self, path):
        self.groups = collections.OrderedDict()
        self.codecs = []
        for line in open(path):
            row = json.loads(line)
            group = self.groups.setdefault((row['folder'], row['bits']), collections.OrderedDict())
            group.setdefault(row['mesh'], {})[row['codec']] = row
            if row['codec'] not in self.codecs:
                self.codecs.append(row['codec'])

    def ratios(self, folder, bits, codec, key, reference):
        """This codec's figure over the reference's, for each mesh that has both."""
        found = {}
        for mesh, rows in self.groups.get((folder, bits), {}).items():
            a, b = rows.get(codec, {}), rows.get(reference, {})
            if a.get(key) and b.get(key):
                found[mesh] = a[key] / b[key]
        return found

    def noise(self, folder, bits):
        group = self.groups.get((folder, bits), {})
        return {mesh: rows[yardstick(bits)]['bits_per_vertex'] for mesh, rows in group.items()
                if 'bits_per_vertex' in rows.get(yardstick(bits), {})}

    def spread(self, folder, bits, codec, key, reference, worst=max, only=None):
        found = self.ratios(folder, bits, codec, key, reference)
        found = {mesh: value for mesh, value in found.items() if only is None or mesh in only}
        return Spread(found, self.noise(folder, bits), worst) if found else None

    def figures(self, folder, bits, codec, key):
        rows = [rows.get(codec, {}) for rows in self.groups.get((folder, bits), {}).values()]
        return [row[key] for row in rows if row.get(key) is not None]


class Spread:
    """Ratios of some meshes: geometric mean, median, geometric mean of the noisy half, worst. Noise: bits a vertex that
    the yardstick takes; a mesh of the noisy half has more than the median."""

    def __init__(self, ratios, noise, worst=max):
        self.ratios = ratios
        self.mean = geometric_mean(list(ratios.values()))
        self.median = statistics.median(ratios.values())
        self.worst = worst(ratios, key=ratios.get)
        by_noise = sorted((mesh for mesh in ratios if mesh in noise), key=noise.get, reverse=True)
        self.noisy = geometric_mean([ratios[mesh] for mesh in by_noise[:(len(by_noise) + 1) // 2]])


def table(header, rows):
    align = ['---'] + ['--:'] * (len(header) - 1)
    return '\n'.join('| ' + ' | '.join(line) + ' |' for line in [header, align] + rows) + '\n'


def summary_rows(results, folder, bits):
    reference = yardstick(bits)
    for codec in results.codecs:
        sizes = results.spread(folder, bits, codec, 'bytes', reference)
        if not sizes:
            continue
        median = lambda key: statistics.median(results.figures(folder, bits, codec, key))
        speed = results.ratios(folder, bits, codec, 'decode_mtps', reference)
        yield [codec, str(len(sizes.ratios)), f'{sizes.mean:.3f}', f'{sizes.median:.3f}', f'{sizes.noisy:.3f}',
               f'{sizes.ratios[sizes.worst]:.2f} ({sizes.worst})',
               f'{median("encode_mtps"):.2f}', f'{median("decode_mtps"):.1f}', f'{statistics.median(speed.values()):.2f}',
               f'{median("encode_peak_per_vertex"):.0f}', f'{median("decode_peak_per_vertex"):.0f}']


def summary(results, wanted=lambda bits: True):
    for folder, bits in results.groups:
        if folder == 'special' or not wanted(bits):
            continue
        rows = list(summary_rows(results, folder, bits))
        if not rows:
            continue
        reference = yardstick(bits)
        title = 'lossless float32' if bits == 'lossless' else f'{bits} bits'
        yield f'### {folder}, {title}\n\n' + table(
            ['codec', 'meshes', f'size / {reference}', 'median', 'noisy half', 'worst', 'encode M tri/s', 'decode M tri/s',
             f'decode speed / {reference}', 'encode peak B/vertex', 'decode peak B/vertex'], rows)


def per_mesh(results, folder, bits):
    group = results.groups.get((folder, bits), {})
    codecs = [codec for codec in results.codecs if any('bytes' in rows.get(codec, {}) for rows in group.values())]
    lines = []
    for mesh, rows in group.items():
        first = next(iter(rows.values()))
        cells = [f'{rows[c]["bits_per_vertex"]:.2f}' if 'bytes' in rows.get(c, {}) else '-' for c in codecs]
        lines.append([mesh, str(first['vertices']), str(first['faces'])] + cells)
    return table(['mesh', 'vertices', 'faces'] + codecs, lines) if lines else ''


def connectivity(results, folder, bits):
    """Bits per vertex of connectivity + geometry where both are known."""
    group = results.groups.get((folder, bits), {})
    codecs = [c for c in results.codecs if any('geometry_bytes' in rows.get(c, {}) for rows in group.values())]
    lines = []
    for mesh, rows in group.items():
        cells = []
        for codec in codecs:
            row = rows.get(codec, {})
            split = [f'{8 * row[k] / row["vertices"]:.2f}' for k in ('connectivity_bytes', 'geometry_bytes') if k in row]
            cells.append(' + '.join(split) or '-')
        lines.append([mesh] + cells)
    return table(['mesh'] + codecs, lines) if lines else ''


def special(results):
    """What turning every second face around costs: size over that of the same mesh as it was."""
    lines = []
    for (folder, bits), group in results.groups.items():
        for mesh, rows in group.items() if folder == 'special' else ():
            plain = next((g[mesh.split(',')[0]] for (f, b), g in results.groups.items()
                          if f != 'special' and b == bits and mesh.split(',')[0] in g), {})
            for codec, row in rows.items():
                before = plain.get(codec, {}).get('bytes')
                if 'bytes' in row and before:
                    lines.append([mesh, bits, codec, f'{row["bytes"] / before:.2f}', row['round_trip']])
    return table(['mesh', 'bits', 'codec', 'size / unflipped', 'round trip'], lines) if lines else ''


def losses(results):
    """Codecs whose output is not the input, with how often and an example."""
    found = collections.OrderedDict()
    for group in results.groups.values():
        for mesh, rows in group.items():
            for codec, row in rows.items():
                verdict = row.get('failed') or row['round_trip']
                if verdict != 'exact':
                    kind = re.sub(r'\d+ ', '', verdict)
                    found.setdefault((codec, kind), []).append(f'{mesh}: {verdict}')
    lines = [[codec, kind, str(len(where)), where[0]] for (codec, kind), where in sorted(found.items())]
    return table(['codec', 'what came back', 'rows', 'for example'], lines) if lines else 'Nothing.\n'


def bars(results):
    """The figures that the default level must reach."""
    ours = next((c for c in results.codecs if c.startswith('maille -5')), None)
    def bar(text, value, passes):
        print(f'{"ok  " if passes else "MISS"}  {text}: {value}')
    for bits in ('12', '14'):
        sizes = results.ratios('tri', bits, ours, 'bytes', DRACO)
        if sizes:
            mean, worst = geometric_mean(list(sizes.values())), max(sizes, key=sizes.get)
            bar(f'tri/ at {bits} bits, size / {DRACO} <= 1.00', f'{mean:.3f} over {len(sizes)}', mean <= 1)
            bar(f'tri/ at {bits} bits, none above 1.10', f'{sizes[worst]:.3f} ({worst})', sizes[worst] <= 1.1)
            if 'motorBike' in sizes:
                bar(f'motorBike at {bits} bits, size / {DRACO} <= 1', f'{sizes["motorBike"]:.3f}', sizes['motorBike'] <= 1)
            speed = statistics.median(results.ratios('tri', bits, ours, 'decode_mtps', DRACO).values())
            bar(f'decode speed at {bits} bits / {DRACO} >= 1.5', f'{speed:.2f}', speed >= 1.5)
            large = [rows[ours] for rows in results.groups[('tri', bits)].values()
                     if 'bytes' in rows.get(ours, {}) and rows[ours]['vertices'] >= 100_000]
            for key, limit in (('encode_peak_per_vertex', 120), ('decode_peak_per_vertex', 80)):
                if not large:
                    continue
                worst_peak = max(row[key] for row in large)
                bar(f'{key} at {bits} bits, from 100,000 vertices, <= {limit}', f'{worst_peak:.0f}', worst_peak <= limit)
    sizes = results.ratios('tri', 'lossless', ours, 'bytes', YARDSTICK['lossless'])
    if sizes:
        mean = geometric_mean(list(sizes.values()))
        bar(f'tri/ lossless, size / {YARDSTICK["lossless"]} <= 0.85', f'{mean:.3f} over {len(sizes)}', mean <= 0.85)
    for (folder, bits), group in results.groups.items():
        for mesh, rows in group.items():
            row = rows.get(ours, {})
            if row.get('round_trip') != 'exact':
                bar(f'{folder}/{mesh}, {bits}: round trip', row.get('failed') or row.get('round_trip'), False)
            plain = results.groups.get(('tri', bits), {}).get(mesh.split(',')[0], {}).get(ours, {})
            if folder == 'special' and row.get('bytes') and plain.get('bytes'):
                growth = row['bytes'] / plain['bytes']
                bar(f'{mesh}, {bits}: growth <= 1.3', f'{growth:.2f}', growth <= 1.3)


def write_docs(results, path):
    write_between(path, 'tables', list(summary(results, lambda bits: bits not in BESIDE_BITS)))
    write_between(by_mesh(path), 'tables', list(sections_by_mesh(results)))


def by_mesh(path):
    """The page of the long tables beside that of the summaries: who reads the summaries is not to scroll past them."""
    return path.removesuffix('.md') + '-by-mesh.md'


def sections_by_mesh(results):
    yield from summary(results, lambda bits: bits in BESIDE_BITS)
    folders = list(collections.OrderedDict.fromkeys(f for f, _ in results.groups if f != 'special'))
    for folder in folders:
        for bits in [b for f, b in results.groups if f == folder]:
            title = 'lossless float32' if bits == 'lossless' else f'{bits} bits'
            yield f'### Bits per vertex, {folder}, {title}\n\n' + per_mesh(results, folder, bits)
    split = connectivity(results, 'tri', PLOT_BITS)
    if split:
        yield f'### Connectivity + geometry, bits per vertex, tri, {PLOT_BITS} bits\n\n' + split
    turned = special(results)
    if turned:
        yield '### Every second face turned around\n\n' + turned
    yield '### What does not come back\n\n' + losses(results)


def write_between(path, marker, parts):
    text = open(path).read()
    begin, end = f'<!-- {marker}: begin -->\n', f'<!-- {marker}: end -->'
    head, rest = text.split(begin)
    open(path, 'w').write(head + begin + '\n' + '\n'.join(parts) + '\n' + end + rest.split(end)[1])


def plot(results, path):
    import matplotlib
    matplotlib.use('Agg')
    import matplotlib.pyplot as plt
    from matplotlib.ticker import FixedLocator, FormatStrFormatter, NullLocator

    colours = {'maille': '#d1495b', 'draco': '#30638e', 'meshopt': '#00798c', 'openctm': '#8d96a3', 'xz': '#b8b8b8'}
    figure, axes = plt.subplots(figsize=(7.2, 4.6), dpi=160)
    for codec in results.codecs:
        sizes = list(results.ratios('tri', PLOT_BITS, codec, 'bytes', DRACO).values())
        if not sizes:
            continue
        speeds = results.figures('tri', PLOT_BITS, codec, 'decode_mtps')
        x, y = statistics.median(speeds), geometric_mean(sizes)
        colour = next((c for name, c in colours.items() if codec.startswith(name)), 'black')
        if len(sizes) > 3:  # the middle half of the meshes, both ways
            low, _, high = statistics.quantiles(sizes, n=4)
            left, _, right = statistics.quantiles(speeds, n=4)
            axes.plot([x, x], [low, high], color=colour, alpha=0.35, linewidth=2)
            axes.plot([left, right], [y, y], color=colour, alpha=0.35, linewidth=2)
        axes.scatter([x], [y], s=60, color=colour, zorder=3)
        below = codec == DRACO or codec.startswith('maille')  # keeps the labels of neighbours apart
        axes.annotate(codec, (x, y), textcoords='offset points', xytext=(0, -16 if below else 9), color=colour,
                      ha='center', fontweight='bold' if codec.startswith('maille') else None)
    axes.axhline(1, color='#30638e', linewidth=0.6, linestyle=':')
    axes.set_xscale('log')
    axes.set_yscale('log')
    for axis in (axes.xaxis, axes.yaxis):
        axis.set_major_locator(FixedLocator([0.5, 0.7, 1, 1.5, 2, 3, 5, 7, 10, 20, 50, 100, 200]))
        axis.set_minor_locator(NullLocator())
        axis.set_major_formatter(FormatStrFormatter('%g'))
    axes.set_xlabel('decode speed, million triangles per second, one thread (faster: right)')
    axes.set_ylabel(f'size / {DRACO} (smaller: down)')
    count = len(results.groups.get(('tri', PLOT_BITS), {}))
    axes.set_title(f'{count} triangle meshes, {PLOT_BITS} bits: geometric mean of size, median of speed', fontsize=10)
    axes.margins(0.18)
    axes.grid(True, which='major', alpha=0.2)
    figure.tight_layout()
    figure.savefig(path, metadata={'Software': None})


def main():
    arguments = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    arguments.add_argument('results')
    arguments.add_argument('--docs')
    arguments.add_argument('--plot')
    arguments.add_argument('--volume', action='store_true')
    options = arguments.parse_args()
    if options.volume:
        volumes = report_volume.Volumes(options.results)
        parts, of_files = list(report_volume.sections(volumes)), list(report_volume.sections_by_file(volumes))
        print('\n' + '\n'.join(parts + of_files))
        if options.docs:
            write_between(options.docs, 'volume tables', parts)
            write_between(by_mesh(options.docs), 'volume tables', of_files)
        return
    results = Results(options.results)
    print('\n' + '\n'.join(summary(results)))
    bars(results)
    if options.docs:
        write_docs(results, options.docs)
    if options.plot:
        plot(results, options.plot)


if __name__ == '__main__':
    main()
