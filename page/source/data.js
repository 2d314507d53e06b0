/* Reads the data of a page: a JSON object in which references are replaced by arrays (`report/container.py`). */

const KINDS = { f4: Float32Array, i4: Int32Array, u1: Uint8Array };

/* The data in these bytes (an ArrayBuffer). */
export function unpacked(buffer) {
  const start = 4 + new DataView(buffer).getUint32(0, true);
  const text = new TextDecoder().decode(new Uint8Array(buffer, 4, start - 4));
  return JSON.parse(text, (_, value) => (value?.array ? new KINDS[value.array](buffer, start + value.at, value.count) : value));
}

/* The data in the text of an element: base64 of compressed bytes. */
export async function embedded(element) {
  const bytes = Uint8Array.from(atob(element.textContent), (letter) => letter.charCodeAt(0));
  const plain = new Blob([bytes]).stream().pipeThrough(new DecompressionStream("deflate"));
  return unpacked(await new Response(plain).arrayBuffer());
}
