// SPDX-License-Identifier: GPL-3.0-or-later
// Decodes the arrays of a page, which export/viewer_data.cpp has written: numbers of four bytes as differences from
// the number `stride` places before, split into their first, second, third and fourth bytes, deflated, in base64.

async function inflate(bytes) {
  const stream = new Blob([bytes]).stream().pipeThrough(new DecompressionStream("deflate"));
  return new Uint8Array(await new Response(stream).arrayBuffer());
}

function from_base64(text) {
  if (Uint8Array.fromBase64) return Uint8Array.fromBase64(text);
  const characters = atob(text),
    bytes = new Uint8Array(characters.length);
  for (let i = 0; i < bytes.length; ++i) bytes[i] = characters.charCodeAt(i);
  return bytes;
}

/// Returns a Float32Array ("f32") or Uint32Array ("u32"); array: {type, size, stride, data}, or null for none.
export async function decode(array) {
  if (!array) return null;
  const { type, size, stride } = array,
    planes = await inflate(from_base64(array.data));
  if (planes.length !== 4 * size) throw new Error("the data of the page are damaged");
  const words = new Uint32Array(size);
  for (let i = 0; i < size; ++i) {
    const word = planes[i] | (planes[size + i] << 8) | (planes[2 * size + i] << 16) | (planes[3 * size + i] << 24);
    words[i] = i < stride ? word : word + words[i - stride];
  }
  return type === "f32" ? new Float32Array(words.buffer) : words;
}
