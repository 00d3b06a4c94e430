// Tests of a replay page: poses, arrows, keys, mouse, links, ghosts, pictures.
import assert from 'node:assert/strict';
import {readFileSync, writeFileSync} from 'node:fs';
import {join} from 'node:path';
import {inflateSync} from 'node:zlib';
import {
  arrowPixels, at, bodyPixels, browser, difference, evil, kSize, open, pinhole, run, scenes,
  table, test, until
} from './pages.mjs';

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
  await view.evaluate('counterpointReplay.enlargeForces(2)');  // long enough to stick out of the ball that it carries
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
  await until(view, '!counterpointReplay.state.playing');  // no loop
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
  // A link restores the same view.
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
  // A browser plays it: checks size, duration, and access to the last picture.
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

// A link whose visuals (a red pyramid and a missing mesh) differ from its collision shape (a ball).
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
