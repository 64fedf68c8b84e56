// The websocket to the station: opens it, reads its messages, notices silence, and comes back by itself.
// The messages are described in docs/ground-station.md.

const SILENCE_S = 3; // The station says something twice a second.
const FIRST_WAIT_S = 0.5;
const LONGEST_WAIT_S = 5;

/** Calls `on.hello`, `on.points`, `on.poses`, `on.trail`, `on.links`, `on.status` and `on.state(state, text)`. */
export class Link {
  constructor(on) {
    this.on = on;
    this.wait_s = FIRST_WAIT_S;
    this.heard_ms = performance.now();
    this.lost_ms = null;
    this.opensAt_ms = 0;
    setInterval(() => this.watch(), 250);
    this.open();
  }

  open() {
    this.opensAt_ms = 0;
    const socket = new WebSocket(`${location.protocol === 'https:' ? 'wss' : 'ws'}://${location.host}/ws`);
    socket.binaryType = 'arraybuffer';
    socket.onmessage = (event) => this.hear(event.data);
    socket.onclose = () => { if (this.socket === socket) this.lose(); };
    this.socket = socket;
    this.heard_ms = performance.now();
  }

  lose() {
    this.socket = null;
    this.lost_ms ??= performance.now();
    this.opensAt_ms = performance.now() + 1000 * this.wait_s;
    this.wait_s = Math.min(2 * this.wait_s, LONGEST_WAIT_S);
    this.watch();
  }

  watch() {
    const now = performance.now();
    const silent_s = (now - this.heard_ms) / 1000;
    if (!this.socket) {
      if (now >= this.opensAt_ms) this.open();
    } else if (silent_s > 2 * SILENCE_S) {
      const socket = this.socket;
      this.lose();
      socket.close();
      return;
    }
    if (this.lost_ms !== null) {
      const ago = Math.round((now - this.lost_ms) / 1000);
      this.on.state('lost', `station lost ${ago} s ago, trying again`);
    } else if (this.greeted && silent_s > SILENCE_S) {
      this.on.state('stale', `stale: no word for ${Math.round(silent_s)} s`);
    }
  }

  hear(data) {
    this.heard_ms = performance.now();
    if (typeof data === 'string') {
      const message = JSON.parse(data);
      if (message.type === 'hello') {
        this.greeted = true;
        this.lost_ms = null;
        this.wait_s = FIRST_WAIT_S;
      }
      this.on[message.type]?.(message);
    } else {
      read(new Uint32Array(data), new Float32Array(data), new Uint8Array(data), this.on);
    }
    if (this.greeted && this.lost_ms === null) this.on.state('live', 'live');
  }
}

// Flags of a pose after the first one, from the least bit on.
const TROUBLES = [
  'contested', 'clock contested', 'beacon implausible', 'inertial unit missing', 'dead reckoning', 'position lost', 'attitude lost',
];

const array = (floats, first, count) => Array.from(floats.subarray(first, first + count));

/** Reads a binary message; the three views are of the same bytes. */
export function read(words, floats, bytes, on) {
  const kind = words[0];
  if (kind === 1) {
    const runs = [];
    let at = 3;
    for (let k = 0; k < words[2]; k += 1) {
      const [first, count] = [words[at], words[at + 1]];
      runs.push({ first, count, at: at + 2 });
      at += 2 + 5 * count;
    }
    on.points({ total: words[1], runs, floats, bytes });
  } else if (kind === 2) {
    const poses = [];
    for (let k = 0, at = 3; k < words[2]; k += 1, at += 18) {
      const flags = bytes[4 * at + 1];
      poses.push({
        uav: bytes[4 * at],
        starting: (flags & 1) !== 0,
        troubles: TROUBLES.filter((_, bit) => flags & (2 << bit)),
        lineOfSight: bytes[4 * at + 3] !== 0,
        resets: bytes[4 * at + 2],
        seen_s: floats[at + 1],
        position: array(floats, at + 2, 3),
        quaternion: array(floats, at + 5, 4),
        velocity: array(floats, at + 9, 3),
        gmt: Number.isNaN(floats[at + 12]) ? null : array(floats, at + 12, 3),
        sigma: array(floats, at + 15, 3),
      });
    }
    on.poses({ now_s: floats[1], poses });
  } else if (kind === 3) {
    on.trail({ uav: bytes[4], whose: bytes[5] ? 'gmt' : 'uav', places: floats.subarray(3, 3 + 3 * words[2]) });
  }
}
