"use strict";
// The record of the page and its numbers (docs/viewing.md, "What is in the page").
const View = {};

View.unpack = async function () {
  const record = JSON.parse(document.getElementById("record").textContent);
  const words = atob(document.getElementById("numbers").textContent);
  const packed = new Uint8Array(words.length);
  for (let k = 0; k < words.length; k++) packed[k] = words.charCodeAt(k);
  const stream = new Blob([packed]).stream().pipeThrough(new DecompressionStream("deflate"));
  const bytes = new Uint8Array(await new Response(stream).arrayBuffer());
  return { record, array: (ref) => (ref ? View.numbers(bytes, ref) : null) };
};

// numbers of one array; quantised ones as value = offset + scale * n
View.numbers = function (bytes, ref) {
  const count = ref.shape.reduce((product, n) => product * n, 1);
  if (ref.type === "f4") return new Float32Array(bytes.buffer.slice(ref.at, ref.at + 4 * count));
  if (ref.type === "u4") return new Uint32Array(bytes.buffer.slice(ref.at, ref.at + 4 * count));
  const whole = ref.type === "u2" ? new Uint32Array(count) : new Float32Array(count);
  for (let k = 0; k < count; k++) {
    const n = bytes[ref.at + k] | (bytes[ref.at + count + k] << 8);
    whole[k] = ref.type === "i2" && n > 32767 ? n - 65536 : n;
  }
  if (ref.type === "u2" || !count) return whole;
  const scale = [].concat(ref.scale), offset = [].concat(ref.offset);
  const inner = ref.shape.slice(ref.each + 1).reduce((product, n) => product * n, 1), along = ref.shape[ref.each];
  for (let k = 0; k < count; k++) {
    const j = scale.length > 1 ? Math.floor(k / inner) % along : 0;
    whole[k] = offset[j] + scale[j] * whole[k];
  }
  return whole;
};
