// The pages of bundled scenes open and show their bodies: all at the top, every tenth one of the folders below, whose
// pages differ in their bodies alone.
import assert from 'node:assert/strict';
import {readFileSync, readdirSync, rmSync} from 'node:fs';
import {join, relative} from 'node:path';
import {at, difference, folder, open, run, scenes, test} from './pages.mjs';

/// All scene files below a folder; problem files of optimize do not count.
function sceneFiles(folder) {
  return readdirSync(folder, {withFileTypes: true}).flatMap((entry) => {
    const file = join(folder, entry.name);
    if (entry.isDirectory()) return entry.name === 'sizes' ? [] : sceneFiles(file);
    return entry.name.endsWith('.yaml') && /^ground|^models|^robots|^gravity|^terrain/m.test(readFileSync(file, 'utf8')) ? [file] : [];
  });
}
const files = sceneFiles(scenes).map((file) => relative(scenes, file)).sort();
for (const name of files.filter((name, i) => !name.includes('/') || i % 10 === 0)) {
  const file = join(scenes, name);
  test(`bundled scene ${name}`, async () => {
    const page = at(`${name.replaceAll('/', '_')}.html`), top = !name.includes('/');
    if (/package:\/\//.test(readFileSync(file, 'utf8'))) return 'its robot is not bundled';
    run('simulate', file, '--duration', top ? '0.2' : '0.02', '--view', page);
    const view = await open(page, `#t=${top ? 0.1 : 0.01}&ui=0&hide=forces,points,pulls`, {width: 400, height: 300});
    const seen = () => difference(view, '(view) => { view.bodies.group.visible = false; }',
                                  '(view) => { view.bodies.group.visible = true; }');
    let {pixels} = await seen();
    if (pixels <= 20) {  // thin in a large scene: looks from nearby
      await view.evaluate('counterpointReplay.follow(counterpointReplay.replay.bodies[1].name); counterpointReplay.update(); ' +
                          'counterpointReplay.stage.look(-55, 20, 3 * counterpointReplay.replay.body_radius, counterpointReplay.stage.controls.target.clone());');
      ({pixels} = await seen());
    }
    assert.ok(pixels > 20, `bodies take ${pixels} pixels`);
    await view.close();
    rmSync(page);
  });
}
