// Computes a block of a run again, in Node: prints what its elements come to, as a line of JSON.
//
// usage: node deploy/wasm/recompute.mjs MODULE BLOCK
//        MODULE  target/recompute.wasm, which deploy/wasm/build.sh builds, or recompute.wasm of a master's page
//        BLOCK   a file from /api/jobs/N/sample of a master
//
// exit code: 0 computed; 1 the block cannot be computed; 2 wrong words.
import { readFile } from 'node:fs/promises';
import { recompute } from '../../master/page/recompute.mjs';

const [module, block, ...others] = process.argv.slice(2);
if (!block || others.length) {
  console.error('usage: node recompute.mjs MODULE BLOCK');
  process.exit(2);
}
try {
  const bytes = await Promise.all([module, block].map(path => readFile(path)));
  console.log(JSON.stringify(await recompute(...bytes)));
} catch (error) {
  console.error(`recompute.mjs: ${error.message}`);
  process.exit(1);
}
