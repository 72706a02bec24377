// A real browser for the tests: Debian's Chromium, which draws with the processor.
import {spawn} from 'node:child_process';
import {existsSync, mkdirSync} from 'node:fs';
import {createRequire} from 'node:module';
import path from 'node:path';
import {fileURLToPath} from 'node:url';

export const root = fileURLToPath(new URL('../../..', import.meta.url));
export const build = process.env.MAILLE_BUILD ?? path.join(root, 'build/release');
export const maille = path.join(build, 'tool/maille');
const screenshots = path.join(root, 'build/web/screenshots');

export const chromium = [process.env.CHROMIUM, '/usr/bin/chromium', '/usr/bin/google-chrome'].find(file => file && existsSync(file));

/** Nothing here is timed: a machine may be slow. */
export const PATIENCE = 180_000;

export async function launch() {
  // playwright-core is one of what the viewer is developed with.
  const {chromium: engine} = createRequire(new URL('../../viewer/package.json', import.meta.url))('playwright-core');
  return engine.launch({
    executablePath: chromium, timeout: PATIENCE,
    args: ['--no-sandbox', '--use-gl=angle', '--use-angle=swiftshader', '--enable-unsafe-swiftshader', '--ignore-gpu-blocklist',
      '--disable-background-networking', '--disable-component-update', '--no-first-run', '--disable-sync', '--disable-extensions'],
  });
}

/** A page, with what it complained of in `page.complaints`. */
export async function newPage(browser, {width = 960, height = 640, ...more} = {}) {
  const page = await browser.newPage({viewport: {width, height}, colorScheme: 'dark', ...more});
  page.setDefaultTimeout(PATIENCE);
  page.complaints = [];
  page.on('console', message => {
    if (['error', 'warning'].includes(message.type()) && !isOfSwiftshader(message.text())) page.complaints.push(message.text());
  });
  page.on('pageerror', error => page.complaints.push(String(error.stack ?? error)));
  return page;
}
/** Reading pixels back is slow; it says so. */
function isOfSwiftshader(text) {
  return /GPU stall due to ReadPixels|Automatic fallback to software WebGL/.test(text);
}

export async function screenshot(page, name) {
  mkdirSync(screenshots, {recursive: true});
  await page.screenshot({path: path.join(screenshots, `${name}.png`), timeout: PATIENCE});
}

/** `maille serve FOLDER` or `maille view ...`; {address, stop()}. */
export function serve(...words) {
  const child = spawn(maille, words, {stdio: ['ignore', 'pipe', 'pipe']});
  return new Promise((resolve, reject) => {
    let text = '', said = '';
    child.stderr.on('data', data => { said += data; });
    child.stdout.on('data', data => {
      text += data;
      if (text.endsWith('\n')) resolve({address: text.trim(), stop: () => new Promise(end => { child.once('exit', end); child.kill(); })});
    });
    child.once('exit', code => reject(new Error(`maille ${words.join(' ')} ended with ${code}: ${said}`)));
  });
}

/** Waits until the viewer shows its model as fine as it is to be. */
export async function settle(page) {
  await page.waitForFunction(() => window.viewer?.model && window.viewer.done, null, {timeout: PATIENCE, polling: 100});
}

/** Waits until what was changed last is in the picture, drawn as it is when the camera rests. */
export async function drawn(page) {
  const isDrawn = () => {
    const {stage} = window.viewer ?? document.querySelector('maille-viewer');
    return stage.drawn > 0 && !stage.changed && stage.resting && !stage.rough;
  };
  await page.waitForFunction(isDrawn, null, {timeout: PATIENCE, polling: 100});
}
