// Figures beside the map: UAVs, the chosen one, and the station.

import { colourOf } from './cloud.mjs';
import { draw, words } from './timeline.mjs';

const MOST_ROWS = 1200;
const $ = (id) => document.getElementById(id);
const say = (name) => name.replaceAll('_', ' ');
const whole = (value) => value.toLocaleString('en').replaceAll(',', '\u202f');

function element(tag, text, name) {
  const made = document.createElement(tag);
  if (text !== undefined) made.textContent = text;
  if (name) made.className = name;
  return made;
}

/** Fills a list of figures: [name, value, class] each. Text only: what a UAV says is never markup. */
function figures(list, rows) {
  const parts = rows.flatMap(([name, value, kind]) => [element('dt', name), element('dd', value, kind)]);
  list.replaceChildren(...parts);
}

function age(seconds) {
  if (seconds < 1.5) return 'now';
  if (seconds < 120) return `${Math.round(seconds)} s ago`;
  return `${Math.round(seconds / 60)} min ago`;
}

export class Panel {
  /** `clock()` is the station's time, s; `choose(id)` is called when a UAV is chosen. */
  constructor(clock, choose) {
    this.clock = clock;
    this.choose = choose;
    this.clear();
    $('fold').addEventListener('click', () => this.fold());
    if (matchMedia('(max-width: 820px)').matches) this.fold();
  }

  fold() {
    const folded = $('panel').classList.toggle('folded');
    $('fold').setAttribute('aria-expanded', String(!folded));
    if (!folded) this.show();
  }

  clear() {
    this.uavs = new Map();
    this.rows = new Map();
    this.poses = new Map();
    this.buttons = new Map();
    $('uavs').replaceChildren();
    this.status = null;
  }

  take(status) {
    this.status = status;
    for (const uav of status.uavs) this.uavs.set(uav.uav, uav);
    this.chosen ??= this.uavs.keys().next().value;
    this.show();
  }

  links({ links }) {
    for (const { uav, rows } of links) {
      const all = (this.rows.get(uav) ?? []).concat(rows);
      // The whole state may come twice.
      const fresh = all.filter((row, k) => k === 0 || row[1] > all[k - 1][1] || row[0] > all[k - 1][0]);
      this.rows.set(uav, fresh.slice(-MOST_ROWS));
      if (uav === this.chosen) this.timeline();
    }
  }

  takePoses({ poses }) { for (const pose of poses) this.poses.set(pose.uav, pose); }

  select(id) {
    this.chosen = id;
    this.choose(id);
    this.show();
  }

  next() {
    const ids = [...this.uavs.keys()].sort((a, b) => a - b);
    if (ids.length) this.select(ids[(ids.indexOf(this.chosen) + 1) % ids.length]);
  }

  /** A word and a class for how a UAV is. */
  state(id) {
    const [uav, pose] = [this.uavs.get(id), this.poses.get(id)];
    const silent = this.clock() - uav.seen_s;
    if (silent > this.staleAfter_s) return [`stale, ${age(silent)}`, 'bad'];
    if (!pose) return ['no pose', 'warn'];
    if (pose.starting) return ['starting', 'warn'];
    if (pose.troubles.length) return [pose.troubles.join(', '), pose.troubles.some((t) => t.includes('lost')) ? 'bad' : 'warn'];
    return pose.lineOfSight ? ['line of sight', 'ok'] : ['no line of sight', 'warn'];
  }

  show() {
    if (!this.status) return;
    this.list();
    const [uav, dark] = [this.uavs.get(this.chosen), this.dark];
    $('one').hidden = !uav;
    if (uav) this.one(uav, dark);
    this.station();
  }

  list() {
    for (const [id, uav] of [...this.uavs].sort(([a], [b]) => a - b)) {
      let button = this.buttons.get(id);
      if (!button) {
        const item = element('li');
        button = element('button');
        button.type = 'button';
        button.append(element('i'), element('b', `UAV ${id}`), element('span', '', 'state'), element('span', '', 'more'));
        button.addEventListener('click', () => this.select(id));
        item.append(button);
        item.dataset.id = id;
        const after = [...$('uavs').children].find((other) => Number(other.dataset.id) > id);
        $('uavs').insertBefore(item, after ?? null);
        this.buttons.set(id, button);
      }
      const [dot, , state, more] = button.children;
      const [word, kind] = this.state(id);
      dot.style.background = colourOf(id, this.dark);
      [state.textContent, state.className] = [word, `state ${kind}`];
      const pose = this.poses.get(id);
      const lost = uav.losses.lost / Math.max(1, uav.losses.lost + uav.losses.received);
      const speed = pose ? `${Math.hypot(...pose.velocity).toFixed(1)} m/s, ${pose.position[2].toFixed(1)} m up, ` : '';
      more.textContent = `${speed}${whole(uav.points)} points, ${(100 * lost).toFixed(1)} % lost`;
      button.setAttribute('aria-pressed', String(id === this.chosen));
      button.parentElement.dataset.state = kind === 'bad' && word.startsWith('stale') ? 'stale' : 'live';
    }
  }

  one(uav) {
    $('one-title').textContent = `UAV ${uav.uav}`;
    this.timeline();
    const pose = this.poses.get(uav.uav);
    const place = (values) => values.map((v) => v.toFixed(2)).join(', ');
    figures($('pose'), pose ? [
      ['position east, north, up', `${place(pose.position)} m`],
      ['\u03c3 of position', `${pose.sigma[0].toFixed(3)} m`],
      ['\u03c3 of attitude', `${((pose.sigma[1] * 180) / Math.PI).toFixed(2)} deg`],
      ['\u03c3 of velocity', `${pose.sigma[2].toFixed(3)} m/s`],
      ['GMT', pose.gmt ? `${place(pose.gmt)} m` : 'unknown'],
      ['clock against the GMT', uav.pose?.clock_offset_s == null ? 'unknown' : `${(uav.pose.clock_offset_s * 1e9).toFixed(1)} ns`],
      ['jumps of the pose', String(pose.resets)],
    ] : [['pose', 'none yet']]);
    const { losses } = uav;
    figures($('packets'), [
      ...Object.entries(uav.packets).map(([kind, count]) => [`packets: ${kind}`, whole(count)]),
      ['bytes', whole(uav.bytes)],
      ['lost on the way', whole(losses.lost), losses.lost ? 'warn' : ''],
      ['came late', whole(losses.late)],
      ['restarts of the UAV', whole(losses.restarts), losses.restarts ? 'warn' : ''],
    ]);
    const { health } = uav;
    const silent = health ? this.clock() - health.seen_s : 0;
    $('health-age').textContent = health ? `(${age(silent)})` : '';
    $('health-age').className = silent > 10 ? 'bad' : '';
    figures($('health'), health ? [
      ['up for', `${Math.round(health.uptime_s)} s`],
      ['load', `${(100 * health.cpu_load).toFixed(0)} %`],
      ['stack never used', `${whole(health.free_stack_bytes)} bytes`],
      ['last reset', say(health.reset_cause)],
      ...health.counters.map(([name, count]) => [say(name), whole(count)]),
    ] : [['health', 'no word yet']]);
    $('events').replaceChildren(...(uav.events.length ? [...uav.events].reverse().map(([seen, severity, text]) => {
      const item = element('li', undefined, { error: 'bad', warning: 'warn' }[severity]);
      item.append(element('b', `${seen.toFixed(1)} s `), text);
      return item;
    }) : [element('li', 'none')]));
    figures($('config'), uav.config ?? [['configuration', 'no word yet']]);
  }

  timeline() {
    const rows = this.rows.get(this.chosen) ?? [];
    draw($('timeline'), rows);
    $('last-link').textContent = words(rows);
  }

  station() {
    const { map, refused, inputs, outputs, now_s } = this.status;
    const { counters } = map;
    figures($('station'), [
      ['points in the map', `${whole(map.points)} of ${whole(map.capacity)}`, map.points >= map.capacity ? 'warn' : ''],
      ['reflections fused into them', whole(counters.fused)],
      ['replaced by better ones', whole(counters.replaced)],
      ['dropped, the map being full', whole(counters.dropped), counters.dropped ? 'warn' : ''],
      ['out of range', whole(counters.out_of_range)],
      ['left with their surfaces', whole(counters.withdrawn)],
      ['came after their surface had left', whole(counters.late)],
      ...Object.entries(refused).map(([reason, count]) => [`refused: ${reason}`, whole(count), 'bad']),
      ...Object.entries(inputs).map(([name, input]) => [name, input.trouble ?? `${whole(input.bytes)} bytes`, input.trouble ? 'bad' : '']),
      ...outputs.map((output) => [output, '']),
      ['up for', `${Math.round(now_s)} s`],
    ]);
  }
}
