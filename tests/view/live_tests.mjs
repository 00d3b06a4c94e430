// Tests of live pages: a body is dragged, time goes back, settings change, recordings repeat, pages come and go.
import assert from 'node:assert/strict';
import {execFileSync, spawn} from 'node:child_process';
import {once} from 'node:events';
import {existsSync, mkdirSync, readFileSync, writeFileSync} from 'node:fs';
import {join} from 'node:path';
import {at, browser, evil, folder, program, root, scenes, test, until} from './pages.mjs';

const box = at('box.yaml');
writeFileSync(box, `name: box
ground: {}
models:
  - {name: box, box: [0.15, 0.1, 0.1], mass: 2, position: [0, 0, 0.1]}
`);

/// Starts a server; `address` is its first line, `stop` ends it with Ctrl-C and returns all its
/// words.
async function serve(...args) {
  const server = spawn(program, ['live', ...args, '--no-browser'], {cwd: root, stdio: ['ignore', 'pipe', 'pipe']});
  let said = '', wrong = '';
  server.stderr.on('data', (part) => { wrong += part; });
  const kill = () => server.kill('SIGKILL');
  process.once('exit', kill);  // after a test that failed
  const gone = new Promise((resolve) => server.once('exit', resolve)).finally(() => process.off('exit', kill));
  const address = await new Promise((resolve, reject) => {
    server.stdout.on('data', (part) => {
      said += part;
      const line = said.match(/^(http\S+)\n/);
      if (line) resolve(line[1]);
    });
    gone.then((code) => reject(new Error(`the server ended with ${code}: ${wrong}`)));
  });
  const stop = async () => {
    server.kill('SIGINT');
    assert.equal(await gone, 0, wrong);
    return said;
  };
  return {address, stop};
}

/// Opens a page of a server and waits for its first frame; expects no console output.
async function watch({address}, options = {}) {
  const view = await browser.open(address, options);
  await until(view, 'window.counterpointReplay?.rendered > 0 && counterpointReplay.status !== null');
  assert.deepEqual(view.console, []);
  return view;
}

/// Waits until a condition on the page's `view` and its `status` is true.
const wait = (page, condition) =>
  until(page, `((view, status) => ${condition})(counterpointReplay, counterpointReplay.status)`);
const status = (view) => view.evaluate('counterpointReplay.status');
/// Height of the box [m] in the newest frame.
const kHeight = '(({poses, frames, bodies}) => poses[((frames - 1) * bodies + 1) * 7 + 2])(counterpointReplay.motion)';

/// Presses the mouse on the box and moves it up the picture [pixels].
async function pull(view, up, more = {}) {
  const {x, y} = await view.evaluate('counterpointReplay.project("box/body")');
  await view.mouse('mousePressed', x, y, more);
  for (let i = 1; i <= 5; ++i) await view.mouse('mouseMoved', x, y - up * i / 5, {buttons: 1, ...more});
  return [x, y - up];
}

async function change(view, key, value) {
  await view.evaluate(`(() => { const input = counterpointReplay.livePanel.inputs.get('${key}');
    input.value = ${JSON.stringify(value)}; input.onchange(); })()`);
}

test('a body is pulled up, time goes back, and recordings repeat to the bit', async () => {
  const server = await serve(box, '--port', '0', '--record', at('motion.csv'));
  const view = await watch(server);
  await wait(view, 'view.motion.end > 0.2');
  const camera = await view.evaluate('counterpointReplay.stage.view');
  const [x, y] = await pull(view, 250);
  await wait(view, `${kHeight} > 0.165`);
  await wait(view, 'status.hand?.force_N > 15');
  assert.match(await view.evaluate('counterpointReplay.livePanel.hand.textContent'), /^box\/body: [\d.]+ N$/);
  await wait(view, '/ N$/.test(view.handMarks.label?.name) && view.handMarks.forces.shown[0].size > 15');
  assert.deepEqual(await view.evaluate('counterpointReplay.stage.view'), camera, 'the view does not turn meanwhile');
  await view.mouse('mouseReleased', x, y);
  await wait(view, 'status.hand === null');
  await wait(view, `${kHeight} < 0.155`);
  assert.equal((await status(view)).recording.file, at('motion.csv'));

  await view.key(' ');
  await wait(view, 'status.playing === false');
  const [start, end] = await view.evaluate('(({start, end}) => [start, end])(counterpointReplay.motion)');
  await view.evaluate(`(({scrub}) => { scrub.value = ${(start + end) / 2}; scrub.oninput(); })
    (counterpointReplay.panel)`);
  assert.equal(await view.evaluate('counterpointReplay.isFollowing'), false);
  assert.equal((await status(view)).time, end, 'looking back changes nothing');
  await view.key(' ');
  await wait(view, 'status.playing');
  assert.ok(await view.evaluate('counterpointReplay.motion.end') < end, 'later frames are undone');
  await wait(view, `status.recording.file.endsWith('motion_2.csv') && view.time > ${(start + end) / 2 + 0.1}`);

  await change(view, 'time_step', '1.5');  // [ms]
  await wait(view, 'Math.abs(status.settings.time_step - 0.0015) < 1e-12');
  await wait(view, `status.recording.file.endsWith('motion_3.csv') && status.recording.steps > 50`);
  await pull(view, 100);
  await wait(view, 'status.hand?.force_N > 5');
  await new Promise((resolve) => setTimeout(resolve, 300));
  assert.deepEqual(view.console, []);
  assert.match(await server.stop(), /to repeat the last recording: counterpoint simulate .*motion_3/);
  await view.close();
  const last = (file) => readFileSync(file, 'utf8').trim().split(',').pop();
  for (const name of ['motion', 'motion_2', 'motion_3']) {
    const command = readFileSync(at(`${name}.txt`), 'utf8').trim();
    assert.match(command, /^counterpoint simulate /);
    execFileSync('sh', ['-c', `'${program}'${command.slice('counterpoint'.length)} --output ${name}_again.csv`],
                 {cwd: folder, stdio: ['ignore', 'ignore', 'pipe']});
    assert.equal(last(at(`${name}_again.csv`)), last(at(`${name}.csv`)), name);
  }
});

test('on a desktop the page opens by itself', async () => {
  const bin = at('bin'), opened = at('opened.txt');
  mkdirSync(bin, {recursive: true});
  writeFileSync(join(bin, 'xdg-open'), `#!/bin/sh\necho "$1" > '${opened}'\n`, {mode: 0o755});
  const server = spawn(program, ['live', box, '--port', '0'], {
    stdio: ['ignore', 'pipe', 'ignore'], env: {...process.env, DISPLAY: ':0', PATH: `${bin}:${process.env.PATH}`}});
  const address = String(await once(server.stdout, 'data')).split('\n')[0];
  for (let i = 0; i < 100 && !existsSync(opened); ++i) await new Promise((resolve) => setTimeout(resolve, 50));
  server.kill('SIGINT');
  await once(server, 'exit');
  assert.equal(readFileSync(opened, 'utf8').trim(), address);
});

test('keys step, save, restore and reset', async () => {
  const server = await serve(box, '--port', '0', '--paused');
  const view = await watch(server);
  assert.equal((await status(view)).playing, false);
  const {time_step: h} = (await status(view)).settings;
  await view.key('ArrowRight');
  await view.key('ArrowRight');
  await wait(view, `Math.abs(view.time - ${2 * h}) < 1e-9`);
  await view.key('s');
  await wait(view, 'status.saved.length === 1');
  await view.key(' ');
  await wait(view, 'view.time > 0.3');
  await view.key(' ');
  await wait(view, 'status.playing === false');
  await view.key('y');
  await wait(view, `Math.abs(view.motion.end - ${2 * h}) < 1e-9`);
  await view.key('.');
  await wait(view, 'status.speed === 2');
  await view.key('b');
  await wait(view, 'view.motion.end === 0 && view.motion.frames === 1');
  await view.key('w');
  assert.equal(await view.evaluate('counterpointReplay.state.show.wireframe'), true);
  assert.equal(await view.evaluate('counterpointReplay.livePanel.record.disabled'), true, 'no --record');
  await change(view, 'contact', 'hard');
  await wait(view, 'status.settings.contact === "hard"');
  await change(view, 'contact.friction_model', 'lagged');
  await wait(view, 'status.settings["contact.friction_model"] === "lagged" && status.settings.contact === ""');
  await change(view, 'contact.smoothing', '1e-6');
  await wait(view, 'status.settings["contact.smoothing"] === 1e-6');
  await view.evaluate('counterpointReplay.livePanel.set("time_step", -1)');
  await wait(view, '!view.panel.message.hidden');
  assert.deepEqual(view.console, []);
  await view.close();
  await server.stop();
});

test('Ctrl turns a body', async () => {
  const server = await serve(box, '--port', '0');
  const view = await watch(server);
  const [x, y] = await pull(view, 120, {modifiers: 2});
  await wait(view, 'status.hand?.torque_Nm > 0');
  assert.match(await view.evaluate('counterpointReplay.livePanel.hand.textContent'), / N m$/);
  await view.mouse('mouseReleased', x, y, {modifiers: 2});
  await wait(view, 'status.hand === null');
  await view.close();
  await server.stop();
});

test('a finger drags', async () => {
  const server = await serve(box, '--port', '0');
  const view = await watch(server, {width: 390, height: 760, mobile: true, touch: true});
  const {x, y} = await view.evaluate('counterpointReplay.project("box/body")');
  await view.touch('touchStart', [x, y]);
  for (let i = 1; i <= 5; ++i) await view.touch('touchMove', [x, y - 40 * i]);
  await wait(view, `${kHeight} > 0.13`);
  await view.touch('touchEnd');
  await wait(view, 'status.hand === null');
  const rights = await view.evaluate(`[...document.querySelectorAll('.bar > *')].map(
    (control) => control.getBoundingClientRect().right)`);
  assert.ok(Math.max(...rights) <= 390, 'all controls are on the screen');
  await view.close();
  await server.stop();
});

test('a second page watches, takes over, and may vanish', async () => {
  const server = await serve(box, '--port', '0');
  const first = await watch(server), second = await watch(server);
  await wait(second, 'status.clients === 2');
  assert.equal((await status(second)).driver, false);
  const before = await second.evaluate('counterpointReplay.stage.view[0]');
  const {x, y} = await second.evaluate('counterpointReplay.project("box/body")');
  await second.mouse('mousePressed', x, y);
  await second.mouse('mouseMoved', x + 60, y, {buttons: 1});
  await second.mouse('mouseReleased', x + 60, y);
  const turned = await second.evaluate('counterpointReplay.stage.view[0]') - before;
  assert.ok(Math.abs(turned) > 5, 'its drag turns the view');
  assert.equal((await status(first)).hand, null);
  await second.evaluate('counterpointReplay.livePanel.drive.click()');
  await wait(second, 'status.driver');
  await wait(first, '!status.driver && !view.livePanel.drive.hidden');
  await pull(second, 100);
  await wait(first, 'status.hand?.body === "box/body"');
  await second.close();
  await wait(first, 'status.driver && status.hand === null && status.clients === 1');
  const {end} = await first.evaluate('({end: counterpointReplay.motion.end})');
  await wait(first, `view.motion.end > ${end}`);
  assert.deepEqual(first.console, []);
  await first.close();
  await server.stop();
});

test('the page waits for a server that is gone', async () => {
  const server = await serve(box, '--port', '0'), port = new URL(server.address).port;
  const view = await watch(server);
  await wait(view, 'view.motion.end > 0.3');
  await server.stop();
  await wait(view, '!view.livePanel.gone.hidden && view.livePanel.controls.disabled');
  const again = await serve(box, '--port', port);
  await wait(view, 'view.livePanel.gone.hidden && status?.driver');
  await wait(view, 'view.motion.end > 0.1 && view.motion.end < 5');
  await view.close();
  await again.stop();
});

test('a page with the token drives', async () => {
  const server = await serve(box, '--port', '0', '--host', '0.0.0.0');
  assert.match(server.address, /\?token=[0-9a-f]{32}$/);
  const view = await watch(server);
  await wait(view, 'status.driver && view.motion.end > 0.1');
  await view.close();
  await server.stop();
});

test('sliders move servos', async () => {
  const server = await serve(join(scenes, 'arm7_servo.yaml'), '--port', '0');
  const view = await watch(server);
  const {sliders} = await view.evaluate('counterpointReplay.replay.live');
  const target = sliders.find((slider) => slider.group === 'targets of servos');
  const wanted = JSON.stringify(`${target.name}: position`);
  const now = `counterpointReplay.replay.curves.find((curve) => curve.group === ${wanted})
    .read(counterpointReplay.motion.frames - 1)`;
  const before = await view.evaluate(now), middle = (target.lower + target.upper) / 2;
  const goal = before > middle ? target.lower : target.upper;
  await view.evaluate(`((input) => { input.value = ${0.5 * (before + goal)}; input.oninput(); })
    (document.querySelector('.slider input'))`);
  await wait(view, `Math.abs(status.sliders[0] - ${0.5 * (before + goal)}) < 1e-9`);
  await wait(view, `Math.abs(${now} - ${before}) > 0.1 * ${Math.abs(goal - before)}`);
  assert.deepEqual(view.console, []);
  await view.close();
  await server.stop();
});

test('a ghost runs with a finer time step', async () => {
  const server = await serve(box, '--port', '0');
  const view = await watch(server);
  const isDrawn = 'counterpointReplay.ghost.group.visible';
  assert.equal(await view.evaluate(isDrawn), false);
  await view.evaluate('counterpointReplay.livePanel.ghost.click()');
  await wait(view, `${isDrawn} && status.ghost.on && view.ghost.motion.frames > 5`);
  await wait(view, '/^0.5 ms: differs by/.test(view.livePanel.numbers.get("ghost").textContent)');
  await view.evaluate('counterpointReplay.livePanel.ghost.click()');
  await wait(view, `!${isDrawn} && !status.ghost.on`);
  assert.deepEqual(view.console, []);
  await view.close();
  await server.stop();
});

test('a page of simulate --live watches the run', async () => {
  const run = spawn(program, ['simulate', box, '--duration', '1000000', '--live'], {cwd: root, stdio: ['ignore', 'ignore', 'pipe']});
  const kill = () => run.kill('SIGKILL');
  process.once('exit', kill);
  const address = await new Promise((resolve) => run.stderr.once('data', (part) => resolve(String(part).trim())));
  const view = await browser.open(address);
  await until(view, 'window.counterpointReplay?.motion.frames > 5');
  assert.equal(await view.evaluate('counterpointReplay.state.playing'), true);
  await view.key(' ');
  const time = await view.evaluate('counterpointReplay.time');
  await until(view, `counterpointReplay.motion.end > ${time}`);
  assert.equal(await view.evaluate('counterpointReplay.time'), time, 'the view stays where it was stopped');
  await view.key(' ');
  await until(view, `counterpointReplay.time > ${time}`);
  assert.equal(await view.evaluate('counterpointReplay.livePanel.record.hidden'), true);
  assert.deepEqual(view.console, []);
  await view.close();
  kill();
  process.off('exit', kill);
});

test('names cannot inject anything into a live page', async () => {
  const server = await serve(at('evil.yaml'), '--port', '0');
  const view = await watch(server);
  await view.key('n');
  assert.equal(await view.evaluate('window.injected'), undefined);
  assert.equal(await view.evaluate('document.querySelectorAll("img").length'), 0);
  assert.equal(await view.evaluate('document.title'), evil);
  assert.deepEqual(view.console, []);
  await view.close();
  await server.stop();
});
