/* Reads the data of a page: a JSON object in which references are replaced by arrays (`report/container.py`). */

const KINDS = { f4: Float32Array, i4: Int32Array, u1: Uint8Array };

/* The data in these bytes (an ArrayBuffer). */
export function unpacked(buffer) {
  const start = 4 + new DataView(buffer).getUint32(0, true);
  const text = new TextDecoder().decode(new Uint8Array(buffer, 4, start - 4));
  return JSON.parse(text, (_, value) => (value?.array ? numbers(buffer, start + value.at, value) : value));
}

/* An array of `count` numbers: at `from` are the first bytes of all numbers, then all second bytes, and so on. */
function numbers(buffer, from, { array, count }) {
  const all = new KINDS[array](count);
  const size = all.BYTES_PER_ELEMENT;
  const bytes = new Uint8Array(buffer, from, size * count);
  const whole = new Uint8Array(all.buffer);
  for (let i = 0; i < size; i++) for (let n = 0; n < count; n++) whole[size * n + i] = bytes[count * i + n];
  return all;
}

/* The data in the text of an element: base64 of compressed bytes. */
export async function embedded(element) {
  const bytes = Uint8Array.from(atob(element.textContent), (letter) => letter.charCodeAt(0));
  const plain = new Blob([bytes]).stream().pipeThrough(new DecompressionStream("deflate"));
  return unpacked(await new Response(plain).arrayBuffer());
}
