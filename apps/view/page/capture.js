// Pictures for documents: #png=0.5,1&size=960,540, #gif=START,END,FRAMES_PER_S or #webm= alike. The page draws them and
// leaves them as text in <pre class="capture">, which `counterpoint view --png` reads (capture.cc).
import {GIFEncoder, applyPalette, quantize} from 'gifenc';
import {element, text} from './dom.js';
import {video} from './webm.js';

function base64(bytes) {
  let raw = '';
  for (let i = 0; i < bytes.length; i += 0x8000)
    raw += String.fromCharCode(...bytes.subarray(i, i + 0x8000));
  return btoa(raw);
}

/// Draws the picture at a time [s], with the time and the force scale written into it.
function draw(view, time, canvas) {
  view.setTime(time);
  view.renderNow();
  const context = canvas.getContext('2d', {willReadFrequently: true});
  context.drawImage(view.canvas, 0, 0, canvas.width, canvas.height);
  const size = Math.round(canvas.height / 26);
  context.font = `${size}px system-ui, sans-serif`;
  context.fillStyle = document.documentElement.dataset.theme === 'dark' ? '#dfe5ec' : '#333';
  context.fillText(`t = ${text(time)} s`, size, canvas.height - size);
  const ruler = view.forceRuler();
  if (ruler) {
    const right = canvas.width - size, left = right - context.measureText(ruler.words).width;
    context.fillText(ruler.words, left, canvas.height - size);
    context.fillStyle = '#e4402c';
    context.fillRect(left - size / 2 - ruler.pixels, canvas.height - 1.5 * size, ruler.pixels, size / 3);
  }
  return context;
}

/// Number of pictures from START to END.
function count([from, to, rate]) { return Math.max(1, Math.floor((to - from) * rate + 1e-6) + 1); }

function gif(view, range, canvas) {
  const encoder = GIFEncoder(), [from, , rate] = range;
  for (let k = 0; k < count(range); ++k) {
    const {data} = draw(view, from + k / rate, canvas).getImageData(0, 0, canvas.width, canvas.height);
    const palette = quantize(data, 128);
    encoder.writeFrame(applyPalette(data, palette), canvas.width, canvas.height, {palette, delay: 1000 / rate});
  }
  encoder.finish();
  return encoder.bytes();
}

/// Draws the pictures that the fragment asks for, if any.
export function capture(view, link) {
  if (!link.png && !link.gif && !link.webm) return;
  const [width, height] = link.size ?? [960, 540];
  view.resize(width, height, 1);
  view.stage.aside(0);
  if (!link.cam && !link.follow) view.resetView();
  const canvas = element('canvas', {width, height});
  const leave = (kind, words) => document.body.append(element('pre', {class: 'capture', 'data-kind': kind, hidden: true}, words));
  for (const time of link.png ?? []) {
    draw(view, time, canvas);
    leave('png', canvas.toDataURL('image/png').split(',')[1]);
  }
  if (link.gif?.length === 3) leave('gif', base64(gif(view, link.gif, canvas)));
  if (link.webm?.length !== 3) return;
  // The encoder answers later. An open document keeps the page loading, so that Chromium waits for
  // it.
  const wait = element('iframe', {hidden: true});
  document.body.append(wait);
  wait.contentDocument.open();
  const [from, , rate] = link.webm;
  video(count(link.webm), rate, canvas, (k) => draw(view, from + k / rate, canvas).canvas)
    .then((bytes) => leave('webm', base64(bytes)), (error) => leave('failed', btoa(error.message.replace(/[^ -~]/g, '?'))))
    .finally(() => wait.contentDocument.close());
}
