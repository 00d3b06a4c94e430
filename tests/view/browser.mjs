// Headless Chromium, driven through its DevTools protocol over a pipe; needs no package.
import {spawn} from 'node:child_process';
import {mkdtempSync, rmSync} from 'node:fs';
import {tmpdir} from 'node:os';
import {join} from 'node:path';

const kTimeout = 120000;  // [ms] per answer: without a graphics card a picture may take many seconds

export class Browser {
  constructor(program, {width = 1000, height = 640} = {}) {
    this.profile = mkdtempSync(join(tmpdir(), 'counterpoint_browser_'));
    const flags = ['--headless', '--remote-debugging-pipe', '--use-gl=angle', '--use-angle=swiftshader',
                   '--enable-unsafe-swiftshader', '--no-first-run', '--disable-extensions', '--hide-scrollbars',
                   '--disable-background-networking', '--disable-component-update', '--disable-sync',
                   `--user-data-dir=${this.profile}`, `--window-size=${width},${height}`];
    if (process.getuid() === 0) flags.push('--no-sandbox');
    this.process = spawn(program, [...flags, 'about:blank'], {stdio: ['ignore', 'ignore', 'ignore', 'pipe', 'pipe']});
    this.waiting = new Map();
    this.listeners = new Map();
    this.count = 0;
    let rest = '';
    this.process.stdio[4].on('data', (part) => {
      const messages = (rest + part).split('\0');
      rest = messages.pop();
      messages.forEach((message) => this.receive(JSON.parse(message)));
    });
  }

  receive({id, result, error, method, params, sessionId}) {
    if (id === undefined) return this.listeners.get(sessionId)?.(method, params);
    const {resolve, reject, timer} = this.waiting.get(id);
    clearTimeout(timer);
    this.waiting.delete(id);
    error ? reject(new Error(error.message)) : resolve(result);
  }

  send(method, params = {}, sessionId = undefined) {
    const id = ++this.count;
    return new Promise((resolve, reject) => {
      const timer = setTimeout(() => reject(new Error(`${method}: no answer`)), kTimeout);
      this.waiting.set(id, {resolve, reject, timer});
      this.process.stdio[3].write(`${JSON.stringify({id, method, params, sessionId})}\0`);
    });
  }

  async open(address, options = {}) {
    const {targetId} = await this.send('Target.createTarget', {url: 'about:blank'});
    const {sessionId} = await this.send('Target.attachToTarget', {targetId, flatten: true});
    const page = new Page(this, targetId, sessionId);
    await page.start(address, options);
    return page;
  }

  async close() {
    const gone = new Promise((resolve) => this.process.once('exit', resolve));
    this.send('Browser.close').catch(() => {});
    const timer = setTimeout(() => this.process.kill('SIGKILL'), 5000);
    await gone;
    clearTimeout(timer);
    rmSync(this.profile, {recursive: true, force: true, maxRetries: 5, retryDelay: 500});
  }
}

/// One page: its console output and requests, and input events for it.
class Page {
  constructor(browser, target, session) {
    Object.assign(this, {browser, target, session, console: [], requests: []});
    browser.listeners.set(session, (method, params) => this.note(method, params));
  }

  send(method, params) { return this.browser.send(method, params, this.session); }

  note(method, params) {
    if (method === 'Runtime.consoleAPICalled')
      this.console.push(params.args.map((arg) => arg.value ?? arg.description).join(' '));
    if (method === 'Runtime.exceptionThrown')
      this.console.push(params.exceptionDetails.exception?.description ?? params.exceptionDetails.text);
    if (method === 'Log.entryAdded') this.console.push(params.entry.text);
    if (method === 'Network.requestWillBeSent') this.requests.push(params.request.url);
    if (method === 'Page.loadEventFired') this.loaded?.();
  }

  async start(address, {width = 1000, height = 640, mobile = false, dark = false, touch = false}) {
    for (const domain of ['Page', 'Runtime', 'Network', 'Log']) await this.send(`${domain}.enable`);
    await this.send('Emulation.setDeviceMetricsOverride', {width, height, deviceScaleFactor: 1, mobile});
    if (touch) await this.send('Emulation.setTouchEmulationEnabled', {enabled: true, maxTouchPoints: 2});
    await this.send('Emulation.setEmulatedMedia',
                    {features: [{name: 'prefers-color-scheme', value: dark ? 'dark' : 'light'}]});
    const load = new Promise((resolve) => { this.loaded = resolve; });
    await this.send('Page.navigate', {url: address});
    await load;
  }

  /// Evaluates an expression in the page; waits for promises.
  async evaluate(expression) {
    const {result, exceptionDetails} =
      await this.send('Runtime.evaluate', {expression, awaitPromise: true, returnByValue: true});
    if (exceptionDetails) throw new Error(exceptionDetails.exception?.description ?? exceptionDetails.text);
    return result.value;
  }

  /// The visible page as a PNG.
  async screenshot() {
    const {data} = await this.send('Page.captureScreenshot', {format: 'png'});
    return Buffer.from(data, 'base64');
  }

  async key(key, modifiers = 0) {
    const letter = key.length === 1 ? {text: key} : {};
    await this.send('Input.dispatchKeyEvent', {type: 'keyDown', key, modifiers, ...letter});
    await this.send('Input.dispatchKeyEvent', {type: 'keyUp', key, modifiers});
  }

  async mouse(type, x, y, more = {}) {
    await this.send('Input.dispatchMouseEvent', {type, x, y, clickCount: 1, button: type === 'mouseMoved' && !more.buttons ? 'none' : 'left', ...more});
  }

  /// Touch events: touchStart, touchMove, touchEnd with fingers at [[x, y], ...].
  async touch(type, ...fingers) {
    await this.send('Input.dispatchTouchEvent', {type, touchPoints: fingers.map(([x, y], id) => ({x, y, id}))});
  }

  async close() { await this.browser.send('Target.closeTarget', {targetId: this.target}); }
}
