// Bundles entry.mjs into three.mjs: `npm ci && npm run build`. With --check, compares with the committed file instead.
import { readFileSync, writeFileSync } from 'node:fs';
import { dirname, join } from 'node:path';
import { fileURLToPath } from 'node:url';
import { build } from 'esbuild';

const here = dirname(fileURLToPath(import.meta.url));
const { version } = JSON.parse(readFileSync(join(here, 'node_modules/three/package.json'), 'utf8'));
const result = await build({
  entryPoints: [join(here, 'entry.mjs')],
  bundle: true,
  minify: true,
  format: 'esm',
  target: 'es2022',
  write: false,
  legalComments: 'none',
  banner: { js: `/* three.js ${version}, MIT licence, Copyright 2010-2026 three.js authors; bundled by build.mjs */` },
});
const file = join(here, 'three.mjs');
const made = result.outputFiles[0].text;
if (process.argv.includes('--check')) {
  const same = readFileSync(file, 'utf8') === made;
  console.log(same ? 'three.mjs is what the sources give' : 'three.mjs is not what the sources give: npm run build');
  process.exit(same ? 0 : 1);
}
writeFileSync(file, made);
console.log(`three.mjs: ${(made.length / 1024).toFixed(0)} KiB`);
