// The settings in the page's fragment: #t=1.25&follow=pelvis (docs/reference/replay.md, Links).

export const kToggles = ['forces', 'points', 'com', 'frames', 'limits', 'closures', 'sleep', 'names', 'hull',
                         'ghost', 'visuals', 'pulls', 'curves', 'legend', 'wireframe'];

/// Parses numbers between commas; null if one is invalid.
function numbers(value) {
  const list = value.split(',').map(Number);
  return list.every(Number.isFinite) ? list : null;
}

/// Returns the settings in a fragment; malformed ones are left out.
export function read(fragment) {
  const out = {show: {}};
  for (const [key, value] of new URLSearchParams(fragment.replace(/^#/, ''))) {
    const list = numbers(value);
    if (key === 't' || key === 'speed' || key === 'ghost') {
      if (list?.length === 1) out[key] = list[0];
    } else if (key === 'cam') {
      if (list && (list.length === 3 || list.length === 6) && list[2] > 0) out.cam = list;
    } else if (key === 'play' || key === 'loop' || key === 'ui') {
      out[key] = value !== '0';
    } else if (key === 'show' || key === 'hide') {
      for (const name of value.split(',')) if (kToggles.includes(name)) out.show[name] = key === 'show';
    } else if (key === 'follow' || key === 'theme') {
      out[key] = value;
    } else if (key === 'curve') {
      (out.curves ??= []).push(value);
    } else if (key === 'png' || key === 'gif' || key === 'webm' || key === 'size') {
      if (list) out[key] = list;
    }
  }
  return out;
}

/// Returns the fragment of a view.
export function write({t, follow, cam, speed, ghost, show, defaults, curves}) {
  const parts = new URLSearchParams();
  parts.set('t', String(Number(t.toFixed(4))));
  if (follow) parts.set('follow', follow);
  if (ghost > 0) parts.set('ghost', String(ghost + 1));
  if (speed !== 1) parts.set('speed', String(speed));
  parts.set('cam', cam.map((x) => String(Number(x.toPrecision(5)))).join(','));
  const changed = (wanted) => kToggles.filter((name) => show[name] === wanted && defaults[name] !== wanted);
  for (const [key, wanted] of [['show', true], ['hide', false]])
    if (changed(wanted).length) parts.set(key, changed(wanted).join(','));
  for (const curve of curves) parts.append('curve', curve);
  return `#${parts}`.replaceAll('%2C', ',');
}
