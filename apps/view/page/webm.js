// Video for documents: VP9 by the browser's own encoder (WebCodecs), put into WebM (EBML, RFC 8794).

/// The number in `count` bytes, big-endian.
function bytesOf(value, count) {
  return Array.from({length: count}, (_, i) => Math.floor(value / 2 ** (8 * (count - 1 - i))) % 256);
}

/// An EBML element: its id, the length of its content in eight bytes, its content.
function element(id, ...parts) {
  const length = parts.reduce((sum, part) => sum + part.length, 0);
  const idBytes = bytesOf(id, id > 0xffffff ? 4 : id > 0xffff ? 3 : id > 0xff ? 2 : 1);
  const out = new Uint8Array(idBytes.length + 8 + length);
  out.set(idBytes);
  out.set(bytesOf(length, 8), idBytes.length);
  out[idBytes.length] = 1;  // the length has seven further bytes
  let at = idBytes.length + 8;
  for (const part of parts) {
    out.set(part, at);
    at += part.length;
  }
  return out;
}
const number = (id, value) => element(id, bytesOf(value, 4));
const text = (id, words) => element(id, new TextEncoder().encode(words));
function double(id, value) {
  const bytes = new Uint8Array(8);
  new DataView(bytes.buffer).setFloat64(0, value);
  return element(id, bytes);
}

/// A cluster of frames; the first is a key frame. Times in ms.
function cluster(frames) {
  const start = frames[0].time;
  const blocks = frames.map(({time, key, data}) =>
    element(0xa3, [0x81, ...bytesOf(time - start, 2), key ? 0x80 : 0], data));
  return element(0x1f43b675, number(0xe7, start), ...blocks);
}

function webm(frames, width, height, duration) {
  const header = element(0x1a45dfa3, number(0x4286, 1), number(0x42f7, 1), number(0x42f2, 4), number(0x42f3, 8),
                         text(0x4282, 'webm'), number(0x4287, 2), number(0x4285, 2));
  const info = element(0x1549a966, number(0x2ad7b1, 1e6), double(0x4489, duration),
                       text(0x4d80, 'counterpoint'), text(0x5741, 'counterpoint'));
  const track = element(0x1654ae6b, element(0xae, number(0xd7, 1), number(0x73c5, 1), number(0x83, 1),
                                            text(0x86, 'V_VP9'), element(0xe0, number(0xb0, width), number(0xba, height))));
  const groups = [];
  for (const frame of frames) frame.key ? groups.push([frame]) : groups[groups.length - 1].push(frame);
  const segment = element(0x18538067, info, track, ...groups.map(cluster));
  return [header, segment];
}

/// Encodes a video of the frames that draw(k) puts on a canvas, at `rate` frames per second.
export async function video(frames, rate, {width, height}, draw) {
  if (typeof VideoEncoder === 'undefined') throw new Error('this browser has no encoder for video (WebCodecs)');
  const out = [];
  let wrong = null;
  const encoder = new VideoEncoder({
    output: (chunk) => {
      const data = new Uint8Array(chunk.byteLength);
      chunk.copyTo(data);
      out.push({time: Math.round(chunk.timestamp / 1000), key: chunk.type === 'key', data});
    },
    error: (error) => { wrong = error; },
  });
  // 0.1 bit per pixel keeps edges sharp, as only a small part of the picture moves.
  encoder.configure({codec: width * height > 2e6 ? 'vp09.00.51.08' : 'vp09.00.41.08', width, height, framerate: rate,
                     bitrate: Math.max(4e5, 0.1 * width * height * rate), latencyMode: 'quality'});
  const group = Math.max(1, Math.min(250, Math.floor(20 * rate)));  // 16 bits hold 32 s in ms
  for (let k = 0; k < frames && !wrong; ++k) {
    const frame = new VideoFrame(draw(k), {timestamp: Math.round(1e6 * k / rate), duration: Math.round(1e6 / rate)});
    encoder.encode(frame, {keyFrame: k % group === 0});
    frame.close();
    while (encoder.encodeQueueSize > 8 && !wrong) await new Promise((resolve) => setTimeout(resolve, 1));
  }
  if (!wrong) await encoder.flush();
  if (wrong) throw wrong;
  return new Uint8Array(await new Blob(webm(out, width, height, 1000 * frames / rate)).arrayBuffer());
}
