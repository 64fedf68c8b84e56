// The link of a UAV over its last sweeps: a strip of link states with the signal-to-noise ratio above.

const STATES = ['outage', 'line of sight', 'one reflection', 'more reflections'];
const STRIP = 14;
const BAR = 2; // CSS pixels a sweep.

/** Rows are [sweep, seen_s, state, snr_db, beams, verdict, outcomes]. */
export function draw(canvas, rows) {
  const { clientWidth: width, clientHeight: height } = canvas;
  if (!width) return;
  const ratio = Math.min(devicePixelRatio, 2);
  [canvas.width, canvas.height] = [width * ratio, height * ratio];
  const style = getComputedStyle(document.documentElement);
  const colour = (name) => style.getPropertyValue(name).trim();
  const pen = canvas.getContext('2d');
  pen.scale(ratio, ratio);
  const shown = rows.slice(-Math.floor((width - 30) / BAR));
  const top = 8;
  const foot = height - STRIP - 6;
  const snrs = shown.map((row) => row[3]).filter((snr) => snr !== null);
  const low = Math.min(0, ...snrs);
  const high = Math.max(20, ...snrs);
  const y = (snr) => foot - ((snr - low) / (high - low)) * (foot - top);
  pen.font = '11px system-ui, sans-serif';
  pen.fillStyle = colour('--muted');
  pen.strokeStyle = colour('--line');
  for (const snr of [low, high]) {
    pen.beginPath();
    pen.moveTo(30, y(snr));
    pen.lineTo(width, y(snr));
    pen.stroke();
    pen.fillText(`${Math.round(snr)} dB`, 0, y(snr) + 4, 28);
  }
  const x = (index) => width - BAR * (shown.length - index);
  shown.forEach((row, index) => {
    pen.fillStyle = colour(`--s${row[2]}`);
    pen.fillRect(x(index), height - STRIP, BAR, STRIP);
  });
  pen.strokeStyle = colour('--snr');
  pen.lineWidth = 1.4;
  pen.beginPath();
  let down = false;
  shown.forEach((row, index) => {
    const [last, gap] = [shown[index - 1], row[3] === null];
    if (gap || (last && row[0] - last[0] > 4)) down = false;
    if (gap) return;
    pen[down ? 'lineTo' : 'moveTo'](x(index) + BAR / 2, y(row[3]));
    down = true;
  });
  pen.stroke();
}

/** The last sweep in words. */
export function words(rows) {
  const row = rows.at(-1);
  if (!row) return 'no sweep yet';
  const [sweep, , state, snr, beams, verdict, outcomes] = row;
  const paths = new Map();
  for (const outcome of outcomes) paths.set(outcome, (paths.get(outcome) ?? 0) + 1);
  const list = [...paths].map(([name, count]) => (count > 1 ? `${count} x ${name}` : name)).join(', ') || 'none';
  const loud = snr === null ? '' : `, ${snr.toFixed(1)} dB`;
  return `Sweep ${sweep}: ${STATES[state] ?? state}${loud}, ${beams} beams heard; pose: ${verdict}. Paths: ${list}.`;
}
