// Pages of replays as a reader has them: opened from file:// in Chromium, looked at, touched.
//   node browser_test.mjs COUNTERPOINT CHROMIUM FOLDER
import assert from 'node:assert/strict';
import {execFileSync} from 'node:child_process';
import {mkdirSync, readFileSync, readdirSync, rmSync, writeFileSync} from 'node:fs';
import {dirname, join, relative} from 'node:path';
import {fileURLToPath} from 'node:url';
import {inflateSync} from 'node:zlib';
import {Browser} from './browser.mjs';

const [program, chromium, folder] = process.argv.slice(2);
const root = join(dirname(fileURLToPath(import.meta.url)), '../..');
const scenes = join(root, 'data/scenes');
const at = (name) => join(folder, name);
const run = (...args) => execFileSync(program, args, {cwd: root, encoding: 'utf8', stdio: ['ignore', 'pipe', 'pipe']});

// A ball that is thrown and a ball that lies on the ground.
writeFileSync(at('balls.yaml'), `name: balls
ground: {}
models:
  - {name: thrown, sphere: 0.1, mass: 1, position: [0, -1, 1.5], velocity: {linear: [0, 2, 1], angular: [0, 0, 0]}}
  - {name: lying, sphere: 0.1, mass: 2, position: [0.6, 0, 0.1]}
`);
run('simulate', at('balls.yaml'), '--duration', '0.6', '--output', at('balls.csv'));
run('view', at('balls.yaml'), at('balls.csv'), '--forces', '--output', at('balls.html'));
// In these names everything that could end a string, a tag or a script.
const evil = '</script><script>window.injected=1</script><img src=x onerror="window.injected=1">&\'`';
writeFileSync(at('evil.yaml'), `name: ${JSON.stringify(evil)}
ground: {}
models:
  - {name: ${JSON.stringify(evil)}, sphere: 0.1, mass: 1, position: [0, 0, 1]}
`);

const browser = new Browser(chromium);
const tests = [];
const test = (name, body) => tests.push({name, body});

/// Opens a page and waits until it has drawn; it must say nothing and ask for nothing.
async function open(page, fragment = '', options = {}) {
  const view = await browser.open(`file://${page}${fragment}`, options);
  await until(view, 'window.counterpointReplay?.rendered > 0');
  assert.deepEqual(view.console, [], page);
  assert.equal(view.requests.filter((url) => !/^(file|data|blob):/.test(url)).length, 0, view.requests.join());
  assert.equal(view.requests.filter((url) => url.startsWith('file:')).length, 1, 'the page itself only');
  return view;
}

/// The page of a report: its charts answer; it says nothing and asks for nothing.
async function openReport(page) {
  const view = await browser.open(`file://${page}`);
  await until(view, 'document.readyState === "complete"');
  assert.deepEqual(view.console, [], page);
  assert.deepEqual(view.requests.filter((url) => !url.startsWith('data:')), [`file://${page}`], 'the page itself only');
  return view;
}

async function until(view, condition) {
  for (let i = 0; i < 200; ++i) {
    if (await view.evaluate(condition)) return;
    await new Promise((resolve) => setTimeout(resolve, 50));
  }
  throw new Error(`never came true: ${condition}; console: ${view.console.join('; ')}`);
}

/// In the page: the box around the pixels that change when `hide` is done to it, and their mean colour before.
const kDifference = `(hide, show) => {
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
const difference = (view, hide, show) => view.evaluate(`(${kDifference})(${hide}, ${show})`);
const kSize = '({width: counterpointReplay.canvas.clientWidth, height: counterpointReplay.canvas.clientHeight})';
/// The shapes of one body alone, without shadows: shrunk to nothing and back.
const scaleBody = (body, factor) => `(view) => view.bodies.items.filter((item) => item.shape.body === ${body})
  .forEach((item) => item.local.scale({x: ${factor}, y: ${factor}, z: ${factor}}))`;
async function bodyPixels(view, body) {
  await view.evaluate('counterpointReplay.bodies.items.forEach((item) => { item.mesh.castShadow = false; })');
  return difference(view, scaleBody(body, 2 ** -20), scaleBody(body, 2 ** 20));
}

const arrowPixels = (view) => difference(view, '(view) => { view.state.show.forces = false; }',
                                         '(view) => { view.state.show.forces = true; }');

/// A pinhole camera by itself: where a point is on the picture, from what the fragment asked for.
function pinhole([azimuth, elevation, distance, ...target], width, height, point) {
  const a = azimuth * Math.PI / 180, e = elevation * Math.PI / 180;
  const back = [Math.cos(e) * Math.cos(a), Math.cos(e) * Math.sin(a), Math.sin(e)];
  const right = [-Math.sin(a), Math.cos(a), 0];
  const up = [-Math.sin(e) * Math.cos(a), -Math.sin(e) * Math.sin(a), Math.cos(e)];
  const dot = (u, v) => u[0] * v[0] + u[1] * v[1] + u[2] * v[2];
  const arm = point.map((x, i) => x - target[i]);
  const depth = distance - dot(arm, back), focal = height / 2 / Math.tan(19 * Math.PI / 180);
  return {x: width / 2 + focal * dot(arm, right) / depth, y: height / 2 - focal * dot(arm, up) / depth};
}

/// A trajectory as rows of numbers by column name.
function table(file) {
  const [header, ...rows] = readFileSync(file, 'utf8').trim().split('\n').map((line) => line.split(','));
  return rows.map((row) => Object.fromEntries(header.map((name, i) => [name, Number(row[i])])));
}

/// Every scene file below a folder; problems of optimize are none.
function sceneFiles(folder) {
  return readdirSync(folder, {withFileTypes: true}).flatMap((entry) => {
    const file = join(folder, entry.name);
    if (entry.isDirectory()) return entry.name === 'sizes' ? [] : sceneFiles(file);
    return entry.name.endsWith('.yaml') && /^ground|^models|^robots|^gravity|^terrain/m.test(readFileSync(file, 'utf8')) ? [file] : [];
  });
}
for (const file of sceneFiles(scenes)) {
  const name = relative(scenes, file);
  test(`bundled scene ${name}`, async () => {
    const page = at(`${name.replaceAll('/', '_')}.html`), top = !name.includes('/');
    if (/package:\/\//.test(readFileSync(file, 'utf8'))) return 'its robot is not bundled';
    run('simulate', file, '--duration', top ? '0.2' : '0.02', '--view', page);
    const view = await open(page, `#t=${top ? 0.1 : 0.01}&ui=0&hide=forces,points,pulls`, {width: 400, height: 300});
    const seen = () => difference(view, '(view) => { view.bodies.group.visible = false; }',
                                  '(view) => { view.bodies.group.visible = true; }');
    let {pixels} = await seen();
    if (pixels <= 20) {  // thin in a large scene: from near
      await view.evaluate('counterpointReplay.follow(counterpointReplay.replay.bodies[1].name); counterpointReplay.update(); ' +
                          'counterpointReplay.stage.look(-55, 20, 3 * counterpointReplay.replay.body_radius, counterpointReplay.stage.controls.target.clone());');
      ({pixels} = await seen());
    }
    assert.ok(pixels > 20, `bodies take ${pixels} pixels`);
    await view.close();
    rmSync(page);
  });
}

test('a body is where the trajectory says, and moves when scrubbed', async () => {
  const rows = table(at('balls.csv'));
  const cam = [20, 10, 6, 0, 0, 0.8];
  const view = await open(at('balls.html'), `#t=0&hide=forces,points,legend,curves&cam=${cam}`);
  const seen = [];
  for (const time of [0, 0.2, 0.5]) {
    await view.evaluate(`counterpointReplay.seek(${time})`);
    const {width, height} = await view.evaluate(kSize);
    const row = rows.find((one) => Math.abs(one.time - time) < 1e-9);
    const centre = [row['thrown/body.x'], row['thrown/body.y'], row['thrown/body.z']];
    const wanted = pinhole(cam, width, height, centre);
    const box = await bodyPixels(view, 1);
    assert.ok(box.pixels > 100, `${box.pixels} pixels at ${time} s`);
    const off = Math.hypot((box.x0 + box.x1) / 2 - wanted.x, (box.y0 + box.y1) / 2 - wanted.y);
    assert.ok(off < 3, `${off} pixels off at ${time} s: ${JSON.stringify({box, wanted})}`);
    const own = await view.evaluate('counterpointReplay.project("thrown/body")');
    assert.ok(Math.hypot(own.x - wanted.x, own.y - wanted.y) < 0.5, JSON.stringify({own, wanted}));
    seen.push(wanted.x);
  }
  assert.ok(seen[2] - seen[0] > 50, 'it flies across the picture');
  await view.close();
});

test('arrows stand where contacts are', async () => {
  const cam = [-90, 5, 4, 0.6, 0, 0.3];
  const view = await open(at('balls.html'), `#t=0.1&hide=points,legend,curves&cam=${cam}`);
  const shown = await view.evaluate('counterpointReplay.forces.shown');
  assert.equal(shown.length, 1);
  assert.ok(Math.abs(shown[0].size - 2 * 9.80665) < 0.05, `${shown[0].size} N`);
  shown[0].position.forEach((x, i) => assert.ok(Math.abs(x - [0.6, 0, 0][i]) < 1e-3, shown[0].position.join()));
  await view.evaluate('counterpointReplay.enlargeForces(2)');  // out of the ball that it carries
  const box = await arrowPixels(view);
  const {width, height} = await view.evaluate(kSize);
  const foot = pinhole(cam, width, height, [0.6, 0, 0]);
  assert.ok(box.pixels > 30 && box.color[0] > box.color[2] + 40, `red pixels: ${JSON.stringify(box)}`);
  assert.ok(box.x0 - 2 < foot.x && foot.x < box.x1 + 60 && box.y0 < foot.y, JSON.stringify({box, foot}));
  await view.evaluate('counterpointReplay.enlargeForces(1.5)');
  const longer = await arrowPixels(view);
  assert.ok(longer.y1 - longer.y0 > 1.3 * (box.y1 - box.y0), 'arrows grow with their scale');
  await view.close();
});

test('the keyboard does all of it', async () => {
  const view = await open(at('balls.html'));
  const state = () => view.evaluate('({...counterpointReplay.state, show: {...counterpointReplay.state.show}, theme: counterpointReplay.themeName})');
  await view.key('ArrowRight');
  await view.key('ArrowRight');
  assert.ok(Math.abs((await state()).time - 0.02) < 1e-9);
  await view.key('ArrowLeft');
  assert.ok(Math.abs((await state()).time - 0.01) < 1e-9);
  await view.key('End');
  assert.ok(Math.abs((await state()).time - 0.6) < 1e-9);
  await view.key('Home');
  assert.equal((await state()).time, 0);
  await view.key('ArrowRight', 8);  // shift
  assert.ok(Math.abs((await state()).time - 0.06) < 1e-9);
  for (const [key, name] of [['c', 'forces'], ['p', 'points'], ['o', 'com'], ['a', 'frames'], ['k', 'curves'], ['i', 'legend'],
                             ['n', 'names'], ['j', 'limits'], ['z', 'sleep'], ['m', 'hull'], ['g', 'ghost'],
                             ['v', 'visuals'], ['x', 'pulls']]) {
    const before = (await state()).show[name];
    await view.key(key);
    assert.equal((await state()).show[name], !before, key);
  }
  await view.key('.');
  assert.equal((await state()).speed, 2);
  const theme = (await state()).theme;
  await view.key('d');
  assert.notEqual((await state()).theme, theme);
  await view.key('l');
  assert.equal((await state()).loop, false);
  await view.key('f');
  assert.equal((await state()).follow, 'thrown/body');
  await view.key('?');
  assert.equal(await view.evaluate('counterpointReplay.panel.keys.hidden'), false);
  await view.key('Escape');
  await view.key('Home');
  await view.key(' ');
  await until(view, 'counterpointReplay.time > 0.1');
  await until(view, '!counterpointReplay.state.playing');  // it does not loop any more
  assert.ok(Math.abs((await state()).time - 0.6) < 1e-9);
  assert.deepEqual(view.console, []);
  await view.close();
});

test('the fragment says time, body and view', async () => {
  run('simulate', join(scenes, 'humanoid_drop.yaml'), '--duration', '0.5', '--view', at('humanoid.html'));
  const view = await open(at('humanoid.html'), '#t=0.25&follow=pelvis&show=com,names&hide=curves,legend&theme=dark');
  const state = () => view.evaluate('({...counterpointReplay.state, theme: counterpointReplay.themeName})');
  let now = await state();
  assert.equal(now.time, 0.25);
  assert.equal(now.follow, 'pelvis');
  assert.equal(now.theme, 'dark');
  assert.ok(now.show.com && now.show.names && !now.show.curves);
  const aside = () => view.evaluate(`(() => { const p = counterpointReplay.project('pelvis'), c = counterpointReplay.canvas;
    return Math.hypot(p.x - c.clientWidth / 2, p.y - c.clientHeight / 2); })()`);
  assert.ok(await aside() < 1, 'the pelvis is in the middle');
  await view.evaluate('location.hash = "#t=0.45&follow=pelvis&hide=legend"');
  await until(view, 'counterpointReplay.time === 0.45');
  await view.evaluate('counterpointReplay.renderNow()');
  assert.ok(await aside() < 1, 'and stays there');
  // A link leads back to the same view.
  const link = await view.evaluate('counterpointReplay.link');
  const again = await open(at('humanoid.html'), link);
  assert.deepEqual(await again.evaluate('[counterpointReplay.time, counterpointReplay.state.follow]'), [0.45, 'pelvis']);
  const [a, b] = [await view.evaluate('counterpointReplay.stage.view'), await again.evaluate('counterpointReplay.stage.view')];
  a.forEach((x, i) => assert.ok(Math.abs(x - b[i]) < 0.01 * (1 + Math.abs(x)), `${a} against ${b}`));
  for (const bad of ['#t=x&cam=1,2&show=nothing&follow=nobody&speed=', '#%%%=&t', '#png=a']) await (await open(at('humanoid.html'), bad)).close();
  await again.close();
  await view.close();
});

test('the mouse turns the view, selects a body, moves the time', async () => {
  const view = await open(at('balls.html'), '#t=0.1&hide=legend');
  const before = await view.evaluate('counterpointReplay.stage.view');
  await view.mouse('mousePressed', 300, 450);
  await view.mouse('mouseMoved', 360, 450, {buttons: 1});
  await view.mouse('mouseReleased', 360, 450);
  const after = await view.evaluate('counterpointReplay.stage.view');
  assert.ok(Math.abs(after[0] - before[0]) > 5, 'dragging turns');
  const {x, y} = await view.evaluate('counterpointReplay.project("lying/body")');
  await view.mouse('mouseMoved', x, y);
  await until(view, '!counterpointReplay.panel.tip.hidden');
  assert.match(await view.evaluate('counterpointReplay.panel.tip.textContent'), /^lying/);
  await view.mouse('mousePressed', x, y);
  await view.mouse('mouseReleased', x, y);
  assert.equal(await view.evaluate('counterpointReplay.state.selected'), 2);
  assert.ok((await view.evaluate('counterpointReplay.curves.names')).includes('lying/body: position'));
  const box = await view.evaluate(`(() => { const {left, top, width, height} = document.querySelector('.chart canvas').getBoundingClientRect();
    return {left, top, width, height}; })()`);
  await view.mouse('mousePressed', box.left + box.width / 2, box.top + box.height / 2);
  await view.mouse('mouseReleased', box.left + box.width / 2, box.top + box.height / 2);
  assert.ok(Math.abs(await view.evaluate('counterpointReplay.time') - 0.3) < 0.01, 'a curve is a scrub bar');
  await view.close();
});

test('names cannot inject anything', async () => {
  run('simulate', at('evil.yaml'), '--duration', '0.1', '--view', at('evil.html'));
  const view = await open(at('evil.html'), '#show=names,legend');
  assert.equal(await view.evaluate('window.injected'), undefined);
  assert.equal(await view.evaluate('document.querySelectorAll("img").length'), 0);
  assert.equal(await view.evaluate('document.title'), evil);
  assert.equal(await view.evaluate('counterpointReplay.panel.legend.querySelector("h1").textContent'), evil);
  await until(view, 'counterpointReplay.panel.labels.childElementCount === 1');
  assert.equal(await view.evaluate('counterpointReplay.panel.labels.textContent'), `${evil}/body`);
  await view.close();
});

test('a ghost is drawn beside the motion', async () => {
  writeFileSync(at('other.csv'), readFileSync(at('balls.csv'), 'utf8').split('\n').map((line, i) => {
    if (i === 0 || !line) return line;
    const cells = line.split(',');
    cells[2] = String(Number(cells[2]) + 0.5);
    return cells.join(',');
  }).join('\n'));
  run('view', at('balls.yaml'), at('balls.csv'), '--ghost', at('other.csv'), '--ghost-name', 'half a metre aside', '--output', at('ghost.html'));
  const view = await open(at('ghost.html'), '#t=0.3');
  const {pixels} = await difference(view, '(view) => { view.state.show.ghost = false; }', '(view) => { view.state.show.ghost = true; }');
  assert.ok(pixels > 50, `${pixels} pixels`);
  assert.match(await view.evaluate('counterpointReplay.panel.legend.textContent'), /half a metre aside/);
  await view.close();
});

test('the inputs can be had back, and what made it is said', async () => {
  const view = await open(at('balls.html'));
  const inputs = await view.evaluate('counterpointReplay.replay.inputs');
  const scene = inputs.find((input) => input.name.endsWith('balls.yaml'));
  assert.equal(inflateSync(Buffer.from(scene.data, 'base64')).toString(), readFileSync(at('balls.yaml'), 'utf8'));
  const motion = inputs.find((input) => input.name.endsWith('balls.csv'));
  assert.equal(inflateSync(Buffer.from(motion.data, 'base64')).toString(), readFileSync(at('balls.csv'), 'utf8'));
  const made = Object.fromEntries(await view.evaluate('counterpointReplay.replay.made'));
  assert.match(made.command, /^counterpoint view /);
  assert.equal(made['state hash at the end'], readFileSync(at('balls.csv'), 'utf8').trim().split(',').pop());
  await view.close();
});

test('a phone and a dark screen', async () => {
  const view = await open(at('balls.html'), '', {width: 390, height: 760, mobile: true, dark: true});
  assert.equal(await view.evaluate('counterpointReplay.themeName'), 'dark');
  assert.equal(await view.evaluate('counterpointReplay.canvas.clientWidth'), 390);
  assert.ok(await view.evaluate('counterpointReplay.canvas.clientHeight') > 400, 'the picture has most of the room');
  assert.ok(await view.evaluate('[...document.querySelectorAll(".bar > *")].every((e) => e.getBoundingClientRect().right <= 390)'));
  await view.close();
});

test('ten seconds of the humanoid', async () => {
  run('simulate', join(scenes, 'humanoid_drop.yaml'), '--duration', '10', '--view', at('long.html'));
  const {length} = readFileSync(at('long.html'));
  assert.ok(length < 3e6, `${length} bytes`);
  const view = await open(at('long.html'), '#t=9.99');
  assert.equal(await view.evaluate('counterpointReplay.motion.frames'), 1001);
  await view.close();
});

test('pictures for documents', async () => {
  run('view', at('balls.yaml'), at('balls.csv'), '--forces', '--output', at('shots.html'), '--png', '0.1,0.5', '--gif', '0,0.3,10', '--size', '160x120');
  for (const name of ['shots_0.1.png', 'shots_0.5.png']) {
    const png = readFileSync(at(name));
    assert.equal(png.subarray(1, 4).toString(), 'PNG');
    assert.deepEqual([png.readUInt32BE(16), png.readUInt32BE(20)], [160, 120]);
  }
  assert.notDeepEqual(readFileSync(at('shots_0.1.png')), readFileSync(at('shots_0.5.png')));
  const gif = readFileSync(at('shots.gif'));
  assert.equal(gif.subarray(0, 6).toString(), 'GIF89a');
  assert.deepEqual([gif.readUInt16LE(6), gif.readUInt16LE(8)], [160, 120]);
});

test('a video for documents', async () => {
  run('view', at('balls.yaml'), at('balls.csv'), '--output', at('film.html'), '--webm', '0,0.5,20', '--size', '160x120');
  const film = readFileSync(at('film.webm'));
  assert.equal(film.readUInt32BE(0), 0x1a45dfa3, 'EBML');
  // A browser plays it: size, length, and the last picture can be had.
  writeFileSync(at('film_player.html'), '<!DOCTYPE html><video muted src="film.webm"></video>');
  const view = await browser.open(`file://${at('film_player.html')}`);
  await until(view, 'document.querySelector("video").readyState >= 1');
  const figures = await view.evaluate('(({videoWidth, videoHeight, duration}) => [videoWidth, videoHeight, duration])(document.querySelector("video"))');
  assert.deepEqual(figures.slice(0, 2), [160, 120]);
  assert.ok(Math.abs(figures[2] - 0.55) < 0.01, `${figures[2]} s for 11 frames at 20 a second`);
  await view.evaluate('document.querySelector("video").play()');
  await until(view, 'document.querySelector("video").ended');
  assert.equal(await view.evaluate('document.querySelector("video").error'), null);
  assert.equal(await view.evaluate('document.querySelector("video").getVideoPlaybackQuality().totalVideoFrames > 1'), true);
  await view.close();
});

// A link whose looks (a red pyramid, and a mesh that is gone) are not what collides (a ball).
writeFileSync(at('pyramid.obj'), 'v -1 -1 0\nv 1 -1 0\nv 1 1 0\nv -1 1 0\nv 0 0 1\nf 1 3 2\nf 1 4 3\nf 1 2 5\nf 2 3 5\nf 3 4 5\nf 4 1 5\n');
writeFileSync(at('looks.urdf'), `<robot name="looks"><material name="red"><color rgba="1 0 0 1"/></material><link name="a">
  <inertial><mass value="1"/><inertia ixx="1" iyy="1" izz="1" ixy="0" ixz="0" iyz="0"/></inertial>
  <visual><origin xyz="0 0 0.5"/><geometry><mesh filename="pyramid.obj" scale="0.2 0.2 0.4"/></geometry><material name="red"/></visual>
  <visual><geometry><mesh filename="gone.stl"/></geometry></visual>
  <collision><geometry><sphere radius="0.1"/></geometry></collision></link></robot>`);
writeFileSync(at('looks.yaml'), 'models:\n  - {urdf: looks.urdf, base: floating, count: 2, spacing: [0, 1, 0]}\n');

test('robots are shown as they look, or as they collide', async () => {
  run('simulate', at('looks.yaml'), '--duration', '0.02', '--output', at('looks.csv'), '--view', at('looks.html'));
  const cam = [0, 10, 5, 0, 0, 0.3];
  const view = await open(at('looks.html'), `#t=0&hide=legend,curves&cam=${cam}`);
  const {width, height} = await view.evaluate(kSize);
  const centre = (box) => [(box.x0 + box.x1) / 2, (box.y0 + box.y1) / 2];
  const looks = await bodyPixels(view, 1);
  assert.ok(looks.color[0] > 2 * looks.color[1], `red: ${looks.color}`);
  const base = pinhole(cam, width, height, [0, 0, 0.5]), tip = pinhole(cam, width, height, [0, 0, 0.9]);
  assert.ok(Math.abs(centre(looks)[0] - tip.x) < 3 && Math.abs(looks.y0 - tip.y) < 3, JSON.stringify({looks, tip}));
  assert.ok(looks.y1 > base.y - 2 && looks.y1 < pinhole(cam, width, height, [0, 0, 0.3]).y, 'nothing of the ball');
  await view.key('v');
  const ball = await bodyPixels(view, 1), middle = pinhole(cam, width, height, [0, 0, 0]);
  assert.ok(Math.hypot(centre(ball)[0] - middle.x, centre(ball)[1] - middle.y) < 3, JSON.stringify({ball, middle}));
  assert.match(await view.evaluate('counterpointReplay.panel.legend.textContent'), /gone\.stl/);
  await view.close();
});

test('arrows of closures', async () => {
  writeFileSync(at('hung.yaml'), `name: hung
models:
  - {name: load, sphere: 0.1, mass: 2, position: [0, 0, 1]}
closures:
  - {type: distance, name: rope, between: [world, load/body], anchor_a: [0, 0, 2]}
`);
  run('simulate', at('hung.yaml'), '--duration', '0.1', '--view', at('hung.html'));
  const cam = [-90, 5, 4, 0, 0, 1.5];
  const view = await open(at('hung.html'), `#t=0.1&hide=legend,curves,closures&cam=${cam}`);
  const [pull] = await view.evaluate('counterpointReplay.pulls.shown');
  assert.ok(Math.abs(pull.size - 2 * 9.80665) < 0.05, `${pull.size} N`);
  pull.position.forEach((x, i) => assert.ok(Math.abs(x - [0, 0, 1.5][i]) < 1e-2, pull.position.join()));
  await view.evaluate('counterpointReplay.enlargeForces(5)');
  const box = await difference(view, '(view) => { view.state.show.pulls = false; }', '(view) => { view.state.show.pulls = true; }');
  const {width, height} = await view.evaluate(kSize), foot = pinhole(cam, width, height, [0, 0, 1.5]);
  assert.ok(box.pixels > 30 && Math.abs((box.x0 + box.x1) / 2 - foot.x) < 4 && box.y0 < foot.y, JSON.stringify({box, foot}));
  assert.ok((await view.evaluate('[...counterpointReplay.curves.groups.keys()]')).includes('closure force'));
  await view.close();
});

test('of several ghosts one is shown', async () => {
  run('view', at('balls.yaml'), at('balls.csv'), '--ghost', at('balls.csv'), '--ghost-name', 'the same',
      '--ghost', at('balls.csv'), '--ghost-name', 'aside', '--output', at('ghosts.html'));
  const view = await open(at('ghosts.html'), '#t=0.3&ghost=2');
  const name = () => view.evaluate('counterpointReplay.ghost.motion.name');
  assert.equal(await name(), 'aside');
  await view.key('h');
  assert.equal(await name(), 'the same');
  await view.evaluate('counterpointReplay.panel.ghosts.value = 1; counterpointReplay.panel.ghosts.onchange()');
  assert.equal(await name(), 'aside');
  assert.match(await view.evaluate('counterpointReplay.link'), /ghost=2/);
  await view.close();
});

test('a report of compare: curves of each recording, values under the cursor, zoom', async () => {
  const row = (t, x, z) => `${t},${x},0,${z},1,0,0,0,0,0,0,0,0,0`;
  for (const [i, x] of [[0, 0.1], [1, 0.3]])  // at rest in the air for ever; x grows
    writeFileSync(at(`toss${i}.csv`), ['t,x,y,z,qw,qx,qy,qz,vx,vy,vz,wx,wy,wz', row(0, 0, 1), row(1, x, 1), row(2, 2 * x, 1)].join('\n'));
  run('compare', join(scenes, 'cube_toss.yaml'), at('toss0.csv'), at('toss1.csv'), '--columns', join(root, 'data/maps/cube_toss.yaml'),
      '--report', at('compared'));
  const index = await openReport(at('compared/index.html'));
  const links = await index.evaluate('[...document.querySelectorAll("a")].map((a) => a.getAttribute("href"))');
  for (const link of ['recording0.html', 'replay0.html', 'recording1.html', 'replay1.html']) assert.ok(links.includes(link), link);
  assert.ok(await index.evaluate('counterpointCharts.length') > 8, 'the worst recording is in the page itself');
  await index.close();
  const view = await openReport(at('compared/recording0.html'));
  const chart = await view.evaluate(`(() => { const i = counterpointCharts.findIndex((c) => [...c.svg.querySelectorAll('text')].some((t) => /\.x$/.test(t.textContent)));
    const c = counterpointCharts[i]; c.svg.scrollIntoView({block: 'center'}); const b = c.svg.getBoundingClientRect();
    return {i, x: b.left + b.width * (c.left + 0.5 * (c.right - c.left)) / c.svg.viewBox.baseVal.width, y: b.top + b.height / 2}; })()`);
  const words = () => view.evaluate(`counterpointCharts[${chart.i}].words.textContent`);
  await view.mouse('mouseMoved', chart.x, chart.y);
  await until(view, `counterpointCharts[${chart.i}].words.textContent !== ''`);
  const value = Number((await words()).match(/recorded: ([-\d.e]+)/)[1]);
  const time = Number((await words()).match(/t \[s\]: ([-\d.e]+)/)[1]);
  const speed = 148 * (/toss0/.test(await view.evaluate('document.title')) ? 0.1 : 0.3);  // rows a second (cube_toss.yaml)
  assert.ok(Math.abs(value - speed * time) < 2e-3, `${await words()}`);
  await view.send('Input.dispatchMouseEvent', {type: 'mouseWheel', x: chart.x, y: chart.y, deltaX: 0, deltaY: -400});
  const width = () => view.evaluate(`(([a, b]) => b - a)(counterpointCharts[${chart.i}].x.range)`);
  const all = await view.evaluate(`(([a, b]) => b - a)(counterpointCharts[${chart.i}].x.all)`);
  await until(view, `(([a, b]) => b - a)(counterpointCharts[${chart.i}].x.range) < ${0.7 * all}`);
  await view.mouse('mouseMoved', chart.x + 1, chart.y);
  const [, again, at2] = (await words()).match(/t \[s\]: ([-\d.e]+).*recorded: ([-\d.e]+)/);
  assert.ok(Math.abs(Number(at2) - speed * Number(again)) < 2e-3, `zoomed: ${await words()}`);
  await view.evaluate(`counterpointCharts[${chart.i}].svg.dispatchEvent(new MouseEvent('dblclick'))`);
  assert.equal(await width(), all);
  assert.deepEqual(view.console, []);
  await view.close();
  await (await open(at('compared/replay0.html'))).close();
});

test('reports of accuracy, hard-cases and optimize lead to replays', async () => {
  run('accuracy', join(scenes, 'double_pendulum.yaml'), '--duration', '0.5', '--pieces', '2', '--repeats', '1', '--vary', 'timestep,integrator',
      '--finer', '8', '--report', at('accuracy'));
  const report = await openReport(at('accuracy/accuracy.html'));
  assert.ok(await report.evaluate('counterpointCharts.length') >= 1);
  assert.equal(await report.evaluate('document.querySelector("a").getAttribute("href")'), 'replay.html');
  await report.close();
  const settings = await open(at('accuracy/replay.html'));
  assert.ok(await settings.evaluate('counterpointReplay.replay.motions.length') >= 2, 'another setting is the ghost');
  await settings.close();
  run('hard-cases', '--only', 'dzhanibekov', '--no-peers', '--report', at('hard'), '--views');
  const cases = await openReport(at('hard/replays.html'));
  assert.equal(await cases.evaluate('document.querySelector("a").getAttribute("href")'), 'dzhanibekov.html');
  assert.match(readFileSync(at('hard/hard-cases.md'), 'utf8'), /\(replays\.html\)/);
  await cases.close();
  await (await open(at('hard/dzhanibekov.html'))).close();
  run('optimize', join(scenes, 'optimize/spinner.yaml'), '--quiet', '--report', at('optimized'));
  const page = await openReport(at('optimized/index.html'));
  assert.ok((await page.evaluate('[...document.querySelectorAll("a")].map((a) => a.getAttribute("href"))')).includes('replay.html'));
  await page.close();
  const stages = await open(at('optimized/replay.html'));
  assert.match(await stages.evaluate('counterpointReplay.replay.motions[1].name'), /^stage 1, smoothing/);
  await stages.close();
});

test('fingers on a phone', async () => {
  const view = await open(at('balls.html'), '#t=0.1', {width: 390, height: 760, mobile: true, touch: true});
  const now = () => view.evaluate('({view: counterpointReplay.stage.view, state: {...counterpointReplay.state, show: {...counterpointReplay.state.show}}})');
  const before = await now();
  await view.touch('touchStart', [150, 200]);
  for (const x of [170, 190, 210]) await view.touch('touchMove', [x, 200]);
  await view.touch('touchEnd');
  const turned = await now();
  assert.ok(Math.abs(turned.view[0] - before.view[0]) > 5, 'one finger turns');
  await view.touch('touchStart', [150, 200], [250, 300]);
  for (const by of [10, 20, 30]) await view.touch('touchMove', [150 - by, 200 - by], [250 + by, 300 + by]);
  await view.touch('touchEnd');
  const nearer = await now();
  assert.ok(nearer.view[2] < 0.9 * turned.view[2], `two fingers come nearer: ${turned.view[2]} to ${nearer.view[2]} m`);
  const tap = async (label) => {
    const [x, y, size] = await view.evaluate(`(() => { const b = document.querySelector('button[aria-label^="${label}"]').getBoundingClientRect();
      return [b.left + b.width / 2, b.top + b.height / 2, Math.min(b.width, b.height)]; })()`);
    assert.ok(size >= 36, `${label}: ${size} pixels is too little for a finger`);
    await view.touch('touchStart', [x, y]);
    await view.touch('touchEnd');
  };
  await tap('Curves');
  await until(view, 'counterpointReplay.state.show.curves');
  await until(view, 'document.querySelector(".chart canvas").clientWidth > 100');
  const box = await view.evaluate(`(() => { const {left, top, width, height} = document.querySelector('.chart canvas').getBoundingClientRect();
    return {x: left + width / 2, y: top + height / 2}; })()`);
  await view.touch('touchStart', [box.x, box.y]);
  await view.touch('touchEnd');
  await until(view, 'Math.abs(counterpointReplay.time - 0.3) < 0.02');
  await tap('Play');
  await until(view, 'counterpointReplay.state.playing');
  assert.deepEqual(view.console, []);
  await view.close();
});

let failed = 0;
const began = Date.now(), only = process.env.ONLY;
for (const {name, body} of tests) {
  if (only && !name.includes(only)) continue;
  const start = Date.now();
  try {
    const skipped = await body();
    if (skipped) console.log(`SKIPPED ${name}: ${skipped}`);
    else console.log(`ok      ${name} (${((Date.now() - start) / 1000).toFixed(1)} s)`);
  } catch (error) {
    ++failed;
    console.log(`FAILED  ${name}\n${error.stderr ?? ''}${error.stack}`);
  }
}
await browser.close();
console.log(`${tests.length} tests, ${failed} failed, ${((Date.now() - began) / 1000).toFixed(0)} s`);
process.exit(failed ? 1 : 0);
