// Does a camera rest? Controls that come to rest slowly move it by the last bits for seconds.

/** Of the matrix, and of a mesh's radius for its place: less is not seen. */
const UNSEEN = 1e-5;

export class Rest {
  /** @param after milliseconds without movement */
  constructor(after) {
    Object.assign(this, {after, seen: null, movedAt: performance.now()});
  }
  /** @param {number[]} elements of the camera's matrix of the world; @returns has it moved since the last time? */
  look(elements, radius) {
    const reach = i => UNSEEN * (i < 12 ? 1 : radius);
    if (this.seen && elements.every((x, i) => Math.abs(x - this.seen[i]) <= reach(i))) return false;
    this.seen = [...elements];
    this.movedAt = performance.now();
    return true;
  }
  get resting() {
    return performance.now() - this.movedAt > this.after;
  }
}
