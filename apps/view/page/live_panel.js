// Controls and numbers of a live page: buttons in the bar, sections above the curves.
import {element, text} from './dom.js';

const kColors = ['#2f7fe6', '#e4703c', '#2fa06a', '#a05bd0', '#c09a1c', '#c2476f', '#7f8a99'];
const kMany = 8;  // sliders without a search field
const kShown = 60;  // sliders at once
/// [key of the status, words before its number, unit, factor into this unit]
const kNumbers = [
  ['newton', 'Newton steps in a step', '', 1], ['contacts', 'contacts', '', 1], ['rows', 'constraint rows', '', 1],
  ['energy_J', 'energy', 'J', 1], ['overlap_m', 'overlap', 'mm', 1e3],
  ['softened', 'softened steps', '', 1], ['unfinished', 'unfinished steps', '', 1],
];
/// [setting, words, unit, factor into this unit] of settings that are numbers.
const kSettings = [['time_step', 'time step', 'ms', 1e3], ['contact.smoothing', 'smoothing', 'm', 1],
                   ['contact.compliance', 'compliance', '', 1]];

export const section = (title, ...children) => element('details', {open: true}, element('summary', {}, title), ...children);
const row = (label, ...children) => element('label', {}, element('span', {}, label), ...children);
/// Words over the picture while the server is gone.
export const goneSign = () => element('p', {class: 'gone', role: 'alert', hidden: true},
                                      'the server is gone; the page tries again every second');

export class LivePanel {
  constructor(replay, panel, act) {
    Object.assign(this, {replay, panel, act});
    this.numbers = new Map();
    this.inputs = new Map();
    this.effects = new Map();
    this.sliders = [];
    this.addButtons();
    this.controls = element('fieldset', {disabled: true}, this.makeSettings(), this.makeGhost(), this.makeSliders());
    this.root = element('div', {class: 'live'}, this.makeNumbers(), this.makeSearch(), this.controls);
    panel.side.prepend(this.root);
    if (replay.live.watch)
      for (const one of [this.root, this.reset, this.save, this.restore, this.record, panel.speed]) one.hidden = true;
  }

  addButtons() {
    const {act, panel} = this, add = (name, label, title, onclick) => {
      this[name] = panel.button(label, title, onclick);
      panel.bar.insertBefore(this[name], panel.scrub);
    };
    add('reset', '↺', 'Back to the start (B)', () => act.reset());
    add('save', 'save', 'Save the state (S)', () => act.save());
    add('restore', 'restore', 'Restore the last saved state (Y)', () => act.restore());
    this.saved = element('select', {'aria-label': 'Saved states', title: 'Restore a saved state', hidden: true});
    this.saved.onchange = () => {
      act.restore(Number(this.saved.value));
      this.saved.value = '';
      this.saved.blur();
    };
    panel.bar.insertBefore(this.saved, panel.scrub);
    add('record', '●', 'Start or end a recording', () => act.record());
    add('drive', 'drive', 'Take over: this page drives', () => act.drive());
    this.drive.hidden = true;
    this.hand = element('output', {class: 'hand', 'aria-label': 'Hand'});
    panel.clock.after(this.hand);
    panel.loop.hidden = true;
    this.gone = goneSign();
    document.body.append(this.gone);
  }

  number(key, label) {
    this.numbers.set(key, element('b'));
    return element('div', {class: 'number'}, element('span', {}, label), this.numbers.get(key));
  }

  makeNumbers() {
    this.fault = element('p', {class: 'fault', hidden: true});
    this.phases = element('div', {class: 'phases'});
    this.phaseNames = element('div', {class: 'values'});
    this.command = element('code', {hidden: true});
    const copy = this.panel.button('copy command', 'Copy the command that repeats what is seen',
                                   () => this.act.copyCommand());
    return section('Numbers', this.fault, this.number('real_time', 'times real time'),
                   this.number('step', 'time of a step'), this.phases, this.phaseNames,
                   ...kNumbers.map(([key, label]) => this.number(key, label)), this.number('recording', 'recording'),
                   this.number('clients', 'pages'), copy, this.command);
  }

  makeSearch() {
    const names = element('datalist', {id: 'body-names'});
    names.append(...this.replay.bodies.slice(1, 2001).map((body) => element('option', {value: body.name})));
    const input = element('input', {list: 'body-names', placeholder: 'follow a body …', 'aria-label': 'Find a body'});
    input.onchange = () => {
      const body = this.act.names.get(input.value);
      if (body > 0) this.act.select(body);
      if (!this.act.follow(input.value) && input.value) this.panel.say(`there is no body ${input.value}`);
      input.value = '';
      input.blur();
    };
    return element('div', {}, input, names);
  }

  set(key, value) { this.act.command({do: 'set', key, value}); }

  makeSettings() {
    const rows = kSettings.map(([key, label, unit, factor]) => {
      const input = element('input', {type: 'number', min: 0, step: 'any', onchange: () => {
        if (Number.isFinite(input.valueAsNumber)) this.set(key, Number((input.valueAsNumber / factor).toPrecision(12)));
        input.blur();
      }});
      this.inputs.set(key, input);
      return row(unit ? `${label} [${unit}]` : label, input);
    });
    for (const [key, words] of Object.entries(this.replay.live.choices)) {
      const select = element('select', {onchange: () => { this.set(key, select.value); select.blur(); }});
      select.append(...words.map((word) => element('option', {value: word}, word.replaceAll('_', ' '))));
      this.inputs.set(key, select);
      rows.push(row(key.split('.').pop().replaceAll('_', ' '), select));
    }
    const effects = this.replay.live.effects.map((name) => {
      const box = element('input', {type: 'checkbox', onchange: () => {
        this.set(`effects.${name}`, box.checked);
        box.blur();
      }});
      const free = element('i', {title: 'On, but unused in the last second: it costs nothing'});
      const label = element('label', {class: 'effect'}, box, name.replaceAll('_', ' '), free);
      this.effects.set(name, {box, free, label});
      return label;
    });
    this.effectCount = element('summary', {}, 'Effects');
    return element('div', {}, section('Settings', ...rows), element('details', {}, this.effectCount, ...effects));
  }

  makeGhost() {
    this.ghost = element('input', {type: 'checkbox', onchange: () => {
      this.act.command({do: 'ghost', on: this.ghost.checked});
      this.ghost.blur();
    }});
    const label = element('label', {class: 'effect'}, this.ghost, 'ghost: the same with a finer time step');
    return section('Accuracy', label, this.number('ghost', ''));
  }

  slider({do: kind, index, group, name, unit, lower, upper, switch: isSwitch, value}) {
    const label = unit ? `${name} [${unit}]` : name, output = element('output', {}, text(value));
    const input = element('input', {type: 'range', min: lower, max: upper, step: isSwitch ? 1 : 'any', 'aria-label': label,
                                    title: 'Double click: the first value'});
    input.value = value;
    const send = () => {
      const now = input.valueAsNumber, of = kind === 'input' ? 'input' : 'coordinate';
      output.textContent = text(now);
      this.act.live.queue(`${kind} ${index}`, {do: kind, [of]: index, value: now});
    };
    input.oninput = send;
    input.onchange = () => input.blur();
    input.ondblclick = () => {
      input.value = value;
      send();
    };
    return {group, name, input, output, root: element('div', {class: 'slider'}, element('span', {}, label), output, input)};
  }

  makeSliders() {
    const sliders = this.sliders = this.replay.live.sliders.map((slider) => this.slider(slider));
    const search = element('input', {placeholder: 'find a slider …', 'aria-label': 'Find a slider',
                                     hidden: sliders.length <= kMany});
    const names = [...new Set(sliders.map(({group}) => group))];
    const groups = names.map((name) => ({name, root: section(name)}));
    for (const {name, root} of groups)
      root.append(...sliders.filter(({group}) => group === name).map((one) => one.root));
    const filter = search.oninput = () => {
      const words = search.value.toLowerCase();
      const found = new Set(sliders.filter(({name}) => name.toLowerCase().includes(words)).slice(0, kShown));
      for (const one of sliders) one.root.hidden = !found.has(one);
      for (const {name, root} of groups) {
        root.hidden = ![...found].some(({group}) => group === name);
        root.open = found.size <= kMany;
      }
    };
    filter();
    return element('div', {}, search, ...groups.map(({root}) => root));
  }

  // --- updates

  serverIs(isThere) {
    this.gone.hidden = isThere;
    if (!isThere) this.controls.disabled = true;
  }

  showCommand(words) {
    this.command.textContent = words;
    this.command.hidden = false;
    getSelection().selectAllChildren(this.command);
  }

  write(key, words) { this.numbers.get(key).textContent = words; }

  update(status) {
    const {driver, recording, saved = [], ghost, fault} = status;
    this.controls.disabled = !driver;
    for (const name of ['reset', 'save', 'restore']) this[name].disabled = !driver;
    this.drive.hidden = driver || this.replay.live.watch;
    this.record.disabled = !driver || !recording?.can;
    this.record.classList.toggle('on', Boolean(recording?.on));
    this.record.title = recording?.can ? `Start or end a recording: ${recording.file}` : 'Only with --record';
    this.hand.textContent = this.act.handWords;
    this.fault.hidden = !fault;
    this.fault.textContent = fault || '';
    this.showSaved(saved, driver);
    this.showNumbers(status);
    this.showSettings(status.settings ?? {});
    this.showSliders(status.sliders ?? []);
    this.ghost.checked = Boolean(ghost?.on);
    const distance = ghost?.on && `${text(1e3 * ghost.time_step)} ms: differs by ${text(1e3 * ghost.distance_m)} mm, `;
    this.write('ghost', distance ? distance + (ghost.ended ? 'ended' : `behind by ${text(ghost.behind)} s`) : '');
  }

  showSaved(saved, driver) {
    const words = saved.map((time) => `${text(time)} s`);
    this.saved.hidden = saved.length < 2;
    this.saved.disabled = !driver;
    if (words.join() === this.savedWords) return;
    this.savedWords = words.join();
    this.saved.replaceChildren(element('option', {value: ''}, 'saved …'),
                               ...words.map((word, i) => element('option', {value: i}, word)));
  }

  showNumbers(status) {
    const {step_us: step, phases_us: phases = {}, recording} = status;
    this.write('real_time', `${text(status.real_time)} (asked: ${text(status.speed)})`);
    this.write('step', `${text(step)} µs`);
    for (const [key, , unit, factor] of kNumbers)
      this.write(key, `${text(status[key] && status[key] * factor)} ${unit}`);
    const file = recording?.file?.split('/').pop();
    this.write('recording', recording?.on ? `${file}, ${recording.steps} steps` : 'off');
    this.write('clients', `${status.clients}${status.driver ? ', this one drives' : ''}`);
    const entries = Object.entries(phases).filter(([, time]) => time > 0);
    this.phases.replaceChildren(...entries.map(([name, time], i) => {
      const part = element('span', {title: `${name}: ${text(time)} µs`});
      part.style.background = kColors[i % kColors.length];
      part.style.flexGrow = time;
      return part;
    }));
    this.phaseNames.replaceChildren(...entries.map(([name, time], i) => {
      const mark = element('span', {class: 'mark'});
      mark.style.background = kColors[i % kColors.length];
      return element('span', {}, mark, `${name.replaceAll('_', ' ')} `, element('i', {}, `${text(time)} µs`));
    }));
  }

  /// Shows the values in force, except of a slider that is being moved.
  showSliders(values) {
    values.forEach((value, i) => {
      const {input, output} = this.sliders[i];
      if (input === document.activeElement || input.valueAsNumber === value) return;
      input.value = value;
      output.textContent = text(value);
    });
  }

  /// Shows the settings in force, except in a field that is being edited.
  showSettings({effects = {}, ...settings}) {
    for (const [key, input] of this.inputs) {
      const [, , , factor] = kSettings.find(([name]) => name === key) ?? [];
      if (input === document.activeElement || settings[key] === undefined) continue;
      input.value = factor ? Number((settings[key] * factor).toPrecision(6)) : settings[key];
    }
    const list = Object.values(effects);
    const count = (wanted) => list.filter(wanted).length;
    this.effectCount.textContent = `Effects: ${count(({on}) => on)} on, ${count(({used}) => used)} used`;
    for (const [name, {box, free, label}] of this.effects) {
      const {on, used} = effects[name] ?? {};
      box.checked = Boolean(on);
      free.textContent = on && !used ? 'free' : '';
      label.classList.toggle('free', !used);
    }
  }
}
