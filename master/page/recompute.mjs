// Calls the module that computes a block of a run again: in a browser, and in Node by deploy/wasm/recompute.mjs.

/// What the elements of a block come to, `{cycle, elements, hash, proof}`: of the bytes of the module and of the block. Throws why it cannot be computed.
export async function recompute(module, block) {
  const { instance } = await WebAssembly.instantiate(module);
  const { memory, input, compute, output } = instance.exports;
  const at = input(block.byteLength);
  if (!at) throw new Error(`a block of ${block.byteLength} bytes is too long for the module`);
  new Uint8Array(memory.buffer, at, block.byteLength).set(new Uint8Array(block));
  let length;
  try {
    length = compute();
  } catch (error) {
    throw new Error(`the block is damaged, or this is a fault of Bolide: the module stopped (${error.message})`);
  }
  const answer = JSON.parse(new TextDecoder().decode(new Uint8Array(memory.buffer, output(), length)));
  if (answer.error) throw new Error(answer.error);
  return answer;
}
