// The keyboard (docs/reference/replay.md, Keys).

const kToggles = {c: 'forces', p: 'points', o: 'com', a: 'frames', j: 'limits', z: 'sleep', n: 'names', m: 'hull',
                  g: 'ghost', v: 'visuals', x: 'pulls', k: 'curves', i: 'legend', w: 'wireframe'};

export function listen(act) {
  const once = {
    ' ': () => act.togglePlay(), Home: () => act.seekStart(), End: () => act.seekEnd(), l: () => act.toggleLoop(),
    ',': () => act.changeSpeed(-1), '.': () => act.changeSpeed(1), f: () => act.followNext(), r: () => act.resetView(),
    1: () => act.lookFrom(0, 8), 2: () => act.lookFrom(-90, 8), 3: () => act.lookFrom(-90, 89.9),
    '+': () => act.enlargeForces(1.25), '=': () => act.enlargeForces(1.25), '-': () => act.enlargeForces(0.8),
    d: () => act.toggleTheme(), h: () => act.nextGhost(), u: () => act.copyLink(), '?': () => act.toggleKeys(), Escape: () => act.escape(),
    ...act.ownKeys,
  };
  document.addEventListener('keydown', (event) => {
    if (event.ctrlKey || event.metaKey || event.altKey) return;
    if (event.target.matches('input:not([type=range]):not([type=checkbox]), select')) return;
    const key = event.key.length === 1 ? event.key.toLowerCase() : event.key;
    const arrow = {ArrowLeft: -1, ArrowRight: 1}[key];
    if (arrow) event.shiftKey ? act.jump(arrow) : act.step(arrow);
    else if (kToggles[key]) act.toggle(kToggles[key]);
    else if (once[key]) once[key]();
    else return;
    event.preventDefault();
  });
}
