// Tests of the pages of searches, optimize --live and explain --live: motions come, ghosts stay, a button ends it.
import assert from 'node:assert/strict';
import {spawn} from 'node:child_process';
import {existsSync, readFileSync, writeFileSync} from 'node:fs';
import {join} from 'node:path';
import {at, browser, program, root, run, scenes, test, until} from './pages.mjs';

const problem = (name) => join(scenes, 'optimize', `${name}.yaml`);

/// Starts a search and opens its page; `end` waits for the exit code and all words.
async function search(...args) {
  const command = spawn(program, [...args, '--live'], {cwd: root, stdio: ['ignore', 'pipe', 'pipe']});
  let said = '';
  for (const stream of [command.stdout, command.stderr]) stream.on('data', (part) => { said += part; });
  const kill = () => command.kill('SIGKILL');
  process.once('exit', kill);  // after a test that failed
  const gone = new Promise((resolve) => command.once('close', resolve)).finally(() => process.off('exit', kill));
  const address = await new Promise((resolve, reject) => {
    command.stderr.on('data', () => {
      const line = said.match(/^(http\S+)\n/m);
      if (line) resolve(line[1]);
    });
    gone.then((code) => reject(new Error(`the search ended with ${code}: ${said}`)));
  });
  const view = await browser.open(address);
  const end = async () => ({code: await gone, said});
  return {view, end};
}

/// Waits until a condition on the page's `view` and its `search` is true.
const wait = (page, condition) =>
  until(page, `((view, search) => view && ${condition})(window.counterpointReplay, window.counterpointReplay?.search)`);
const names = (view) => view.evaluate('counterpointReplay.replay.motions.slice(1).map((ghost) => ghost.name)');
/// Whether the first chart has pixels in the colour of its curve.
const kDrawn = `(({width, height}, context) => {
  const {data} = context.getImageData(0, 0, width, height);
  for (let i = 0; i < data.length; i += 4) if (data[i + 3] > 200 && data[i + 2] > data[i] + 100) return true;
  return false;
})(document.querySelector('.search canvas'), document.querySelector('.search canvas').getContext('2d'))`;

/// Expects that a page whose search has ended plays on, without alarm.
async function expectPlaying(view) {
  const [time, rendered] = await view.evaluate('[counterpointReplay.time, counterpointReplay.rendered]');
  await wait(view, `view.rendered > ${rendered} && view.time !== ${time} && view.searchPanel.gone.hidden`);
  assert.deepEqual(view.console, []);
}

test('a search shows its motions, and its page stops it', async () => {
  const motion = at('stopped.csv');
  const {view, end} = await search('optimize', problem('quadruped_up'), '--frames', '1600', '--output', motion);
  await wait(view, 'search.rows.length > 3 && view.kept.length > 0 && view.motion.frames > 1');
  assert.equal((await names(view))[0], 'guess');
  await until(view, kDrawn);
  await wait(view, 'view.ghost.group.visible && view.state.playing && view.panel.ghosts.options.length > 0');
  assert.ok((await view.evaluate('counterpointReplay.search.words')).length > 0);
  await view.evaluate('counterpointReplay.searchPanel.stop.click()');
  assert.equal(await view.evaluate('counterpointReplay.searchPanel.stop.disabled'), true);
  const {code, said} = await end();
  assert.equal(code, 1, said);
  assert.match(said, /stopped\.csv is the motion so far/);
  assert.ok(existsSync(motion));
  await wait(view, '/^stopped/.test(search.ended)');
  await expectPlaying(view);
  await view.close();
});

test('a search ends, and its page keeps the motions', async () => {
  const {view, end} = await search('optimize', problem('acrobot_quick'));
  await wait(view, '/^converged: cost/.test(search.ended)');
  const {code, said} = await end();
  assert.equal(code, 0, said);
  await wait(view, '/^result/.test(view.motion.name) && view.searchPanel.stop.disabled');
  await expectPlaying(view);
  const ghosts = await names(view);
  assert.equal(ghosts[0], 'guess');
  const {x, y, height} = await view.evaluate(`(({x, y, height}) => ({x, y, height}))(
    document.querySelector('.search canvas').getBoundingClientRect())`);
  await view.mouse('mousePressed', x + 1, y + height / 2);
  await view.mouse('mouseReleased', x + 1, y + height / 2);
  assert.equal(await view.evaluate('counterpointReplay.ghost.motion.name'), 'guess', 'the nearest to a click');
  await view.key('h');
  const next = await view.evaluate('counterpointReplay.ghost.motion.name');
  assert.equal(next, ghosts[1 % ghosts.length]);
  await view.close();
});

test('an explanation shows its motions beside the recorded one', async () => {
  const columns = ['x', 'y', 'z', 'qw', 'qx', 'qy', 'qz'].map((name) => `cube.${name}`);
  run('simulate', join(scenes, 'cube_drop.yaml'), '--duration', '1', '--output', at('cube.csv'));
  const [header, ...rows] = readFileSync(at('cube.csv'), 'utf8').trim().split('\n').map((line) => line.split(','));
  const places = columns.map((name) => header.indexOf(name));
  const rounded = rows.filter((_, k) => k % 5 === 0)
    .map((row) => [row[0], ...places.map((place) => Number(row[place]).toFixed(3))].join());
  writeFileSync(at('noisy.csv'), [['time', ...columns].join(), ...rounded, ''].join('\n'));
  const map = ['time: time', 'columns:', ...columns.map((name) => `  ${name}: ${name}`), ''];
  writeFileSync(at('noisy.yaml'), map.join('\n'));
  const {view, end} = await search('explain', join(scenes, 'cube_drop.yaml'), at('noisy.csv'),
                                   '--columns', at('noisy.yaml'));
  await wait(view, 'search.ended !== "" && search.rows.length > 3');
  const {code, said} = await end();
  assert.equal(code, 0, said);
  await wait(view, 'view.replay.motions.length > 1');
  assert.equal((await names(view))[0], 'recorded');
  await expectPlaying(view);
  await view.close();
});
