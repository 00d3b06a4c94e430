// Cost of a replay of a thousand boxes: page size and frame times (docs/reference/replay.md, Limits). A benchmark to
// run by hand, not a test.
//   node tests/view/frame_times.mjs build/release/bin/counterpoint chromium
import {execFileSync} from 'node:child_process';
import {mkdtempSync, rmSync, statSync, writeFileSync} from 'node:fs';
import {tmpdir} from 'node:os';
import {join} from 'node:path';
import {Browser} from './browser.mjs';

const [program, chromium] = process.argv.slice(2);
const folder = mkdtempSync(join(tmpdir(), 'counterpoint_frames_')), page = join(folder, 'boxes.html');
// A thousand cubes in 100 columns of ten, 5 cm apart, fall on the ground and on each other.
const models = Array.from({length: 100}, (_, i) =>
  `  - {name: c${i}_, box: [0.1, 0.1, 0.1], mass: 1, position: [${0.3 * (i % 10)}, ${0.3 * Math.floor(i / 10)}, 0.15], count: 10, spacing: [0.01, 0, 0.25]}`);
writeFileSync(join(folder, 'boxes.yaml'), `name: boxes\nground: {}\nmodels:\n${models.join('\n')}\n`);
execFileSync(program, ['simulate', join(folder, 'boxes.yaml'), '--duration', '4', '--view', page], {stdio: 'inherit'});
const browser = new Browser(chromium, {width: 640, height: 360});
try {
  const view = await browser.open(`file://${page}`, {width: 640, height: 360});
  for (let i = 0; i < 600 && !await view.evaluate('window.counterpointReplay?.rendered > 0'); ++i)
    await new Promise((resolve) => setTimeout(resolve, 100));
  await view.evaluate('counterpointReplay.redraw = () => {}; counterpointReplay.dirty = false;');  // no other frames
  const kSetup = `const view = counterpointReplay, {start, end} = view.motion, gl = view.stage.renderer.getContext();
    const times = (count, body) => Array.from({length: count}, (_, k) => {
      view.setTime(start + (end - start) * (k + 0.5) / count);
      const from = performance.now();
      body();
      return performance.now() - from;
    }).sort((a, b) => a - b)[count >> 1];`;
  const measure = (body) => view.evaluate(`(() => { ${kSetup} ${body} })()`);
  const figures = {
    // The page's own script: poses of bodies, arrows, panel, curves.
    script_ms: await measure('return times(60, () => { view.update(); view.panel.update(view.state); view.curves.draw(view.state.at); });'),
    arrows: await measure('return view.forces.shown.length;'),
    // Rendered to completion, on the CPU where there is no graphics card.
    draw_ms: await measure('return times(1, () => { view.stage.render(); gl.readPixels(0, 0, 1, 1, gl.RGBA, gl.UNSIGNED_BYTE, new Uint8Array(4)); });'),
    // Script and three.js down to the graphics library, with its draw calls disabled.
    script_and_calls_ms: await measure(`for (const name of ['drawElements', 'drawArrays', 'drawElementsInstanced', 'drawArraysInstanced']) gl[name] = () => {};
      return times(30, () => { view.update(); view.stage.render(); });`),
    bodies: await measure('return view.replay.bodies.length - 1;'),
    frames: await measure('return view.motion.frames;'),
    renderer: await measure('return gl.getParameter(gl.getExtension("WEBGL_debug_renderer_info")?.UNMASKED_RENDERER_WEBGL ?? gl.RENDERER);'),
  };
  console.log(JSON.stringify({page_bytes: statSync(page).size, ...figures}, null, 1));
} finally {
  await browser.close();
  rmSync(folder, {recursive: true, force: true});
}
