// Firefox by WebDriver BiDi, which it speaks without a driver, as far as these checks need it.

import { spawn } from 'node:child_process';
import { mkdtempSync, rmSync } from 'node:fs';
import { tmpdir } from 'node:os';
import { join } from 'node:path';

/** The address that a browser which has just been started prints. */
function addressOf(child) {
  return new Promise((resolve, reject) => {
    let output = '';
    child.stderr.on('data', (data) => {
      output += data;
      const match = /WebDriver BiDi listening on (ws:\/\/\S+)/.exec(output);
      if (match) resolve(match[1]);
    });
    child.on('error', reject);
    child.on('exit', () => reject(new Error(`the browser has ended: ${output}`)));
  });
}

/** The commands of a session, by their names, and its events. */
class Session {
  #socket;
  #calls = new Map();
  #last = 0;
  onEvent = () => {};

  static async open(address) {
    const session = new Session();
    session.#socket = new WebSocket(`${address}/session`);
    session.#socket.onmessage = ({ data }) => session.#receive(JSON.parse(data));
    await new Promise((resolve, reject) => {
      session.#socket.onopen = resolve;
      session.#socket.onerror = () => reject(new Error(`${address} cannot be reached`));
    });
    return session;
  }

  #receive({ id, type, result, error, message, ...event }) {
    if (type === 'event') return this.onEvent(event);
    const { resolve, reject } = this.#calls.get(id);
    this.#calls.delete(id);
    if (type === 'success') resolve(result);
    else reject(new Error(`${error}: ${message}`));
  }

  send(method, params = {}) {
    const id = (this.#last += 1);
    this.#socket.send(JSON.stringify({ id, method, params }));
    return new Promise((resolve, reject) => this.#calls.set(id, { resolve, reject }));
  }

  close() {
    this.#socket.close();
  }
}

/** A tab. */
class Page {
  #session;
  #context;
  /** What the page's scripts did not catch, and logged as an error. */
  errors = [];

  constructor(session, context) {
    this.#session = session;
    this.#context = context;
  }

  goto(url) {
    return this.#session.send('browsingContext.navigate', { context: this.#context, url, wait: 'complete' });
  }

  /** Calls a function on the page; arguments and result are JSON. */
  async evaluate(run, ...values) {
    const functionDeclaration = `async (text) => JSON.stringify((await (${run})(...JSON.parse(text))) ?? null)`;
    const { type, result, exceptionDetails } = await this.#session.send('script.callFunction', {
      functionDeclaration,
      arguments: [{ type: 'string', value: JSON.stringify(values) }],
      target: { context: this.#context },
      awaitPromise: true,
    });
    if (type === 'exception') throw new Error(exceptionDetails.text);
    return JSON.parse(result.value);
  }

  /** A PDF file of the page. */
  async print() {
    const { data } = await this.#session.send('browsingContext.print', { context: this.#context });
    return Buffer.from(data, 'base64');
  }

  close() {
    return this.#session.send('browsingContext.close', { context: this.#context });
  }
}

/** Starts a browser: `{ version, open, close }`, where `open` gives a `Page`. */
export async function launch(program) {
  const profile = mkdtempSync(join(tmpdir(), 'image-gip-firefox-'));
  const child = spawn(program, ['--headless', '--no-remote', '--profile', profile, '--remote-debugging-port', '0']);
  const pages = new Map();
  const session = await Session.open(await addressOf(child));
  const { capabilities } = await session.send('session.new', { capabilities: {} });
  await session.send('session.subscribe', { events: ['log.entryAdded'] });
  session.onEvent = ({ params: { level, text, source } }) => {
    if (level === 'error') pages.get(source.context)?.errors.push(text);
  };
  return {
    version: capabilities.browserVersion,
    async open() {
      const { context } = await session.send('browsingContext.create', { type: 'tab' });
      const page = new Page(session, context);
      pages.set(context, page);
      return page;
    },
    async close() {
      const ended = new Promise((resolve) => child.on('exit', resolve));
      session.close();
      child.kill();
      await ended;
      rmSync(profile, { recursive: true, force: true });
    },
  };
}
