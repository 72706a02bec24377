// Steps of time: a slider, and playing them one after the other. The newest choice wins.

import {tell} from './page.js';
import {number, sentence} from './text.js';

const find = id => document.getElementById(id);
/** How long a step is to be seen when steps are played, in milliseconds. */
const SEEN = 300;

export class Timeline {
  /** @param onStep is called when the values of another step are in the model */
  constructor(onStep) {
    Object.assign(this, {onStep, model: null, steps: [], playing: false});
    find('step').oninput = () => {
      this.play(false);
      this.choose(find('step').valueAsNumber);
    };
    find('play').onclick = () => this.play(!this.playing);
  }

  /** Of a model that is shown from now on: as soon as its file has told them. */
  async offer(model) {
    this.loading?.abort();
    this.model = model;
    this.#list([]);
    try {
      const steps = await model.file.readSteps();
      if (this.model === model) this.#list(steps);
    } catch (error) {
      if (this.model === model) tell(`${sentence(error)} Only the values that the mesh came with are shown.`);
    }
  }
  #list(steps) {
    this.steps = steps;
    this.play(false);
    find('timeline').hidden = steps.length === 0;
    document.body.classList.toggle('has-steps', steps.length > 0);
    find('step').max = steps.length;
    this.#tell(0);
  }

  /** Shows a step, 0 is what the mesh came with; resolves to whether it is shown, and not another that was chosen since. */
  async choose(step) {
    if (this.steps.length === 0) return false;
    this.loading?.abort();
    const {model} = this, loading = this.loading = new AbortController();
    this.#tell(step);
    find('timeline').setAttribute('aria-busy', true);
    try {
      await model.showStep(step, loading.signal);
      this.onStep();
      return true;
    } catch (error) {
      if (loading.signal.aborted) return false;
      tell(sentence(error), true, {text: 'Try again', run: () => this.choose(step)}, 'step');
      this.#tell(model.step);
      return false;
    } finally {
      if (this.loading === loading) find('timeline').setAttribute('aria-busy', false);
    }
  }
  /** Pauses at the next step or the one before, around the ends. */
  move(by) {
    this.play(false);
    return this.choose(this.#neighbour(by));
  }
  #neighbour(by) {
    const count = this.steps.length + 1;
    return (find('step').valueAsNumber + by + count) % count;
  }

  async play(on) {
    this.playing = on && this.steps.length > 0;
    find('play').setAttribute('aria-pressed', this.playing);
    find('play').title = `${this.playing ? 'Pause' : 'Play'} (Space)`;
    if (!this.playing) return;
    const run = this.run = Symbol('run'), goesOn = () => this.playing && this.run === run;
    while (goesOn()) {
      const seen = new Promise(resolve => setTimeout(resolve, SEEN)), shown = await this.choose(this.#neighbour(1));
      if (!shown && goesOn()) return this.play(false);
      await seen;
    }
  }

  #tell(step) {
    find('step').value = step;
    const text = step === 0 ? 'the mesh itself' : `time ${number(this.steps[step - 1].time)}`;
    find('step').setAttribute('aria-valuetext', text);
    find('step-time').textContent = text;
    find('step-number').textContent = `${step} of ${this.steps.length}`;
  }
}
