// Replay pages as a reader opens them: from file:// in Chromium, with screenshots and input events.
//   node browser_test.mjs COUNTERPOINT CHROMIUM FOLDER [scene] [replay] [report] [live] [search]
// The last words select files of tests, default all; ONLY=WORDS the tests whose names contain these words.
import {browser, tests} from './pages.mjs';

const files = process.argv.slice(5);
for (const file of files.length ? files : ['scene', 'replay', 'report', 'live', 'search']) await import(`./${file}_tests.mjs`);

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
