// Connection of a live page to its server (docs/reference/live.md, Messages).

/// Decodes the bytes of a frame into views of them.
export function decodeFrame(buffer) {
  const head = new DataView(buffer);
  const names = ['bodies', 'trees', 'contacts', 'closures', 'curves'];
  const count = (name) => head.getUint32(16 + 4 * names.indexOf(name), true);
  let at = 40;
  const take = (Type, length) => {
    at += length * Type.BYTES_PER_ELEMENT;
    return new Type(buffer, at - length * Type.BYTES_PER_ELEMENT, length);
  };
  return {
    isGhost: head.getUint32(0, true) === 1, held: head.getUint32(4, true), time: head.getFloat64(8, true),
    poses: take(Float32Array, 7 * count('bodies')), contacts: take(Float32Array, 6 * count('contacts')),
    closures: take(Float32Array, 6 * count('closures')), curves: take(Float32Array, count('curves')),
    hand: take(Float32Array, 6), asleep: take(Uint8Array, count('trees')), atLimit: take(Uint8Array, count('bodies')),
  };
}

export class Connection {
  /// on: called with bytes, statuses, words of the server, and true or false when it comes or goes.
  constructor(on) {
    this.on = on;
    this.isOver = false;  // the server has nothing more to say: its end is expected
    this.status = null;
    this.waiting = new Map();
  }

  get isOpen() { return this.socket?.readyState === WebSocket.OPEN; }

  /// Connects, and again every second after the server went away unexpectedly.
  open() {
    const {protocol, host, search} = location;
    this.socket = new WebSocket(`${protocol === 'https:' ? 'wss' : 'ws'}://${host}/live${search}`);
    this.socket.binaryType = 'arraybuffer';
    this.socket.onopen = () => this.on.there(true);
    this.socket.onmessage = ({data}) => {
      if (typeof data === 'string') this.receive(JSON.parse(data));
      else this.on.bytes(data);
    };
    this.socket.onclose = () => {
      this.status = null;
      this.waiting.clear();
      this.on.there(false);
      if (!this.isOver) setTimeout(() => this.open(), 1000);
    };
  }

  receive(message) {
    if (message.type === 'status') this.on.status(this.status = message);
    if (message.type === 'say') this.on.say(message.words);
  }

  send(message) {
    this.flush();
    if (this.isOpen) this.socket.send(JSON.stringify(message));
  }

  /// Sends a message with the next picture, unless one of the same name replaces it before.
  queue(name, message) { this.waiting.set(name, message); }
  cancel(name) { this.waiting.delete(name); }
  flush() {
    const messages = [...this.waiting.values()];
    this.waiting.clear();
    if (this.isOpen) for (const message of messages) this.socket.send(JSON.stringify(message));
  }
}
