// Common part of the page tests: the browser, opened pages, measurements of their pictures, the list of tests.
//   node browser_test.mjs COUNTERPOINT CHROMIUM FOLDER
import assert from 'node:assert/strict';
import {execFileSync} from 'node:child_process';
import {readFileSync, writeFileSync} from 'node:fs';
import {dirname, join} from 'node:path';
import {fileURLToPath} from 'node:url';
import {Browser} from './browser.mjs';

export const [program, chromium, folder] = process.argv.slice(2);
export const root = join(dirname(fileURLToPath(import.meta.url)), '../..');
export const scenes = join(root, 'data/scenes');
export const at = (name) => join(folder, name);
export const run = (...args) => execFileSync(program, args, {cwd: root, encoding: 'utf8', stdio: ['ignore', 'pipe', 'pipe']});

// A ball in flight and a ball at rest on the ground.
writeFileSync(at('balls.yaml'), `name: balls
ground: {}
models:
  - {name: thrown, sphere: 0.1, mass: 1, position: [0, -1, 1.5], velocity: {linear: [0, 2, 1], angular: [0, 0, 0]}}
  - {name: lying, sphere: 0.1, mass: 2, position: [0.6, 0, 0.1]}
`);
run('simulate', at('balls.yaml'), '--duration', '0.6', '--output', at('balls.csv'));
run('view', at('balls.yaml'), at('balls.csv'), '--forces', '--output', at('balls.html'));
// A name with everything that could end a string, a tag or a script.
export const evil = '</script><script>window.injected=1</script><img src=x onerror="window.injected=1">&\'`';
writeFileSync(at('evil.yaml'), `name: ${JSON.stringify(evil)}
ground: {}
models:
  - {name: ${JSON.stringify(evil)}, sphere: 0.1, mass: 1, position: [0, 0, 1]}
`);

export const browser = new Browser(chromium);
export const tests = [];
export const test = (name, body) => tests.push({name, body});

/// Opens a page and waits for its first frame; expects no console output and no requests.
export async function open(page, fragment = '', options = {}) {
  const view = await browser.open(`file://${page}${fragment}`, options);
  await until(view, 'window.counterpointReplay?.rendered > 0');
  assert.deepEqual(view.console, [], page);
  assert.equal(view.requests.filter((url) => !/^(file|data|blob):/.test(url)).length, 0, view.requests.join());
  assert.equal(view.requests.filter((url) => url.startsWith('file:')).length, 1, 'the page itself only');
  return view;
}

/// Opens the page of a report; expects no console output and no requests.
export async function openReport(page) {
  const view = await browser.open(`file://${page}`);
  await until(view, 'document.readyState === "complete"');
  assert.deepEqual(view.console, [], page);
  assert.deepEqual(view.requests.filter((url) => !url.startsWith('data:')), [`file://${page}`], 'the page itself only');
  return view;
}

export async function until(view, condition) {
  for (let i = 0; i < 200; ++i) {
    if (await view.evaluate(condition)) return;
    await new Promise((resolve) => setTimeout(resolve, 50));
  }
  throw new Error(`never came true: ${condition}; console: ${view.console.join('; ')}`);
}

/// Runs in the page: bounding box of the pixels that change with `hide`, and their mean colour before.
export const kDifference = `(hide, show) => {
  const view = counterpointReplay, source = view.canvas;
  const read = () => {
    view.renderNow();
    const canvas = document.createElement('canvas');
    canvas.width = source.clientWidth;
    canvas.height = source.clientHeight;
    const context = canvas.getContext('2d');
    context.drawImage(source, 0, 0, canvas.width, canvas.height);
    return context.getImageData(0, 0, canvas.width, canvas.height);
  };
  const before = read();
  hide(view);
  const after = read();
  show(view);
  const box = {pixels: 0, x0: 1e9, x1: -1, y0: 1e9, y1: -1, color: [0, 0, 0]};
  for (let i = 0; i < before.data.length; i += 4) {
    let off = 0;
    for (let c = 0; c < 3; ++c) off += Math.abs(before.data[i + c] - after.data[i + c]);
    if (off < 40) continue;
    const x = i / 4 % before.width, y = Math.floor(i / 4 / before.width);
    Object.assign(box, {x0: Math.min(box.x0, x), x1: Math.max(box.x1, x), y0: Math.min(box.y0, y), y1: Math.max(box.y1, y)});
    ++box.pixels;
    for (let c = 0; c < 3; ++c) box.color[c] += before.data[i + c];
  }
  box.color = box.color.map((sum) => sum / Math.max(1, box.pixels));
  return box;
}`;
export const difference = (view, hide, show) => view.evaluate(`(${kDifference})(${hide}, ${show})`);
export const kSize = '({width: counterpointReplay.canvas.clientWidth, height: counterpointReplay.canvas.clientHeight})';
/// Shapes of a single body, hidden by scaling them to zero size and back; without shadows.
export const scaleBody = (body, factor) => `(view) => view.bodies.items.filter((item) => item.shape.body === ${body})
  .forEach((item) => item.local.scale({x: ${factor}, y: ${factor}, z: ${factor}}))`;
export async function bodyPixels(view, body) {
  await view.evaluate('counterpointReplay.bodies.items.forEach((item) => { item.mesh.castShadow = false; })');
  return difference(view, scaleBody(body, 2 ** -20), scaleBody(body, 2 ** 20));
}

export const arrowPixels = (view) => difference(view, '(view) => { view.state.show.forces = false; }',
                                         '(view) => { view.state.show.forces = true; }');

/// An independent pinhole camera: pixel of a point for the view given in the fragment.
export function pinhole([azimuth, elevation, distance, ...target], width, height, point) {
  const a = azimuth * Math.PI / 180, e = elevation * Math.PI / 180;
  const back = [Math.cos(e) * Math.cos(a), Math.cos(e) * Math.sin(a), Math.sin(e)];
  const right = [-Math.sin(a), Math.cos(a), 0];
  const up = [-Math.sin(e) * Math.cos(a), -Math.sin(e) * Math.sin(a), Math.cos(e)];
  const dot = (u, v) => u[0] * v[0] + u[1] * v[1] + u[2] * v[2];
  const arm = point.map((x, i) => x - target[i]);
  const depth = distance - dot(arm, back), focal = height / 2 / Math.tan(19 * Math.PI / 180);
  return {x: width / 2 + focal * dot(arm, right) / depth, y: height / 2 - focal * dot(arm, up) / depth};
}

/// Reads a trajectory as rows of numbers by column name.
export function table(file) {
  const [header, ...rows] = readFileSync(file, 'utf8').trim().split('\n').map((line) => line.split(','));
  return rows.map((row) => Object.fromEntries(header.map((name, i) => [name, Number(row[i])])));
}
