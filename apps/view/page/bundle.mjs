// Bundles the page's scripts and the licences of their packages into a C++ source file:
// node bundle.mjs FOLDER OUTPUT, where FOLDER has these files and node_modules (bundle.cmake).
import {readFileSync, writeFileSync} from 'node:fs';
import {createRequire} from 'node:module';
import {join} from 'node:path';

const [folder, output] = process.argv.slice(2);
const {build} = createRequire(join(folder, 'package.json'))('esbuild-wasm');
const packages = ['three', 'fflate', 'gifenc'];
const licences = packages.map((name) => {
  const at = join(folder, 'node_modules', name);
  const {version} = JSON.parse(readFileSync(join(at, 'package.json')));
  const file = ['LICENSE', 'LICENSE.md'].find((one) => {
    try { return readFileSync(join(at, one)); } catch { return false; }
  });
  return `${name} ${version}\n\n${readFileSync(join(at, file), 'utf8').trim()}`;
});
const result = await build({
  entryPoints: [join(folder, 'main.js')], bundle: true, minify: true, write: false, format: 'iife', charset: 'ascii',
  target: ['chrome100', 'firefox100', 'safari15.4'], loader: {'.css': 'text'}, legalComments: 'none', logLevel: 'warning',
});
const script = result.outputFiles[0].text;
// The bundle stands inside <script>: nothing in it may end that element.
if (/<\/script|<!--/i.test(script)) throw new Error('the bundle holds markup that would end its <script>');
const program = `/*!\n${licences.join('\n\n----\n\n').replaceAll('*/', '* /')}\n*/\n${script}`
  .replaceAll('\u00a9', '(c)').replace(/[^\x00-\x7f]/g, '?');
// A list of numbers, since compilers limit the length of string literals.
const numbers = [...Buffer.from(program, 'ascii'), 0].join(',').replace(/(.{95,100},)/g, '$1\n');
writeFileSync(output, `#include "view/program.h"
namespace counterpoint::view {
namespace {
const char kProgram[] = {
${numbers}};
}
const char* program() { return kProgram; }
const char* program_missing() { return ""; }
}
`);
