// Reports: interactive charts, links to replays, and touch input.
import assert from 'node:assert/strict';
import {readFileSync, writeFileSync} from 'node:fs';
import {join} from 'node:path';
import {at, open, openReport, root, run, scenes, test, until} from './pages.mjs';

test('a report of compare: curves of each recording, values under the cursor, zoom', async () => {
  const row = (t, x, z) => `${t},${x},0,${z},1,0,0,0,0,0,0,0,0,0`;
  for (const [i, x] of [[0, 0.1], [1, 0.3]])  // at rest in the air; x grows
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
  const speed = 148 * (/toss0/.test(await view.evaluate('document.title')) ? 0.1 : 0.3);  // 148 Hz (cube_toss.yaml)
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
