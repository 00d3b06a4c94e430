// Draws docs/images/live_humanoid.png: the page of a live run while a hand pulls the humanoid up.
//   node scripts/live_picture.mjs COUNTERPOINT CHROMIUM OUTPUT
import {spawn} from 'node:child_process';
import {writeFileSync} from 'node:fs';
import {Browser} from '../tests/view/browser.mjs';

const [program, chromium, output] = process.argv.slice(2);
const server = spawn(program, ['live', 'humanoid_drop', '--port', '0', '--no-browser'],
                     {stdio: ['ignore', 'pipe', 'inherit']});
const address = await new Promise((resolve) => server.stdout.once('data', (part) => resolve(String(part).split('\n')[0])));
const browser = new Browser(chromium, {width: 1200, height: 675});
const view = await browser.open(address, {width: 1200, height: 675});
const until = async (condition) => {
  while (!await view.evaluate(`((view, status) => ${condition})(window.counterpointReplay, window.counterpointReplay?.status)`))
    await new Promise((resolve) => setTimeout(resolve, 50));
};
await until('status && view.time > 1.5');
await view.evaluate('counterpointReplay.applyLink({cam: [-50, 12, 3.4, 0, 0, 0.55], show: {legend: false, curves: true}})');
await view.evaluate('counterpointReplay.livePanel.ghost.click()');
const {x, y} = await view.evaluate('counterpointReplay.project("chest")');
await view.mouse('mousePressed', x, y);
for (let i = 1; i <= 20; ++i) await view.mouse('mouseMoved', x + 2 * i, y - 11 * i, {buttons: 1});
await until('status.hand?.force_N > 100');
await new Promise((resolve) => setTimeout(resolve, 1500));
writeFileSync(output, await view.screenshot());
await view.mouse('mouseReleased', x, y);
await view.close();
await browser.close();
server.kill('SIGINT');
