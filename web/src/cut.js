// Which charts of a file of mode random are shown, and which are to be fetched: by what a view needs and what is here.
// What is shown is at every moment one cut through the hierarchy: a group of charts stands in the place of those it refines
// only when all of it that is in sight is here, and all those it refines might be shown. So there is never a crack, and
// where something is missing only this place is less fine.

const PAGE = 256;  // groups of one page of the index

/** Charts this far outside the view are fetched too, after those within: a share of their distance from the eye. */
const MARGIN = 0.25;

function keyOf({group, chart}) {
  return `${group}/${chart}`;
}

/** The groups of a file, as far as they were read; each chart has its `key`. */
export class Hierarchy {
  /** @param {MeshFile} file of mode random */
  constructor(file) {
    Object.assign(this, {file, groups: [], asked: new Set(), error: null});
  }
  /** A group, or null while its page of the index is on its way. */
  group(number) {
    const group = this.groups[number];
    if (!group) this.#ask(Math.floor(number / PAGE));
    return group ?? null;
  }
  #ask(page) {
    if (this.asked.has(page)) return;
    this.asked.add(page);
    this.file.groups(page * PAGE, PAGE).then(({groups}) => {
      groups.forEach((group, i) => {
        // Made once: every frame looks for all that is in sight.
        for (const chart of group.charts) chart.key = keyOf(chart);
        this.groups[page * PAGE + i] = group;
      });
    }, error => { this.error = error; });
  }
}

/**
 * @param {Hierarchy} hierarchy
 * @param view {eye, pixelsPerRadian, pixels, planes, level}: planes {normal, offset} of what is in sight; level: as fine as this
 *   one everywhere, whatever is seen of it
 * @param isHere(chart): can it be shown now?
 * @returns {shown, needed, wanted, waits, error}: charts to be shown; all that this cut rests on; charts that a finer cut
 *   lacks, those that are seen to be worst first, each with what is seen without it: `error`, `inSight`; is a page of the index
 *   on its way? The error of what is shown.
 */
export function cutOf(hierarchy, view, isHere) {
  const cut = {shown: [], needed: [], wanted: [], waits: false, error: 0};
  const root = hierarchy.group(0);
  if (!root) return {...cut, waits: true};
  takeGroup(root, Infinity, view, isHere, cut);
  // All charts that a group refines are of one level, so groups can be decided level by level.
  for (let groups = [root]; groups.length > 0;) {
    const finer = new Map();  // by number: charts that it refines, of groups that are refined
    for (const group of groups) {
      for (const chart of group.charts) {
        if (chart.refinedBy < 0) show(chart, view, isHere, cut);
        else if (finer.has(chart.refinedBy)) finer.get(chart.refinedBy).push(chart);
        else finer.set(chart.refinedBy, [chart]);
      }
    }
    groups = [];
    for (const [number, replaced] of finer) {
      const group = refinement(hierarchy, number, replaced, view, isHere, cut);
      if (group) groups.push(group);
      else for (const chart of replaced) show(chart, view, isHere, cut);
    }
  }
  cut.wanted.sort((a, b) => b.inSight - a.inSight || b.error - a.error);
  return cut;
}

/** The group, where it is to be shown in the place of `replaced`; else null, and what is missing for it is in cut.wanted. */
function refinement(hierarchy, number, replaced, view, isHere, cut) {
  if (!replaced.some(chart => isInSight(chart.sphere, view, MARGIN))) return null;
  const group = hierarchy.group(number);
  if (!group) {
    cut.waits = true;
    return null;
  }
  const error = seenError(group, view);
  if (error <= view.pixels || !isInSight(group.sphere, view, MARGIN)) {
    if (isInSight(group.sphere, view, 0)) cut.error = Math.max(cut.error, error);
    return null;
  }
  if (replaced.length < group.replaces) return null;
  const complete = takeGroup(group, error, view, isHere, cut);
  if (!complete) cut.error = Math.max(cut.error, error);
  return complete ? group : null;
}

function takeGroup(group, error, view, isHere, cut) {
  let complete = true;
  for (const chart of group.charts) {
    const inSight = isInSight(chart.sphere, view, 0);
    if (!inSight && !isInSight(chart.sphere, view, MARGIN)) continue;
    if (isHere(chart)) {
      cut.needed.push(chart);
      continue;
    }
    // On the chart: there may be thousands in every frame.
    chart.error = error;
    chart.inSight = inSight;
    cut.wanted.push(chart);
    if (inSight) complete = false;
  }
  return complete;
}

function show(chart, view, isHere, cut) {
  if (isInSight(chart.sphere, view, 0) && isHere(chart)) cut.shown.push(chart);
}

// These run for all charts in every frame, and make no objects: no hypot(), no closures.

function distanceTo({centre, radius}, {eye}) {
  const x = centre[0] - eye[0], y = centre[1] - eye[1], z = centre[2] - eye[2];
  return Math.sqrt(x * x + y * y + z * z) - radius;
}

/** Of what a group replaces, in pixels: an error is seen from the nearest point of its sphere. */
function seenError(group, view) {
  if (view.level != null) return group.level >= view.level ? Infinity : 0;
  const distance = distanceTo(group.sphere, view);
  return distance > 0 ? group.viewError / distance * view.pixelsPerRadian : Infinity;
}

function isInSight(sphere, view, margin) {
  const reach = sphere.radius + margin * Math.max(0, distanceTo(sphere, view));
  const x = sphere.centre[0], y = sphere.centre[1], z = sphere.centre[2];
  for (const {normal, offset} of view.planes) {
    if (!(normal[0] * x + normal[1] * y + normal[2] * z + offset >= -reach)) return false;
  }
  return true;
}
