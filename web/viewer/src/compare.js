// Two meshes side by side, seen by one camera: another file, or another level of the same one.

import {openModel} from './models.js';

const find = id => document.getElementById(id);

export class Compare {
  /** @param viewer see main.js */
  constructor(viewer) {
    Object.assign(this, {viewer, model: null});
  }

  /**
   * @param input an address, File or ArrayBuffer
   * @param {number | null} level of a file of mode random: all of it as this one
   * @param {string} name in the page
   */
  async open(input, name, level = null) {
    this.opening?.abort();
    const {signal} = this.opening = new AbortController(), model = await openModel(input, {}, signal);
    if (signal.aborted) return model.dispose();
    this.close();
    this.model = model;
    this.viewer.done = false;
    if (model.refines) model.object.level = level;
    const {stage, colouring} = this.viewer, {scene} = stage;
    scene.add(model.object);
    for (const mesh of model.meshes) colouring.apply(mesh);
    model.object.addEventListener('chart', ({mesh}) => colouring.apply(mesh));
    model.onChange = () => stage.touch();
    model.setCuts?.(this.viewer.cuts.planes);
    const show = first => () => {
      this.viewer.model.object.visible = first;
      model.object.visible = !first;
    };
    const all = () => { this.viewer.model.object.visible = model.object.visible = true; };
    stage.setPanes([{begin: show(true), end: all}, {begin: show(false), end: all}]);
    find('pane-names').hidden = false;
    find('pane-names').children[1].textContent = name;
    document.body.classList.add('is-beside');
    this.viewer.fit();
  }
  close() {
    if (!this.model) return;
    this.model.dispose();
    this.model = null;
    this.viewer.stage.setPanes([{}]);
    find('pane-names').hidden = true;
    document.body.classList.remove('is-beside');
    this.viewer.fit();
  }

  /** Once a frame. @returns whether all is there */
  update(stage) {
    const {model} = this;
    if (!model) return true;
    stage.lookIn(1);
    const done = model.update(stage.camera, stage.renderer);
    stage.lookIn(0);
    const {shown} = model.object;
    if (model.refines && shown !== this.lastShown) {
      this.lastShown = shown;
      stage.touch();
    }
    return done;
  }
}
